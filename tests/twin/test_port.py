"""The port as a PC sees it: unmodified mpremote, and a terminal program."""

import os
import subprocess
import sys
import termios
import time

import pytest
import serial
from barberpole.errors import PortError


def test_files_go_there_and_back(start, mpremote, tmp_path):
    twin = start()
    text = tmp_path / "text.txt"
    text.write_bytes(bytes(range(256)) * 40)
    mpremote(twin, "cp", text, ":text.txt", "+", "mkdir", "lib", "+", "cp", text, ":lib/copy.txt")
    assert "10240 text.txt" in mpremote(twin, "ls")
    back = tmp_path / "back.txt"
    mpremote(twin, "cp", ":lib/copy.txt", back)
    assert back.read_bytes() == text.read_bytes()
    mpremote(twin, "rm", "text.txt")
    assert "text.txt" not in mpremote(twin, "ls")


def test_run_exec_and_modules_of_the_board(start, mpremote, tmp_path):
    twin = start()
    script = tmp_path / "script.py"
    script.write_text(
        "import machine, pyb, stm, os\nprint(len(machine.unique_id()), machine.freq()[0], os.uname()[0])\n"
    )
    assert mpremote(twin, "run", script) == "12 168000000 pyboard\n"
    assert mpremote(twin, "exec", "import sys; print(sys.path)") == "['', '.frozen', '/lib']\n"
    assert mpremote(twin, "exec", "import utime, time; print(utime is time)") == "True\n"


def test_mount_serves_the_pcs_folder(start, mpremote, tmp_path):
    (tmp_path / "there.py").write_text("answer = 42\n")
    program = "import there; print(there.answer)"
    assert mpremote(start(), "mount", tmp_path, "exec", program).endswith("42\n")


def test_soft_reset_keeps_files_and_forgets_names(start, mpremote):
    twin = start()
    mpremote(twin, "exec", "kept = 1; open('kept','w').write('x')")
    assert mpremote(twin, "resume", "eval", "kept") == "1\n"
    mpremote(twin, "soft-reset")
    assert mpremote(twin, "resume", "exec", "print('kept' in globals())") == "False\n"
    assert "kept" in mpremote(twin, "ls")


def test_reset_and_soft_reset_run_main_again(start, mpremote, said):
    twin = start("readings.py")
    said(twin, "end of readings")
    assert twin.start_s() == 0.0
    mpremote(twin, "reset")
    said(twin, "end of readings", count=2)
    assert twin.start_s() > 0.0


def test_a_streaming_program_is_interrupted(start, mpremote):
    """mpremote's Ctrl-C ends main.py, however much it has said before anybody listened."""
    twin = start("forever.py")
    twin.wait_until(1.0)
    assert mpremote(twin, "resume", "eval", "row > 100") == "True\n"


def test_output_waits_for_a_reader(start):
    twin = start("forever.py")
    twin.wait_until(1.0)
    with serial.Serial(twin.port, timeout=1.0) as port:
        lines = [port.readline() for _ in range(500)]
    assert lines == [b"row %d\r\n" % (i + 1) for i in range(500)]


def read_rows(port, count):
    text = b""
    while text.count(b"\n") < count:
        text += os.read(port, 4096)
    return text.splitlines()[:count]


ROWS = [b"row %d" % (i + 1) for i in range(500)]


def test_a_reader_that_takes_its_time_to_empty_the_port_loses_nothing(start):
    twin = start("forever.py")
    twin.wait_until(1.0)
    port = os.open(twin.port, os.O_RDWR | os.O_NOCTTY)
    time.sleep(0.3)  # of a busy PC
    termios.tcflush(port, termios.TCIFLUSH)
    assert read_rows(port, len(ROWS)) == ROWS
    os.close(port)


def test_a_reader_that_empties_nothing_loses_nothing_and_finds_the_line_as_it_was(start):
    twin = start("forever.py")
    twin.kill()
    with serial.Serial(twin.port, timeout=0.0) as port:  # which leaves a line whose reads do not wait
        port.read(1 << 20)
    time.sleep(0.2)
    twin.power_cycle()
    port = os.open(twin.port, os.O_RDONLY | os.O_NOCTTY)
    assert termios.tcgetattr(port)[6][termios.VMIN] == 1
    twin.wait_until(1.0)
    assert read_rows(port, len(ROWS)) == ROWS
    os.close(port)


@pytest.fixture
def terminal(start):
    twin = start()
    with serial.Serial(twin.port, timeout=5.0) as port:
        port.write(b"\r\x03")
        port.read_until(b">>> \r\n>>> ")
        yield port


def test_ctrl_c_ends_a_program_that_asks_nothing(terminal):
    terminal.write(b"while True: pass\r\r")
    time.sleep(0.1)
    terminal.write(b"\x03")
    assert b"KeyboardInterrupt" in terminal.read_until(b"KeyboardInterrupt: \r\n>>> ")
    terminal.write(b"print(6*7)\r")
    assert terminal.read_until(b"42\r\n").endswith(b"42\r\n")


def test_ctrl_c_ends_a_sleeping_program(terminal):
    terminal.write(b"import time\rwhile True: time.sleep(1)\r\r")
    time.sleep(0.1)
    terminal.write(b"\x03")
    assert terminal.read_until(b"KeyboardInterrupt: \r\n>>> ").endswith(b"KeyboardInterrupt: \r\n>>> ")


def test_ctrl_d_says_what_a_board_says(terminal):
    terminal.write(b"\x04")
    assert b"MPY: sync filesystems\r\nMPY: soft reboot\r\n" in terminal.read_until(b">>> ")


def test_full_flash_is_an_error_of_the_board(start, mpremote):
    program = "\n".join(
        [
            "try:",
            "    with open('big','wb') as file:",
            "        for _ in range(400): file.write(bytes(1024))",
            "except OSError as error: print(error.errno)",
        ]
    )
    assert mpremote(start(), "exec", program) == "28\n"


def test_port_opens_again_and_again(start, mpremote):
    twin = start()
    for n in range(4):
        assert mpremote(twin, "eval", f"{n}+1") == f"{n + 1}\n"


def test_memory_is_the_boards_and_not_the_pcs(start, mpremote):
    free = int(mpremote(start(), "exec", "import gc; gc.collect(); print(gc.mem_free())"))
    assert 190_000 < free < 220_000  # twice the pyboard's 100 kB: objects are twice the size


def test_command_prints_the_port_first_and_stops_on_ctrl_c(tmp_path):
    program = "from barberpole.twin.command import run_twin; import sys; run_twin('pybv11', flash_dir=sys.argv[1])"
    command = [sys.executable, "-c", program, str(tmp_path)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
    port = process.stdout.readline().strip()
    with serial.Serial(port, timeout=5.0) as terminal:
        terminal.write(b"\r")
        assert terminal.read_until(b">>> ")
    process.terminate()
    assert process.wait(10.0) == 0
    assert process.stdout.read() == ""
    assert (tmp_path / "pybv11.lfs2").exists()


def test_port_of_a_dead_board(start):
    twin = start()
    twin._process.kill()
    twin._process.wait()
    with pytest.raises(PortError, match="emulated board must be alive"):
        twin.truth()
