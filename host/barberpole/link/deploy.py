"""Put a build on a board and make sure that what arrived is what was built."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from barberpole.errors import InputError, PortError, must
from barberpole.files import read_text
from barberpole.link import mpremote
from barberpole.link.arriving import arriving

RUN_FILE = "bp/run.bpr"  # the coil run and verdict of the last power-up, as bp_main writes it


@dataclass(frozen=True)
class Shipment:
    """A build folder's files with their places and hashes on the board. The main program is last: until it is there,
    the board runs what it ran."""

    folder: Path
    calibration: str
    files: tuple[tuple[Path, str], ...]
    sha256: dict[str, str]


def shipment(folder: Path) -> Shipment:
    """What `barberpole build` left in a folder. Raises InputError if it is no build or a file was changed."""
    listing = folder / "build.json"
    if not listing.exists():
        raise InputError(must("the build", "a folder made by `barberpole build`", "no build.json", folder))
    try:
        described = json.loads(read_text(listing, "the build's listing"))
        entries = sorted(described["files"], key=lambda entry: entry["target"] == "main.py")
        files = tuple((folder / entry["source"], entry["target"]) for entry in entries)
        digests = {entry["target"]: entry["sha256"] for entry in entries}
        return Shipment(folder, described["calibration"], files, digests)
    except (ValueError, KeyError, TypeError):
        raise InputError(must("build.json", "as `barberpole build` wrote it", "another form", listing)) from None


def flash(folder: Path, port: str, say: Callable[[str], None] = lambda _: None) -> Shipment:
    """Copy a build to the board, compare hashes there, and restart it.

    Files that are already the same are not copied again, so an interrupted flash is simply repeated.
    Raises PortError where the board does not answer or a file did not arrive whole.
    """
    parcel = shipment(folder)
    say(f"copying {len(parcel.files)} files to {port}")
    mpremote.copy(port, parcel.files)
    say("comparing hashes on the board")
    there = mpremote.hashes(port, list(parcel.sha256))
    wrong = [target for target, digest in parcel.sha256.items() if there.get(target) != digest]
    if wrong:
        raise PortError(must(f"{wrong[0]} on the board", "what was built", "another content: flash again"))
    mpremote.reset(port)
    return parcel


def pull(port: str, target: Path) -> None:
    """The coil run and verdict of the last power-up, from the board's flash."""
    mpremote.require_port(port)
    with arriving(target) as beside:
        mpremote.fetch(port, RUN_FILE, beside)
