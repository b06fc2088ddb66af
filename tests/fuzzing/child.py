"""A case in a process of its own, forked when all is loaded: what it takes of time and memory is its own, and a crash
is an answer like others."""

import contextlib
import io
import json
import os
import resource
import select
import shutil
import signal
import tempfile
import time
import traceback
from dataclasses import dataclass
from pathlib import Path

from barberpole.cli import run

from fuzzing.case import Case

SLOW_S = 5.0  # of processor time
HANGING_S = 60.0  # of real time; the machine may be busy
BLOATED = 300 << 20  # bytes beyond what is loaded
LARGEST = 3 << 30  # bytes of address space beyond what is loaded: what asks for more is refused
CODES = (0, 1, 2)
TOO_LARGE = "fits into the memory"  # a small file must not ask for as much


@dataclass(frozen=True)
class Outcome:
    """How a case ended. fault: what is wrong with that, '' if nothing."""

    case: Case
    code: int | None
    fault: str
    said: str = ""


@dataclass
class Child:
    """A case at work. `fileno` can be waited for."""

    case: Case
    here: Path
    pid: int
    pipe: int
    began: float

    def fileno(self) -> int:
        return self.pipe

    @property
    def overdue(self) -> bool:
        return time.monotonic() - self.began > HANGING_S

    def ready(self, wait_s: float = 0.0) -> bool:
        """Whether it has answered, or died."""
        return bool(select.select([self.pipe], [], [], wait_s)[0])

    def end(self) -> Outcome:
        """Wait for it (a child that is overdue is killed) and judge."""
        late = self.overdue and not self.ready()
        if late:
            os.kill(self.pid, signal.SIGKILL)
        with open(self.pipe, "rb") as pipe:  # noqa: PTH123  (a descriptor)
            said = pipe.read()
        _, status, used = os.wait4(self.pid, 0)
        shutil.rmtree(self.here, ignore_errors=True)
        if late:
            return Outcome(self.case, None, f"did not end in {HANGING_S:.0f} s")
        if os.WIFSIGNALED(status):
            return Outcome(self.case, None, _killed(os.WTERMSIG(status)))
        answer = json.loads(said)
        fault = answer["fault"] or _judged(answer["code"], answer["wrong"])
        grown = used.ru_maxrss * 1024 - answer["base"]
        if not fault and grown > BLOATED:
            fault = f"{grown >> 20} MB of memory"
        return Outcome(self.case, answer["code"], fault, answer["said"] + answer["wrong"])


def start(case: Case, here: Path, good: Path) -> Child:
    """Begin a case in the new folder `here`."""
    reading, writing = os.pipe()
    began = time.monotonic()
    pid = os.fork()
    if pid == 0:
        try:
            os.close(reading)
            answer = _run(case, here, good)
            with open(writing, "wb") as pipe:  # noqa: PTH123
                pipe.write(json.dumps(answer).encode())
        finally:
            os._exit(0)
    os.close(writing)
    return Child(case, here, pid, reading, began)


def _run(case: Case, here: Path, good: Path) -> dict:
    here.mkdir(parents=True)
    case.write(here)
    # its own: a fork takes on what its parent has mapped of files only when it is used
    loaded, base = (int(pages) * resource.getpagesize() for pages in Path("/proc/self/statm").read_text().split()[:2])
    resource.setrlimit(resource.RLIMIT_AS, (loaded + LARGEST, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CPU, (int(SLOW_S), resource.RLIM_INFINITY))
    said, wrong, fault, code = io.StringIO(), io.StringIO(), "", None
    with tempfile.TemporaryFile() as raw, contextlib.redirect_stdout(said), contextlib.redirect_stderr(wrong):
        for descriptor in (1, 2):
            os.dup2(raw.fileno(), descriptor)
        try:
            code = run(case.words(here, good))
        except BaseException:  # noqa: BLE001  (any at all is what is looked for)
            fault = f"traceback\n{traceback.format_exc(limit=-4)}"
        raw.seek(0)
        below = raw.read(2000).decode(errors="replace")
        if below and not fault:
            fault = f"a library spoke: {below}"
    return {
        "code": code,
        "fault": fault,
        "base": base,
        "said": said.getvalue()[-2000:],
        "wrong": wrong.getvalue()[-2000:],
    }


def _killed(number: int) -> str:
    slow = f"more than {SLOW_S:.0f} s of processor time"
    return slow if number == signal.SIGXCPU else f"died of {signal.Signals(number).name}"


def _judged(code: int, wrong: str) -> str:
    """What is wrong with an exit code and what was said on stderr."""
    if code not in CODES:
        return f"exit {code}\n{wrong[-500:]}"
    if code == 2 and (not wrong.strip() or "Traceback" in wrong):
        return f"exit 2 without one sentence\n{wrong[-500:]}"
    return f"asks for too much memory: {wrong[-300:]}" if TOO_LARGE in wrong else ""
