"""`compare -o`: a comparison as one page, with the sections of the report."""

from pathlib import Path
from typing import Any

from barberpole import __version__
from barberpole.diagnose import Comparison
from barberpole.fit.fit import Fit
from barberpole.numbers import strict
from barberpole.report.cited import Answer
from barberpole.report.page import write_page
from barberpole.report.parts import fails, follows, grounds

FLOOR = 1.1  # times the noise: a residual below it is at the floor


def write_comparison(found: Comparison, fit: Fit, path: Path, log_name: str, model: str) -> None:
    """Write the page of one comparison; its numbers are those of `compare --json`."""
    numbers: dict[str, Any] = strict(found.to_json())
    answer, ground = Answer(numbers), grounds(fit)
    sections = [follows(fit, ground), fails(found, answer, fit, ground)]
    provenance = f"barberpole {__version__}\nrepeat it: barberpole compare {log_name} --model {model}"
    said = answer.say("The model leaves {rms_lsb} LSB rms; the noise is {noise_lsb} LSB.")
    mark = "good" if found.rms_lsb < FLOOR * found.noise_lsb else "bad"
    title = f"{log_name} against {', '.join(fit.model.effects)}"
    write_page(path, title, said, mark, sections, provenance, numbers)
