"""How many conversions a second of real time the emulated board reads."""

import time

import pytest
from barberpole.twin import Tumble, World


@pytest.mark.bench
@pytest.mark.parametrize("ambient", ["fixed", "tumble"])
def test_conversions_per_second(start, board, said, ambient):
    world = World.of(board, ambient=Tumble()) if ambient == "tumble" else World.of(board)
    twin = start(world=world)
    twin.close()
    begin = time.monotonic()
    twin = start("speed.py", world=world)
    said(twin, "end of reading", timeout_s=60.0)
    rate = 40000 / (time.monotonic() - begin)
    print(f"{ambient}: {rate:.0f} conversions/s with start-up")
    assert rate > 8000
