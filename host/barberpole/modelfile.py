"""Model files: which effects, in words that a person edits.

    effects = ["bias", "scale", "misalignment"]
    plugins = ["my_effect.py"]      # optional, beside the model file
    sensor = "hmc1021_1022"         # optional
    [reference]                     # optional
    kind = "constant"               # "vector", "magnitude" or "constant": use no more of the field than that
    magnitude_ut = 48.9
    [cross_field]                   # optional settings of an effect

Which names are effects is the catalogue's to say; here only the form is checked.
"""

import hashlib
import json
import re
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import tomlkit
import tomlkit.exceptions
from pydantic.dataclasses import dataclass as checked_dataclass

from barberpole.errors import InputError, must
from barberpole.files import read_text, write_atomic
from barberpole.tables import STRICT, Number, Positive, read_toml, unknown, validate

HASH_DIGITS = 12
UPWARD = 2  # folders above a model file, within which a plugin's path is written from there
KEYS = ("effects", "plugins", "sensor", "reference")
NAME = re.compile(r"[a-z][a-z0-9_]*")


@dataclass(frozen=True)
class ModelFile:
    """The chosen effects. `settings` by effect; `plugins` as paths that can be opened from here; `path` if it was read.

    reference may hold kind ("vector", "magnitude" or "scalar", "constant": what is used of the field; without it, all
    that the log knows), magnitude_ut and temp_c.
    """

    effects: tuple[str, ...]
    settings: dict[str, dict[str, Any]] = field(default_factory=dict)
    reference: dict[str, Any] = field(default_factory=dict)
    plugins: tuple[str, ...] = ()
    sensor: str | None = None
    path: Path | None = None

    @property
    def hash(self) -> str:
        """12 hex digits that tell models apart; the same wherever the plugins lie."""
        plugins = [Path(plugin).name for plugin in self.plugins]
        return short_hash([list(self.effects), self.settings, self.reference, plugins, self.sensor])


def short_hash(content: Any) -> str:
    """The first 12 hex digits of the SHA-256 of `content` as JSON; floats count to the last bit."""
    text = json.dumps(content, sort_keys=True, separators=(",", ":"))
    return hashlib.sha256(text.encode()).hexdigest()[:HASH_DIGITS]


def read_model(spec: str | Path) -> ModelFile:
    """A model from a .toml file, or from a bare list such as "bias,scale,misalignment". Raises InputError."""
    if str(spec).endswith(".toml"):
        return _from_file(Path(spec))
    names = tuple(name.strip() for name in str(spec).split(",") if name.strip())
    wanted = "a .toml file or a comma list of effects"
    if not names or not all(NAME.fullmatch(name) for name in names):
        raise InputError(must("the model", wanted, repr(str(spec))))
    return ModelFile(_distinct(names, "the model"))


def write_model(model: ModelFile, path: str | Path) -> None:
    """Write `model` to `path`; what was written there by hand, comments included, stays."""
    path = Path(path)
    source = path if path.exists() else model.path
    text = read_text(source, "the model file") if source else ""
    write_atomic(path, model_text(model, path, text))


def model_text(model: ModelFile, path: Path, text: str = "") -> str:
    """The file's text: `text` with effects, plugins and sensor brought up to date, or a new one."""
    try:
        document = tomlkit.parse(text)
    except (tomlkit.exceptions.TOMLKitError, ValueError, RecursionError) as error:  # it takes less than tomllib
        got = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(must("the model file", "TOML that can be kept as it was written", got, path)) from None
    _update_list(document, "effects", model.effects)
    if model.plugins or "plugins" in document:
        _update_list(document, "plugins", [relative(plugin, path.parent) for plugin in model.plugins])
    if model.sensor and document.get("sensor") != model.sensor:
        document["sensor"] = model.sensor
    for name, table in {"reference": model.reference, **model.settings}.items():
        if table and name not in document:
            document[name] = table
    return tomlkit.dumps(document)


def add_effect(model: ModelFile, name: str) -> ModelFile:
    """The model with one more effect. Raises InputError if it has it."""
    if name in model.effects:
        raise InputError(must(f"effect {name}", "one that the model lacks", "it there already", model.path or ""))
    return replace(model, effects=(*model.effects, name))


def remove_effect(model: ModelFile, name: str) -> ModelFile:
    """The model without an effect; its settings stay. Raises InputError if it does not have it."""
    if name not in model.effects:
        raise InputError(must(f"effect {name}", f"one of {', '.join(model.effects)}", "none of them", model.path or ""))
    return replace(model, effects=tuple(effect for effect in model.effects if effect != name))


@checked_dataclass(frozen=True, config=STRICT)
class _Reference:
    kind: Literal["vector", "magnitude", "scalar", "constant"] | None = None
    """What is used of the known field."""
    magnitude_ut: Positive | None = None
    """µT. Magnitude of the field."""
    temp_c: Number | None = None
    """°C. Reference temperature."""


@checked_dataclass(frozen=True, config=STRICT)
class _Head:
    effects: tuple[str, ...]
    """Names from the catalogue."""
    plugins: tuple[str, ...] = ()
    """Files of own effects, beside the model file."""
    sensor: str | None = None
    """Name of a sensor file."""
    reference: _Reference | None = None


def _from_file(path: Path) -> ModelFile:
    tables = read_toml(path, "the model file")
    listed = tables.get("effects")
    names = [name for name in listed if isinstance(name, str)] if isinstance(listed, list) else []
    settings = {name: tables.pop(name) for name in list(tables) if name in names and isinstance(tables[name], dict)}
    if {"format", "parameters", "model"} <= tables.keys():
        got = "a calibration (`verify --calibration` and `report --calibration` hold one against a log)"
        raise InputError(must("the model file", "one that lists effects", got, path))
    for name in tables:
        if name not in KEYS:
            raise InputError(unknown(name, [*KEYS, *names], "the model file", path))
    if isinstance(tables.get("reference"), str):  # reference = "vector" says the kind alone
        tables["reference"] = {"kind": tables["reference"]}
    head = validate(_Head, tables, "the model file", path)
    if not head.effects:
        raise InputError(must("effects", "a list of at least one effect", "an empty list", path))
    plugins = tuple(str(path.parent / plugin) for plugin in head.plugins)
    reference = dict(tables.get("reference", {}))
    if reference.get("kind") == "scalar":
        reference["kind"] = "magnitude"
    return ModelFile(_distinct(head.effects, path), settings, reference, plugins, head.sensor, path)


def _distinct(names: tuple[str, ...], where: object) -> tuple[str, ...]:
    for at, name in enumerate(names):
        if name in names[:at]:
            raise InputError(must(f"effect {name}", "named once", "it twice", where))
    return names


def _update_list(document: tomlkit.TOMLDocument, key: str, wanted: tuple[str, ...] | list[str]) -> None:
    """Change a list item by item, so that comments between the items stay."""
    if key not in document:
        document[key] = list(wanted)
        return
    items: Any = document[key]
    for item in [item for item in items if item not in wanted]:
        items.remove(item)
    for item in wanted:
        if item not in items:
            items.append(item)


def relative(plugin: str, folder: Path) -> str:
    """A plugin's path from the folder of the file that lists it; the whole path where it lies far from there."""
    path, folder = Path(plugin).resolve(), folder.resolve()
    if path.is_relative_to(folder):
        return path.relative_to(folder).as_posix()
    near = next((up for up in folder.parents[:UPWARD] if path.is_relative_to(up)), None)
    if near is None or near == Path(near.anchor):
        return path.as_posix()
    return "../" * (folder.parents.index(near) + 1) + path.relative_to(near).as_posix()
