"""What a recording goes through: orientation, temperature, load and coil currents against time."""

import numpy as np

HELD = (15, 60)  # samples that a station lasts
TURNED = (60, 200)  # samples that a smooth turn lasts


def directions(n: int, rng: np.random.Generator) -> np.ndarray:
    """(3, n) unit vectors: smooth turns about random axes, and stations stepped to and held."""
    parts, done, current = [], 0, _unit(rng.normal(size=3))
    while done < n:
        if rng.random() < 0.5:
            part = _turn(current, int(rng.integers(*TURNED)), rng)
        else:
            part = np.repeat(_unit(rng.normal(size=3))[:, None], int(rng.integers(*HELD)), axis=1)
        current = part[:, -1]
        parts.append(part)
        done += part.shape[1]
    return np.concatenate(parts, axis=1)[:, :n]


def _turn(start: np.ndarray, samples: int, rng: np.random.Generator) -> np.ndarray:
    """Rotation of `start` about a random axis at 2 to 6 degrees a sample."""
    axis = _unit(rng.normal(size=3))
    angle = np.radians(rng.uniform(2.0, 6.0)) * np.arange(1, samples + 1)
    along, across = axis * (axis @ start), start - axis * (axis @ start)
    return along[:, None] + across[:, None] * np.cos(angle) + np.cross(axis, start)[:, None] * np.sin(angle)


def smooth(n: int, rng: np.random.Generator) -> np.ndarray:
    """(3, n) unit vectors: slow turns through all directions without a stop or a step."""
    t, (a, b) = np.arange(n), rng.uniform(0.008, 0.015, 2)
    z = np.sin(a * t + rng.uniform(0, 2 * np.pi))
    return np.stack([np.sqrt(1 - z * z) * np.cos(2.3 * b * t), np.sqrt(1 - z * z) * np.sin(2.3 * b * t), z])


def planar(n: int, rng: np.random.Generator) -> np.ndarray:
    """(3, n): turning about the vertical only, the field dipping 60 degrees."""
    angle = np.linspace(0, rng.uniform(3, 8) * 2 * np.pi, n)
    dip = np.radians(60.0)
    return np.stack([np.cos(dip) * np.cos(angle), -np.cos(dip) * np.sin(angle), np.full(n, np.sin(dip))])


def temperature(n: int, rng: np.random.Generator) -> np.ndarray:
    """(n,) °C: 10 K up and down one and a half to three times, from a random phase."""
    phase = np.linspace(0, rng.uniform(1.5, 3.0) * 2 * np.pi, n) + rng.uniform(0, 2 * np.pi)
    return 25.0 + rng.uniform(-3, 3) + 5.0 * np.sin(phase) + 0.02 * rng.normal(size=n)


def switched(n: int, levels: int, rng: np.random.Generator) -> np.ndarray:
    """(n,) in 0..1: a load that changes level every 20 to 120 samples."""
    out = np.empty(n)
    at = 0
    while at < n:
        step = int(rng.integers(20, 120))
        out[at : at + step] = rng.integers(0, levels) / max(levels - 1, 1)
        at += step
    return out


def cycled(n: int, rng: np.random.Generator) -> np.ndarray:
    """(n,) of 0 and 1 in turns of 300 to 900 samples."""
    out, at, on = np.empty(n), 0, float(rng.integers(0, 2))
    while at < n:
        step = int(rng.integers(300, 900))
        out[at : at + step] = on
        at, on = at + step, 1.0 - on
    return out


def _unit(v: np.ndarray) -> np.ndarray:
    return v / np.linalg.norm(v)
