"""The sensors of an array calibrated together (thesis 6.2): once by turning, then in one coil run each time.

    H = M h + B                          each sensor, M and B by the two-step ellipsoid of one turned log    (4.20)
    M <- R M,  B <- R B                  R turns each sensor's frame into that of the first                       (1)
    S_c sigma_c = M A^-1, B_c = B - B'   from a coil run of the same day, A and B' by 6.3-6.6                (6.8, 6.9)
    H = S_c sigma_c A h + B' + B_c       from any later coil run                                             (6.7)

R of (1) is the rotation that brings fields seen in common closest together (least squares; Kabsch). Outside a shield
a coil run shows the ambient field and not B': the biases of the turned log stay.
"""

from dataclasses import dataclass, field

import numpy as np

from barberpole.arrays.array_file import Array
from barberpole.errors import InputError, must
from barberpole.log import Log
from barberpole.methods.ellipsoid import efficient
from barberpole.methods.linear import linear_model, require_followed
from barberpole.methods.offset_coil import Affine, require_driven, transfer, transferred
from barberpole.methods.readings import demodulated, one_magnitude, require_regular, scalar
from barberpole.methods.scalar import require_seen

WHAT = "an array's calibration"


@dataclass(frozen=True)
class OfArray:
    """What is known of each sensor, by name.

    affine      M (3, 3) in µT/LSB and B (3,) in µT, in the frame of the first sensor
    carried     S_c sigma_c and B_c; empty before a coil run
    gain        (3,) of M today over M of the turned log; ones before
    left_ut     rms of what the turned log left of |H| - K, µT
    """

    affine: dict[str, Affine]
    carried: dict[str, Affine] = field(default_factory=dict)
    gain: dict[str, np.ndarray] = field(default_factory=dict)
    left_ut: dict[str, float] = field(default_factory=dict)


def turned(logs: dict[str, Log], otherwise_ut: float) -> OfArray:
    """M and B of sensors turned together in a field of one magnitude. Raises InputError as `ellipsoid`, per sensor."""
    affine, left, fields = {}, {}, {}
    for name, log in logs.items():
        seen = scalar(log, f"{WHAT} (sensor {name})")
        known = one_magnitude(seen, otherwise_ut, WHAT, log.path)
        require_seen(seen, known, f"{log.path}, sensor {name}")
        shape = efficient(seen.y, known)
        affine[name] = Affine(shape.upper, -shape.upper @ shape.centre)
        fields[name] = shape.field(seen.y)
        left[name] = float(np.sqrt(np.mean((np.linalg.norm(fields[name], axis=0) - known) ** 2)))
    first = next(iter(fields))
    for name in affine:
        r = rotation(fields[name], fields[first])
        affine[name] = Affine(r @ affine[name].a, r @ affine[name].b)
    return OfArray(affine, gain={name: np.ones(3) for name in affine}, left_ut=left)


def rotation(seen: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """R (3, 3) with R `seen` closest to `wanted`, both (3, n), eq. 1; a reflection too where the axes are mirrored."""
    u, _, v = np.linalg.svd(wanted @ seen.T)
    return u @ v


def coil_run(logs: dict[str, Log], array: Array) -> dict[str, Affine]:
    """A and B' of each sensor from one run of currents through all coils in series (6.3-6.6).

    Raises InputError without currents in all three coils, or for a sensor that does not follow them.
    """
    found = {}
    for name, log in logs.items():
        seen = demodulated(log, f"{WHAT} (sensor {name})")
        where = f"{log.path}, sensor {name}"
        current = require_driven(seen, where)
        coil_ut = array.kind.offset_coil_ut_per_ma * current
        require_regular(seen.y, coil_ut, where)
        made = linear_model(seen.y, coil_ut)
        require_followed(made, seen.y, coil_ut, "the coil currents", where)
        found[name] = Affine(made.matrix, -made.matrix @ made.offset_lsb)
    return found


def factory(once: OfArray, run: dict[str, Affine]) -> OfArray:
    """S_c sigma_c and B_c of each sensor (6.8, 6.9), from a coil run of the day on which they were turned."""
    carried = {name: transfer(run[name], affine) for name, affine in once.affine.items()}
    return OfArray(once.affine, carried, once.gain, once.left_ut)


def today(then: OfArray, run: dict[str, Affine], shielded: bool) -> OfArray:
    """Each sensor by 6.7 from a coil run of today. Raises InputError where there is nothing to carry over."""
    if set(then.carried) != set(run):
        got = ", ".join(then.carried) or "no coil run"
        raise InputError(must("the array's calibration", f"one with a coil run of {', '.join(run)}", got))
    affine, gain = {}, {}
    for name, coil in run.items():
        now, before = transferred(coil, then.carried[name]), then.affine[name]
        affine[name] = now if shielded else Affine(now.a, before.b)
        gain[name] = np.diag(np.linalg.solve(now.a, before.a))
    return OfArray(affine, then.carried, gain, then.left_ut)


def fields_of(found: OfArray, logs: dict[str, Log]) -> dict[str, np.ndarray]:
    """Fields (3, n) in µT of each sensor's log."""
    return {name: found.affine[name].field(demodulated(log, WHAT).y) for name, log in logs.items()}
