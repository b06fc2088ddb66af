"""Effects that a whole lot shares: the boards' scores added up find what is too small to see on any one of them.

With u_b, M_b of board b (`scores`), theta_b its own parameters and S_b = u_b^T M_b^-1 u_b:
    the same on all     theta = (sum M_b)^-1 sum u_b,   T = theta^T sum u_b            chi^2 of k       (1)
    each its own        Q = sum S_b - T                                                chi^2 of K = sum rank - k  (2)
(1) finds an effect whose sign and size the lot shares. (2) finds one that every board has in a size of its own; its
likelihood gain for a spread of the parameters is Q - K - K log(Q / K). Both count as falls of an information criterion.

Each is believed only behind a gate that a wrong noise model does not open: (1) if the scores scatter so little between
the boards that their sum is no chance (Hotelling's T^2), (2) if most boards show more than the median of chi^2, which
a few bad boards cannot bring about. What all effects show alike is the noise, and is taken off.
"""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import stats

ENOUGH = 10.0  # fall of the information criterion that a name needs, as in a diagnosis
SURE = 1e-6  # chance behind each gate
OWN_COLOUR = 1.5  # by so much all effects alike may exceed the noise before sizes of their own are taken for noise
LEAST = 12  # boards: with fewer nothing is added up


@dataclass(frozen=True)
class Summed:
    """One form of an effect over B boards: u (B, k), m (B, k, k), rank (B,), and S_b (B,)."""

    effect: str
    settings: dict[str, Any]
    names: tuple[str, ...]
    u: np.ndarray
    m: np.ndarray
    rank: np.ndarray
    taken: np.ndarray


@dataclass(frozen=True)
class LotEffect:
    """An effect of the lot. gain: fall of the information criterion; `common` and `individual` are its parts.

    size        RMS of what it does to the readings, over the noise
    parameters  the lot's mean of each with its standard error, in the effect's own units (noise of each board taken)
    rivals      effects that the boards together cannot tell from it
    """

    effect: str
    settings: dict[str, Any]
    boards: int
    gain: float
    common: float
    individual: float
    size: float
    parameters: dict[str, tuple[float, float]]
    rivals: tuple[str, ...] = ()

    @property
    def kind(self) -> str:
        if self.common > 0 and self.individual > 0:
            return "on all boards, around a common size"
        return "the same on all boards" if self.common > 0 else "on all boards, in a size of its own on each"


def lot_effects(scores: Sequence[str]) -> list[LotEffect]:
    """Effects that these boards (their column `scores`, JSON) share, the strongest first; others only as its rivals."""
    read = [json.loads(text) for text in scores]
    forms = _added(read)
    if not forms:
        return []
    noise, count = _noise(forms), sum(board["count"] for board in read)
    numbers = {name: sum(f.effect == name for f in forms) for name in {f.effect for f in forms}}
    best: dict[str, LotEffect] = {}
    for form in forms:
        found = _judged(form, noise, count, 2.0 * np.log(numbers[form.effect]))
        if found.gain > max(ENOUGH, best[form.effect].gain if form.effect in best else 0.0):
            best[form.effect] = found
    ranked = sorted(best.values(), key=lambda one: -one.gain)
    return [_with_rivals(ranked)] if ranked else []


def _with_rivals(ranked: list[LotEffect]) -> LotEffect:
    first, others = ranked[0], ranked[1:]
    rivals = tuple(one.effect for one in others if first.gain - one.gain < ENOUGH)
    return LotEffect(**{**vars(first), "rivals": rivals})


def _added(read: list[dict]) -> list[Summed]:
    """Each form over the boards that could show it, if these are enough."""
    by_form: dict[tuple, list[dict]] = {}
    for board in read:
        for form in board["forms"]:
            if form["rank"]:
                by_form.setdefault((form["effect"], form["form"], tuple(form["names"])), []).append(form)
    return [_summed(found) for found in by_form.values() if len(found) >= max(LEAST, len(read) / 2)]


def _summed(found: list[dict]) -> Summed:
    k = len(found[0]["names"])
    u = np.array([form["u"] for form in found])
    m = np.array([form["m"] for form in found]).reshape(-1, k, k)
    taken = np.array([a @ _inverse(b) @ a for a, b in zip(u, m, strict=True)])
    rank = np.array([form["rank"] for form in found])
    return Summed(found[0]["effect"], found[0]["settings"], tuple(found[0]["names"]), u, m, rank, taken)


def _inverse(m: np.ndarray) -> np.ndarray:
    """Pseudo-inverse with every column brought to unit size first."""
    size = np.sqrt(np.maximum(np.diag(m), 1e-300))
    return np.linalg.pinv(m / np.outer(size, size), rcond=1e-6, hermitian=True) / np.outer(size, size)


def _noise(forms: Sequence[Summed]) -> float:
    """By how much the falls of all effects alike exceed those of the noise that was assumed; at least 1."""
    over: dict[str, list[float]] = {}
    for form in forms:
        over.setdefault(form.effect, []).append(float(np.median(form.taken / stats.chi2.median(form.rank))))
    return max(1.0, float(np.median([np.median(ratios) for ratios in over.values()])))


def _judged(form: Summed, noise: float, count: float, tried: float) -> LotEffect:
    boards, k = form.u.shape
    total, summed = form.u.sum(axis=0), form.m.sum(axis=0)
    inverse = _inverse(summed)
    mean = inverse @ total
    common = float(mean @ total) / noise
    gain_common = common - k * np.log(count) - tried if _coherent(form, mean) else 0.0
    left, freedom = float(form.taken.sum()) / noise - common, float(form.rank.sum()) - k
    over = max(left / freedom, 1.0)
    gain_own = freedom * (over - 1.0 - np.log(over)) - k * np.log(boards) - tried
    gain_own = gain_own if noise < OWN_COLOUR and _most_boards(form, noise) else 0.0
    excess = max(float(form.taken.sum()) / noise - float(form.rank.sum()), 0.0)
    errors = np.sqrt(np.maximum(np.diag(inverse), 0.0) * noise)
    values = zip(mean.tolist(), errors.tolist(), strict=True)
    return LotEffect(
        form.effect,
        form.settings,
        boards,
        max(gain_common, 0.0) + max(gain_own, 0.0),
        max(gain_common, 0.0),
        max(gain_own, 0.0),
        float(np.sqrt(excess / count)),
        dict(zip(form.names, values, strict=True)),
    )


def _coherent(form: Summed, mean: np.ndarray) -> bool:
    """Whether the sum of the scores is no chance, judged by how they scatter from board to board."""
    boards, k = form.u.shape
    if boards <= k + 2:
        return False
    apart = form.u - form.m @ mean
    total = form.u.sum(axis=0)
    ratio = float(total @ _inverse(apart.T @ apart) @ total) * (boards - k) / k / boards
    return float(stats.f.sf(ratio, k, boards - k)) < SURE


def _most_boards(form: Summed, noise: float) -> bool:
    """Whether more boards than chance makes lie above the median of what noise takes."""
    above = int(np.sum(form.taken / noise > stats.chi2.median(form.rank)))
    return float(stats.binom.sf(above - 1, form.taken.size, 0.5)) < SURE
