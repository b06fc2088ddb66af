"""Readings that no fit can use, refused with the reason: each of these would be answered finite, confident and wrong.

The checks look for one fault each that good data do not show; what only lowers the certainty is left to the standard
errors.
"""

from typing import Any

import numpy as np

from barberpole.errors import CoverageError, InputError, must
from barberpole.fit.affine import Moments
from barberpole.fit.few import few
from barberpole.fit.spikes import no_surface
from barberpole.fit.start import Linear
from barberpole.observations import Observations

LEAST_UT = 1.0  # largest field of any use; the Earth's is 22 to 67 µT and 0.22 to 0.67 gauss
LARGEST_UT = 5000.0  # ten times what saturates an AMR bridge; the Earth's field is 22 000 to 67 000 nT
RAIL = 0.003  # part of the rows at one extreme reading that makes it the end of the range
RAIL_ROWS = 5
PILED = 4  # times the rows at the next reading: at the end of a range they pile up
DEAD = 0.02  # of the other axes' gain
CROSSED = 0.2  # part of an axis' gain that is along its own component, at least
SPANS = 1e-3  # smallest over largest extent of a known field that shows all axes
STEP = 0.1  # of |B|: two levels further apart than this are two fields
TOLD = 0.5  # of the variance of |B| that two levels must explain; missing physics of 30 sigma gives 0.3
SUDDEN = 0.6  # of the step that must be there within a thirtieth of the log: a slow drift has 0.07
FILLED = 0.2  # robust deviation of |H|/K from 1: a ball of noise has 0.4, a bad real log 0.03
GAIN_RATIO = 8.0  # between the axes of one sensor
MAD = 1.4826
EDGE = 0.1  # of the rows on either side, too few to be a level
UNEVEN = 0.6 * STEP * EDGE**0.5  # relative deviation of |B|: the least step at the edge has 1.4 times that


def require_usable(seen: Observations, linear: Linear, magnitude_ut: float, known: Moments | None = None) -> None:
    """Raise InputError with the reason and what to do next. known: the moments against a vector reference."""
    require_in_range(seen.y)
    if seen.b_ut is not None:
        over: np.ndarray | float = np.sqrt(np.einsum("ij,ij->j", seen.b_ut, seen.b_ut))
    else:
        over = magnitude_ut if seen.b_mag is None else seen.b_mag
    require_microtesla(float(np.max(over)))
    some = few(seen.y.shape[1])
    if known is None:
        _require_a_shell(seen, linear, ratio := _over_known(seen, linear, over, some))
    elif known.spans(SPANS):
        _require_own_axes(linear)
        ratio = _over_known(seen, linear, over, some)
    else:
        return
    if np.std(ratio) > UNEVEN * np.mean(ratio):  # then every sample is worth its time
        require_one_field(_over_known(seen, linear, over), _causes(seen), seen.row)


def _over_known(seen: Observations, linear: Linear, known: np.ndarray | float, some: Any = slice(None)) -> np.ndarray:
    """(k,) magnitude of the linear part's field over the known one (n,), of some samples; 1 where that is null."""
    y = seen.y[:, some] - linear.offset[:, None]
    known = known if np.ndim(known) == 0 else np.asarray(known)[some]
    if linear.bridge.any():
        y -= np.broadcast_to(seen.at.state, seen.y.shape[1:])[some] * linear.bridge[:, None]
    field = np.linalg.inv(linear.matrix) @ y  # a solve with as many right sides as samples is ten times slower
    found = np.sqrt(np.einsum("ij,ij->j", field, field))
    usable = known > 0.1 * np.max(known)
    return found / known if np.all(usable) else np.where(usable, found / np.where(usable, known, 1.0), 1.0)


def _causes(seen: Observations) -> list[np.ndarray]:
    """Columns a step of which explains one of the readings."""
    at = seen.at
    single = [v for v in (at.temp_c, at.load_a, at.supply_v) if v is not None]
    return single + ([] if at.i_ma is None else list(at.i_ma))


def require_in_range(y: np.ndarray) -> None:
    """Raise InputError where readings (3, n) pile up at an end of the converter's range."""
    for axis, readings, high, low in zip("xyz", y, y.max(axis=1), y.min(axis=1), strict=True):
        for end, beyond in ((high, np.less), (low, np.greater)):
            at = readings == end
            count = int(np.count_nonzero(at))
            if count < max(RAIL_ROWS, RAIL * readings.size) or count == readings.size:
                continue
            inside = readings[beyond(readings, end)]
            next_to = inside.max() if beyond is np.less else inside.min()
            if count > PILED * np.count_nonzero(readings == next_to) and _moves(y[:, at]):
                got = f"{count} rows of {axis} at {end:.9g} LSB, where the converter or the amplifier ends"
                wanted = "within the converter's range (take those rows out, or lower the gain)"
                raise InputError(must("the readings", wanted, got))


