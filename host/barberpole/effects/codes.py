"""What a converter adds to its codes c: a bent transfer curve, or a ripple from a bit of the wrong weight.

    k |c| + q c^2 + r c^3                                                with 9 parameters   (1)
    sum_h (s_h sin(2 pi h c / P) + u_h cos(2 pi h c / P))                with 6 h + 1         (2)

p holds three parameters of each kind, one an axis, and in (2) the period P last.
"""

import numpy as np


def terms(codes, p):
    """Pairs of what a parameter multiplies and its slope by the code, (3, n) each, in steps of three parameters."""
    if len(p) == 9:
        sign, square = np.copysign(1.0, np.real(codes)), codes * codes
        return [(codes * sign, sign), (square, 2.0 * codes), (square * codes, 3.0 * square)]  # a power is slow
    found = []
    for h in range(1, (len(p) - 1) // 6 + 1):
        turn = 2.0 * np.pi * h / p[-1]
        sine, cosine = np.sin(turn * codes), np.cos(turn * codes)
        found += [(sine, turn * cosine), (cosine, -turn * sine)]
    return found


def error(codes, p, parts=None):
    """What the law adds to the codes (3, n), and its slope by the code. `parts`: their `terms`, where known."""
    groups = [np.asarray(p[j : j + 3])[:, None] for j in range(0, len(p) - len(p) % 3, 3)]
    total, slope = np.zeros(codes.shape), np.zeros(codes.shape)
    for group, (value, steepness) in zip(groups, parts or terms(codes, p), strict=True):
        if np.any(group):
            total, slope = total + group * value, slope + group * steepness
    return total, slope
