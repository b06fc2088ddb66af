"""What a coverage-guided search feeds: each reader of files, in this process. Whatever it raises but our own errors is
a finding.

Each target takes bytes; `seeds` are good ones to begin with.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from barberpole import log
from barberpole.arrays import array_file, keeping
from barberpole.board import load_board, load_sensor
from barberpole.board_log import read_board_log
from barberpole.calibration import read_calibration
from barberpole.challenge.game import unsealed
from barberpole.driver_board import load_driver
from barberpole.errors import BarberpoleError
from barberpole.fleet.table import read_fleet
from barberpole.imcs import read_driven
from barberpole.link.monitor import _Heard, _second
from barberpole.modelfile import model_text, read_model
from barberpole.plugins import compiled
from barberpole.records import TYPES, Decoder, decode, encode
from barberpole.workbench.watch import Watch

if TYPE_CHECKING:  # what makes the good files loads all of barberpole
    from fuzzing.files import Kind

Reader = Callable[[bytes], None]
PIECE = 17  # bytes of a stream at a time: no divisor of anything


@dataclass(frozen=True)
class Target:
    """A reader, and the kinds of `fuzzing.files` whose good files it begins with."""

    read: Reader
    kinds: tuple[str, ...]


def targets(folder: Path) -> dict[str, Target]:
    """All targets; files that a reader wants on disk are written to `folder`."""

    def by_path(suffix: str, read: Callable[[Path], object]) -> Reader:
        path = folder / f"case{suffix}"

        def one(data: bytes) -> None:
            path.write_bytes(data)
            read(path)

        return _forgiving(one)

    def model(path: Path) -> None:
        model_text(read_model(path), path, path.read_text(encoding="utf-8-sig"))

    return {
        "csv": Target(by_path(".csv", log.read_log), ("field.csv", "pairs.csv", "still.csv")),
        "parquet": Target(by_path(".parquet", log.read_log), ("field.parquet",)),
        "record": Target(by_path(".bpr", log.read_log), ("log.bpr",)),
        "frames": Target(_forgiving(_frames), ("log.bpr", "driver.bpr")),
        "pieces": Target(_forgiving(_pieces), ("log.bpr", "driver.bpr")),
        "driver_record": Target(by_path(".bpr", read_driven), ("driver.bpr",)),
        "board": Target(by_path(".toml", load_board), ("board.toml", "timed.toml")),
        "driver": Target(by_path(".toml", load_driver), ("driver.toml",)),
        "array": Target(by_path(".toml", array_file.load_array_board), ("array.toml",)),
        "sensor": Target(by_path(".toml", load_sensor), ("sensor.toml", "digital.toml")),
        "model": Target(by_path(".toml", model), ("model.toml",)),
        "calibration": Target(by_path(".toml", read_calibration), ("calibration.toml",)),
        "array_calibration": Target(
            by_path(".toml", lambda path: keeping.read_array(path, ("a", "b"))), ("array-cal.toml",)
        ),
        "plugin": Target(_forgiving(_plugin), ("mine.py",)),
        "answer": Target(by_path(".sealed", unsealed), ("answer.sealed",)),
        "fleet": Target(by_path(".parquet", read_fleet), ("fleet.parquet",)),
    }


def seeds(target: Target, kinds: "list[Kind]") -> list[bytes]:
    """Good files, and what stands in them where a check sum is put around it."""
    found = [kind.wrapped(kind.good) for kind in kinds if kind.name in target.kinds]
    return [_unframed(data) for data in found] if target.read.__name__ == "frames" else found


def _forgiving(read: Reader) -> Reader:
    def one(data: bytes) -> None:
        try:
            read(data)
        except BarberpoleError:
            return

    one.__name__ = read.__name__.strip("_")
    return one


def _plugin(data: bytes) -> None:
    compiled(data.decode("utf-8", "replace"), Path("mine.py"))


def _pieces(data: bytes) -> None:
    """A stream in pieces is the stream."""
    decoder = Decoder()
    frames = [frame for at in range(0, len(data), PIECE) for frame in decoder.feed(data[at : at + PIECE])]
    frames += decoder.finish()
    whole = decode(data)
    if (tuple(frames), decoder.damaged, decoder.lost) != (whole.frames, whole.damaged, whole.lost):
        raise AssertionError("in pieces another stream")


def _frames(data: bytes) -> None:
    """Lines as the content of frames with a good check sum: what a strange board could say, to all who listen."""
    stream = b"".join(
        encode(line[:1].decode("latin-1"), at, line[1:]) for at, line in enumerate(data.split(b"\n\n")) if line
    )
    frames = list(decode(stream).frames)
    heard, watch = _Heard(), Watch("none")
    for frame in frames:
        heard.take(frame)
    if heard.header:
        _second(heard, 0)
    watch._take(frames)
    watch.seen()
    read_board_log(stream, "a board")


def _unframed(data: bytes) -> bytes:
    """The lines of which `_frames` makes these frames."""
    return b"\n\n".join(frame.type.encode() + frame.payload for frame in decode(data).frames if frame.type in TYPES)