def _moves(rows: np.ndarray) -> bool:
    """Whether the other axes go on while one stands at an end: a sensor that is held still has its readings twice."""
    return np.unique(rows, axis=1).shape[1] > 0.5 * rows.shape[1]


def require_microtesla(largest: float, what: str = "the reference field") -> None:
    """Raise InputError for a largest field that only another unit explains."""
    if not LEAST_UT <= largest <= LARGEST_UT and largest != 0.0:
        unit = "gauss or mT (1 gauss is 100 µT)" if largest < LEAST_UT else "nT (1000 nT are 1 µT)"
        wanted = f"in µT, from {LEAST_UT:g} to {LARGEST_UT:g} at the largest"
        raise InputError(must(what, wanted, f"{largest:.3g}: is it in {unit}?"))


def _require_own_axes(linear: Linear) -> None:
    """Raise InputError where a reading follows no component of the known field, or another one than its own."""
    gain = np.linalg.norm(linear.matrix, axis=1)
    usual = sorted(gain)[1]
    for i, axis in enumerate("xyz"):
        if gain[i] < DEAD * usual:
            got = f"{axis}_lsb with {gain[i]:.2g} LSB/µT, the others with {usual:.2g}"
            wanted = "such as follow the field (a dead bridge, a broken wire?)"
            raise InputError(must("the readings", wanted, got))
        if abs(linear.matrix[i, i]) < CROSSED * gain[i]:
            other = "xyz"[int(np.argmax(np.abs(linear.matrix[i])))]
            wanted = "named after the axes of the field (swap the columns, or turn the field into the sensor's frame)"
            raise InputError(must("the readings", wanted, f"{axis}_lsb that follows b{other}_ut and not b{axis}_ut"))


def _require_a_shell(seen: Observations, linear: Linear, ratio: np.ndarray) -> None:
    """Raise InputError where readings fill a ball of noise, or lie in a flat cloud that was drawn out into a sphere.

    ratio (k,) of the magnitude found to the known one.
    """
    gain = np.linalg.norm(linear.matrix, axis=1)
    if MAD * float(np.median(np.abs(ratio - 1.0))) > FILLED or gain.max() > GAIN_RATIO * gain.min():
        raise CoverageError(no_surface(seen.y))


def require_one_field(ratio: np.ndarray, causes: list[np.ndarray], row: np.ndarray) -> None:
    """Raise InputError where |B| over the known one (n,) steps between two levels and no cause (n,) does."""
    at, gained, levels = best_step(ratio)
    if gained < TOLD or abs(levels[1] / levels[0] - 1.0) < STEP:
        return
    near = max(ratio.size // 30, 1)
    sudden = np.mean(ratio[at : at + near]) - np.mean(ratio[max(at - near, 0) : at])
    if abs(sudden) < SUDDEN * abs(levels[1] - levels[0]) or any(_steps_too(values, at) for values in causes):
        return
    got = f"{100 * abs(levels[1] / levels[0] - 1.0):.0f} % {'more' if levels[1] > levels[0] else 'less'}"
    wanted = "in one field from first to last, or in the one that the log says (cut it there, and fit the parts)"
    raise InputError(must("the readings", wanted, f"{got} from row {row[at] + 1} on"))


def _steps_too(values: np.ndarray, at: int) -> bool:
    """Whether a column (n,) has two levels before and after row `at`."""
    before, after = values[:at], values[at:]
    scatter = max(float(np.std(before)), float(np.std(after)))
    return abs(float(np.mean(after) - np.mean(before))) > 2.0 * scatter + 1e-12


def best_step(values: np.ndarray) -> tuple[int, float, tuple[float, float]]:
    """Where values (n,) step from one level to another, the part of their variance that it explains, the levels."""
    n = values.size
    first = np.arange(1, n)
    left = np.cumsum(values)[:-1] / first
    right = (values.sum() - np.cumsum(values)[:-1]) / (n - first)
    between = first * (n - first) / n * (right - left) ** 2
    between[(first < EDGE * n) | (first > (1.0 - EDGE) * n)] = 0.0
    at = int(np.argmax(between)) if n > 1 else 0
    total = float(np.sum((values - values.mean()) ** 2))
    if n < 2 or total == 0.0:
        return 0, 0.0, (1.0, 1.0)
    return at + 1, float(between[at]) / total, (float(left[at]), float(right[at]))
