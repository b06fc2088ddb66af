"""`make bench`: what fit and diagnose cost, as ratios to one plain linear least-squares fit of the same rows."""

import resource
import time

import numpy as np
import pytest
from barberpole.diagnose import diagnose_observations
from barberpole.effects import Conditions
from barberpole.fit.fit import fit_observations
from barberpole.methods.ellipsoid import algebraic
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations

LINEAR = ModelFile(("bias", "scale", "misalignment"))
REPEATS = 5
pytestmark = pytest.mark.bench


def turned(n, reference="vector"):
    """n readings of a sensor turned through all directions in 50 µT, 0.1 µT of noise, temperature up and down."""
    rng = np.random.default_rng(1)
    b = rng.normal(size=(3, n))
    b *= 50.0 / np.linalg.norm(b, axis=0)
    y = 3.0 * b + 0.3 * rng.normal(size=b.shape)
    at = Conditions(state=np.zeros(n), t_s=np.arange(n) / 100.0, temp_c=25.0 + 5.0 * np.sin(np.arange(n) * 20.0 / n))
    known = b if reference == "vector" else None
    return Observations(y, at, known, None, np.arange(n), reference, False)


def median_s(work):
    times = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return float(np.median(times))


def plain_s(seen):
    """One linear least-squares fit of the same rows: twelve unknowns against a field, nine for an ellipsoid."""
    if seen.b_ut is None:
        x, y, z = seen.y
        columns = np.stack([x * x, y * y, z * z, x * y, x * z, y * z, x, y, z], axis=1)
        return median_s(lambda: np.linalg.lstsq(columns, np.ones(len(columns)), rcond=None))
    columns = np.vstack([seen.b_ut, np.ones(seen.y.shape[1])]).T
    return median_s(lambda: np.linalg.lstsq(columns, seen.y.T, rcond=None))


def report(what, seconds, plain):
    peak_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    print(f"\n{what:<44} {1000 * seconds:9.1f} ms  {seconds / plain:7.1f} x plain  peak {peak_mb:5.0f} MB", end="")


@pytest.mark.parametrize("n", [10_000, 200_000])
def test_fits(n):
    seen, scalar = turned(n), turned(n, "constant")
    fit_s = median_s(lambda: fit_observations(seen, LINEAR))
    report(f"vector fit, 12 parameters, {n} rows", fit_s, plain_s(seen))
    report(f"scalar fit, 9 parameters, {n} rows", median_s(lambda: fit_observations(scalar, LINEAR)), plain_s(scalar))
    report(f"algebraic ellipsoid, {n} rows", median_s(lambda: algebraic(scalar.y)), plain_s(scalar))
    assert fit_observations(seen, LINEAR).rms_lsb == pytest.approx(0.3, rel=0.05)


@pytest.mark.parametrize(("n", "limit_s"), [(5_000, 0.4), (100_000, 3.0)])
@pytest.mark.parametrize("reference", ["vector", "constant"])
def test_diagnose(n, limit_s, reference):
    seen = turned(n, reference)
    began = time.perf_counter()
    found = diagnose_observations(seen, LINEAR, state_known=False)
    seconds = time.perf_counter() - began
    report(f"diagnose, {reference}, {n} rows (wanted {limit_s} s)", seconds, plain_s(seen))
    assert found.verdict in ("adequate", "inconclusive")
