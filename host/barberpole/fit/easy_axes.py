"""Which axis lies along the easy axis of each bridge, where no sensor file says it.

The first term of a cross field in a bridge's reading is s H_i H_j (thesis 3.14), and demodulated H_i H_j^2 (3.34), with
j the easy axis. Both other axes are tried beside everything linear, and the usual one is left only for clear evidence:
a wrong one would leave structure that other effects then seem to explain. Demodulated readings of one magnitude do not
show it: H_i^2 H_j^2 is the same for i, j and j, i.
"""

from dataclasses import replace

import numpy as np

from barberpole.errors import InputError
from barberpole.fit.ellipsoid import algebraic
from barberpole.observations import Observations

CLEAR = 8.0  # standard errors of the product with another axis before it counts
AHEAD = 3.0  # times those of the product with the usual axis
MOST = 20_000  # samples looked at
OTHERS = ((1, 2), (0, 2), (0, 1))


def with_easy_axes(seen: Observations) -> Observations:
    """The observations with the easy axes that they show, or as they are where the sensor's are known or none shows."""
    if seen.sensor_known:
        return seen
    step = -(-seen.y.shape[1] // MOST)
    try:
        errors = _standard_errors(seen, slice(None, None, step))
    except (InputError, np.linalg.LinAlgError):
        return seen
    axes = tuple(_chosen(errors[i], OTHERS[i], seen.at.easy_axis[i]) for i in range(3))
    return seen if axes == seen.at.easy_axis else replace(seen, at=replace(seen.at, easy_axis=axes))


def _chosen(shown: np.ndarray, others: tuple[int, int], usual: int) -> int:
    other = others[1] if others[0] == usual else others[0]
    of_usual, of_other = (shown[others.index(axis)] for axis in (usual, other))
    return other if of_other > max(CLEAR, AHEAD * of_usual) else usual


def _standard_errors(seen: Observations, rows: slice) -> np.ndarray:
    """(3, 2): how many standard errors each product amounts to, for each bridge with each of the other axes."""
    at = seen.at.take(rows)
    y = seen.y[:, rows]
    state = np.broadcast_to(np.asarray(at.state, float), y.shape[1:])
    if seen.b_ut is not None:
        h = seen.b_ut[:, rows]
        h = h / np.max(np.abs(h))
        linear = (
            np.vstack([np.ones(h.shape[1]), h, state, state * h]) if np.any(state) else np.vstack([h[0] * 0 + 1, h])
        )
        return np.maximum(*(_by_channel(y, linear, products) for products in _products(h, state)))
    return _on_the_surface(y, state)


def _products(h: np.ndarray, state: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The first and the second term by bridge and axis, each (3, 2, n); a known state leaves only the first."""
    pairs = np.array([[h[i] * h[j] for j in OTHERS[i]] for i in range(3)])
    squares = np.array([[h[i] * h[j] ** 2 for j in OTHERS[i]] for i in range(3)])
    return (state * pairs, state * pairs) if np.any(state) else (pairs, squares)


def _by_channel(y: np.ndarray, linear: np.ndarray, products: np.ndarray) -> np.ndarray:
    return np.array([_errors_of(np.vstack([linear, products[i]]).T, y[i], 2) for i in range(3)])


def _on_the_surface(y: np.ndarray, state: np.ndarray) -> np.ndarray:
    """The same where only the magnitude is known: what the products leave of |H| - K, beside a quadric."""
    shift = 0.0
    if np.any(state > 0) and np.any(state < 0):
        shift = 0.5 * state * (np.median(y[:, state > 0], axis=1) - np.median(y[:, state < 0], axis=1))[:, None]
    h = algebraic(y - shift).field(y - shift)
    norm = np.linalg.norm(h, axis=0)
    u = h / norm
    quadric = [u[i] * u[j] for i in range(3) for j in range(i, 3)] + [*u]
    linear = np.vstack([*quadric, *(state * u)]) if np.any(state) else np.vstack(quadric)
    found = []
    for products in _products(u, state):
        columns = np.vstack([linear, (products * u[:, None]).reshape(6, -1)])
        found.append(_errors_of(columns.T, norm - 1.0, 6).reshape(3, 2))
    return np.maximum(*found)


def _errors_of(columns: np.ndarray, values: np.ndarray, last: int) -> np.ndarray:
    """(last,) magnitudes over standard errors of the last coefficients of a least-squares fit."""
    gram = columns.T @ columns
    inverse = np.linalg.pinv(gram, rcond=1e-10, hermitian=True)
    answer = inverse @ (columns.T @ values)
    left = values - columns @ answer
    variance = float(left @ left) / max(values.size - len(answer), 1)
    spread = np.sqrt(np.maximum(np.diag(inverse) * variance, 1e-300))
    return (np.abs(answer) / spread)[-last:]
