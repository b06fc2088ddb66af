"""A challenge: a log in which something is wrong that nobody names, and a sealed answer."""

import base64
import json
import zlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from barberpole.adding import change
from barberpole.challenge.record import Recipe, record, rest, write
from barberpole.challenge.world import CATALOGUE, FOREIGN
from barberpole.errors import InputError, must
from barberpole.files import read_text, write_atomic
from barberpole.log import read_log
from barberpole.modelfile import read_model
from barberpole.observations import observations

BASE = ("bias", "scale", "misalignment")
LOG, REST, MODEL, SEALED = "log.csv", "rest.csv", "model.toml", "answer.sealed"
NOTHING = "none"
UNKNOWN = "unknown"  # the answer where no effect of the catalogue is right
PLAYED = tuple(name for name in CATALOGUE if name not in ("misalignment", "soft_iron"))  # the model has the angles
LARGEST_ANSWER = 1 << 20  # bytes


@dataclass(frozen=True)
class Level:
    """What makes a level: size of the effect over the noise, what is known of the field, 1/f corner over fs."""

    size: float
    reference: str
    corner: float
    kinds: tuple[int, ...]  # how many effects there may be; 0 may also be one that is in no catalogue
    text: str


LEVELS = {
    1: Level(10.0, "vector", 0.0, (1,), "one large effect, the field known"),
    2: Level(2.0, "vector", 0.0, (1,), "one effect of twice the noise, the field known"),
    3: Level(2.0, "magnitude", 0.0, (1,), "one effect of twice the noise, only the magnitude known"),
    4: Level(1.5, "vector", 0.1, (1,), "one effect, 1/f noise, with a minute at rest"),
    5: Level(2.0, "vector", 0.0, (0, 1, 2), "two effects, one, none, or one that is in no catalogue"),
}


@dataclass(frozen=True)
class Opened:
    """A sealed answer beside the one given. right: exactly what was hidden was named."""

    hidden: tuple[str, ...]
    given: tuple[str, ...]

    @property
    def taken(self) -> tuple[str, ...]:
        """What was hidden and the catalogue has."""
        return tuple(name for name in self.hidden if name not in FOREIGN)

    @property
    def right(self) -> bool:
        wanted = {UNKNOWN if name in FOREIGN else name for name in self.hidden} or {NOTHING}
        return set(self.given) == wanted


def new(folder: Path, level: int, seed: int | None = None) -> Level:
    """Write log, model and sealed answer into a folder. Raises InputError for another level or a folder in use."""
    if level not in LEVELS:
        raise InputError(must("the level", f"one of {', '.join(map(str, LEVELS))}", level))
    if (folder / SEALED).exists():
        raise InputError(must("the folder", "one without a challenge", "one with a sealed answer", folder))
    rng = np.random.default_rng(seed)
    chosen = LEVELS[level]
    hidden = _draw(chosen, rng)
    sizes = dict.fromkeys(hidden, chosen.size)
    recipe = Recipe(sizes, reference=chosen.reference, corner=chosen.corner, seed=int(rng.integers(1 << 30)))
    folder.mkdir(parents=True, exist_ok=True)
    write(record(recipe), folder / LOG)
    if chosen.corner:
        write(rest(recipe), folder / REST)
    write_atomic(folder / MODEL, f"effects = {json.dumps(BASE)}\n")
    write_atomic(folder / SEALED, _seal({"hidden": hidden, "level": level}))
    return chosen


def _draw(level: Level, rng: np.random.Generator) -> list[str]:
    seen = [name for name in PLAYED if level.reference == "vector" or name != "lag"]  # a scalar log cannot show lag
    count = int(rng.choice(level.kinds))
    if count:
        return [str(name) for name in rng.choice(seen, count, replace=False)]
    return [str(rng.choice(FOREIGN))] if rng.random() < 0.5 else []


def answer(folder: Path, given: tuple[str, ...]) -> Opened:
    """Open the sealed answer. Raises InputError where there is none, or for a name that is no effect."""
    hidden = unsealed(folder / SEALED)
    for name in given:
        if name not in (*CATALOGUE, NOTHING, UNKNOWN):
            raise InputError(must("the answer", f"of {', '.join((*CATALOGUE, NOTHING, UNKNOWN))}", repr(name)))
    return Opened(hidden, given)


def fall(folder: Path, opened: Opened) -> list[float]:
    """Held-out error in LSB of the model as it was given, then with each hidden effect of the catalogue in it too."""
    seen, file = observations(read_log(folder / LOG)), replace(read_model(folder / MODEL), effects=BASE)
    errors: list[float] = []
    for name in opened.taken:
        made = change(seen, file, replace(file, effects=(*file.effects, name)), name)
        errors += [made.after.heldout_rms_lsb] if errors else [made.before.heldout_rms_lsb, made.after.heldout_rms_lsb]
        file = made.after_file
    return errors


def _seal(content: dict) -> bytes:
    """Not a secret, only not readable by accident."""
    return base64.b64encode(zlib.compress(json.dumps(content).encode())) + b"\n"


def _unpacked(sealed: bytes) -> bytes:
    """What is packed in an answer, of the size that one may have: a few bytes may claim to hold gigabytes."""
    return zlib.decompressobj().decompress(sealed, LARGEST_ANSWER)


def unsealed(path: Path) -> tuple[str, ...]:
    """What was hidden. Raises InputError where the answer is none of ours."""
    try:
        content = json.loads(_unpacked(base64.b64decode(read_text(path, "the sealed answer"))))
        hidden = content["hidden"]
    except (ValueError, zlib.error, KeyError, TypeError, RecursionError):
        hidden = None
    if not isinstance(hidden, list) or not all(name in (*CATALOGUE, *FOREIGN) for name in hidden):
        raise InputError(must("the sealed answer", "as `challenge new` wrote it", "another content", path))
    return tuple(hidden)
