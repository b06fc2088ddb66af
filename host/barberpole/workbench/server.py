"""The server of the page: this machine only, one session a window."""

import os
import socket
import tempfile
from collections.abc import Callable
from pathlib import Path

from barberpole.errors import InputError, must
from barberpole.workbench.guard import Guard
from barberpole.workbench.worker import prepare

HOST = "127.0.0.1"
RECONNECT_S = 60.0  # a window that sleeps so long finds its bench again


def serve(
    folder: Path,
    log: Path | None = None,
    port: int = 8642,
    browser: bool = True,
    ready: Callable[[], None] = lambda: None,
) -> None:
    """Serve the page until Ctrl-C; `ready` is called once it is up. Raises InputError for a wrong folder."""
    folder = folder.resolve()
    if not folder.is_dir():
        raise InputError(must("the folder", "one that is there", folder))
    with tempfile.TemporaryDirectory(prefix="barberpole-workbench-") as storage:
        os.environ["NICEGUI_STORAGE_PATH"] = storage  # nothing is stored, and not here
        from nicegui import app, ui  # here: slow to load

        from barberpole.workbench.page import build

        app.add_middleware(Guard, port=port)
        prepare()
        build(folder, log)
        app.on_startup(ready)
        ui.run(
            host=HOST,
            port=port,
            title="barberpole workbench",
            favicon=FAVICON,
            dark=None,
            reload=False,
            show=browser,
            show_welcome_message=False,
            reconnect_timeout=RECONNECT_S,
            binding_refresh_interval=None,
        )


def url(port: int) -> str:
    """Where the page is."""
    return f"http://{HOST}:{port}/"


def free_port(port: int) -> int:
    """The port, or for 0 any that is free. Raises InputError where it is taken."""
    with socket.socket() as trial:
        trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            trial.bind((HOST, port))
        except OSError as error:
            raise InputError(must("--port", "one that is free", f"{port}: {error.strerror}")) from None
        return trial.getsockname()[1]


FAVICON = (
    '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 32 32"><rect width="32" height="32" rx="6" fill="#0072B2"/>'
    '<path d="M-4 26 L10 4 M6 30 L20 4 M16 30 L30 4 M26 30 L40 4" stroke="#fff" stroke-width="4"/></svg>'
)
