"""Chunks of logs through any executor of the standard kind: processes here, or a Dask cluster, by the same loop.

A chunk whose process dies is taken apart, and its logs are tried one at a time with nothing else at work: only the log
that really ends its process is given up, and the others go on.
"""

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Executor, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait as wait_for
from typing import Any

from barberpole.errors import InputError, must

Row = dict[str, Any]
AHEAD = 3  # chunks handed in for each process, so that none waits for the next
JOIN_S = 15.0  # for a Dask scheduler to answer


@dataclass(frozen=True)
class Pool:
    """start makes an executor, stop ends one; width: how many chunks it works on at a time."""

    start: Callable[[], Executor]
    stop: Callable[[Executor], None]
    width: int


def processes(count: int | None = None) -> Pool:
    """A pool of processes here, with everything loaded before the first is made."""
    width = count or available()
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["barberpole.fleet.work"])

    def start() -> Executor:
        return ProcessPoolExecutor(width, mp_context=context, initializer=_begin)

    return Pool(start, lambda pool: pool.shutdown(wait=True, cancel_futures=True), width)


def available() -> int:
    """Cores that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begin() -> None:
    """In each process: Ctrl-C is the parent's to handle, and without the parent there is nothing left to do."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_follow, args=(parent.sentinel,), daemon=True).start()


def _follow(parent: int) -> None:
    wait_for([parent])
    os._exit(1)


@contextmanager
def dask(address: str) -> Iterator[Pool]:
    """A pool of the workers of a Dask cluster, which see the same files. Raises InputError if none answers."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError(must("--dask", "used with the extra: pip install 'barberpole[fleet]'", "no dask")) from None
    try:
        client = Client(address, timeout=JOIN_S)
    except (OSError, ValueError) as error:
        got = " ".join(str(error).split())[:120]
        raise InputError(must("--dask", "the address of a running scheduler, tcp://host:8786", got, address)) from None
    try:
        threads: Any = client.nthreads()  # of each worker, here where the client is not asynchronous
        width = max(sum(threads.values()), 1)
        yield Pool(lambda: client.get_executor(pure=False), lambda pool: pool.shutdown(False), width)
    finally:
        client.close()


def each(
    chunks: Sequence[Sequence[str]],
    work: Callable[[Sequence[str]], list[Row]],
    pool: Pool,
    lost: Callable[[str, BaseException], Row],
) -> Generator[list[Row], None, None]:
    """Rows of the chunks as they come, in any order. `work` must be what another process can be sent."""
    runner, alone = _Runner(pool, work), list[str]()
    try:
        for chunk, rows, error in _finished(runner, deque(chunks)):
            if error is None:
                yield rows
            else:
                alone.extend(chunk)
        for path in alone:
            future = runner.submit([path])
            error = _error(future)
            yield future.result() if error is None else [lost(path, error)]
    finally:
        runner.stop()


class _Runner:
    """An executor that is replaced when it breaks."""

    def __init__(self, pool: Pool, work: Callable[[Sequence[str]], list[Row]]):
        self.pool, self._work, self._executor = pool, work, pool.start()

    def submit(self, chunk: Sequence[str]) -> Future:
        try:
            return self._executor.submit(self._work, chunk)
        except BrokenProcessPool:
            self._executor = self.pool.start()
            return self._executor.submit(self._work, chunk)

    def stop(self) -> None:
        self.pool.stop(self._executor)


def _finished(
    runner: _Runner, waiting: deque[Sequence[str]]
) -> Iterator[tuple[Sequence[str], list[Row], BaseException | None]]:
    """Chunks with their rows or their error, as they come; only a few are handed in at a time."""
    running: dict[Future, Sequence[str]] = {}
    while waiting or running:
        while waiting and len(running) < AHEAD * runner.pool.width:
            chunk = waiting.popleft()
            running[runner.submit(chunk)] = chunk
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            chunk, error = running.pop(future), _error(future)
            yield chunk, future.result() if error is None else [], error


def _error(future: Future) -> BaseException | None:
    """What ended the work, if anything did. Raises InputError where the executor itself is gone."""
    try:
        return future.exception()
    except CancelledError:
        raise InputError(must("the cluster", "one that stays until the run ends", "its end")) from None
