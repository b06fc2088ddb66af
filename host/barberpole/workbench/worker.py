"""A process for the work of one window: the page never waits for it, and can always stop it.

Processes are forked from one that has loaded everything and computes nothing, so that a new one is there at once.
Requests and answers go over a pipe. An answer is ("tick", samples), ("done", value) or ("failed", sentence). Stopping
is killing: every request carries all it needs, so the next one starts a new process, which reads the log again.
"""

import asyncio
import contextlib
import multiprocessing
import os
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import forkserver
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from barberpole.errors import BarberpoleError, InputError, must

CONTEXT = multiprocessing.get_context("forkserver")
LOADED = ["barberpole.blas", "barberpole.workbench.tasks"]


def prepare() -> None:
    """Begin to load what the work needs."""
    CONTEXT.set_forkserver_preload(LOADED)
    forkserver.ensure_running()


class Stopped(BarberpoleError):
    """The work was cancelled."""


class Worker:
    """The page's end. One request at a time; further ones wait their turn."""

    def __init__(self) -> None:
        self._turn = asyncio.Lock()
        self._thread = ThreadPoolExecutor(1)
        self._process: BaseProcess | None = None
        self._line: Connection | None = None
        self.busy = False

    def start(self) -> None:
        """Start the process, so that the first request finds it there."""
        self._thread.submit(self._ensure)

    async def ask(self, task: str, *arguments: Any, tick: Callable[[int], None] | None = None) -> Any:
        """Have a task of `tasks.TASKS` done. Raises what it raises, as an InputError, or Stopped."""
        async with self._turn:
            self.busy = True
            try:
                loop = asyncio.get_running_loop()
                return await loop.run_in_executor(self._thread, self._exchange, task, arguments, tick)
            finally:
                self.busy = False

    def stop(self) -> None:
        """Cancel what is being done, now."""
        if self._process:
            self._process.kill()

    def close(self) -> None:
        """The window is closed."""
        self.stop()
        self._thread.shutdown(wait=False)

    def _ensure(self) -> Connection:
        if self._line is None or self._process is None or not self._process.is_alive():
            prepare()
            self._line, there = CONTEXT.Pipe()
            self._process = CONTEXT.Process(target=serve, args=(there,), daemon=True)
            self._process.start()
            there.close()
        return self._line

    def _exchange(self, task: str, arguments: tuple, tick: Callable[[int], None] | None) -> Any:
        try:
            line = self._ensure()
            line.send((task, arguments))
            while True:
                kind, value = line.recv()
                if kind == "tick" and tick:
                    tick(value)
                elif kind == "done":
                    return value
                elif kind == "failed":
                    raise InputError(value)
        except (EOFError, OSError):
            self._gone()
            raise Stopped("stopped") from None

    def _gone(self) -> None:
        if self._process:
            self._process.kill()
            self._process.join()
        if self._line:
            self._line.close()
        self._process = self._line = None


def serve(line: Connection) -> None:
    """The worker's own end: answer requests until the line is closed."""
    import warnings

    from barberpole.workbench.lab import Lab
    from barberpole.workbench.tasks import TASKS

    os.setsid()  # Ctrl-C is the server's to hear
    warnings.simplefilter("ignore", RuntimeWarning)  # what they warn of shows in the answer, or is refused
    lab = Lab()
    lab.tick = lambda done: line.send(("tick", done))
    with contextlib.suppress(EOFError, OSError):
        while True:
            task, arguments = line.recv()
            line.send(_answer(lambda task=task, arguments=arguments: TASKS[task](lab, *arguments)))


def _answer(work: Callable[[], Any]) -> tuple[str, Any]:
    from numpy.linalg import LinAlgError

    try:
        return "done", work()
    except BarberpoleError as error:
        return "failed", str(error)
    except LinAlgError as error:
        return "failed", must("the log", "one that determines what is asked", f"readings without a solution: {error}")
    except MemoryError:
        return "failed", must("the log", "one that fits into memory", "more rows than that")
