"""Do 95 % intervals hold the truth in 95 % of logs? `python -m truth.coverage` repeats logs of each effect and counts.

The readings are those of the effect's own law with parameters that are known, so that every parameter has a truth;
field, temperature and currents are those of the independent simulator. Only the noise is drawn afresh.
"""

import argparse
import os
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path

import numpy as np
from barberpole.challenge import noise
from barberpole.challenge.record import Recipe, record
from barberpole.effects import STACK
from barberpole.fit.fit import fit_observations
from barberpole.log import Log
from barberpole.modelfile import ModelFile
from barberpole.observations import Observations, observations

ROWS = 600
NOISE_LSB = 2.0
CORNER = 0.1  # of the 1/f noise, in cycles a sample
WIDE = 1.959964
LINEAR = ("bias", "scale", "misalignment")
INSTEAD = {"soft_iron": ("bias", "scale", "soft_iron")}  # both together take each other's place
SETTINGS = {"mains": {"frequency_hz": 7.3}}
SIZES = {"mains.frequency": 7.3, "lag.tau": 0.05, "hysteresis.width": 5.0, "coil_heating.tau": 5.0}
STRONG = {"coil_heating": 20.0, "bias_temperature": 10.0, "sensitivity_temperature": 3.0}
SPIKES = 0.01  # of the readings of a log with outliers


@dataclass(frozen=True)
class Case:
    """One effect, under one kind of noise."""

    effect: str
    coloured: bool = False
    reference: str = "vector"


@dataclass(frozen=True)
class Counted:
    """Of one effect: intervals that held the truth, all, and the worst parameter with its own part."""

    case: Case
    held: int
    of: int
    worst: str
    worst_part: float

    @property
    def part(self) -> float:
        return self.held / max(self.of, 1)


@cache
def _prepared(case: Case) -> tuple[Observations, ModelFile, np.ndarray, np.ndarray, tuple[str, ...]]:
    """Observations without noise, the model file, the truth (P,), the clean readings (3, n), parameter names."""
    form = "flips" if case.effect in ("cross_field", "flip_asymmetry", "hysteresis") else "demodulated"
    columns = record(Recipe({}, rows=ROWS, form=form, noise_ut=1e-9, seed=77, reference="vector"))
    seen = observations(Log(columns, Path("made.csv"), ""))
    effects = INSTEAD.get(case.effect, LINEAR if case.effect in LINEAR else (*LINEAR, case.effect))
    file = ModelFile(effects, settings={n: s for n, s in SETTINGS.items() if n in effects})
    first = fit_observations(seen, ModelFile(tuple(e for e in effects if e in LINEAR)))
    at = dict(zip(first.model.names, first.p, strict=True))
    model = fit_observations(seen, file).model
    sign = np.random.default_rng(4).choice([-1.0, 1.0], len(model.params))
    truth = np.array([at.get(n, _truth(n, q, s)) for n, q, s in zip(model.names, model.params, sign, strict=True)])
    truth = np.clip(truth, *model.bounds())
    assert seen.b_ut is not None
    clean = model.predict(seen.b_ut, truth, replace(seen.at, t0_s=float(np.asarray(seen.at.t_s)[0])))
    if case.reference == "constant":
        field = 50.0 * seen.b_ut / np.linalg.norm(seen.b_ut, axis=0)
        clean = model.predict(field, truth, replace(seen.at, t0_s=float(np.asarray(seen.at.t_s)[0])))
        seen = replace(seen, b_ut=None, reference="constant")
    return seen, file, truth, clean, model.names


def _truth(name: str, param, sign: float) -> float:
    size = next((v for stem, v in SIZES.items() if name.startswith(stem)), param.typical or 0.0)
    size *= 1.0 if param.inner else STRONG.get(name.split(".")[0], 2.0)
    if param.inner or param.lower >= 0.0:
        return 0.6 if name.endswith("share") else abs(size)
    return sign * size


def off(case: Case, seed: int) -> tuple[tuple[str, ...], np.ndarray]:
    """Names and (value - truth) / standard error of what one log with fresh noise gives."""
    seen, file, truth, clean, names = _prepared(case)
    rng = np.random.default_rng(seed)
    drawn = noise.draw(clean.shape[1], NOISE_LSB, CORNER if case.coloured else 0.0, rng)
    if case.effect == "outliers":
        drawn = drawn + 100.0 * NOISE_LSB * (rng.random(drawn.shape) < SPIKES) * rng.choice([-1, 1], drawn.shape)
    fit = fit_observations(replace(seen, y=clean + drawn), file)
    at = dict(zip(names, truth, strict=True))
    free = np.flatnonzero(fit.free)
    return tuple(fit.model.names[j] for j in free), np.array(
        [(fit.p[j] - at[fit.model.names[j]]) / fit.stderr[j] for j in free]
    )


def count(case: Case, seeds: range) -> Counted:
    """Over all logs of one case."""
    held: dict[str, list[bool]] = {}
    for seed in seeds:
        for name, z in zip(*off(case, seed), strict=True):
            held.setdefault(name, []).append(bool(abs(z) <= WIDE))
    own = {n: h for n, h in held.items() if n.split(".")[0] == case.effect} or held
    parts = {n: float(np.mean(h)) for n, h in own.items()}
    worst = min(parts, key=lambda n: parts[n])
    return Counted(case, sum(map(sum, own.values())), sum(map(len, own.values())), worst, parts[worst])


def cases() -> Iterator[Case]:
    """Every effect in white noise; then the basic ones in 1/f noise and against one magnitude."""
    for effect in STACK:
        yield Case(effect.name)
    for effect in STACK:
        yield Case(effect.name, coloured=True)
    for name in LINEAR:
        if name != "misalignment":
            yield Case(name, reference="constant")


def line(found: Counted) -> str:
    """One line of the table."""
    kind = f"{'1/f' if found.case.coloured else 'white'}, {found.case.reference}"
    return (
        f"{found.case.effect:24s} {kind:16s} {100 * found.part:6.1f} %   {found.worst} {100 * found.worst_part:.1f} %"
    )


def main() -> None:
    """Count and print."""
    parser = argparse.ArgumentParser(description="coverage of 95 % intervals")
    parser.add_argument("--logs", type=int, default=500, help="logs of each effect")
    parser.add_argument("--only", default="", help="one effect")
    chosen = parser.parse_args()
    began = time.perf_counter()
    plan = [case for case in cases() if chosen.only in ("", case.effect)]
    print(f"{'effect':24s} {'noise, reference':16s} {'held':>7s}    worst parameter   ({chosen.logs} logs each)")
    with ProcessPoolExecutor(os.cpu_count() or 1) as pool:
        for found in pool.map(count, plan, [range(chosen.logs)] * len(plan)):
            print(line(found), flush=True)
    print(f"{time.perf_counter() - began:.0f} s")


if __name__ == "__main__":
    main()
