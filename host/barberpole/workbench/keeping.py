"""What is kept of a bench: model, calibration with its history, report, firmware. All within the chosen folder."""

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from barberpole.calibrating import calibration_of
from barberpole.calibration import Calibration, write_calibration
from barberpole.calibration_tables import Step
from barberpole.modelfile import model_text, write_model
from barberpole.workbench.bench import Bench
from barberpole.workbench.history import Step as Attempt
from barberpole.workbench.lab import Lab


def save_model(lab: Lab, bench: Bench, path: Path) -> str:
    """Write model.toml; a file that is there keeps its comments. Its text."""
    write_model(bench.file, path)
    return model_text(bench.file, path)


def save_calibration(lab: Lab, bench: Bench, path: Path, attempts: Sequence[Attempt]) -> str:
    """Write calibration.toml with the path that led to it. Its hash."""
    made = calibration(lab, bench, attempts)
    write_calibration(made, path)
    return made.hash


def calibration(lab: Lab, bench: Bench, attempts: Sequence[Attempt] = ()) -> Calibration:
    """The fit on the bench as a calibration."""
    return calibration_of(lab.fit(bench), lab.kept_log(bench), bench.file, history=steps_of(attempts))


def steps_of(attempts: Sequence[Attempt]) -> list[Step]:
    """The attempts that changed the model, as a calibration tells them."""
    steps = []
    for attempt in attempts:
        sign, _, effect = attempt.label.partition(" ")
        if attempt.rms_lsb is None or (steps and sign not in "+−"):
            continue
        changed = {"+": {"added": effect}, "−": {"removed": effect}}.get(sign, {}) if steps else {}
        steps.append(Step(rms_lsb=attempt.rms_lsb, heldout_rms_lsb=attempt.heldout_lsb, **changed))
    return steps


def save_report(lab: Lab, bench: Bench, path: Path) -> str:
    """Write the report of the log on the bench under its model."""
    from barberpole.report.report import versions, write_report  # here: slow to load
    from barberpole.report.study import Given, answers, study

    rest = None if bench.rest is None else lab.log(bench.rest)
    done = study(lab.kept_log(bench), Given(bench.file, rest=rest, extra=lab.extra(bench)))
    words = ["barberpole", "report", str(bench.log), "--model", ",".join(bench.file.effects), "-o", path.name]
    write_report(path, [done], answers([done], shlex.join(words), versions()))
    return done.verdict


def build_firmware(lab: Lab, bench: Bench, board: str, folder: Path, attempts: Sequence[Attempt]) -> dict[str, Any]:
    """Build the flash-resident modules for a board. Its budget."""
    from barberpole_codegen.build import build

    made = build(board, calibration(lab, bench, attempts), folder)
    return made.budget
