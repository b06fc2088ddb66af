"""The demo as one HTML file to open: the verdict, where the model failed, and the error falling."""

from pathlib import Path

from barberpole import __version__
from barberpole.demo.story import Believed, Outcome
from barberpole.figures import Stage, error_over_time
from barberpole.numbers import strict
from barberpole.report.cited import Answer
from barberpole.report.page import Section, write_page
from barberpole.report.parts import checks, fails, falls, missing


def write_demo_page(outcome: Outcome, path: Path) -> None:
    """Write the page of one demo; it carries the object of `demo --json` and what it rests on."""
    stages = _stages(outcome)
    numbers = strict(
        {
            "demo": outcome.to_json(),
            "comparison": outcome.comparison.to_json(),
            "diagnosis": outcome.diagnosis.to_json(),
            "path": [vars(stage) for stage in stages],
        }
    )
    answer = Answer(numbers)
    sections = [
        fails(outcome.comparison, answer.at("comparison")),
        missing(outcome.diagnosis, answer.at("diagnosis")),
        falls(stages, outcome.noise_lsb, answer.at("path")),
        _board(outcome),
        _power_up(outcome),
    ]
    provenance = (
        f"barberpole {__version__}. Log {outcome.before.session.log.sha256[:12]}, "
        f"calibrations {outcome.before.calibration.hash} and {outcome.after.calibration.hash}.\n"
        f"repeat it: barberpole demo --hidden {outcome.hidden}"
    )
    mark = "good" if outcome.after.verification.passed else "bad"
    write_page(path, "barberpole demo", _verdict(outcome), mark, sections, provenance, numbers)


def _verdict(outcome: Outcome) -> str:
    if outcome.named is None:
        return (
            f"Nothing is missing: the model leaves {outcome.comparison.rms_lsb:.1f} LSB, "
            f"the noise is {outcome.noise_lsb:.1f} LSB."
        )
    answer = outcome.to_json()
    return (
        f"{outcome.named} was missing. With it, the error on stretches never fitted falls from "
        f"{answer['heldout_before_lsb']:.1f} to {answer['heldout_after_lsb']:.1f} LSB (noise {outcome.noise_lsb:.1f}), "
        f"and on the board from {outcome.before.rms_nt:.2f} to {outcome.after.rms_nt:.2f} nT."
    )


def _stages(outcome: Outcome) -> list[Stage]:
    """Before and after the addition; the noise is the one that the emulated board was given."""
    answer = outcome.to_json()
    before = Stage("model", answer["heldout_before_lsb"], answer["rms_before_lsb"])
    after = Stage(f"+ {outcome.named}", answer["heldout_after_lsb"], answer["rms_after_lsb"])
    return [before, after] if outcome.addition else [before]


def _board(outcome: Outcome) -> Section:
    steps = [("before", outcome.before)] + ([("after", outcome.after)] if outcome.addition else [])
    sentence = "The board compensates each sample with the generated code and the gains it found at power-up."
    return Section("What does the board itself compute?", sentence, [_error(name, one) for name, one in steps])


def _error(name: str, believed: Believed):
    return error_over_time(believed.session.log["t_s"], believed.error_nt, "nT", f"board's error {name}")


def _power_up(outcome: Outcome) -> Section:
    made = checks(outcome.after.verification, "Does the host believe the board's self-calibration?")
    gains = ", ".join(f"{ppm:+.0f}" for ppm in outcome.after.gain_error_ppm)
    sentence = f"{made.sentence} Gains against the truth after the last power-up: {gains} ppm (x, y, z)."
    return Section(made.title, sentence, (), made.tables, mark=made.mark)
