"""Tables of other programs: separators, decimal commas, times as text, other units; nothing guessed."""

import json

import numpy as np
import pytest
from barberpole import units
from barberpole.cli import run
from barberpole.errors import InputError
from barberpole.foreign import read_foreign
from barberpole.log import read_log

TAKE = ("t_s=Zeit", "x_lsb=mx", "y_lsb=my", "z_lsb=mz")


def table(tmp_path, text: str, name: str = "odd.csv", encoding: str = "utf-8"):
    path = tmp_path / name
    path.write_bytes(text.encode(encoding))
    return path


def test_semicolons_decimal_commas_and_times_as_text(tmp_path):
    text = (
        "Zeit;mx;my;mz;Temperatur;Puls\n"
        "2026-11-20 09:15:02.120;0,374;-1,5e-1;3;31,5;SET\n"
        "2026-11-20 09:15:02.370;0,376;,25;4;;reset\n"
        "2026-11-20 09:16:02.120;0,378;0,5;5;32;SET\n"
    )
    log = read_foreign(table(tmp_path, text, encoding="utf-8-sig"), (*TAKE, "state=Puls", "temp_c=Temperatur"))
    assert log["t_s"].tolist() == [0.0, 60.0]  # the row without its temperature is dropped, and said
    assert log["x_lsb"].tolist() == [0.374, 0.378]
    assert log["y_lsb"].tolist() == [-0.15, 0.5]
    assert log["state"].tolist() == [1.0, 1.0]
    assert any("1 of 3 rows were dropped" in note for note in log.notes)


@pytest.mark.parametrize(
    ("text", "seconds"),
    [
        ("Zeit mx my mz\n0.5 1 2 3\n1.5 4 5 6\n", [0.5, 1.5]),
        ("# Zeit\tmx\tmy\tmz\n20.11.2026 23:59:59.5\t1\t2\t3\n21.11.2026 00:00:01.0\t4\t5\t6\n", [0.0, 1.5]),
        ("Zeit,mx,my,mz\n09:15:02.5,1,2,3\n09:15:03.0,4,5,6\n", [0.0, 0.5]),
        ("mx;Zeit;my;mz;Größe\n1;2026-11-20T09:15:02Z;2;3;x\n4;2026-11-20T09:15:04Z;5;6;y\n", [0.0, 2.0]),
    ],
)
def test_separators_and_clocks(tmp_path, text, seconds):
    log = read_foreign(table(tmp_path, text, encoding="latin-1"), TAKE)
    assert log["t_s"].tolist() == seconds
    assert np.stack([log[name] for name in ("x_lsb", "y_lsb", "z_lsb")]).tolist() == [[1, 4], [2, 5], [3, 6]]


def test_units_are_said_and_converted(tmp_path):
    text = "ms,mx,my,mz,Bx,By,Bz,T\n0,1,2,3,0.5,0,0,300\n20,1,2,3,0,500,0,310\n"
    take = ("t_s=ms:ms", *TAKE[1:], "bx_ut=Bx:gauss", "by_ut=By:mG", "bz_ut=Bz:nT", "temp_c=T:K")
    log = read_foreign(table(tmp_path, text), take)
    assert log["t_s"].tolist() == [0.0, 0.02]
    assert log["bx_ut"][0] == pytest.approx(units.gauss_to_ut(0.5))
    assert log["by_ut"][1] == pytest.approx(units.gauss_to_ut(0.5))
    assert log["temp_c"] == pytest.approx([26.85, 36.85])
    assert units.other_unit(np.array([212.0]), "temp_c", "f") == pytest.approx([100.0])


@pytest.mark.parametrize(
    ("take", "says"),
    [
        (("x_lsb=mx", "y_lsb=my", "z_lsb=no"), "a column of the table; got 'no'; there are Zeit, mx, my, mz"),
        (("x_lsb", "y_lsb=my", "z_lsb=mz"), "--take must be NAME=COLUMN"),
        (("bx=mx",), "the name before = in --take must be one of b_ut"),
        (("x_lsb=mx:gauss",), "must be not given for x_lsb"),
        (("bx_ut=mx:furlong",), "must be one of gauss"),
        (("x_lsb=mx", "x_lsb=my"), "column x_lsb must be taken once"),
        (("x_lsb=mx", "y_lsb=my", "z_lsb=Zeit"), "column Zeit must be numbers; got 'noon' in row 1"),
        (("t_s=Zeit", "x_lsb=mx", "y_lsb=my", "z_lsb=mz"), "column Zeit must be times or numbers of seconds"),
        (("x_lsb=mx", "y_lsb=my"), "column z_lsb must be given beside x_lsb, y_lsb"),
    ],
)
def test_what_is_wrong_is_said(tmp_path, take, says):
    with pytest.raises(InputError) as caught:
        read_foreign(table(tmp_path, "Zeit;mx;my;mz\nnoon;1;2;3\nnoon;1;2;3\n"), take)
    assert says in str(caught.value)


def test_rows_of_another_width_are_refused(tmp_path):
    with pytest.raises(InputError, match="row 2 must be 4 cells wide, as its names; got 3"):
        read_foreign(table(tmp_path, "Zeit;mx;my;mz\n0;1;2;3\n1;2;3\n"), TAKE)
    with pytest.raises(InputError, match="a line of column names and rows under it"):
        read_foreign(table(tmp_path, ""), TAKE)


def test_a_cell_without_end_is_refused(tmp_path):
    """What an open quotation mark makes of the rest of a long file."""
    path = tmp_path / "open.csv"
    path.write_text('t,x,y,z\n0,1,2,"3\n' + "4,5,6,7\n" * 40_000)
    with pytest.raises(InputError, match="field larger than"):
        read_foreign(path, ["t_s=t", "x_lsb=x", "y_lsb=y", "z_lsb=z"])


def test_convert_makes_a_log_of_it(tmp_path, capsys):
    path, made = table(tmp_path, "Zeit;mx;my;mz\n0;1,5;2;3\n1;4;5;6\n", "odd.txt"), tmp_path / "mine.csv"
    words = [word for one in TAKE for word in ("--take", one)]
    assert run(["convert", str(path), "-o", str(made), *words, "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["rows"] == 2
    assert read_log(made)["x_lsb"].tolist() == [1.5, 4.0]


@pytest.mark.parametrize("text", ["a;mx\n1;2\n", "mx,my,mz\n1,2,3\n", "t_s,x_lsb,y_lsb,z_lsb\n09:15:02,1,2,3\n"])
def test_a_table_that_is_no_log_is_told_the_way(tmp_path, capsys, text):
    assert run(["fit", str(table(tmp_path, text)), "--model", "bias"]) == 2
    assert "`barberpole convert --take`" in capsys.readouterr().err
