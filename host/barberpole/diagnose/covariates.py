"""Everything a residual may depend on, whatever the physics: the tests for "none of the effects I know"."""

from dataclasses import dataclass

import numpy as np

from barberpole.observations import Observations

LEVELS = 1024  # bins of the reading, for a ripple with a fixed period in it
SLOWEST_RIPPLE = 6  # periods over the range; slower ones are polynomials
RIPPLE = 12.0  # height of a peak above the logarithm of their number (chance: exp(-12))


@dataclass(frozen=True)
class Covariate:
    """Basis functions (d, n) of one thing logged; `shapes` names the kind of each.

    value: the thing itself (n,) in its unit, None for a group of products. words: what it is called in a sentence.
    channel: the only one it applies to. period: of a ripple, in the unit of value.
    """

    name: str
    basis: np.ndarray
    shapes: tuple[str, ...]
    words: str
    value: np.ndarray | None = None
    unit: str = ""
    channel: int | None = None
    period: float = 0.0


POWERS = ("linear", "quadratic", "cubic")


def covariates(seen: Observations, field_ut: np.ndarray) -> list[Covariate]:
    """All covariates of a log. field_ut (3, n)."""
    u = field_ut / max(float(np.max(np.abs(field_ut))), 1e-300)
    return [*_orientation(u, field_ut), *_motion(u, field_ut, seen), *_logged(seen, u)]


def _orientation(u: np.ndarray, field_ut: np.ndarray) -> list[Covariate]:
    own = zip("xyz", u, field_ut, strict=True)
    out = [Covariate(f"field_{a}", _powers(v), POWERS, f"the {a} field", b, "µT") for a, v, b in own]
    for i, j in ((0, 1), (0, 2), (1, 2)):
        a, b = "xyz"[i], "xyz"[j]
        basis = np.stack([u[i] * u[j], u[i] ** 2 * u[j], u[i] * u[j] ** 2])
        out.append(_product(f"field_{a}*field_{b}", basis, f"the {a} and {b} fields"))
    return [*out, _product("field_x*field_y*field_z", np.prod(u, axis=0)[None], "all three fields")]


def _product(name: str, basis: np.ndarray, words: str) -> Covariate:
    return Covariate(name, basis, ("product",) * len(basis), words)


def _motion(u: np.ndarray, field_ut: np.ndarray, seen: Observations) -> list[Covariate]:
    rate = np.diff(u, axis=1, prepend=u[:, :1])
    before = np.concatenate([rate[:, :1] * 0, rate[:, :-1]], axis=1)
    change = np.diff(field_ut, axis=1, prepend=field_ut[:, :1])
    linear = ("linear", "linear")
    unit = "µT a sample"
    out = [
        Covariate(f"rate_{a}", np.stack([rate[i], before[i]]), linear, f"the rate of the {a} field", change[i], unit)
        for i, a in enumerate("xyz")
    ]
    for a, r in zip("xyz", rate, strict=True):
        way = _direction(r)
        out.append(Covariate(f"history_{a}", way[None], ("loop",), f"the way the {a} field came", way))
    return out


def _direction(rate: np.ndarray) -> np.ndarray:
    """Sign of the last movement that was more than the usual jitter."""
    moving = np.abs(rate) > 1e-3
    last = np.maximum.accumulate(np.where(moving, np.arange(rate.size), 0))
    return np.sign(rate[last])


def _logged(seen: Observations, u: np.ndarray) -> list[Covariate]:
    at, n = seen.at, u.shape[1]
    out = _time(seen, u)
    if at.temp_c is not None:
        v, logged = _unit(at.temp_c, n), _broad(at.temp_c, n)
        out.append(Covariate("temp_c", _powers(v), POWERS, "temperature", logged, "°C"))
        out.append(_product("temp_c*field", v * u, "temperature and field"))
    state = _broad(at.state, n)
    if np.ptp(state) > 0:
        out.append(Covariate("state", state[None], ("step",), "the flip state", state))
        pairs = np.concatenate([state * u, state * _pairs(u)])
        out.append(_product("state*field", pairs, "the flip state and the field"))
    if at.load_a is not None:
        out.append(_current("load_a", at.load_a, "the load current", "A", n))
    if at.i_ma is not None:
        currents = zip("xyz", at.i_ma, strict=True)
        out += [_current(f"i{a}_ma", i, f"the current of the {a} coil", "mA", n) for a, i in currents]
    return out


def _time(seen: Observations, u: np.ndarray) -> list[Covariate]:
    n, t_s = u.shape[1], seen.at.t_s
    slow = np.polynomial.legendre.legvander(np.linspace(-1, 1, n), 4).T[1:]
    value, unit = (np.arange(n, dtype=float), "samples") if t_s is None else (np.asarray(t_s, float), "s")
    shapes = (*POWERS, "quartic")
    return [Covariate("t_s", slow, shapes, "time", value, unit), _product("t_s*field", slow[0] * u, "time and field")]


def _current(name: str, value, words: str, unit: str, n: int) -> Covariate:
    return Covariate(name, _powers(_unit(value, n))[:2], POWERS[:2], words, _broad(value, n), unit)


def _broad(v, n: int) -> np.ndarray:
    return np.broadcast_to(np.asarray(v, float), (n,))


def _unit(v, n: int) -> np.ndarray:
    """Centred and of unit range."""
    v = _broad(v, n)
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
            basis, period = np.stack([np.sin(phase), np.cos(phase)]), span / turns
            name, words = f"reading_{'xyz'[channel]}", f"the {'xyz'[channel]} reading"
            within = np.mod(y - low, period)
            found.append(Covariate(name, basis, ("periodic",) * 2, words, within, "LSB", channel, period))
    return found
