"""`make lint` sees what MicroPython would only say on the board: pyright with the stubs of the stm32 port."""

import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from barberpole import paths

REPOSITORY = Path(__file__).parents[2]
STUBS = REPOSITORY / ".venv" / "stubs"
PYRIGHT = Path(sys.executable).with_name("pyright")

pytestmark = pytest.mark.skipif(
    not (STUBS / "pyb.pyi").exists() or not PYRIGHT.exists(), reason="make lint installs pyright and the stubs"
)


def complaints(folder: Path) -> list[str]:
    """Errors of pyright in a folder with bp_timers.py, by the firmware's own configuration."""
    settings = json.loads((paths.firmware() / "pyrightconfig.json").read_text())
    settings |= {"typeshedPath": str(STUBS), "stubPath": str(STUBS), "extraPaths": [str(STUBS)]}
    (folder / "pyrightconfig.json").write_text(json.dumps(settings))
    words = [str(PYRIGHT), "--outputjson", "--project", str(folder)]
    done = subprocess.run(words, capture_output=True, text=True, check=False, timeout=120)
    found = json.loads(done.stdout)["generalDiagnostics"]
    assert (done.returncode != 0) == any(each["severity"] == "error" for each in found)  # what make goes by
    return [each["message"] for each in found if each["severity"] == "error"]


def test_a_misspelt_keyword_of_a_timer_is_an_error(tmp_path):
    shutil.copy(paths.firmware() / "bp_timers.py", tmp_path)
    text = (tmp_path / "bp_timers.py").read_text()
    misspelt, count = re.subn(r"pyb\.Timer\(8, prescaler=", "pyb.Timer(8, prescalar=", text)
    assert count == 1
    (tmp_path / "bp_misspelt.py").write_text(misspelt)
    found = complaints(tmp_path)
    assert len(found) >= 1
    assert all("prescalar" in message or "overload" in message.lower() for message in found)  # bp_timers.py is clean


def test_make_lint_runs_it():
    lint = (REPOSITORY / "Makefile").read_text().partition("\nlint:")[2].partition("\n\n")[0]
    assert "pyright --warnings --project firmware/pyrightconfig.json" in lint
