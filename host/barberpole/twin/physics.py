"""One AMR film as a single magnetic domain, solved exactly (thesis 3.1 and 3.3).

The magnetisation lies at the angle phi from the easy axis where its energy is lowest:

    E(phi) / (M_s H_k)   ~  sin²(phi) / 2 - (H_a sin(phi) + s H_e cos(phi)) / H_k     (3.2)
    H_k sin(phi) cos(phi) = H_a cos(phi) - s H_e sin(phi)                            (3.3)

H_a is the field across the easy axis (the one that is measured), H_e the field along it, s = +1 after SET and -1 after
RESET. A barber-pole bridge reports sin(phi) cos(phi) (3.12, without its small-angle step); scaled by H_k that is a
field, and it tends to H_a as H_k grows. This file knows nothing of models or fits: it is what they are tested against.
"""

import math

TOLERANCE_RAD = 1e-14
MAX_STEPS = 60


def energy(angle_rad: float, across_ut: float, along_ut: float, anisotropy_ut: float) -> float:
    """Energy (3.2) over mu_0 M_s, in µT; `along_ut` is s H_e, positive along the magnetisation."""
    field = across_ut * math.sin(angle_rad) + along_ut * math.cos(angle_rad)
    return 0.5 * anisotropy_ut * math.sin(angle_rad) ** 2 - field


def domain_angle(across_ut: float, along_ut: float, anisotropy_ut: float) -> float:
    """Angle in rad that solves (3.3) on the branch of the present magnetisation, by Newton.

    Valid inside the astroid (`turns_over` is False), where the energy keeps a minimum on this side.
    """
    angle = math.atan2(across_ut, anisotropy_ut + along_ut)
    for _ in range(MAX_STEPS):
        sine, cosine = math.sin(angle), math.cos(angle)
        torque = anisotropy_ut * sine * cosine - across_ut * cosine + along_ut * sine
        stiffness = anisotropy_ut * (cosine * cosine - sine * sine) + across_ut * sine + along_ut * cosine
        step = torque / stiffness if stiffness else torque / anisotropy_ut
        angle -= step
        if abs(step) < TOLERANCE_RAD:
            break
    return angle


def film_field(across_ut: float, along_ut: float, anisotropy_ut: float, state: int) -> float:
    """What the bridge reports, as a field in µT before the sign of the magnetisation: H_k sin(phi) cos(phi).

    across_ut and along_ut are the fields across and along the easy axis; `state` is +1 (SET) or -1 (RESET). An
    infinite anisotropy field is the ideal bridge, which reports `across_ut`.
    """
    if math.isinf(anisotropy_ut):
        return across_ut
    angle = domain_angle(across_ut, state * along_ut, anisotropy_ut)
    return anisotropy_ut * math.sin(angle) * math.cos(angle)


def turns_over(across_ut: float, along_ut: float, anisotropy_ut: float, state: int) -> bool:
    """Whether the field reverses a magnetisation of this state: it points backwards, outside the astroid

    |H_a|^(2/3) + |H_e|^(2/3) = H_k^(2/3)    (Stoner and Wohlfarth 1948)
    """
    if state * along_ut >= 0.0 or math.isinf(anisotropy_ut):
        return False
    power = 2.0 / 3.0
    return abs(across_ut) ** power + abs(along_ut) ** power > anisotropy_ut**power


def sinc3_step(periods: float) -> float:
    """Answer of a sinc3 filter to a unit step, `periods` conversion periods after it: 0 before it, 1 from the third.

    The integral of the quadratic B-spline, the sinc3's impulse response in the limit of fine oversampling.
    """
    x = periods
    if x <= 0.0:
        return 0.0
    if x < 1.0:
        return x**3 / 6.0
    if x < 2.0:
        return 0.5 - 1.5 * x + 1.5 * x * x - x**3 / 3.0
    if x < 3.0:
        return 1.0 - (3.0 - x) ** 3 / 6.0
    return 1.0
