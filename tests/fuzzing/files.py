"""Good files of every kind that barberpole reads, small, and the commands that read them."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

from barberpole.challenge.game import _seal
from barberpole.paths import boards
from barberpole.plugins import TEMPLATE

from fuzzing.many import with_meta, write_array, write_fleet
from fuzzing.one import DRIVER, HEADER, driver_records, header_text, records, write_logs

LINEAR = "bias,scale,misalignment"
MODEL = b"""effects = ["bias", "scale", "misalignment", "cross_field"]
reference = { kind = "vector", temp_c = 25.0 }
sensor = "hmc1021_1022"
plugins = []

[cross_field]
form = "demodulated"
"""
PLUGGED = b'effects = ["bias", "scale", "mine"]\nplugins = ["mine.py"]\n'

ANY = (f"fit FILE --model {LINEAR} --json", "convert FILE -o OUT.csv", "summary FILE", f"compare FILE --model {LINEAR}")
FIELD = (
    *ANY,
    f"fit FILE --model {LINEAR},cross_field,drift,outliers",
    f"diagnose FILE --model {LINEAR} --json",
    f"diagnose FILE @field.csv --model {LINEAR}",
    "fit FILE --method linear",
    "fit FILE --method polynomial --json",
    "trajectory pybv11 --shape replay --points 20 --log FILE",
    f"add lag FILE --model {LINEAR}",
    "convert FILE -o OUT.csv --take t_s=t_s:ms --take x_lsb=z_lsb --take y_lsb=y_lsb --take z_lsb=x_lsb",
)
MAGNITUDE = (
    *ANY,
    "fit FILE --method ellipsoid",
    "fit FILE --method ellipsoid_algebraic --json",
    "fit FILE --method iterative",
    f"diagnose FILE --model {LINEAR}",
)
STILL = (
    "verify FILE --calibration @good.toml --json",
    "characterise FILE",
    f"diagnose @field.csv --model {LINEAR} --noise FILE",
)
BOARD_LOG = (*ANY, "fit FILE --method ellipsoid", "verify FILE --calibration @good.toml --json")
BOARD = ("board check FILE", "design flip FILE", "design noise FILE", "trajectory FILE --json", "build FILE -o OUT.dir")
CALIBRATION = (
    "verify @still.csv --calibration FILE --json",
    "verify @still.csv --calibration FILE",
    "build pybv11 --calibration FILE -o OUT.dir --json",
)
FLEET = ("fleet report FILE --json", "fleet common FILE", "fleet extract FILE board1 -o OUT.toml")


@dataclass(frozen=True)
class Kind:
    """One kind of file: its name, a good one, and command lines in which FILE stands for it, @NAME for a good file.

    wrapped: what is put around the damaged part, so that no checksum catches the damage.
    beside: other files in its folder, which is HERE.
    """

    name: str
    good: bytes
    commands: tuple[str, ...]
    wrapped: Callable[[bytes], bytes] = bytes
    beside: dict[str, bytes] = field(default_factory=dict)


def kinds(folder: Path) -> list[Kind]:
    """All kinds; the good files lie in `folder`."""
    write_logs(folder, LINEAR)
    return [*_logs(folder), *_records(folder), *_boards(), *_models(folder), *_many(folder)]


def _logs(folder: Path) -> list[Kind]:
    def read(name: str) -> bytes:
        return (folder / name).read_bytes()

    return [
        Kind("field.csv", read("field.csv"), FIELD),
        Kind("turned.csv", read("turned.csv"), MAGNITUDE),
        Kind("still.csv", read("still.csv"), STILL),
        Kind("pairs.csv", read("pairs.csv"), (*ANY, "fit FILE --method polynomial --json", "characterise FILE --json")),
        Kind("field.parquet", read("field.parquet"), ANY),
    ]


def _records(folder: Path) -> list[Kind]:
    header, driver, board = header_text(HEADER), header_text(DRIVER), records(folder)
    driving = ("imcs @in_coils.csv FILE -o OUT.csv",)
    return [
        Kind("log.bpr", board(header), BOARD_LOG),
        Kind("header.bpr", header, BOARD_LOG, board),
        Kind("driver.bpr", driver_records(driver), driving),
        Kind("driver-header.bpr", driver, driving, driver_records),
    ]


def _boards() -> list[Kind]:
    def read(name: str) -> bytes:
        return (boards() / name).read_bytes()

    array = ("array calibrate @array-turned.csv --array FILE -o OUT.toml", "board check FILE")
    sensor = (f"fit @field.csv --model {LINEAR} --sensor FILE", f"diagnose @field.csv --model {LINEAR} --sensor FILE")
    return [
        Kind("board.toml", read("pybv11.toml"), BOARD),
        Kind("timed.toml", read("nucleo_f446re.toml"), BOARD),
        Kind("driver.toml", read("drivers/imcs_driver.toml"), ("build FILE -o OUT.dir --json",)),
        Kind("array.toml", read("arrays/gradiometer.toml"), array),
        Kind("sensor.toml", read("sensors/hmc1021_1022.toml"), sensor),
        Kind("digital.toml", read("sensors/lis3mdl.toml"), sensor),
    ]


def _models(folder: Path) -> list[Kind]:
    log = "@field.csv --model FILE"
    model = (f"fit {log} --json", f"remove scale {log}", f"add lag {log}", f"diagnose {log}")
    plugin = TEMPLATE.read_text().replace("NAME", "mine").encode()
    plugged = tuple(f"{do} @field.csv --model HERE/plugged.toml" for do in ("fit", "diagnose"))
    game = {
        "log.csv": (folder / "field.csv").read_bytes(),
        "model.toml": b'effects = ["bias", "scale", "misalignment"]',
    }
    sealed = _seal({"hidden": ["lag"], "level": 1})
    return [
        Kind("model.toml", MODEL, model),
        Kind("calibration.toml", (folder / "good.toml").read_bytes(), CALIBRATION),
        Kind("mine.py", plugin, plugged, beside={"plugged.toml": PLUGGED}),
        Kind("answer.sealed", sealed, ("challenge answer HERE lag",), beside=game),
    ]


def _many(folder: Path) -> list[Kind]:
    write_array(folder)
    meta = write_fleet(folder, LINEAR)

    def read(name: str) -> bytes:
        return (folder / name).read_bytes()

    gradient, using = "array gradient {} --calibration {} --json", "--calibration @array.toml"
    return [
        Kind("array-turned.csv", read("array-turned.csv"), ("array calibrate FILE -o OUT.toml",)),
        Kind("array-run.csv", read("array-run.csv"), (f"array selfcal FILE {using} -o OUT.toml",)),
        Kind("array-seen.csv", read("array-seen.csv"), (gradient.format("FILE", "@array.toml"),)),
        Kind("array-cal.toml", read("array.toml"), (gradient.format("@array-seen.csv", "FILE"),)),
        Kind("fleet.parquet", read("fleet.parquet"), FLEET),
        Kind("fleet-meta.parquet", meta, FLEET, with_meta(folder / "fleet.parquet")),
    ]
