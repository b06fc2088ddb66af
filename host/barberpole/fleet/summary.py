"""What a fleet's table says at a glance: what its boards share, which stand out and why, which have changed.

A board stands out in a parameter where |v - mean| / sqrt(tau^2 + s^2) is more than chance makes once in a hundred
fleets of this size; a board has changed where its calibrations differ by more than their standard errors explain,
sum (v_i - mean)^2 / s_i^2 ~ chi^2 of their number less one, at the same chance.
"""

from collections import Counter
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
from scipy import stats

from barberpole.fit.fit import MAD
from barberpole.fleet.lots import LotEffect, lot_effects
from barberpole.fleet.spread import LEAST, Row, Spread, spreads
from barberpole.fleet.table import Fleet
from barberpole.numbers import plain

CHANCE = 0.01  # of one false alarm in a whole fleet


@dataclass(frozen=True)
class Outlier:
    """A board that stands out in a parameter, or in the residual (what = "rms_lsb"); z in standard deviations."""

    board: str
    log: str
    what: str
    value: float
    usual: float
    z: float
    why: str


@dataclass(frozen=True)
class Change:
    """A board whose parameter has changed from its first to its last calibration, by `z` standard errors."""

    board: str
    parameter: str
    unit: str
    logs: tuple[str, ...]
    dates: tuple[str | None, ...]
    values: tuple[float, ...]
    errors: tuple[float, ...]
    p_value: float
    why: str


@dataclass(frozen=True)
class Summary:
    """lots: effects by lot; notes: why something could not be said."""

    logs: int
    boards: int
    failed: list[dict[str, str]]
    parameters: list[Spread]
    outliers: list[Outlier]
    changes: list[Change]
    verdicts: dict[str, int]
    lots: dict[str, list[LotEffect]]
    notes: tuple[str, ...]

    def to_json(self) -> dict[str, Any]:
        """The object of `fleet report --json`."""
        said = {key: value for key, value in vars(self).items() if key not in ("parameters", "lots")}
        said["parameters"] = [asdict(one) | {"kind": one.kind} for one in self.parameters]
        said["outliers"] = [asdict(one) for one in self.outliers]
        said["changes"] = [asdict(one) for one in self.changes]
        said["lots"] = {lot: [asdict(e) | {"kind": e.kind} for e in found] for lot, found in self.lots.items()}
        return said


def summarise(fleet: Fleet) -> Summary:
    """All that the rows of a fleet say together."""
    rows, notes = fleet.latest(), []
    known = spreads(rows) if len(rows) >= LEAST else []
    if not known:
        notes.append(f"{len(rows)} fitted boards: at least {LEAST} are needed to compare them")
    lots = _lots(fleet) if fleet.do == "diagnose" else {}
    if fleet.do == "fit":
        notes.append("effects that a lot shares are looked for in the table of `fleet diagnose`")
    return Summary(
        len(fleet.rows),
        len({row["board"] for row in fleet.rows}),
        [{"log": row["log"], "reason": row["reason"]} for row in fleet.failed],
        known,
        outliers(rows, known),
        changes(fleet),
        dict(Counter(row["verdict"] for row in fleet.rows if row.get("verdict"))),
        lots,
        tuple(notes),
    )


def outliers(rows: Sequence[Row], known: Sequence[Spread]) -> list[Outlier]:
    """Boards that stand out, the furthest first."""
    if not known:
        return []
    limit = float(stats.norm.isf(0.5 * CHANCE / (len(rows) * (len(known) + 1))))
    found = [one for of in known for row in rows if (one := _apart(row, of)) and abs(one.z) > limit]
    found += [one for one in _residuals(rows) if one.z > limit]
    return sorted(found, key=lambda one: -abs(one.z))


def _apart(row: Row, of: Spread) -> Outlier | None:
    value, error = row["parameters"].get(of.name, (None, None))
    if value is None or error is None:
        return None
    z = float((value - of.mean) / max(np.hypot(of.tau, error), 1e-300))
    why = (
        f"{of.name} is {value:.5g} {of.unit}; the lot's is {of.mean:.5g} ± {plain(of.tau, 2)}, "
        f"this board's is known to {plain(error, 2)}"
    )
    return Outlier(row["board"], row["log"], of.name, value, of.mean, z, why)


def _residuals(rows: Sequence[Row]) -> list[Outlier]:
    """Boards on which the model leaves more than on the others, by the logarithm of the residual."""
    size = np.log([row["rms_lsb"] for row in rows])
    usual = float(np.median(size))
    width = max(MAD * float(np.median(np.abs(size - usual))), 0.01)
    said = "the model leaves {:.4g} LSB; on the others {:.4g} LSB"
    return [
        Outlier(row["board"], row["log"], "rms_lsb", row["rms_lsb"], float(np.exp(usual)), float(z), why)
        for row, z in zip(rows, (size - usual) / width, strict=True)
        for why in [said.format(row["rms_lsb"], np.exp(usual))]
    ]


def changes(fleet: Fleet) -> list[Change]:
    """Boards with several calibrations that differ, the surest first."""
    several = {board: rows for board, rows in fleet.boards().items() if len(rows) > 1}
    asked = sum(len(rows[0]["parameters"]) for rows in several.values())
    found = [
        one
        for board, rows in several.items()
        for name in rows[0]["parameters"]
        if (one := _changed(board, name, rows)) and one.p_value < CHANCE / asked
    ]
    return sorted(found, key=lambda one: one.p_value)


def _changed(board: str, name: str, rows: Sequence[Row]) -> Change | None:
    having = [row for row in rows if None not in row["parameters"].get(name, [None])]
    if len(having) < 2:
        return None
    v, s = np.array([row["parameters"][name] for row in having]).T
    if not np.all(s > 0):
        return None
    mean = np.sum(v / s**2) / np.sum(1.0 / s**2)
    p_value = float(max(stats.chi2.sf(np.sum(((v - mean) / s) ** 2), v.size - 1), 1e-300))
    unit, step = having[0]["units"][name], v[-1] - v[0]
    why = f"{name} went from {v[0]:.5g} to {v[-1]:.5g} {unit}: {step:+.3g} ± {plain(float(np.hypot(s[0], s[-1])), 2)}"
    logs, dates = tuple(row["log"] for row in having), tuple(row["date"] for row in having)
    return Change(board, name, unit, logs, dates, tuple(v.tolist()), tuple(s.tolist()), p_value, why)


def _lots(fleet: Fleet) -> dict[str, list[LotEffect]]:
    names = sorted({row["lot"] for row in fleet.rows})
    told = {lot: [row["scores"] for row in fleet.latest(lot) if row.get("scores")] for lot in names}
    return {lot: lot_effects(texts) for lot, texts in told.items()}
