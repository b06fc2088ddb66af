"""Everything a residual may depend on, whatever the physics: the tests for "none of the effects I know"."""

from dataclasses import dataclass

import numpy as np

from barberpole.observations import Observations

LEVELS = 1024  # bins of the reading, for a ripple with a fixed period in it
SLOWEST_RIPPLE = 6  # periods over the range; slower ones are polynomials
RIPPLE = 12.0  # height of a peak above the logarithm of their number (chance: exp(-12))


@dataclass(frozen=True)
class Covariate:
    """Basis functions (d, n) of one thing logged; `shapes` names each. channel: the only one it applies to."""

    name: str
    basis: np.ndarray
    shapes: tuple[str, ...]
    channel: int | None = None


POWERS = ("linear", "quadratic", "cubic")


def covariates(seen: Observations, field_ut: np.ndarray) -> list[Covariate]:
    """All covariates of a log. field_ut (3, n)."""
    u = field_ut / max(float(np.max(np.abs(field_ut))), 1e-300)
    return [*_orientation(u), *_motion(u), *_logged(seen, u)]


def _orientation(u: np.ndarray) -> list[Covariate]:
    out = [Covariate(f"field_{a}", _powers(v), POWERS) for a, v in zip("xyz", u, strict=True)]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        name = f"field_{'xyz'[i]}*field_{'xyz'[j]}"
        basis = np.stack([u[i] * u[j], u[i] ** 2 * u[j], u[i] * u[j] ** 2])
        out.append(Covariate(name, basis, ("product", "product", "product")))
    out.append(Covariate("field_x*field_y*field_z", np.prod(u, axis=0)[None], ("product",)))
    return out


def _motion(u: np.ndarray) -> list[Covariate]:
    rate = np.diff(u, axis=1, prepend=u[:, :1])
    before = np.concatenate([rate[:, :1] * 0, rate[:, :-1]], axis=1)
    out = [
        Covariate(f"rate_{a}", np.stack([r, b]), ("linear", "linear"))
        for a, r, b in zip("xyz", rate, before, strict=True)
    ]
    return out + [Covariate(f"history_{a}", _direction(r)[None], ("a loop",)) for a, r in zip("xyz", rate, strict=True)]


def _direction(rate: np.ndarray) -> np.ndarray:
    """Sign of the last movement that was more than the usual jitter."""
    moving = np.abs(rate) > 1e-3
    last = np.maximum.accumulate(np.where(moving, np.arange(rate.size), 0))
    return np.sign(rate[last])


def _logged(seen: Observations, u: np.ndarray) -> list[Covariate]:
    at, n, out = seen.at, u.shape[1], []
    slow = np.polynomial.legendre.legvander(np.linspace(-1, 1, n), 4).T[1:]
    out.append(Covariate("t_s", slow, ("linear", "quadratic", "cubic", "quartic")))
    out.append(Covariate("t_s*field", slow[0] * u, ("product",) * 3))
    if at.temp_c is not None:
        out += _with_field("temp_c", _unit(at.temp_c, n), u)
    state = np.broadcast_to(np.asarray(at.state, float), (n,))
    if np.ptp(state) > 0:
        out.append(Covariate("state", state[None], ("a step",)))
        out.append(Covariate("state*field", np.concatenate([state * u, state * _pairs(u)]), ("product",) * 9))
    if at.load_a is not None:
        out.append(Covariate("load_a", _powers(_unit(at.load_a, n))[:2], POWERS[:2]))
    if at.i_ma is not None:
        currents = zip("xyz", at.i_ma, strict=True)
        out += [Covariate(f"i{a}_ma", _powers(_unit(i, n))[:2], POWERS[:2]) for a, i in currents]
    return out


def _with_field(name: str, v: np.ndarray, u: np.ndarray) -> list[Covariate]:
    return [Covariate(name, _powers(v), POWERS), Covariate(f"{name}*field", v * u, ("product",) * 3)]


def _unit(v, n: int) -> np.ndarray:
    """Centred and of unit range."""
    v = np.broadcast_to(np.asarray(v, float), (n,))
    return (v - v.mean()) / max(float(np.ptp(v)), 1e-300)


def _powers(v: np.ndarray) -> np.ndarray:
    return np.stack([v, v * v, v**3])


def _pairs(u: np.ndarray) -> np.ndarray:
    return np.stack([u[i] * u[j] for i in range(3) for j in range(i, 3)])


def ripples(readings: np.ndarray, residual: np.ndarray) -> list[Covariate]:
    """Periodic error in a reading (m, n), with the period found by a spectrum over reading levels."""
    found = []
    for channel, (y, r) in enumerate(zip(readings, residual, strict=True)):
        low, span = float(y.min()), float(np.ptp(y))
        if span == 0 or not np.any(r):
            continue
        level = np.minimum((y - low) / span * LEVELS, LEVELS - 1).astype(int)
        power = np.abs(np.fft.rfft(np.bincount(level, r, LEVELS), 4 * LEVELS)) ** 2 / np.sum(r * r)
        candidates = power[4 * SLOWEST_RIPPLE : 2 * LEVELS]
        best = int(np.argmax(candidates))
        if candidates[best] > np.log(candidates.size) + RIPPLE:
            turns = (best + 4 * SLOWEST_RIPPLE) / 4
            phase = 2 * np.pi * turns * (y - low) / span
            shape = f"periodic, {span / turns:.3g} LSB a period"
            basis = np.stack([np.sin(phase), np.cos(phase)])
            found.append(Covariate(f"reading_{'xyz'[channel]}", basis, (shape, shape), channel))
    return found
