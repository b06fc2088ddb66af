"""The work behind the page: everything that computes, as functions of what is on the bench, with what was found kept.

A `Lab` lives in a process of its own (`worker`). Its answers are small: figures are decimated here, fits are not sent.
"""

from collections import OrderedDict
from collections.abc import Callable, Hashable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from barberpole.adding import best_form, noise_from_differences
from barberpole.board import load_sensor
from barberpole.effects import Effect, find_effect, in_order
from barberpole.fit.fit import Fit, fit_observations, missing_columns
from barberpole.log import Log, read_log
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations, observations
from barberpole.plugins import load_plugins
from barberpole.workbench.bench import Bench
from barberpole.workbench.pictures import Picture, View, draw
from barberpole.workbench.traces import Traces, traces_of

KEPT = 24  # fits
KEPT_LARGE = 3  # of what has an entry a row

Tick = Callable[[int], None]


class Kept(OrderedDict):
    """The last few results by key."""

    def __init__(self, most: int):
        super().__init__()
        self.most = most

    def get_or(self, key: Hashable, make: Callable[[], Any]) -> Any:
        """What is kept under a key, or what `make` gives."""
        if key not in self:
            self[key] = make()
        self.move_to_end(key)
        while len(self) > self.most:
            self.popitem(last=False)
        return self[key]


@dataclass(frozen=True)
class Opened:
    """A log as it was read: what the page says of it."""

    name: str
    rows: int
    samples: int
    reference: str
    notes: tuple[str, ...]
    columns: tuple[str, ...]
    effects: dict[str, str]  # every effect in physical order: "" or why this log cannot judge it


@dataclass(frozen=True)
class Summary:
    """A fit in figures. parameters: (name, value, standard error, unit); abscissae: what the residual may be drawn
    against, name -> title with unit."""

    n: int
    rms_lsb: float
    heldout_lsb: float
    noise_lsb: float
    rms_ut: float
    converged: bool
    parameters: tuple[tuple[str, float, float, str], ...]
    unobservable: tuple[str, ...]
    abscissae: dict[str, str]


class Lab:
    """Reads, fits and keeps. Raises BarberpoleError with one sentence wherever the command line would."""

    def __init__(self) -> None:
        self._logs, self._seen = Kept(KEPT_LARGE), Kept(KEPT_LARGE)
        self._fits, self._traces, self._own = Kept(KEPT), Kept(KEPT_LARGE), Kept(KEPT)
        self.tick: Tick | None = None
        self._pictures = Kept(KEPT)

    def log(self, path: Path) -> Log:
        """A log, read again where the file has changed."""
        known = path.stat() if path.exists() else None
        key = (path, known and (known.st_mtime_ns, known.st_size))
        return self._logs.get_or(key, lambda: read_log(path))

    def kept_log(self, bench: Bench) -> Log:
        """The log without the rows left out."""
        log = self.log(bench.log)
        return log.take(bench.kept(log.n)) if bench.excluded else log

    def seen(self, bench: Bench) -> Observations:
        """What a fit sees of it."""

        def make() -> Observations:
            log = self.kept_log(bench)
            name = bench.file.sensor or log.meta.get("sensor")
            return observations(log, load_sensor(name) if name else None)

        return self._seen.get_or(bench.rows_key, make)

    def extra(self, bench: Bench) -> tuple[Effect, ...]:
        """The user's own effects, loaded again where a file has changed."""
        return self._own.get_or(bench.plugins_key, lambda: load_plugins(bench.file.plugins))

    def open(self, bench: Bench) -> Opened:
        """Read the log and say what it is."""
        seen, log = self.seen(bench), self.log(bench.log)
        why = {
            effect.name: f"no {lacking[0]} column" if (lacking := missing_columns(seen, effect)) else ""
            for effect in in_order(self.extra(bench))
        }
        notes = (*log.notes, *seen.notes)
        return Opened(log.path.name, log.n, seen.y.shape[1], seen.reference, notes, tuple(log.columns), why)

    def fit(self, bench: Bench) -> Fit:
        """The model fitted to all rows that are in."""
        return self._fits.get_or(
            bench.key, lambda: fit_observations(self.seen(bench), bench.file, self.extra(bench), self.tick)
        )

    def traces(self, bench: Bench) -> Traces:
        """The fit as channels to draw."""
        return self._traces.get_or(bench.key, lambda: traces_of(self.fit(bench), self.kept_log(bench)))

    def summary(self, bench: Bench) -> Summary:
        """The fit in figures."""
        fit = self.fit(bench)
        rows = zip(fit.model.names, fit.p, fit.stderr, fit.model.params, fit.free, strict=True)
        parameters = tuple((name, float(v), float(s), q.unit) for name, v, s, q, free in rows if free)
        traces = self.traces(bench)
        return Summary(
            fit.problem.n,
            fit.rms_lsb,
            fit.heldout_rms_lsb,
            noise_from_differences(traces.residual),
            _field_error(fit, traces),
            fit.converged,
            parameters,
            fit.unobservable,
            {one.name: one.title for one in traces.abscissae.values()},
        )

    def picture(self, bench: Bench, view: View, name: str) -> Picture:
        """A picture of a fit, with the samples that its points stand for."""
        view = view.of(name)
        return self._pictures.get_or((bench.key, name, view), lambda: draw(self.traces(bench), view, name))

    def with_effect(self, bench: Bench, effect: str, settings: dict | None = None) -> Bench:
        """The bench with one more effect, in the form (settings) given or the one that gains most in this log."""
        extra = self.extra(bench)
        name = find_effect(effect, extra).name
        file = replace(bench.file, effects=in_stack_order((*bench.file.effects, name), extra))
        if settings is None:
            settings = self._best_settings(bench, name, extra)
        if settings:
            file = replace(file, settings=file.settings | {name: settings})
        return bench.with_file(file)

    def _best_settings(self, bench: Bench, name: str, extra: tuple[Effect, ...]) -> dict:
        if not _has_forms(find_effect(name, extra)):
            return {}
        found, _ = best_form(self.fit(bench), name, bench.file.settings, extra)
        return {} if found is None else dict(found.setups[name].settings)


def in_stack_order(names: tuple[str, ...], extra: tuple[Effect, ...] = ()) -> tuple[str, ...]:
    """Names in physical order."""
    order = [effect.name for effect in in_order(extra)]
    return tuple(sorted(dict.fromkeys(names), key=order.index))


def without_effect(file: ModelFile, name: str) -> ModelFile:
    """The model without an effect and its settings."""
    settings = {k: v for k, v in file.settings.items() if k != name}
    return replace(file, effects=tuple(e for e in file.effects if e != name), settings=settings)


def _has_forms(effect: Effect) -> bool:
    """Whether an effect may take several forms, among which the log decides."""
    return effect.shapes is not None or effect.search is not None


def _field_error(fit: Fit, traces: Traces) -> float:
    """RMS error in µT: the residual over the gain where the field is known, else of the magnitude."""
    if fit.problem.vector:
        return float(np.sqrt(np.mean(traces.residual**2))) / (fit.linear.lsb_per_ut or 1.0)
    norm = np.linalg.norm(traces.field_ut, axis=0)
    return float(np.sqrt(np.mean((norm - fit.problem.magnitude(slice(None))) ** 2)))
