"""A user's own effects: one file each, with the physics in `forward`; everything else is derived and checked.

What is wrong with a plugin becomes one InputError that names the file, the line and what was expected.
"""

import hashlib
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path
from types import CodeType, ModuleType

import numpy as np

from barberpole import plugin_trial
from barberpole.effects import ALIASES, STACK, Effect
from barberpole.errors import InputError, must
from barberpole.files import read_text, write_atomic

SAID: list[Callable[[Path], None]] = []
"""Whoever runs a session may say here which files of a user's code it is about to run, each the first time."""

_ran: set[tuple[Path, str]] = set()

TEMPLATE = Path(__file__).with_name("plugin_template.py")


def new_plugin(name: str, folder: str | Path = ".") -> Path:
    """Write a plugin file to fill in. Raises InputError for an impossible name or a file that is there already."""
    path = Path(folder) / f"{name}.py"
    _check_name(name, path)
    if path.exists():
        raise InputError(must("a new effect", "a file that is not there yet", path))
    write_atomic(path, read_text(TEMPLATE, "the template").replace("NAME", name))
    return path


def load_plugins(paths: Sequence[str | Path]) -> tuple[Effect, ...]:
    """The effects in these files, each checked. Raises InputError for the first that is broken."""
    effects = tuple(load_plugin(path) for path in paths)
    names = [e.name for e in effects]
    for path, name in zip(paths, names, strict=True):
        if names.count(name) > 1:
            raise InputError(must("effects", "of different names", f"{name} twice", path))
    return effects


def load_plugin(path: str | Path) -> Effect:
    """The effect in a file, named after it."""
    path = Path(path)
    _check_name(path.stem, path)
    module = _execute(path)
    for form in ("params(setup)", "forward(xyz, p, at)"):
        name = form.partition("(")[0]
        if not callable(getattr(module, name, None)):
            raise InputError(must("a plugin", f"a file that defines {form}", f"no {name}", path))
    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")  # the trial looks at the numbers themselves
        trial = plugin_trial.begin(path, _as_written(path.stem, module))
        plugin_trial.check(trial)
        return plugin_trial.complete(trial)


def _check_name(name: str, where: object) -> None:
    if not (name.isidentifier() and name == name.lower()):
        raise InputError(must("the name of an effect", "small letters, digits and _", repr(name), where))
    if name in ALIASES or name in {e.name for e in STACK}:
        raise InputError(must("the name of an effect", "none of the catalogue's", repr(name), where))


def _execute(path: Path) -> ModuleType:
    """The file run as a module of its own, which no import sees and which leaves no cache behind."""
    module = ModuleType(path.stem)
    module.__file__ = str(path)
    text = read_text(path, "a plugin")
    _say(path, text)
    code = compiled(text, path)
    try:
        exec(code, module.__dict__)
    except (Exception, SystemExit) as error:
        where = plugin_trial.line_of(path, error)
        raise InputError(must("a plugin", "a file that runs", plugin_trial.said(error), where)) from error
    return module


def compiled(text: str, path: Path) -> CodeType:
    """The text as code, not run yet. Raises InputError where it is no Python."""
    try:
        return compile(text, str(path), "exec")
    except SyntaxError as error:
        where = f"{path}, line {error.lineno}"
        raise InputError(must("a plugin", "valid Python", error.msg, where)) from error
    except (ValueError, RecursionError, MemoryError, OverflowError) as error:  # NUL bytes, brackets without end
        raise InputError(must("a plugin", "valid Python", plugin_trial.said(error), path)) from error


def _say(path: Path, text: str) -> None:
    """Tell the session before code runs that it has not run yet."""
    this = (path.resolve(), hashlib.sha256(text.encode()).hexdigest())
    if this not in _ran:
        _ran.add(this)
        for say in SAID:
            say(path)


def _requires(module: ModuleType) -> tuple[str, ...]:
    found = getattr(module, "REQUIRES", ())
    if not isinstance(found, tuple | list) or not all(isinstance(name, str) for name in found):
        raise InputError(must("REQUIRES", "a list of columns", repr(found), module.__file__))
    return tuple(found)


def _as_written(name: str, module: ModuleType) -> Effect:
    """The effect with what the file says, nothing derived yet."""
    stage = getattr(module, "STAGE", "field")
    if stage not in ("field", "reading"):
        raise InputError(must("STAGE", "'field' or 'reading'", repr(stage), module.__file__))
    return Effect(
        name,
        str(getattr(module, "EQUATION", "")),
        str(getattr(module, "SOURCE", "a plugin")),
        module.params,
        module.forward,
        getattr(module, "undo", None),
        requires=_requires(module),
        flips=bool(getattr(module, "FLIPS", False)),
        summary=str(getattr(module, "SUMMARY", "")),
        memory=bool(getattr(module, "MEMORY", False)),
        stage=stage,
        settings=None,
    )
