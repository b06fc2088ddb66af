"""A plugin of pytest for coverage.py: which test ran a line, which tests pass, and how long each takes."""

import json
import os
from collections.abc import Iterator
from pathlib import Path

import coverage
import pytest

seconds: dict[str, float] = {}
failed: set[str] = set()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Lines belong to the test, in this process and (by the environment) in those that it starts."""
    measured = coverage.Coverage.current()
    os.environ["BARBERPOLE_TEST"] = item.nodeid
    if measured:
        measured.switch_context(item.nodeid)
    try:
        return (yield)
    finally:
        del os.environ["BARBERPOLE_TEST"]
        if measured:
            measured.switch_context("")


def pytest_runtest_logreport(report: pytest.TestReport) -> None:
    """Add up set-up and call."""
    seconds[report.nodeid] = seconds.get(report.nodeid, 0.0) + report.duration
    if report.outcome != "passed":
        failed.add(report.nodeid)


def pytest_sessionfinish() -> None:
    """Write what passed, with its seconds, where BARBERPOLE_TIMES says; a worker of xdist leaves that to its master."""
    if "PYTEST_XDIST_WORKER" not in os.environ:
        passed = {test: round(s, 3) for test, s in seconds.items() if test not in failed}
        Path(os.environ["BARBERPOLE_TIMES"]).write_text(json.dumps(passed))
