"""Every command in README.md and host/docs runs as it is written, and what a page quotes is what is printed.

A page's commands are its indented lines that begin with `barberpole`; they run in order in a folder of their own. What
follows `#` may say "exit 1". A command that stays until Ctrl-C runs beside the others; its first line is the port that
stands where the page says /dev/ttyACM0. A Python block is what the page's new effect becomes; lines with semicolons are
a table, odd.csv; a line of plugins goes into the model file.
"""

import contextlib
import os
import re
import select
import shlex
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from barberpole.cli import run

REPOSITORY = Path(__file__).parents[2]
DOCS = REPOSITORY / "host" / "docs"
GENERATED = ("boards.md", "limits.md", "reproduction.md", "physics.md")
PAGES = [REPOSITORY / "README.md", *sorted(page for page in DOCS.glob("*.md") if page.name not in GENERATED)]
STAYS = ("twin", "workbench")
PORT = "/dev/ttyACM0"
QUOTES = ("missing-effect.md", "your-own-effect.md")  # pages whose other indented lines are what the commands print
TABLE = "odd.csv"
PATIENCE_S = 60.0


def indented(page: Path) -> Iterator[str]:
    """Lines of the page's indented blocks, and its Python blocks whole."""
    code: list[str] | None = None
    for line in page.read_text().splitlines():
        if line.startswith("```"):
            if code:
                yield "\n".join(code)
            code = [] if line == "```python" else None
        elif code is not None:
            code.append(line)
        elif line.startswith("    ") and not line.lstrip().startswith(("-", "*")):
            yield line.strip()


def commands(page: Path) -> list[str]:
    return [line for line in indented(page) if line.startswith("barberpole ")]


class Shell:
    """Runs a page's commands in one folder, in this process; those that stay in one of their own."""

    def __init__(self, capsys):
        self.capsys, self.port, self.beside, self.printed = capsys, PORT, [], ""

    def __call__(self, line: str) -> None:
        command, _, remark = line.partition("  #")
        words = shlex.split(command)[1:]
        if words[0] in STAYS:
            self.start(words)
            return
        expected = int(found.group(1)) if (found := re.search(r"exit (\d)", remark)) else 0
        code = run([self.port if word == PORT else word for word in words])
        said = self.capsys.readouterr()
        assert code == expected, f"{line}\n{said.err}"
        self.printed += said.out

    def told(self, line: str) -> None:
        """What a reader does who is no command."""
        if line.startswith("plugins ="):
            model = Path("own", "model.toml")
            model.write_text(model.read_text() + line + "\n")
        elif line.startswith("def "):
            (plugin,) = Path().glob("*.py")
            plugin.write_text(plugin.read_text().partition("def params")[0] + line + "\n")
        elif ";" in line and not line.startswith("#"):
            with Path(TABLE).open("a") as table:
                table.write(line + "\n")

    def start(self, words: list[str]) -> None:
        quiet = ["--no-browser"] if words[0] == "workbench" else []
        child = subprocess.Popen(
            [sys.executable, "-m", "barberpole", *words, *quiet],
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
            env={name: value for name, value in os.environ.items() if not name.startswith("PYTEST")},
        )
        self.beside.append(child)
        assert child.stdout is not None
        assert select.select([child.stdout], [], [], PATIENCE_S)[0], f"{words} said nothing"
        first = child.stdout.readline().strip()
        assert first, f"{words} ended"
        if words[0] == "twin":
            self.port = first

    def end(self) -> None:
        for child in self.beside:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(child.pid, signal.SIGINT)
            child.wait(PATIENCE_S)


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    made = Shell(capsys)
    yield made
    made.end()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_does_what_it_says(page, shell, tmp_path):
    for line in indented(page):
        if line.startswith("barberpole "):
            shell(line)
        else:
            shell.told(line)
    if page.name in QUOTES:
        printed = " ".join(shell.printed.split())
        quoted = [line for line in indented(page) if not line.startswith(("barberpole ", "plugins =", "def "))]
        assert quoted
        assert [line for line in quoted if " ".join(line.split()) not in printed] == []


def test_pages_link_to_pages_that_are_there():
    for page in PAGES:
        for target in re.findall(r"\]\(([^)#:]+)\)", page.read_text()):
            assert (page.parent / target).exists(), f"{page.name} links to {target}"


def test_every_command_is_in_some_page():
    listed = {line.split()[1] for page in PAGES for line in commands(page)}
    from barberpole.cli import app

    names = {command.name or command.callback.__name__ for command in app.registered_commands if command.callback}
    names |= {str(group.name) for group in app.registered_groups}
    assert sorted(name.replace("_", "-") for name in names if name.replace("_", "-") not in listed) == []
