"""Whatever comes over the serial line, the board's loop goes on: thousands of lines of garbage, and it still obeys."""

import json
import random
import subprocess

import pytest
from barberpole import paths
from barberpole.records import ANSWER, decode
from barberpole_codegen.budget import find_micropython

LINES = 2500
LONGEST = 40
KNOWN = ("status", "stop", "stream", "read log", "factory reset", "selfcal now", "quit")
SCRIPT = """
import sys
import bp_duty as duty
import bp_records as records
from bp_console import Console

class Nothing:
    runs = 0
    def start(self): pass
    def feed(self): pass
    def rest(self): pass

class Station:
    state = duty.STOPPED
    def __init__(self):
        self.console, self.writer = Console(), records.Writer(sys.stdout.buffer.write)
        self.watchdog = self.clock = Nothing()

def obeyed(station, line):
    duty.answer(station, line, True, {})
    if line == "quit":
        raise SystemExit

duty.serve(Station(), None, dict([(name, obeyed) for name in KNOWN]))
"""


def garbage(rng):
    """A line of anything: bytes, half a character of UTF-8, a known command with something in it, or a long one."""
    known = rng.choice(KNOWN[:-1]).encode()
    at = rng.randrange(len(known))
    return rng.choice(
        (
            bytes(rng.choice([*range(3), *range(4, 256)]) for _ in range(rng.randrange(60))),
            rng.choice((b"\xc3", b"\xe2\x82", b"\xf0\x9f", b"\xff\xfe", b"\x80")),
            known[:at] + bytes([rng.randrange(32, 256)]) + known[at:],
            known * rng.randrange(2, 30),
            b'{"a": "\\', b"\"'%s{0}__import__('os')",
            known,
        )
    )  # fmt: skip


@pytest.mark.parametrize("seed", [1, 2])
def test_garbage_never_ends_the_loop(seed):
    rng = random.Random(seed)
    sent = [garbage(rng) for _ in range(LINES)]
    stream = b"".join(line + rng.choice((b"\n", b"\r\n", b"\r")) for line in sent) + b"\x04\nquit\n"
    done = subprocess.run(
        [find_micropython() or "", "-c", f"KNOWN = {KNOWN!r}\n{SCRIPT}"],
        input=stream, capture_output=True, timeout=60, check=False, env={"MICROPYPATH": str(paths.firmware())},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, b"")
    found = decode(done.stdout)
    assert (found.damaged, found.lost) == (0, 0)
    answers = [frame.json or {} for frame in found.frames]
    assert all(frame.type == ANSWER for frame in found.frames)
    assert answers[-1] == {"command": "quit", "done": True}
    assert all(len(answer["command"]) <= LONGEST and answer["command"].isprintable() for answer in answers)
    whole = [line for line in sent if line.decode("latin-1") in KNOWN]
    obeyed = [answer["command"] for answer in answers if answer["done"]]
    assert len(obeyed) >= len(whole) > LINES // 20
    assert [name for name in obeyed if name not in KNOWN] == []
    assert len(json.dumps(answers)) < len(stream) * 20
