"""The sensor as it really is: one exact domain per bridge, then whatever else is wrong with it, by hand.

Nothing here comes from barberpole: the truth that a diagnosis is tried on must not be the model under test.
Every distortion has one strength; 0 is absent. `pattern` holds random factors, one row an effect, drawn once.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq
from scipy.signal import lfilter

EASY = (1, 0, 1)  # the easy axis of the x, y and z bridge


@dataclass(frozen=True)
class Scene:
    """What happens to the sensor: field (3, n) in µT, state (n,), the rest (n,) or (3, n); fs in Hz.

    raw: RESET readings are recorded with the sign that the converter saw.
    """

    field_ut: np.ndarray
    state: np.ndarray
    temp_c: np.ndarray
    t_s: np.ndarray
    load_a: np.ndarray
    i_ma: np.ndarray
    fs_hz: float
    factors: np.ndarray = field(repr=False)  # (20, 3) random, of order one
    noise_seed: int = 0
    raw: bool = False

    @property
    def n(self) -> int:
        return self.field_ut.shape[1]


Hidden = dict[str, float]


def reading(scene: Scene, hidden: Hidden) -> np.ndarray:
    """(3, n) in µT (gain 1), before gain, bias and noise: the mean of SET and RESET where the state is 0."""
    if np.any(scene.state == 0):
        return 0.5 * (_one_state(scene, hidden, 1.0) + _one_state(scene, hidden, -1.0))
    return _one_state(scene, hidden, scene.state)


def _one_state(scene: Scene, hidden: Hidden, state) -> np.ndarray:
    h = scene.field_ut
    for name in ("load_current", "coil_coupling", "soft_iron", "misalignment"):
        h = _apply(name, h, scene, hidden, state)
    h = domain(h, state, hidden.get("cross_field", 0.0) * scene.factors[0])
    for name in DISTORTIONS:
        if name not in ("load_current", "coil_coupling", "soft_iron", "misalignment"):
            h = _apply(name, h, scene, hidden, state)
    return h


def _apply(name, h, scene, hidden, state):
    strength = hidden.get(name, 0.0)
    return DISTORTIONS[name](h, strength, scene, state) if strength else h


def domain(h: np.ndarray, state, k: np.ndarray, steps: int = 60) -> np.ndarray:
    """The exact single domain (thesis 3.3): sin a cos a = k (Hs cos a - s He sin a), by bisection on the torque."""
    if not np.any(k):
        return h
    own, easy, k = h, state * h[list(EASY)], np.asarray(k)[:, None]
    low, high = np.full(own.shape, -np.pi / 4), np.full(own.shape, np.pi / 4)
    for _ in range(steps):
        a = 0.5 * (low + high)
        torque = np.sin(a) * np.cos(a) - k * (own * np.cos(a) - easy * np.sin(a))
        low, high = np.where(torque < 0, a, low), np.where(torque < 0, high, a)
    a = 0.5 * (low + high)
    return own * np.cos(a) - easy * np.sin(a)


def misalignment(h, e, scene, state):
    turned = np.eye(3) + e * _cross_terms(scene.factors[1], scene.factors[2])
    return turned / np.linalg.norm(turned, axis=1)[:, None] @ h


def soft_iron(h, e, scene, state):
    """A symmetric stretch: induced magnetisation."""
    f = e * scene.factors[3]
    return h + np.array([[0, f[0], f[1]], [f[0], 0, f[2]], [f[1], f[2], 0]]) @ h


def _cross_terms(upper, lower):
    return np.array([[0, upper[0], upper[1]], [lower[0], 0, upper[2]], [lower[1], lower[2], 0]])


def _temperature(scene):
    return (scene.temp_c - 25.0) / 10.0


def lag(h, tau, scene, state):
    """First-order low-pass of time constant tau samples, exact for a held input."""
    a = np.exp(-1.0 / tau) * np.ones(3) if tau > 1e-3 else np.zeros(3)
    return np.stack([lfilter([1 - a[i]], [1, -a[i]], h[i], zi=[a[i] * h[i, 0]])[0] for i in range(3)])


def hysteresis(h, c, scene, state):
    """A play of half width 8 µT holds back a fraction c of the reading."""
    return h + c * scene.factors[4][:, None] * (_play(h, 8.0) - h)


def _play(h, width):
    out, held = np.empty_like(h), h[:, 0].copy()
    for at in range(h.shape[1]):
        held = np.minimum(np.maximum(held, h[:, at] - width), h[:, at] + width)
        out[:, at] = held
    return out


def coil_heating(h, c, scene, state):
    """The coils' heat, filling and leaking in 5 s, shifts the offset."""
    a = np.exp(-1.0 / (5.0 * scene.fs_hz))
    heat = lfilter([1 - a], [1, -a], np.sum(scene.i_ma**2, axis=0) / 100.0)
    return h + c * scene.factors[5][:, None] * heat


