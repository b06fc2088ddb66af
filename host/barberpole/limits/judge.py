"""What becomes of bad data: right within the stated error, or refused with the reason; or, a fault, wrong.

The truth is the same tool's answer to the same motion without noise and without the fault, in full directions; the
numbers of that answer are held against the sensor's own by a test. A figure without a stated error must agree to 2 %.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from barberpole.diagnose.diagnosis import diagnose
from barberpole.errors import InputError
from barberpole.fit.fit import fit_log
from barberpole.limits import sensor
from barberpole.limits.sensor import everywhere
from barberpole.limits.spoil import CASES, Case, log_of, swapped
from barberpole.log import Log, read_log
from barberpole.log_formats import write_csv
from barberpole.methods.answer import Given
from barberpole.methods.registry import METHODS
from barberpole.modelfile import ModelFile

SIGMAS = 4.5  # of the stated error; of 15 normal figures in 100 cells one in 100 tables lies beyond
STATED = 5e-4  # of a figure's size: errors below are the methods' own small bias, and no calibration feels them
UNSTATED = 0.02  # of a figure's size, where no error is stated
FIRST_ORDER = ("L.", "b.", "o11_1", "o22_1", "o33_1", "offset.", "WS.", "sensitivity.")
HONEST = {"0.5 % spikes": {"outliers"}, "a magnet passing by": {"outliers"}}  # what a diagnosis may name: it is so

Figures = dict[str, tuple[float, float]]  # name -> value, standard error


@dataclass(frozen=True)
class Outcome:
    """said: right, refused, not seen or wrong; why: the sentence of the refusal, or what was wrong."""

    said: str
    why: str = ""


@dataclass(frozen=True)
class Way:
    """One way to use a log: what is known of the field beside the readings, and what is computed from it."""

    name: str
    ground: Callable[[np.ndarray], sensor.Ground]
    figures: Callable[[Log, float], Figures]


def ways() -> list[Way]:
    """Every method, and the fit under each reference."""
    found = [Way(f"fit, {r}", _turned(r), _fitted) for r in ("vector", "magnitude", "constant")]
    return found + [Way(f"--method {m.name}", _ground_of(m.name), _by_method(m.name)) for m in METHODS]


def table() -> dict[str, dict[str, Outcome]]:
    """Case -> way -> outcome, the diagnosis last."""
    out = {}
    for case in CASES:
        out[case.name] = {way.name: judge(case, way) for way in ways()}
        out[case.name] |= {f"diagnose, {r}": diagnosed(case, r) for r in ("vector", "constant")}
    return out


def judge(case: Case, way: Way) -> Outcome:
    """One cell of the table."""
    columns = log_of(case, way.ground(case.motion()), sensor.NOISE_LSB)
    if (case.name, way.name) in UNSEEN:
        return Outcome("does not apply", "at null field it does not show")
    try:
        got = way.figures(_read(columns), sensor.FIELD_UT * case.units)
    except InputError as error:
        return Outcome("refused", str(error))
    wrong = beyond(got, truth(case, way))
    return Outcome("wrong", wrong) if wrong else Outcome("right")


UNSEEN = {(name, "--method turn_over") for name in ("one axis dead", "gauss called µT", "two fields spliced")}


def truth(case: Case, way: Way) -> Figures:
    """The answer to the good log without noise; axes that are swapped stay so where nothing tells them apart."""
    return _truth(way.name, case.name == "swapped axes")


@cache
def _truth(name: str, are_swapped: bool) -> Figures:
    way = next(way for way in ways() if way.name == name)
    columns = way.ground(everywhere()).log(noise=0.0)
    return way.figures(_read(swapped(columns) if are_swapped else columns), sensor.FIELD_UT)


def beyond(got: Figures, true: Figures) -> str:
    """The figure that is furthest beyond its stated error; '' where none is."""
    worst, said = 1.0, ""
    for name, (value, stderr) in got.items():
        if name not in true or (np.isnan(stderr) and not name.startswith(FIRST_ORDER)):
            continue
        size = max(abs(true[other][0]) for other in true if other.split(".")[0] == name.split(".")[0])
        allowed = UNSTATED * size if np.isnan(stderr) else SIGMAS * stderr + STATED * size
        off = abs(value - true[name][0])
        if not off <= worst * allowed:
            worst, said = off / max(allowed, 1e-300), f"{name} {value:.5g} ± {stderr:.2g}, true {true[name][0]:.5g}"
    return said


def diagnosed(case: Case, reference: str) -> Outcome:
    """Nothing is missing from the model: whatever else is named is wrong, but for what the case really holds."""
    columns = log_of(case, _turned(reference)(case.motion()), sensor.NOISE_LSB)
    try:
        found = diagnose(_read(columns), MODEL)
    except InputError as error:
        return Outcome("refused", str(error))
    if found.verdict == "inconclusive":
        return Outcome("refused", found.next_experiment)
    named = {s.effect for s in found.suspects} if found.verdict == "missing" else set()
    if named - HONEST.get(case.name, set()):
        return Outcome("wrong", f"named {', '.join(sorted(named))}")
    return Outcome("right", found.verdict)


MODEL = ModelFile(("bias", "scale", "misalignment"), reference={"magnitude_ut": sensor.FIELD_UT})


def _fitted(log: Log, magnitude_ut: float) -> Figures:
    fit = fit_log(log, ModelFile(MODEL.effects, reference={"magnitude_ut": magnitude_ut}))
    rows = zip(fit.model.names, fit.p, fit.stderr, fit.free, strict=True)
    return {name: (float(v), float(s)) for name, v, s, free in rows if free}


def _by_method(name: str) -> Callable[[Log, float], Figures]:
    method = next(m for m in METHODS if m.name == name)

    def run(log: Log, magnitude_ut: float) -> Figures:
        values = method.run(log, Given({"magnitude_ut": magnitude_ut})).values
        return {n: (v.value, v.stderr) for n, v in values.items()}

    return run


def _turned(reference: str) -> Callable[[np.ndarray], sensor.Ground]:
    return lambda direction: sensor.turned(direction, reference)


def _ground_of(method: str) -> Callable[[np.ndarray], sensor.Ground]:
    if method in ("linear", "polynomial"):
        return _turned("vector")
    if method == "offset_coil":
        return sensor.driven
    if method == "turn_over":
        return lambda direction: sensor.turned_over(direction.shape[1])
    return sensor.chambers if method == "temperature" else _turned("constant")


def _read(columns: sensor.Columns) -> Log:
    """Through a file, as a user's log comes."""
    with TemporaryDirectory() as folder:
        path = Path(folder) / "log.csv"
        path.write_bytes(write_csv(columns))
        return read_log(path)
