"""The Pythons that barberpole is for, as far as this machine has them.

`python tests/matrix.py compile` only compiles every file, as `make lint` does. `python tests/matrix.py` makes an
environment of the lock file for each (or for those that are named), and runs ruff, pyright and the quick part of the
tests there: `make matrix`.
"""

import os
import shutil
import subprocess
import sys
from pathlib import Path

REPOSITORY = Path(__file__).parents[1]
VERSIONS = ("3.11", "3.12", "3.13")
FOLDERS = ("host", "codegen", "tests")
PLACE = REPOSITORY / ".venv" / "matrix"
NAMES = (
    *("board", "board_check", "calibration", "cli", "disk_full", "doctor", "effects", "fleet", "house", "link", "lock"),
    *("log", "log_stream", "model", "modelfile", "outputs", "plugins", "records", "report"),
)
QUICK = ("tests/codegen", *(f"tests/host/test_{name}.py" for name in NAMES))
COMPILE = """
import sys, warnings
from pathlib import Path
warnings.simplefilter("error")
shims = {"shims"}  # they run inside MicroPython
for path in (p for folder in sys.argv[1:] for p in Path(folder).rglob("*.py") if not shims & set(p.parts)):
    compile(path.read_bytes(), str(path), "exec")
"""


def interpreter(version: str) -> str:
    """A Python of this version that runs: on the path, or of pyenv; '' if there is none."""
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv")) / "versions"
    here = [sys.executable] if version == "{}.{}".format(*sys.version_info[:2]) else []
    found = [*here, shutil.which(f"python{version}"), *sorted(pyenv.glob(f"{version}.*/bin/python"))]
    for path in filter(None, found):
        words = (path, "-c", "import ensurepip, sys; print(sys.version)")
        asked = subprocess.run(words, capture_output=True, text=True, check=False)
        if asked.returncode == 0 and asked.stdout.startswith(version):
            return str(path)
    return ""


def compiles(python: str) -> bool:
    """Whether this Python takes every file, without a warning."""
    return subprocess.run([python, "-c", COMPILE, *FOLDERS], cwd=REPOSITORY, check=False).returncode == 0


def environment(python: str, version: str) -> Path:
    """The folder of an environment of the lock file, made once for each content of it."""
    place, text = PLACE / version, (REPOSITORY / "host" / "requirements.lock").read_text()
    stamp = place / "installed.lock"
    if not stamp.exists() or stamp.read_text() != text:
        print(f"Python {version}: installing the lock file into {place.relative_to(REPOSITORY)} (once)", flush=True)
        subprocess.run([python, "-m", "venv", "--clear", place], check=True)
        pip = (place / "bin" / "python", "-m", "pip", "install", "-qq", "--disable-pip-version-check")
        subprocess.run([*pip, "--require-hashes", "-r", "host/requirements.lock"], cwd=REPOSITORY, check=True)
        subprocess.run([*pip, "--no-deps", "--no-build-isolation", "--editable", "."], cwd=REPOSITORY, check=True)
        stamp.write_text(text)
    return place / "bin"


def checks(python: str, version: str) -> list[str]:
    """Names of the checks that fail under this Python."""
    tools = environment(python, version)
    wanted = {
        "ruff": ("ruff", "check", "--quiet", "--ignore", "UP", "--target-version", f"py{version.replace('.', '')}"),
        "pyright": ("pyright", "--warnings", "--pythonversion", version),
        "tests": ("python", "-m", "pytest", "-n", "2", "-p", "no:cacheprovider", *QUICK),
    }
    env = {**os.environ, "PATH": f"{tools}{os.pathsep}{os.environ['PATH']}", "OPENBLAS_NUM_THREADS": "1"}
    env.pop("PYTHONPATH", None)
    return [
        name
        for name, (tool, *words) in wanted.items()
        if subprocess.run([tools / tool, *words], cwd=REPOSITORY, env=env, check=False).returncode
    ]


def main(versions: list[str], only_compile: bool) -> int:
    """Exit code: 1 where a check fails under a Python that is here. One line a version."""
    bad = 0
    for version in versions:
        python = interpreter(version)
        if not python:
            print(f"Python {version}: not on this machine")
            continue
        failed = [] if compiles(python) else ["compile"]
        failed += [] if only_compile or failed else checks(python, version)
        bad += bool(failed)
        if failed or not only_compile:
            print(
                f"Python {version}: {', '.join(failed)} failed" if failed else f"Python {version}: passed", flush=True
            )
    return min(bad, 1)


if __name__ == "__main__":
    given = sys.argv[1:]
    sys.exit(main([v for v in given if v != "compile"] or list(VERSIONS), "compile" in given))
