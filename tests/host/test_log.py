"""Logs: what is right is read exactly, what is wrong is one sentence, what is damaged is dropped and counted."""

import struct
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from barberpole.errors import InputError
from barberpole.log import read_log, write_log
from barberpole.records import POINT, encode, encode_json
from hypothesis import given, settings
from hypothesis import strategies as st

HEAD = "t_s,x_lsb,y_lsb,z_lsb,temp_c\n"
ROWS = "0,1,2,3,20\n0.1,4,5,6,20.5\n0.1,7,8,9,21\n"
DATA = Path(__file__).parents[2] / ".." / "shared" / "data"


def csv(tmp_path: Path, text: str | bytes, name: str = "log.csv") -> Path:
    path = tmp_path / name
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return path


def refused(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_log(path)
    sentence = str(caught.value)
    assert "\n" not in sentence
    assert str(path) in sentence
    return sentence


def test_reads_columns_in_order(tmp_path):
    log = read_log(csv(tmp_path, HEAD + ROWS))
    assert list(log.columns) == ["t_s", "x_lsb", "y_lsb", "z_lsb", "temp_c"]
    assert log.n == 3
    assert log["x_lsb"].tolist() == [1, 4, 7]
    assert all(values.dtype == np.float64 for values in log.columns.values())
    assert (log.skipped, log.notes) == (0, ())
    assert log.has("t_s", "temp_c")
    assert not log.has("b_ut")
    with pytest.raises(InputError, match="column b_ut"):
        log["b_ut"]


@pytest.mark.parametrize(
    "mangle", [lambda t: t.replace("\n", "\r\n"), lambda t: "\ufeff" + t, lambda t: t.rstrip("\n")]
)
def test_line_ends_and_byte_order_mark(tmp_path, mangle):
    assert read_log(csv(tmp_path, mangle(HEAD + ROWS)))["z_lsb"].tolist() == [3, 6, 9]


def test_unknown_columns_are_kept_and_named(tmp_path):
    log = read_log(csv(tmp_path, "x_lsb,y_lsb,z_lsb,ax,comment\n1,2,3,9.8,on the roof\n"))
    assert log["ax"].tolist() == [9.8]
    assert "columns kept but not used: ax" in log.notes
    assert "column comment holds text and was left out" in log.notes


def test_gaps_are_dropped_and_counted(tmp_path):
    log = read_log(csv(tmp_path, HEAD + ROWS + "0.2,,1,1,20\n0.3,1,nan,1,\n0.4,1,1,1,20\n"))
    assert (log.n, log.skipped) == (4, 2)
    assert log.notes == ("2 of 6 rows were dropped for missing numbers (x_lsb 1, y_lsb 1, temp_c 1)",)


def test_gaps_in_unknown_columns_cost_nothing(tmp_path):
    log = read_log(csv(tmp_path, "x_lsb,y_lsb,z_lsb,gps\n1,2,3,\n1,2,3,7\n"))
    assert (log.n, log.skipped) == (2, 0)


def test_ragged_rows_are_dropped_and_counted(tmp_path):
    log = read_log(csv(tmp_path, HEAD + ROWS + "0.2,1,2\n0.3,1,2,3,20,9\n0.4,1,2"))
    assert (log.n, log.skipped) == (3, 3)
    assert log.notes == ("3 rows without 5 cells were dropped",)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "an empty file"),
        ("\n1,2,3\n", "column names"),
        (HEAD, "only column names"),
        ("1,2,3,4,5\n" + ROWS, "first line must be column names"),
        ("t_s;x_lsb;y_lsb;z_lsb\n0;1;2;3\n", "separated by commas"),
        ("t_s,x_lsb,y_lsb\n0,1,2\n", "column z_lsb must be given beside x_lsb, y_lsb"),
        ("t_s,ax,ay,az\n0,1,2,3\n", "one with the readings x_lsb, y_lsb, z_lsb"),
        ("x_lsb,x_lsb,y_lsb,z_lsb\n1,1,2,3\n", "column x_lsb must be there once"),
        ("x_lsb,,y_lsb,z_lsb\n1,1,2,3\n", "column 2 must be named"),
        ("x_gauss,y_gauss,z_gauss\n1,2,3\n", "column x_gauss must be x_lsb, in LSB"),
        ("x_ut,y_ut,z_ut\n1,2,3\n", "column x_ut must be x_lsb, in LSB"),
        ("t_ms,x_lsb,y_lsb,z_lsb\n0,1,2,3\n", "column t_ms must be t_s, in s"),
        ("x_lsb,y_lsb,z_lsb,bx_nt,by_nt,bz_nt\n1,2,3,1,2,3\n", "column bx_nt must be bx_ut, in µT; got the unit nt"),
        ("x_lsb,y_lsb,z_lsb,temp_k\n1,2,3,300\n", "column temp_k must be temp_c, in °C"),
        ("x_lsb,y_lsb,z_lsb,ix_a,iy_a,iz_a\n1,2,3,0,0,0\n", "column ix_a must be ix_ma, in mA"),
        ("X_LSB,y_lsb,z_lsb\n1,2,3\n", "column X_LSB must be written x_lsb"),
        ("x_lsb,y_lsb,z_lsb,Bx_uT,by_ut,bz_ut\n1,2,3,1,2,3\n", "must be written bx_ut"),
        ("x_lsb,y_lsb,z_lsb,bx_ut,by_ut\n1,2,3,1,2\n", "column bz_ut must be given beside bx_ut, by_ut"),
        ("x_set_lsb,y_set_lsb,z_set_lsb\n1,2,3\n", "column x_reset_lsb must be given: SET and RESET come in pairs"),
        (HEAD + ROWS + "0.5,1,two,3,20\n", "column y_lsb must be numbers; got 'two' in row 4"),
        (HEAD + "0,1,2,3,\n0.1,1,2,3,\n", "column temp_c must be numbers; got no number in any row"),
        (HEAD + "0,,2,3,20\n0.1,1,,3,20\n", "complete rows"),
        (HEAD + ROWS + "0.05,1,2,3,20\n", "times that do not go back; got 0.05 after 0.1 in row 4"),
        ("x_lsb,y_lsb,z_lsb,state\n1,2,3,1\n1,2,3,2\n", "got 2 in row 2"),
    ],
)
def test_refusals(tmp_path, text, says):
    assert says in refused(csv(tmp_path, text))


