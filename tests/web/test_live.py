"""A board watched live: nothing is lost, memory stays flat, it comes back; and what a rotation still lacks."""

import contextlib
import os
import pty
import struct
import threading
import time
import tty
from pathlib import Path

import numpy as np
import pytest
from barberpole.board import load_board
from barberpole.errors import PortError
from barberpole.log import read_log
from barberpole.nominal import nominal
from barberpole.records import HEADER, RESULT, ROWS, encode, encode_json
from barberpole.twin import Twin
from barberpole.twin.ambient import Tumble
from barberpole.twin.world import World
from barberpole.workbench.rotation import Coverage, bound, words
from barberpole.workbench.watch import KEPT, Watch
from barberpole_codegen.build import build

RATE_HZ = 186.0
TEN_MINUTES = int(600 * RATE_HZ)
COLUMNS = [["t_s", "q", 1e-6]] + [[f"{a}_{s}_lsb", "i", 0.125] for s in ("set", "reset") for a in "xyz"]
COLUMNS += [["temp_c", "f", 1.0]] + [[f"c{a}_ut", "f", 1.0] for a in "xyz"]
ROW = struct.Struct("<q6i4f")
FIELD_UT = 48.0
NOISE_UT = 0.01


class Port:
    """A serial port that a script speaks on; `path` stays the same when it is unplugged and comes back."""

    def __init__(self, path: Path):
        self.path = path
        self.sequence = 0
        self.plug()

    def plug(self) -> None:
        self._main, self._other = pty.openpty()
        tty.setraw(self._other)
        self.path.symlink_to(os.ttyname(self._other))

    def unplug(self) -> None:
        self.path.unlink()
        os.close(self._main)
        os.close(self._other)

    def say(self, kind: str, payload) -> None:
        made = encode_json if isinstance(payload, dict) else encode
        self._write(made(kind, self.sequence, payload))
        self.sequence += 1

    def _write(self, data: bytes) -> None:
        while data:
            data = data[os.write(self._main, data) :]

    def begin(self) -> None:
        """A power-up."""
        self.sequence = 0
        self.header()

    def header(self) -> None:
        """What the board repeats now and then for who joins later."""
        self.say(HEADER, {"format": 1, "board": "pybv11", "sensor": "hmc1021_1022", "boot": 1, "columns": COLUMNS})
        verdict = {"accepted": True, "reasons": [0], "gain": [1.0001, 0.9999, 1.0], "in_force": "slot a"}
        self.say(RESULT, verdict)

    def rows(self, first: int, last: int) -> None:
        """Rows of a field that turns through all directions."""
        at = np.arange(first, last)
        up, turn = np.cos(0.0041 * at), 0.033 * at
        level = np.sqrt(1 - up * up)
        b = FIELD_UT * np.stack([level * np.cos(turn), level * np.sin(turn), up], axis=1)
        b += NOISE_UT * np.random.default_rng(first).normal(size=b.shape)
        lsb, t_us = (800 * b).astype(int), (1e6 * at / RATE_HZ).astype(int)
        for row in zip(t_us.tolist(), lsb.tolist(), (80 - lsb).tolist(), b.tolist(), strict=True):
            self.say(ROWS, ROW.pack(row[0], *row[1], *row[2], 25.0, *row[3]))


@pytest.fixture
def port(tmp_path):
    made = Port(tmp_path / "ttyBOARD")
    yield made
    if made.path.is_symlink():
        made.unplug()


@pytest.fixture
def watch(port):
    made = Watch(str(port.path))
    made.start()
    until(lambda: made.state.startswith("connected"))  # opening a port discards what came before
    yield made
    made.close()


