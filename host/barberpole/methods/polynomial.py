"""The polynomial vector calibration of the article (2.2.2).

    B_cal = R (sum_{i=1..m} O_i B_p^i + sum_{i=1..n} C_i B_p^i),   B_p = B_mea - B_off          (5)-(7)

B_p^i is the i-th power of each component, O_i is diagonal (on-axis), C_i has a zero diagonal (cross-field). R comes
from the linear model: with free C_i it could not be told from them. B_off is the reading at null field where the log
has such rows (2.4), else that of the linear model. For given R each row of (5) is linear least squares.
Degrees: m on-axis, n cross-field, 0 < n <= m; by held-out error where they are not given.
"""

from dataclasses import dataclass

import numpy as np

from barberpole.errors import InputError, must
from barberpole.log import Log
from barberpole.methods.answer import Answer, Given, Values, per_axis, value
from barberpole.methods.linear import decompose, linear_model, require_followed
from barberpole.methods.quality import FOLDS, RUNS, against_field, rms
from barberpole.methods.readings import vector

WHAT = "the polynomial method"
MOST = 5  # highest degree that is tried
SIMPLER = 1.01  # held-out error, relative to the smallest, that lower degrees may have
NULL_UT = 1e-3  # magnitude of an applied field that counts as null


@dataclass(frozen=True)
class Polynomial:
    """Eq. 5. on (m, 3): o_kk,i of axis k; cross (n, 3, 3): c_jk,i, in µT/LSB^i; R (3, 3); B_off (3,) in LSB."""

    rotation: np.ndarray
    offset_lsb: np.ndarray
    on: np.ndarray
    cross: np.ndarray

    @property
    def degrees(self) -> tuple[int, int]:
        """m and n."""
        return len(self.on), len(self.cross)

    def field(self, reading: np.ndarray) -> np.ndarray:
        """(3, n) µT of readings (3, n) in LSB, in the frame of the coils."""
        p = reading - self.offset_lsb[:, None]
        inner = sum(o[:, None] * p**i for i, o in enumerate(self.on, 1))
        inner = inner + sum(c @ p**i for i, c in enumerate(self.cross, 1))
        return self.rotation @ inner


def polynomial_model(reading: np.ndarray, field_ut: np.ndarray, degrees: tuple[int, int]) -> Polynomial:
    """Eq. 5 of degrees (m, n) for readings and applied fields (3, n rows). Raises InputError if n is not in 1..m."""
    m, n = degrees
    if not 1 <= n <= m:
        raise InputError(must("the cross-field degree n", "from 1 to the on-axis degree m", f"m = {m}, n = {n}"))
    line = linear_model(reading, field_ut)
    rotation = decompose(line.matrix).rotation
    null = np.linalg.norm(field_ut, axis=0) < NULL_UT
    offset = reading[:, null].mean(axis=1) if null.any() else line.offset_lsb
    p, target = reading - offset[:, None], rotation.T @ field_ut
    on, cross = np.zeros((m, 3)), np.zeros((n, 3, 3))
    for row in range(3):
        _row(p, target[row], row, on, cross)
    return Polynomial(rotation, offset, on, cross)


def _row(p: np.ndarray, target: np.ndarray, row: int, on: np.ndarray, cross: np.ndarray) -> None:
    """One row of (5), by least squares with the columns brought to unit size."""
    others = [k for k in range(3) if k != row]
    columns = [p[row] ** i for i in range(1, len(on) + 1)]
    columns += [p[k] ** i for i in range(1, len(cross) + 1) for k in others]
    stacked = np.stack(columns)
    size = np.sqrt(np.mean(stacked**2, axis=1, keepdims=True))
    solved = np.linalg.lstsq((stacked / size).T, target, rcond=None)[0] / size[:, 0]
    on[:, row] = solved[: len(on)]
    cross[:, row, others] = solved[len(on) :].reshape(-1, 2)


def heldout_ut(reading: np.ndarray, field_ut: np.ndarray, degrees: tuple[int, int]) -> float:
    """RMS error in µT over stretches that the model was fitted without: every fifth held field, or piece of the log."""
    return rms(_heldout(reading, field_ut, degrees))


def _heldout(reading: np.ndarray, field_ut: np.ndarray, degrees: tuple[int, int]) -> np.ndarray:
    """(3, n) µT: the error of each row by a model fitted without its stretch."""
    fold, left = _folds(field_ut), np.empty(field_ut.shape)
    for k in range(FOLDS):
        kept = fold != k
        found = polynomial_model(reading[:, kept], field_ut[:, kept], degrees)
        left[:, ~kept] = found.field(reading[:, ~kept]) - field_ut[:, ~kept]
    return left


def _folds(field_ut: np.ndarray) -> np.ndarray:
    """Fold (n,) of each row. Rows of one applied field that follow one another stay together."""
    n = field_ut.shape[1]
    run = np.concatenate([[0], np.cumsum(np.any(np.diff(field_ut, axis=1) != 0, axis=0))])
    if run[-1] + 1 > n // 2:
        run = np.arange(n) * RUNS // n
    return run % FOLDS


def choose(reading: np.ndarray, field_ut: np.ndarray, most: int = MOST) -> tuple[tuple[int, int], dict]:
    """Degrees (m, n) of the simplest model whose held-out error is near the smallest; and the error of each pair."""
    errors = {(m, n): heldout_ut(reading, field_ut, (m, n)) for m in range(1, most + 1) for n in range(1, m + 1)}
    smallest = min(errors.values())
    good = [pair for pair, error in errors.items() if error <= SIMPLER * smallest]
    return min(good, key=lambda pair: (pair[0] + 2 * pair[1], pair)), errors


def polynomial(log: Log, given: Given) -> Answer:
    """The method on a log with an applied field. Raises InputError where the field is not known or does not span."""
    seen, field_ut = vector(log, WHAT, 3 * MOST + 1)
    line = linear_model(seen.y, field_ut)
    require_followed(line, seen.y, field_ut, "the applied field", log.path)
    degrees, errors = choose(seen.y, field_ut)
    found = polynomial_model(seen.y, field_ut, degrees)
    before, after = rms(line.field(seen.y) - field_ut), found.field(seen.y) - field_ut
    note = f"m = {degrees[0]}, n = {degrees[1]} by held-out error"
    values = _values(found) | {
        "rms.linear": value(1000.0 * before, np.nan, "nT"),
        "rms.polynomial": value(1000.0 * rms(after), np.nan, "nT"),
        "rms.heldout_linear": value(1000.0 * errors[1, 1], np.nan, "nT"),
        "rms.heldout_polynomial": value(1000.0 * errors[degrees], np.nan, "nT"),
    }
    quality = against_field(after, _heldout(seen.y, field_ut, degrees), line.matrix)
    return Answer(values, notes=(note,), quality=quality)


def _values(found: Polynomial) -> Values:
    out = per_axis("offset", found.offset_lsb, np.nan, "LSB")
    for i, o in enumerate(found.on, 1):
        out |= {f"o{k + 1}{k + 1}_{i}": value(o[k], np.nan, _unit(i)) for k in range(3)}
    for i, c in enumerate(found.cross, 1):
        places = [(j, k) for j in range(3) for k in range(3) if j != k]
        out |= {f"c{j + 1}{k + 1}_{i}": value(c[j, k], np.nan, _unit(i)) for j, k in places}
    rotation = {f"R.{j + 1}{k + 1}": value(found.rotation[j, k], np.nan, "1") for j in range(3) for k in range(3)}
    return out | rotation


def _unit(degree: int) -> str:
    return "uT/LSB" if degree == 1 else f"uT/LSB^{degree}"
