"""A full disk: every command that writes says so in one sentence with exit 2, and what was there before is there still.

The limit of a process on the size of files stands in for the disk: the system refuses the write in the same way.
"""

import json
import resource
from contextlib import contextmanager

import pytest
from barberpole.challenge.record import Recipe, record, write
from barberpole.cli import run

MODEL = "bias,scale,misalignment"
OLD = "of yesterday"


@contextmanager
def full_disk():
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (0, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


def contents(folder):
    return {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.fixture(scope="module")
def made(tmp_path_factory):
    """A folder with one good input of each kind."""
    folder = tmp_path_factory.mktemp("inputs")
    for seed in (1, 2, 3):
        write(record(Recipe({}, rows=500, form="demodulated", seed=seed)), folder / f"log-{seed}.csv")
    rest = "t_s,x_lsb,y_lsb,z_lsb\n" + "".join(f"{k / 50},{k % 3},{k % 5},{k % 7}\n" for k in range(4000))
    (folder / "rest.csv").write_text(rest)
    (folder / "model.toml").write_text(f"effects = {json.dumps(MODEL.split(','))}\n")
    logs = [str(folder / f"log-{seed}.csv") for seed in (1, 2, 3)]
    assert run(["fit", logs[0], "--model", MODEL, "-o", str(folder / "cal.toml")]) == 0
    assert run(["fleet", "fit", *logs, "--model", MODEL, "--processes", "1", "-o", str(folder / "fleet.parquet")]) == 0
    assert run(["array", "simulate", "-o", str(folder / "array")]) == 0
    return folder


COMMANDS = {
    "fit {in}/log-1.csv --model bias,scale -o {out}": "cal.toml",
    "fit {in}/log-1.csv --method linear -o {out}": "cal.toml",
    "compare {in}/log-1.csv --model bias,scale -o {out}": "page.html",
    "report {in}/log-1.csv --model bias,scale -o {out}": "page.html",
    "convert {in}/log-1.csv -o {out}": "log.parquet",
    "add cross_field --model {out} {in}/log-1.csv": "model.toml",
    "remove misalignment --model {out} {in}/log-1.csv": "model.toml",
    "trajectory pybv11 -o {out}": "table.csv",
    "fleet fit {in}/log-1.csv --model bias,scale --processes 1 -o {out}": "fleet.parquet",
    "fleet report {in}/fleet.parquet -o {out}": "page.html",
    "fleet extract {in}/fleet.parquet log-2 -o {out}": "cal.toml",
    "array calibrate {in}/array/turned.csv --run {in}/array/run.csv -o {out}": "array.toml",
    "simulate hmc5983 -o {out}": "log.csv",
    "characterise {in}/rest.csv -o {out}": "page.html",
    "build pybv11 -o {out}": "",
    "challenge new -o {out}": "",
    "array simulate -o {out}": "",
    "demo -o {out}": "",
    "effect new mine --folder {out}": "",
}


@pytest.mark.parametrize("words", COMMANDS)
def test_it_says_so_and_loses_nothing(made, tmp_path, capsys, words):
    out = tmp_path / (COMMANDS[words] or "folder")
    if out.name == "model.toml":
        out.write_text((made / "model.toml").read_text())
    elif out.suffix and "fleet fit" not in words:
        out.write_text(OLD)
    elif out.name == "folder" and "effect new" in words:
        out.mkdir()
    before = contents(tmp_path)
    with full_disk():
        code = run(words.format_map({"in": made, "out": out}).split())
    said = capsys.readouterr().err.strip().splitlines()
    assert code == 2, said
    assert "on a disk with room; got File too large" in said[-1]
    assert [line for line in said if line.startswith("barberpole: ")] == said[-1:]
    assert {path: data for path, data in contents(tmp_path).items() if data} == before
