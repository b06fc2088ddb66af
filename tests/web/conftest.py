"""The page in Debian's chromium, driven by playwright: a server of its own on any free port, a folder of its own."""

import json
import os
import select
import shutil
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import urlsplit

import pytest
from barberpole.challenge.record import Recipe, record, write

CHROMIUM = ("/usr/bin/chromium", "/usr/bin/chromium-browser")
REPOSITORY = Path(__file__).parents[2]
SHOTS = REPOSITORY / "out" / "workbench"  # ignored by git
START_S = 60.0


@pytest.fixture(scope="session")
def shots() -> Path:
    """Where screenshots are kept, to be looked at."""
    SHOTS.mkdir(parents=True, exist_ok=True)
    return SHOTS


@pytest.fixture(scope="session")
def folder(tmp_path_factory) -> Path:
    """The folder that the server may read and write."""
    return tmp_path_factory.mktemp("bench")


@pytest.fixture(scope="session")
def server(folder) -> Iterator[str]:
    """`barberpole workbench` as a user starts it; its address."""
    command = [sys.executable, "-m", "barberpole", "workbench", "--port", "0", "--folder", str(folder), "--no-browser"]
    source = [str(REPOSITORY / "host"), str(REPOSITORY / "codegen"), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(source), "OPENBLAS_NUM_THREADS": "1"}
    environment.pop("PYTEST_CURRENT_TEST", None)  # nicegui would take the server itself for a test
    process = subprocess.Popen([*command, "--json"], stdout=subprocess.PIPE, env=environment, text=True)
    assert process.stdout
    ready, _, _ = select.select([process.stdout], [], [], START_S)
    line = process.stdout.readline() if ready else ""
    assert line, "the server said nothing"
    url = json.loads(line)["url"]
    wait_for(url)
    yield url
    process.terminate()
    process.wait(10)


def wait_for(url: str) -> None:
    """The server says that it is up a moment before it listens."""
    address, until = urlsplit(url), time.monotonic() + START_S
    while True:
        try:
            socket.create_connection((address.hostname, address.port), timeout=1).close()
            return
        except OSError:
            assert time.monotonic() < until
            time.sleep(0.05)


@pytest.fixture(scope="session")
def chromium() -> Iterator:
    """A browser. Skips, loudly, only where there is none and none can be installed."""
    from playwright.sync_api import sync_playwright

    path = find_chromium()
    if path is None:
        pytest.skip("no chromium on this machine, and only root can install it: apt-get install chromium")
    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=path, args=["--no-sandbox", "--disable-gpu"])
        # one context: the scripts of the page are fetched and compiled once
        yield browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
        browser.close()


def find_chromium() -> str | None:
    """Debian's chromium, installed first where that is possible."""
    found = next((path for path in CHROMIUM if Path(path).exists()), None)
    if found is None and os.geteuid() == 0 and shutil.which("apt-get"):
        environment = os.environ | {"DEBIAN_FRONTEND": "noninteractive"}
        for command in (["update", "-qq"], ["install", "-qq", "-y", "--no-install-recommends", "chromium"]):
            subprocess.run(["apt-get", *command], stdout=subprocess.DEVNULL, check=False, env=environment)
        found = next((path for path in CHROMIUM if Path(path).exists()), None)
    return found


@pytest.fixture
def window(chromium, server):
    """A new window on the first screen."""
    page = chromium.new_page()
    page.set_default_timeout(60_000)
    page.faults = []
    page.on("pageerror", lambda error: page.faults.append(str(error)))
    page.goto(server)
    page.wait_for_selector("text=Find a hidden effect")
    yield page
    assert not page.faults
    page.close()


@pytest.fixture(scope="session")
def crossed(tmp_path_factory) -> Path:
    """A log of 3000 rows in which cross_field is hidden, ten times the noise."""
    path = tmp_path_factory.mktemp("logs") / "crossed.csv"
    return write(record(Recipe({"cross_field": 10.0}, rows=3000, seed=3)), path)
