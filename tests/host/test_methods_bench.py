"""`make bench`: the sharp ellipsoid against one plain linear least-squares fit of the same rows."""

import time

import numpy as np
import pytest
from barberpole.methods.ellipsoid import efficient

pytestmark = pytest.mark.bench


def median_s(work):
    times = []
    for _ in range(7):
        began = time.perf_counter()
        work()
        times.append(time.perf_counter() - began)
    return float(np.median(times))


@pytest.mark.parametrize("n", [10_000, 200_000])
def test_efficient_ellipsoid_within_ten_plain_fits(n):
    rng = np.random.default_rng(1)
    b = rng.normal(size=(3, n))
    y = 150.0 * b / np.linalg.norm(b, axis=0) + 0.3 * rng.normal(size=b.shape)

    def plain():
        x, u, z = y
        columns = np.stack([x * x, u * u, z * z, x * u, x * z, u * z, x, u, z], axis=1)
        return np.linalg.lstsq(columns, np.ones(n), rcond=None)

    ratio = median_s(lambda: efficient(y, 50.0)) / median_s(plain)
    print(f"\nefficient ellipsoid, {n} rows: {ratio:.1f} x plain", end="")
    assert ratio < 10.0
