"""Many logs: the same rows however they are done, whatever is interrupted, whichever log is bad."""

import json
import os
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from barberpole import cli
from barberpole.errors import InputError
from barberpole.fit.fit import fit_log
from barberpole.fleet import pool
from barberpole.fleet.identity import identity, in_folders
from barberpole.fleet.journal import beside, rows_of
from barberpole.fleet.run import CHUNK, logs, run
from barberpole.fleet.settings import settings_of
from barberpole.fleet.table import read_fleet
from barberpole.log import read_log
from barberpole.modelfile import read_model

MODEL = read_model("bias,scale,misalignment")
HERE = pool.Pool(lambda: ThreadPoolExecutor(1), lambda executor: executor.shutdown(), 1)
BOARDS = 16


def turned(seed, rows=300):
    """A short log of a board: turned through all directions in 40 to 60 µT."""
    rng = np.random.default_rng(seed)
    field = rng.normal(size=(3, rows))
    field *= rng.uniform(40, 60, rows) / np.linalg.norm(field, axis=0)
    angles = np.eye(3) + 0.02 * rng.normal(size=(3, 3))
    y = rng.normal(10.0, 0.5, (3, 1)) * (angles @ field) + rng.normal(0, 30, (3, 1)) + 2.0 * rng.normal(size=(3, rows))
    out = {"t_s": np.arange(rows) / 40.0, "temp_c": 25.0 + 0.05 * rng.normal(size=rows)}
    return (
        out
        | dict(zip(("x_lsb", "y_lsb", "z_lsb"), y, strict=True))
        | dict(zip(("bx_ut", "by_ut", "bz_ut"), field, strict=True))
    )


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Sixteen logs and one that is none."""
    path = tmp_path_factory.mktemp("lot7")
    for at in range(BOARDS):
        pq.write_table(pa.table(turned(at)), path / f"board{at:02}_2026-05-01.parquet")
    (path / "board99.parquet").write_bytes(b"not a log")
    return path


@pytest.fixture(scope="module")
def plain(folder, tmp_path_factory):
    """The table of an uninterrupted fit in this process."""
    output = tmp_path_factory.mktemp("plain") / "fleet.parquet"
    run(logs([str(folder)]), settings_of("fit", MODEL), output, HERE)
    return output


def test_every_log_is_a_row_and_a_bad_one_has_its_reason(folder, plain):
    fleet = read_fleet(plain)
    assert [Path(row["log"]).name for row in fleet.rows] == sorted(path.name for path in folder.iterdir())
    assert [row["log"] for row in fleet.failed] == [str(folder / "board99.parquet")]
    assert fleet.failed[0]["reason"].startswith("the log must be a Parquet file; got")
    first = fleet.rows[0]
    assert (first["board"], first["lot"], first["date"]) == ("board00", folder.name, "2026-05-01")
    alone = fit_log(read_log(folder / "board00_2026-05-01.parquet"), MODEL)
    found = {name: pytest.approx([v, s]) for name, v, s in zip(alone.model.names, alone.p, alone.stderr, strict=True)}
    assert first["parameters"] == found
    again = fleet.calibration("board00")
    assert again.covariance == pytest.approx(alone.covariance)
    assert again.residual.rms_lsb == pytest.approx(alone.rms_lsb)


def test_processes_give_the_same_bytes(folder, plain, tmp_path):
    output = tmp_path / "fleet.parquet"
    found = run(logs([str(folder)]), settings_of("fit", MODEL), output, pool.processes(2))
    assert (found.known, len(found.failed)) == (0, 1)
    assert output.read_bytes() == plain.read_bytes()
    assert not beside(output).exists()


def test_what_is_done_is_not_done_again(folder, plain, tmp_path, monkeypatch):
    output = tmp_path / "fleet.parquet"
    settings = settings_of("fit", MODEL)
    few = logs([str(folder)])[::3]
    run(few, settings, output, HERE)
    found = run(logs([str(folder)]), settings, output, HERE)
    assert found.known == len(few)
    assert output.read_bytes() == plain.read_bytes()
    other = run(logs([str(folder)]), settings_of("fit", read_model("bias,scale")), output, HERE)
    assert other.known == 0  # another model is another answer


def test_a_killed_run_goes_on_and_ends_the_same(folder, tmp_path):
    whole, killed = tmp_path / "whole.parquet", tmp_path / "killed.parquet"
    some = str(folder / "board0[0-7]*")
    words = ["fleet", "diagnose", some, "--processes", "1", "--json", "-o"]
    process = subprocess.Popen([sys.executable, "-m", "barberpole", *words, str(killed)], stdout=subprocess.DEVNULL)
    until(lambda: len(rows_of(beside(killed))) >= 4)
    process.send_signal(signal.SIGKILL)
    process.wait()
    done = len(rows_of(beside(killed)))
    assert 4 <= done < 8
    assert not killed.exists()
    with beside(killed).open("ab") as journal:
        journal.write(b'{"key": "cut sho')
    settings = settings_of("diagnose", MODEL)
    assert run(logs([some]), settings, killed, HERE).known == done
    run(logs([some]), settings, whole, HERE)
    assert killed.read_bytes() == whole.read_bytes()


def until(true, seconds=60.0):
    end = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < end
        time.sleep(0.01)


def test_ctrl_c_leaves_what_is_done(folder, plain, tmp_path):
    output = tmp_path / "fleet.parquet"

    def interrupt(done):
        if done:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(logs([str(folder)]), settings_of("fit", MODEL), output, HERE, interrupt)
    assert rows_of(beside(output))
    assert not output.exists()
    with pytest.raises(InputError, match=r"start the same run again"):
        read_fleet(output)
    run(logs([str(folder)]), settings_of("fit", MODEL), output, HERE)
    assert output.read_bytes() == plain.read_bytes()


def fatal(paths):
    """Work that one log ends together with its process."""
    if any("board05" in path for path in paths):
        os._exit(1)
    return [{"log": path} for path in paths]


def test_a_log_that_ends_its_process_costs_no_other():
    paths = [f"board{at:02}" for at in range(12)]
    chunks = [paths[at : at + 3] for at in range(0, 12, 3)]
    lost = lambda path, error: {"log": path, "reason": type(error).__name__}  # noqa: E731
    rows = [row for rows in pool.each(chunks, fatal, pool.processes(2), lost) for row in rows]
    assert sorted(row["log"] for row in rows) == paths
    assert [row for row in rows if "reason" in row] == [{"log": "board05", "reason": "BrokenProcessPool"}]


def test_two_runs_of_one_output_do_not_mix(folder, tmp_path):
    output, settings = tmp_path / "fleet.parquet", settings_of("fit", MODEL)

    def second(done):
        with pytest.raises(InputError, match="a file of this run alone"):
            run(logs([str(folder)]), settings, output, HERE)

    run(logs([str(folder)])[:2], settings, output, HERE, second)


def test_a_dask_cluster_gives_the_same_and_survives_the_loss_of_a_worker(folder, plain, tmp_path, monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setitem(CHUNK, "fit", 1)
    settings, output = settings_of("fit", MODEL), tmp_path / "fleet.parquet"
    killed = []
    with distributed.LocalCluster(2, threads_per_worker=1, dashboard_address=None, silence_logs=50) as cluster:

        def kill(done):
            if done and not killed:
                killed.append(cluster.workers[0].pid)
                os.kill(killed[0], signal.SIGKILL)

        with pool.dask(cluster.scheduler_address) as workers:
            found = run(logs([str(folder)]), settings, output, workers, kill)
    assert killed
    assert len(found.failed) == 1
    assert output.read_bytes() == plain.read_bytes()


def test_no_cluster_is_one_sentence(monkeypatch):
    monkeypatch.setattr(pool, "JOIN_S", 0.2)
    with (
        pytest.raises(InputError, match="--dask must be the address of a running scheduler"),
        pool.dask("tcp://127.0.0.1:9"),
    ):
        pass


def test_names_say_board_lot_and_date():
    path = Path("/logs/lot3/b12_20260501T1030.parquet")
    assert vars(identity(path, {})) == {"board": "b12", "lot": "lot3", "date": "2026-05-01T1030"}
    assert identity(Path("a/b12.csv"), {"uid": "3A00", "lot": "L9"}).board == "3A00"
    found = identity(Path("x/L4-0007-2026-05-01.csv"), {}, r"(?P<lot>L\d+)-(?P<board>\d+)-(?P<date>[\d-]+)")
    assert vars(found) == {"board": "0007", "lot": "L4", "date": "2026-05-01"}


def test_a_log_named_by_its_date_or_like_all_others_is_of_its_folders_board():
    """b1/log.csv and b2/log.csv are two boards, not one that changed."""
    assert vars(identity(Path("/lot3/b12/20260501.csv"), {})) == {"board": "b12", "lot": "lot3", "date": "2026-05-01"}
    assert in_folders(["lot3/b1/log.csv", "lot3/b1/turned.csv"]) is None
    assert in_folders(["b1/log.csv"]) is None
    pattern = in_folders(["/lot3/b1/log.csv", "/lot3/b2/log.csv"])
    assert vars(identity(Path("/lot3/b2/log.csv"), {}, pattern)) == {"board": "b2", "lot": "lot3", "date": None}


def test_folders_of_one_name_in_two_lots_are_two_boards():
    pattern = in_folders(["lot1/b1/log.csv", "lot2/b1/log.csv"])
    assert [vars(identity(Path(f"/all/{lot}/b1/log.csv"), {}, pattern)) for lot in ("lot1", "lot2")] == [
        {"board": "lot1/b1", "lot": "lot1", "date": None},
        {"board": "lot2/b1", "lot": "lot2", "date": None},
    ]
    again = in_folders(["2026-05-01/b1/log.csv", "2026-06-01/b1/log.csv"])
    assert identity(Path("2026-06-01/b1/log.csv"), {}, again).board == "b1"


def test_boards_in_folders_are_boards(folder, tmp_path, capsys):
    for name in ("b1", "b2"):
        (tmp_path / "lot" / name).mkdir(parents=True)
        log = next(iter(sorted(folder.glob("board*.parquet"))))
        (tmp_path / "lot" / name / "log.parquet").write_bytes(log.read_bytes())
    output = tmp_path / "fleet.parquet"
    assert cli.run(["fleet", str(tmp_path / "lot"), "-o", str(output), "--processes", "1"]) == 0
    said = capsys.readouterr()
    assert "each board is named after its folder" in said.err
    assert f"barberpole fleet report {output} -o {tmp_path / 'fleet.html'}" in said.out
    assert [row["lot"] for row in read_fleet(output).rows] == ["lot", "lot"]


@pytest.mark.parametrize("words", [["fleet"], ["fleet", "fit"], ["fleet", "--do", "fit"]])
def test_the_command_line_in_each_form(words, folder, tmp_path, capsys):
    output = tmp_path / "fleet.parquet"
    assert cli.run([*words, f"{folder}/board0[0-3]*.parquet", "-o", str(output), "--processes", "1", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert (said["do"], said["logs"], said["ok"], said["failed"]) == ("fit", 4, 4, 0)
    assert len(read_fleet(output).rows) == 4


def test_boards_are_verified_against_their_own_calibration(folder, plain, tmp_path, capsys):
    verify = ["fleet", "verify", "--processes", "1", "-o", str(tmp_path / "v.parquet"), "--calibration", str(plain)]
    assert cli.run([*verify, f"{folder}/board0[0-3]*.parquet"]) == 0
    strange = tmp_path / "board02.parquet"
    columns = turned(2) | {"x_lsb": turned(2)["x_lsb"] + 25.0}
    pq.write_table(pa.table(columns), strange)
    assert cli.run([*verify, f"{folder}/board0[0-1]*.parquet", str(strange)]) == 1
    rows = read_fleet(tmp_path / "v.parquet").rows
    assert [row["pass"] for row in rows] == [row["log"] != str(strange) for row in rows]
    assert cli.run([*verify, f"{folder}/board99.parquet"]) == 2
    assert "1 logs" not in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["fleet", "none/*.parquet", "-o", "a.parquet"], "the logs must be files that are there"),
        (["fleet", "--do", "dance", "x", "-o", "a.parquet"], "--do must be fit or verify or diagnose"),
        (["fleet", "{folder}", "-o", "a.csv"], "must be a file that ends in .parquet"),
        (["fleet", "{folder}", "-o", "a.parquet", "--name", "(?P<b"], "--name must be a regular expression"),
    ],
)
def test_bad_input_is_one_sentence(words, said, folder, capsys):
    assert cli.run([word.format(folder=folder) for word in words]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.bench
def test_two_thousand_boards(tmp_path):
    """2000 boards of 2000 rows, 12 parameters, on two cores: at least 150 boards a second are wanted."""
    for at in range(2000):
        pq.write_table(pa.table(turned(at, 2000)), tmp_path / f"board{at:04}.parquet")
    run(
        logs([str(tmp_path / "board000?.parquet")]),
        settings_of("fit", MODEL),
        tmp_path / "warm.parquet",
        pool.processes(2),
    )
    paths = logs([str(tmp_path / "board*.parquet")])
    found = run(paths, settings_of("fit", MODEL), tmp_path / "fleet.parquet", pool.processes(2))
    print(f"\nfleet fit, 2000 boards of 2000 rows        {found.rate:9.0f} boards/s (wanted 150)", end="")
    assert not found.failed
    assert (found.known, len(found.rows)) == (0, 2000)
