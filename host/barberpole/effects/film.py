"""The film of an AMR bridge as one magnetic domain that has turned by the angle phi (thesis 3.1-3.4).

    sin(phi) cos(phi) = k (H_s cos(phi) - H_e sin(phi)),   k = 1/H_k                 (1)

H_s is the field along the sensitive axis, H_e that along the easy axis, in the direction of the magnetisation.
"""

import numpy as np

NEWTON_STEPS = 8  # at most: convergence is quadratic from the linear answer
CONVERGED = 1e-12  # a step below this leaves value and complex step exact


def tilt(own, easy, k):
    """t = tan(phi) of (1): t = k (H_s - H_e t) sqrt(1 + t^2), by Newton from the linear answer. Real or complex."""
    t = k * own / (1.0 + k * easy)
    for _ in range(NEWTON_STEPS):
        r = np.sqrt(1.0 + t * t)
        torque = k * (own - easy * t)
        step = (t - torque * r) / (1.0 + k * easy * r - torque * t / r)
        t = t - step
        if not np.max(np.abs(step), initial=0.0) > CONVERGED:
            break
    return t


def sine_cosine(u):
    """sin and cos of phi from u = sin(phi) cos(phi), |phi| < 45 degrees."""
    cos = np.sqrt(0.5 + 0.5 * np.sqrt(1.0 - 4.0 * u * u))
    return u / cos, cos


def eliminate(level, slope, easy):
    """Solve h_i = level_i + slope_i h_easy(i) for the three h: every chain of easy axes ends in a pair or a triple."""
    solved: list = [None, None, None]
    for i in range(3):
        j = easy[i]
        if easy[j] == i:
            solved[i] = (level[i] + slope[i] * level[j]) / (1.0 - slope[i] * slope[j])
        elif easy[easy[j]] == i:
            m = easy[j]
            loop = 1.0 - slope[i] * slope[j] * slope[m]
            solved[i] = (level[i] + slope[i] * (level[j] + slope[j] * level[m])) / loop
    for i in range(3):
        if solved[i] is None:
            solved[i] = level[i] + slope[i] * solved[easy[i]]
    return solved
