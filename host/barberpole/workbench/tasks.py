"""What a worker can be asked: one function for each, (lab, arguments) -> a small answer."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from barberpole.challenge import game
from barberpole.workbench.bench import Bench
from barberpole.workbench.keeping import build_firmware, save_calibration, save_model, save_report
from barberpole.workbench.lab import Lab, Opened, Summary
from barberpole.workbench.own import try_effect
from barberpole.workbench.pictures import CHOOSABLE, Box, Chosen, Picture, View, choose
from barberpole.workbench.rivals import rivals
from barberpole.workbench.suspects import Suspicion, suspicion
from barberpole.workbench.traces import inside


def open_log(lab: Lab, bench: Bench) -> Opened:
    """Read a log."""
    return lab.open(bench)


def summary(lab: Lab, bench: Bench) -> Summary:
    """Fit the model."""
    return lab.summary(bench)


def picture(lab: Lab, bench: Bench, view: View, name: str) -> Picture:
    """A picture of a fit."""
    return replace(lab.picture(bench, view, name), samples={})


def select(lab: Lab, bench: Bench, box: Box, view: View) -> Chosen:
    """Samples within a box drawn in a picture."""
    return choose(lab.traces(bench), box, {name: lab.picture(bench, view, name) for name in CHOOSABLE})


def exclude(lab: Lab, bench: Bench, box: Box) -> Bench:
    """The bench without the rows within a box."""
    traces = lab.traces(bench)
    rows = traces.row[inside(traces, box.against, box.x, box.y_lsb, box.channel)]
    kept = bench.kept(lab.log(bench.log).n)
    return bench.without(rows if isinstance(kept, slice) else np.flatnonzero(kept)[rows])


def suspects(lab: Lab, bench: Bench) -> Suspicion:
    """Judge the model and rank what it lacks."""
    return suspicion(lab, bench)


def with_effect(lab: Lab, bench: Bench, effect: str, settings: dict | None) -> Bench:
    """The bench with one more effect."""
    return lab.with_effect(bench, effect, settings)


def truth(lab: Lab, folder: Path, opened: game.Opened) -> list[float]:
    """Held-out error of a trial's first model, then with each effect that was hidden."""
    return game.fall(folder, opened)


BENCH = (open_log, summary, picture, select, exclude, suspects, with_effect, rivals, try_effect, truth)
KEEP = (save_model, save_calibration, save_report, build_firmware)
TASKS: dict[str, Callable[..., Any]] = {task.__name__: task for task in (*BENCH, *KEEP)}