def resident_mb():
    """What this process holds in memory."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE") / 1e6


def until(condition, timeout_s=30.0):
    end = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def test_ten_minutes_of_board_time_lose_nothing_and_memory_is_flat(port, watch):
    port.begin()
    part, before = TEN_MINUTES // 100, 0.0
    for n in range(100):
        port.rows(n * part, (n + 1) * part)
        if n == 20:  # by then everything has the size that it keeps
            before = resident_mb()
    until(lambda: watch.total == 100 * part)
    seen = watch.seen()
    assert (seen.lost, seen.damaged, seen.connections) == (0, 0, 1)
    assert seen.rate_hz == pytest.approx(RATE_HZ, rel=1e-3)
    assert len(seen.rows["t_s"]) == KEPT
    assert np.all(np.diff(seen.rows["t_s"]) > 0)
    assert seen.rows["offset_x"] == pytest.approx(5.0, abs=0.2)
    assert resident_mb() - before < 2.0  # of some 8 MB that have gone through


def test_it_comes_back_after_the_cable_was_pulled_and_counts_what_it_missed(port, watch, tmp_path):
    port.begin()
    watch.record(tmp_path / "kept.bpr")
    port.rows(0, 300)
    until(lambda: watch.total == 300)
    port.unplug()
    until(lambda: watch.seen().state.startswith("waiting"))
    port.plug()
    until(lambda: watch.seen().state.startswith("connected"))
    port.begin()  # the board was restarted by its plug
    port.rows(300, 400)
    until(lambda: watch.total == 400)
    port.sequence += 7
    port.rows(400, 500)
    until(lambda: watch.total == 500)
    assert watch.seen().lost == 7
    assert watch.stop_recording() == "kept.bpr"
    assert read_log(tmp_path / "kept.bpr").n >= 200


def test_what_is_no_port_is_refused(tmp_path):
    with pytest.raises(PortError, match="which does not exist"):
        Watch("/dev/ttyNONE").start()
    (tmp_path / "file").write_text("secret")
    with pytest.raises(PortError, match="a serial port"):
        Watch(str(tmp_path / "file")).start()


def test_the_twin_is_watched(tmp_path):
    board = load_board("pybv11")
    made = build(board, nominal(board), tmp_path / "build")
    files = {f"/{target}": made.folder / source for source, target in made.files.items()}
    with Twin(board, tmp_path / "flash", World.of(board, ("none",), ambient=Tumble()), files=files) as twin:
        watch = Watch(twin.port)
        watch.start()
        twin.wait_until(4.0)
        until(lambda: watch.total > 200)
        watch.say("status")
        until(lambda: watch.seen().answer.get("command") == "status")
        seen = watch.seen()
        watch.close()
    assert (seen.lost, seen.damaged) == (0, 0)
    assert seen.header["board"] == "pybv11"
    assert seen.rows["b_ut"] == pytest.approx(48.0, rel=0.05)


@pytest.mark.bench
def test_ten_minutes_of_the_twin(tmp_path):
    """600 s of board time, the power cut once on the way: nothing lost, memory flat, it comes back."""
    board = load_board("pybv11")
    made = build(board, nominal(board), tmp_path / "build")
    files = {f"/{target}": made.folder / source for source, target in made.files.items()}
    with Twin(board, tmp_path / "flash", World.of(board, ("none",), ambient=Tumble()), files=files) as twin:
        watch = Watch(twin.port)
        watch.start()
        twin.wait_until(300.0, timeout_s=900.0)
        before, half = resident_mb(), watch.total
        twin.kill()
        twin.power_cycle()
        twin.wait_until(300.0, timeout_s=900.0)
        until(lambda: watch.total > 1.99 * half, 60.0)
        seen = watch.seen()
        watch.close()
    grown = resident_mb() - before
    said = f"{seen.total} rows, {seen.lost} lost, {seen.damaged} damaged, memory {grown:+.1f} MB in the second half"
    print(f"\nten minutes of the twin: {said}", end="")
    assert seen.lost == 0
    assert seen.damaged <= 1  # the record that the cut went through
    assert grown < 5.0


def turned(directions, seed=0):
    """Readings in these directions (3, n)."""
    rng = np.random.default_rng(seed)
    return FIELD_UT * directions + NOISE_UT * rng.normal(size=directions.shape)


def everywhere(n):
    u = np.random.default_rng(1).normal(size=(3, n))
    return u / np.linalg.norm(u, axis=0)


def test_a_turn_in_a_plane_is_never_enough():
    flat = Coverage()
    phi = np.linspace(0, 60, 20_000)
    flat.add(turned(np.stack([np.cos(phi), np.sin(phi), 0 * phi])))
    found = bound(flat)
    assert not found.enough
    assert "z" in words(found.next).split(" and ")[0]
    assert np.mean(flat.counts > 0) < 0.2
    flat.add(turned(everywhere(3000)))
    assert bound(flat).enough


def test_the_bound_is_that_of_a_fit():
    """Bias errors of many least-squares fits of eq. (1) against the bound; cells hold less than they count at most."""
    cover, u = Coverage(), everywhere(1500)
    cover.add(turned(u))
    x, y, z = u
    k = FIELD_UT
    j = np.stack([-x, -y, -z, k * x * x, k * y * y, k * z * z, 2 * k * x * y, 2 * k * x * z, 2 * k * y * z])
    rng = np.random.default_rng(2)
    noise = NOISE_UT * rng.normal(size=(1500, 400))
    errors = np.linalg.lstsq(j.T, noise, rcond=None)[0][:3]
    assert bound(cover).bias_ut == pytest.approx(float(np.std(errors, axis=1).max()), rel=0.15)


def test_following_the_advice_is_soon_enough():
    """Held in the direction advised, a dozen times: less than a blind turn through all directions takes."""
    from barberpole.workbench.rotation import SECTORS, U

    cover = Coverage()
    for turn in range(40):
        found = bound(cover)
        if found.enough:
            break
        u = U[:, found.next[0] * SECTORS + found.next[1], None]
        cover.add(turned(np.repeat(u, 40, axis=1), turn))
    assert bound(cover).enough
    assert turn <= 12


def test_the_page_watches_a_board(window, port, shots):
    port.begin()
    over = threading.Event()

    def speak() -> None:
        at = 0
        with contextlib.suppress(OSError):
            while not over.is_set():
                port.header()
                port.rows(at, at + 40)
                at += 40
                time.sleep(0.1)

    voice = threading.Thread(target=speak, daemon=True)
    voice.start()
    try:
        _watched(window, port, shots)
    finally:
        over.set()
        voice.join(2.0)  # nobody may be reading any more


def _watched(window, port, shots):
    window.fill("input[aria-label*='Serial port']", str(port.path))
    window.click("button:has-text('Watch'):not(.bp-level)")
    window.wait_for_selector("[data-test=live-state]:has-text('Live: 48.0')")
    window.wait_for_selector("[data-test=rotation]:has-text('Enough')")
    window.wait_for_selector("[data-test=live-verdict]:has-text('accepted')")
    assert "no record lost" in window.text_content("[data-test=live-about]")
    window.screenshot(path=shots / "live.png", full_page=True)
    window.click("button:has-text('Record')")
    window.wait_for_selector("button:has-text('Stop recording')")
    time.sleep(1.5)
    window.click("button:has-text('Stop recording')")
    window.wait_for_selector(".bp-log:has-text('recording.bpr')")  # and it is on the bench