def outliers(h, size, scene, state):
    rng = np.random.default_rng(scene.noise_seed + 1)
    hit = rng.random(h.shape) < 0.005
    return h + size * hit * rng.choice([-1.0, 1.0], h.shape) * rng.uniform(0.5, 1.5, h.shape)


def telegraph(h, size, scene, state):
    """A bias that jumps between two levels every 150 samples or so."""
    rng = np.random.default_rng(scene.noise_seed + 2)
    jumps = rng.random(h.shape) < 1.0 / 150.0
    return h + size * np.sign(scene.factors[6])[:, None] * (-1.0) ** np.cumsum(jumps, axis=1)


def mains(h, size, scene, state):
    phase = 2 * np.pi * 50.03 * scene.t_s
    return h + size * scene.factors[7][:, None] * np.sin(phase + np.array([[0.3], [1.1], [2.0]]))


def load_current(h, size, scene, state):
    return h + size * scene.factors[8][:, None] * scene.load_a


def coil_coupling(h, size, scene, state):
    return h + size * _cross_terms(scene.factors[9], scene.factors[10]) @ scene.i_ma


def adc_inl(h, size, scene, state):
    """A bow with a kink at mid scale, as of a converter whose top bit is a little wrong.

    It acts on what the converter sees: with the sign of RESET where the record keeps it.
    """
    u, seen = h / 100.0, state if scene.raw else 1.0
    return h + seen * size * scene.factors[11][:, None] * (np.abs(u) - 0.25)


def drift(h, size, scene, state):
    u = scene.t_s / scene.t_s[-1] - 0.5
    return h + size * scene.factors[12][:, None] * u


def ripple(h, size, scene, state):
    return h + size * np.sin(2 * np.pi * h / 6.3 + np.array([[0.0], [1.0], [2.0]]))


def triple(h, size, scene, state):
    return h + size * scene.factors[13][:, None] * h[0] * h[1] * h[2] / 50.0**3


Distortion = Callable[[np.ndarray, float, Scene, np.ndarray], np.ndarray]
DISTORTIONS: dict[str, Distortion] = {
    "load_current": load_current,
    "coil_coupling": coil_coupling,
    "soft_iron": soft_iron,
    "misalignment": misalignment,
    "saturation": lambda h, c, s, state: np.tanh(h * c) / c,
    "quadratic": lambda h, q, s, state: h + q * s.factors[14][:, None] * h * h,
    "cubic": lambda h, q, s, state: h + q * s.factors[15][:, None] * h**3,
    "sensitivity_temperature": lambda h, c, s, state: h * (1 + c * s.factors[16][:, None] * _temperature(s)),
    "lag": lag,
    "hysteresis": hysteresis,
    "flip_asymmetry": lambda h, d, s, state: h * (1 + state * d * s.factors[17][:, None]),
    "bias_temperature": lambda h, c, s, state: h + c * s.factors[18][:, None] * _temperature(s),
    "coil_heating": coil_heating,
    "drift": drift,
    "mains": mains,
    "adc_inl": adc_inl,
    "triple": triple,
    "ripple": ripple,
    "telegraph": telegraph,
    "outliers": outliers,
}
FOREIGN = ("telegraph", "ripple", "triple")
CATALOGUE = ("cross_field", *(name for name in DISTORTIONS if name not in FOREIGN))
_LARGEST = {"cross_field": 8e-3, "saturation": 2e-2, "lag": 100.0}


def strength_for(name: str, rms_ut: float, scene: Scene) -> float:
    """The strength at which the effect changes the reading by rms_ut (RMS over axes and samples)."""
    clean = reading(scene, {})

    def excess(log_strength: float) -> float:
        change = reading(scene, {name: np.exp(log_strength)}) - clean
        return np.log(np.sqrt(np.mean(change**2)) / rms_ut + 1e-300)

    top = np.log(_LARGEST.get(name, 1e3))
    if excess(top) < 0:
        return float(np.exp(top))
    return float(np.exp(float(brentq(excess, np.log(1e-12), top, xtol=1e-3))))  # pyright: ignore[reportArgumentType]
