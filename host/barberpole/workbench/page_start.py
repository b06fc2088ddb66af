"""Where a log comes from: dropped, from the folder, or a built-in trial with a hidden effect."""

from collections.abc import Awaitable, Callable
from pathlib import Path

from nicegui import events, ui

from barberpole.challenge.game import LEVELS
from barberpole.errors import InputError
from barberpole.log import SUFFIXES
from barberpole.workbench.guard import below
from barberpole.workbench.widgets import press, text_of

LISTED = 60  # files shown of a folder
LARGEST = 2 << 30  # bytes of an upload

Open = Callable[[Path], Awaitable[None]]
Play = Callable[[int], Awaitable[None]]


def show_start(folder: Path, uploads: Path, open_log: Open, play: Play, live: Callable[[], None]) -> None:
    """The first screen. `live` shows what a board is watched from."""
    with ui.element("main").classes("bp-start"):
        ui.html("<h1>Hold a model against a measurement</h1>", sanitize=False)
        about = "See where it fails, learn which physical effect is missing, add it, and watch the error fall."
        text_of(about, "p", "bp-off")
        _heading("Find a hidden effect")
        with ui.element("div").classes("bp-levels"):
            for level, about in LEVELS.items():
                with ui.element("button").classes("bp-level").on("click", lambda _, n=level: play(n)):
                    ui.html(f"<b>Level {level}</b>", sanitize=False)
                    text_of(about.text, classes="bp-small")
        _heading("Or bring a log: CSV, Parquet, or a board's records (.bpr)")
        _drop(uploads, open_log)
        _heading("Or watch a board")
        live()
        files = logs_in(folder)
        if files:
            _heading(f"Logs in {folder}")
            with ui.element("div").classes("bp-chips"):
                for name in files:
                    press(name, "bp-chip", lambda n=name: open_log(below(folder, n, "the log")))


def _heading(text: str) -> None:
    text_of(text, "h2")


def _drop(uploads: Path, open_log: Open) -> None:
    async def arrived(event: events.UploadEventArguments) -> None:
        try:
            path = below(uploads, Path(event.file.name).name, "the log")
        except InputError as error:
            ui.notify(str(error), type="negative", multi_line=True)
            return
        await event.file.save(path)
        event.sender.reset()  # type: ignore[attr-defined]
        await open_log(path)

    with ui.element("div").classes("bp-drop").style("width:100%"):
        upload = ui.upload(
            on_upload=arrived, auto_upload=True, max_file_size=LARGEST, label="Drop a log here, or press +"
        )
        upload.props(f'flat accept="{",".join(SUFFIXES)}" aria-label="Log to open"')
        upload.on("rejected", lambda: ui.notify(f"A log must end in {', '.join(SUFFIXES)}.", type="negative"))


def logs_in(folder: Path) -> list[str]:
    """Logs of a folder and of the folders in it, newest first."""
    found = [p for pattern in ("*", "*/*") for p in folder.glob(pattern) if p.suffix.lower() in SUFFIXES]
    found = [p for p in found if p.is_file() and not any(part.startswith(".") for part in p.parts[-2:])]
    found.sort(key=lambda p: -p.stat().st_mtime)
    return [p.relative_to(folder).as_posix() for p in found[:LISTED]]