def test_other_refusals(tmp_path):
    assert "ends in .csv, .parquet, .bpr" in refused(csv(tmp_path, HEAD + ROWS, "log.txt"))
    assert "can be read" in refused(tmp_path / "nowhere.csv")
    assert "a Parquet file" in refused(csv(tmp_path, HEAD + ROWS, "log.parquet"))
    assert "no header" in refused(csv(tmp_path, HEAD + ROWS, "log.bpr"))
    assert "UTF-8" in refused(csv(tmp_path, b"x_lsb,\xff,y_lsb,z_lsb\n"))
    assert "got '\ufffd1' in row 2" in refused(csv(tmp_path, b"x_lsb,y_lsb,z_lsb\n1,2,3\n1,2,\xff1\n"))


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 8 * len(HEAD + ROWS) - 1))
def test_bit_flip_reads_or_says_one_sentence(tmp_path_factory, bit):
    data = bytearray((HEAD + ROWS).encode())
    data[bit // 8] ^= 1 << bit % 8
    path = csv(tmp_path_factory.mktemp("flip"), bytes(data))
    try:
        rows = read_log(path).n
    except InputError as error:
        rows = 1
        sentence = str(error)
    else:
        sentence = ""
    assert rows >= 1
    assert "\n" not in sentence


@pytest.mark.parametrize("ending", ["csv", "parquet"])
@given(values=st.lists(st.floats(-1e30, 1e30), min_size=1, max_size=20))
def test_round_trip_is_exact(tmp_path_factory, ending, values):
    folder = tmp_path_factory.mktemp("trip")
    rows = "".join(f"{value!r},1,2\n" for value in values)
    log = read_log(csv(folder, "x_lsb,y_lsb,z_lsb\n" + rows))
    write_log(log, folder / f"copy.{ending}")
    back = read_log(folder / f"copy.{ending}")
    assert back["x_lsb"].tolist() == values
    assert list(back.columns) == list(log.columns)


def test_write_refuses_other_endings_and_absent_folders(tmp_path):
    log = read_log(csv(tmp_path, HEAD + ROWS))
    with pytest.raises(InputError, match=r"ends in \.csv or \.parquet"):
        write_log(log, tmp_path / "log.bpr")
    with pytest.raises(InputError, match="folder"):
        write_log(log, tmp_path / "nowhere" / "log.csv")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["log.csv"]


def test_parquet_of_others(tmp_path):
    table = pa.table({"x_lsb": [1, 2], "y_lsb": [1.5, None], "z_lsb": pa.array([1, 2], pa.int16()), "who": ["a", "b"]})
    pq.write_table(table, tmp_path / "log.parquet")
    log = read_log(tmp_path / "log.parquet")
    assert (log.n, log.skipped) == (1, 1)
    assert "column who holds text and was left out" in log.notes


def test_set_and_reset_give_the_demodulated_reading(tmp_path):
    head = "x_set_lsb,y_set_lsb,z_set_lsb,x_reset_lsb,y_reset_lsb,z_reset_lsb\n"
    field = np.random.default_rng(1).normal(0, 100, (50, 3))
    for sign in (-1.0, 1.0):  # raw, and already turned
        rows = np.hstack([field + 7, sign * (field + 7)])
        text = head + "".join(",".join(map(repr, row)) + "\n" for row in rows.tolist())
        log = read_log(csv(tmp_path, text))
        np.testing.assert_allclose(np.stack([log[f"{a}_lsb"] for a in "xyz"], axis=1), field + 7, atol=1e-9)


# The board's records

COLUMNS = [["t_s", "q", 1e-6], *([f"{a}_{s}_lsb", "i", 0.125] for s in ("set", "reset") for a in "xyz")]
HEADER = {"format": 1, "board": "pybv11", "sensor": "hmc1021_1022", "model": "ab", "columns": COLUMNS}


def row(at: int) -> bytes:
    return struct.pack("<q6i", 5000 * at, 80 + at, 160, 240, -80 - at, -160, -240)


def point(index: int) -> bytes:
    return POINT.pack(index, 1, 0, 0, 80, 160, 240, -80, -160, -240, 3.5, 0, 0, 25)


def board_record(rows: int = 4) -> list[bytes]:
    return [
        encode_json("H", 0, HEADER),
        encode_json("T", 1, {"trajectory": "sphere", "points": 2}),
        encode("P", 2, point(0)),
        encode("P", 3, point(1)),
        encode_json("S", 4, {"accepted": True}),
        *(encode("D", 5 + k, row(2 * k) + row(2 * k + 1)) for k in range(rows // 2)),
        encode_json("E", 5 + rows // 2, {"code": 0}),
    ]


def test_board_record(tmp_path):
    log = read_log(csv(tmp_path, b"MPY: soft reboot\r\n" + b"".join(board_record()), "log.bpr"))
    assert log["t_s"].tolist() == [0, 0.005, 0.01, 0.015]
    assert log["x_set_lsb"].tolist() == [10, 10.125, 10.25, 10.375]
    assert log["x_lsb"].tolist() == log["x_set_lsb"].tolist()
    assert (log.meta["board"], log.meta["polarity"], log.meta["events"]) == ("pybv11", "raw", [{"code": 0}])
    assert (log.skipped, log.notes) == (0, ())
    run = log.selfcal
    assert run is not None
    assert (run.header["trajectory"], run.result) == ("sphere", {"accepted": True})
    assert run.unit.shape == run.set_lsb.shape == run.current_ma.shape == (3, 2)
    assert run.reset_lsb[:, 0].tolist() == [-80, -160, -240]
    assert run.temp_c.tolist() == [25, 25]


def test_damaged_record_is_skipped_and_counted(tmp_path):
    frames = board_record(8)
    frames[6] = frames[6].replace(frames[6][10:12], b"??")
    del frames[7]
    log = read_log(csv(tmp_path, b"".join(frames), "log.bpr"))
    assert (log.n, log.skipped) == (4, 2)
    assert log.notes == ("1 damaged records were skipped", "1 records are missing from the sequence")


def test_only_the_last_power_up_counts(tmp_path):
    log = read_log(csv(tmp_path, b"".join([*board_record(6), *board_record(4)]), "log.bpr"))
    assert log.n == 4
    assert log.notes == ("8 frames of earlier power-ups were left out",)


def streamed(first: int, rows: int, boot: int = 7) -> list[bytes]:
    """Rows from sequence `first` on, every fifth frame the header again."""
    head = {**HEADER, "uid": "ab12", "boot": boot}
    kinds = [encode_json("H", k, head) if k % 5 == 0 else encode("D", k, row(k)) for k in range(first, first + rows)]
    return list(kinds)


def test_a_repeated_header_is_the_same_power_up(tmp_path):
    log = read_log(csv(tmp_path, b"".join(streamed(0, 20)), "log.bpr"))
    assert (log.n, log.skipped, log.notes) == (16, 0, ())
    lost = streamed(0, 20)
    del lost[9:12]  # the header between two rows, and the rows
    log = read_log(csv(tmp_path, b"".join(lost), "log.bpr"))
    assert (log.n, log.notes) == (14, ("3 records are missing from the sequence",))


def test_a_reader_that_joins_later_loses_nothing_of_that_power_up(tmp_path):
    log = read_log(csv(tmp_path, b"".join(streamed(23, 20)), "log.bpr"))
    assert (log.n, log.skipped, log.notes) == (16, 0, ())
    assert log.meta["boot"] == 7
    wraps = streamed(65534, 20)  # the sequence is 16 bits
    assert read_log(csv(tmp_path, b"".join(wraps), "log.bpr")).n == 16


def test_rows_of_the_power_up_before_are_not_taken_for_this_one(tmp_path):
    """Both first headers are gone: the sequence that goes back is all that tells them apart."""
    log = read_log(csv(tmp_path, b"".join([*streamed(31, 3, boot=6), *streamed(1, 9)]), "log.bpr"))
    assert (log.n, log.skipped) == (8, 3)
    assert "3 frames before the first header" in log.notes[-1]


def test_the_same_boot_number_again_is_another_power_up(tmp_path):
    """A board whose flash is full counts no further."""
    log = read_log(csv(tmp_path, b"".join([*streamed(0, 20), *streamed(0, 10)]), "log.bpr"))
    assert log.n == 8
    assert log.notes == ("16 frames of earlier power-ups were left out",)


def test_points_stand_in_for_rows(tmp_path):
    log = read_log(csv(tmp_path, b"".join(board_record()[:5]), "log.bpr"))
    assert log.n == 2
    assert log["ix_ma"].tolist() == [3.5, 3.5]
    assert log["x_lsb"].tolist() == [80, 80]
    assert "the points of the self-calibration" in log.notes[0]


def test_frames_of_wrong_length_are_skipped(tmp_path):
    frames = [*board_record(), encode("D", 8, row(9)[:-1]), encode("P", 9, b"")]
    log = read_log(csv(tmp_path, b"".join(frames), "log.bpr"))
    assert (log.n, log.skipped) == (4, 2)


@pytest.mark.parametrize(
    ("header", "says"),
    [
        ({**HEADER, "format": 2}, "of format 1; got format 2"),
        ({**HEADER, "columns": [["t_s", "z", 1]]}, "a list of [name, struct code, scale]"),
        ({**HEADER, "columns": "t_s"}, "a list of [name, struct code, scale]"),
        ({**HEADER, "columns": [["x_gauss", "f", 1]]}, "x_lsb"),
        ({**HEADER, "columns": []}, "with columns"),
    ],
)
def test_bad_header(tmp_path, header, says):
    path = csv(tmp_path, encode_json("H", 0, header) + encode("D", 1, b"1234"), "log.bpr")
    assert says in refused(path)


def test_convert_keeps_the_header(tmp_path):
    log = read_log(csv(tmp_path, b"".join(board_record()), "log.bpr"))
    write_log(log, tmp_path / "log.parquet")
    back = read_log(tmp_path / "log.parquet")
    assert back.meta == log.meta
    assert back["x_reset_lsb"].tolist() == log["x_reset_lsb"].tolist()


# Real logs


@pytest.mark.skipif(not DATA.is_dir(), reason="the folder ../shared/data with real logs is not here")
@pytest.mark.parametrize(
    ("name", "n"),
    [
        ("hmc5883l_full_sphere", 8190),
        ("hmc5883l_tilt_sphere", 4322),
        ("hmc5883l_static_warming", 15948),
        ("qmc5883l_strong_iron", 22745),
        ("rm3100_shots_bb", 24),
        ("rm3100_shots_cf", 24),
    ],
)
def test_real_logs(name, n):
    log = read_log(DATA / f"{name}.csv")
    assert (log.n, log.skipped) == (n, 0)
    assert log.has("t_s", "x_lsb", "y_lsb", "z_lsb")
