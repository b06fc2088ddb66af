"""Time series, for effects in which a sample depends on earlier ones.

    y_k = a_k y_(k-1) + v_k                                                          (1)

SET and RESET readings of one row are two series of the same field: where the samples alternate between the states
with equal times, each state is its own series.
"""

import numpy as np
from scipy.linalg import get_lapack_funcs

from barberpole.effects.effect import Array, Conditions


def streams(at: Conditions, n: int) -> tuple[slice, ...]:
    """Which samples follow one another: all of them, or SET and RESET apart where each row gave both."""
    t, state = at.t_s, np.asarray(at.state)
    if t is None or state.ndim == 0 or state.size != n or n < 2 or n % 2:
        return (slice(0, n),)
    paired = np.array_equal(t[0::2], t[1::2]) and np.all(state[0::2] * state[1::2] < 0)
    return (slice(0, n, 2), slice(1, n, 2)) if paired else (slice(0, n),)


def intervals(t_s: Array) -> Array:
    """Time since the sample before in s, (n,), always positive; the first one is never used.

    Equal times are those of a logger that buffered: its burst is spread over the time since the stamp before. Without
    any step of time nothing is known of the order of samples, and they are taken as far apart.
    """
    stamps, count = np.unique(np.asarray(t_s, float), return_counts=True)
    if stamps.size < 2:
        return np.full(np.size(t_s), np.inf)
    gaps = np.diff(stamps)
    return np.repeat(np.concatenate([gaps[:1], gaps]) / count, count)


def recur(a: Array, v: Array) -> Array:
    """y (..., n) of (1) from a (n,) and v (..., n), starting with y_0 = v_0. Real or complex."""
    flat = np.reshape(v, (-1, np.shape(v)[-1]))
    band = np.ones((2, a.size), np.result_type(a, flat))
    band[1, :-1] = -a[1:]
    (solve,) = get_lapack_funcs(("tbtrs",), (band, flat))
    y, _ = solve(band, np.asarray(flat, band.dtype).T, uplo="L", diag="U")
    return y.T.reshape(np.shape(v))


def low_pass(x: Array, dt: Array, tau_s) -> Array:
    """Response (..., n) to x (..., n) of  tau dy/dt + y = x  by backward differences, settled at the first sample."""
    keep = memory(dt, tau_s)
    v = (1.0 - keep) * x
    v[..., 0] = x[..., 0]
    return recur(keep, v)


def warm_up(x: Array, dt: Array, tau_s) -> Array:
    """The same, beginning from nothing before the first sample."""
    keep = memory(dt, tau_s)
    return recur(keep, (1.0 - keep) * x)


def memory(dt: Array, tau_s) -> Array:
    """How much of the last output survives a step: tau / (tau + dt)."""
    return tau_s / (tau_s + dt)


def low_pass_by_tau(y: Array, dt: Array, tau_s: float) -> Array:
    """d y / d tau of `low_pass`, from its output y (..., n): a low-pass of -dy/dt."""
    v = np.zeros(np.shape(y))
    v[..., 1:] = -np.diff(y) / (tau_s + dt[1:])
    return recur(memory(dt, tau_s), v)


def warm_up_by_tau(y: Array, dt: Array, tau_s: float) -> Array:
    """d y / d tau of `warm_up`, from its output y (..., n)."""
    return recur(memory(dt, tau_s), -np.diff(y, prepend=0.0) / (tau_s + dt))


def high_pass(y: Array, dt: Array, tau_s) -> Array:
    """Inverse of `low_pass`: x = y + tau dy/dt."""
    x = np.array(y)
    x[..., 1:] += tau_s / dt[1:] * np.diff(y)
    return x


def filtered(rows: Array, taus, at: Conditions, one) -> Array:
    """one(row, dt, tau) applied to each axis of rows (3, ..., n), each series apart."""
    out = np.empty_like(rows)
    for samples in streams(at, out.shape[-1]):
        dt = intervals(np.asarray(at.t_s)[samples])
        for axis, tau in enumerate(taus):
            out[axis][..., samples] = one(rows[axis][..., samples], dt, tau)
    return out
