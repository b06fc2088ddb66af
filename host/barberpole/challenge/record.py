"""A recording of the independent truth, as columns of the log contract or as a CSV file."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from barberpole.challenge import motion, noise
from barberpole.challenge.world import Hidden, Scene, reading, strength_for
from barberpole.files import write_atomic
from barberpole.log_formats import write_csv

FS_HZ = 40.0
REST_S = 60.0


@dataclass(frozen=True)
class Recipe:
    """What to record. hidden: effect -> raw RMS over the noise RMS. corner: of the 1/f noise, as a part of fs.

    resting: samples at the start in which the sensor lies still.
    """

    hidden: dict[str, float]
    rows: int = 3000
    reference: str = "vector"  # magnitude | constant
    form: str = "flips"  # demodulated | unflipped | pairs
    corner: float = 0.0
    lsb_per_ut: float = 10.0
    noise_ut: float = 0.2
    planar: bool = False
    smooth: bool = False
    resting: int = 0
    still_temperature: bool = False
    seed: int = 0


def scene_of(recipe: Recipe, rows: int) -> Scene:
    """The scene a recipe asks for."""
    rng = np.random.default_rng(recipe.seed)
    turn = motion.planar if recipe.planar else motion.smooth if recipe.smooth else motion.directions
    field = 50.0 * turn(rows, rng)
    field[:, : recipe.resting] = field[:, recipe.resting, None]
    if recipe.reference == "vector" and not recipe.planar:
        field = field * np.repeat(rng.uniform(0.6, 1.2, rows // 100 + 1), 100)[:rows]
    temp = (
        np.full(rows, 25.0) + 0.02 * rng.normal(size=rows)
        if recipe.still_temperature
        else motion.temperature(rows, rng)
    )
    worked = motion.cycled(rows, rng)  # the coils work and rest, so that their heat comes and goes
    coil = worked * np.stack([20.0 * motion.switched(rows, 5, rng) - 10.0 for _ in range(3)])
    factors = rng.choice([-1.0, 1.0], (20, 3)) * rng.uniform(0.6, 1.4, (20, 3))
    factors[0] = 1.0 + 0.1 * rng.normal(size=3)  # anisotropy fields of one wafer are alike
    return Scene(
        field,
        _state(recipe.form, rows),
        temp,
        np.arange(rows) / FS_HZ,
        motion.switched(rows, 4, rng),
        coil,
        FS_HZ,
        factors,
        recipe.seed,
    )


def _state(form: str, rows: int) -> np.ndarray:
    if form == "flips":
        return np.where(np.arange(rows) // 25 % 2 == 0, 1.0, -1.0)
    if form == "pairs":
        return np.where(np.arange(rows) % 2 == 0, 1.0, -1.0)
    return np.full(rows, 1.0 if form == "unflipped" else 0.0)


def record(recipe: Recipe) -> dict[str, np.ndarray]:
    """Columns of the recording."""
    rows = 2 * recipe.rows if recipe.form == "pairs" else recipe.rows
    scene = scene_of(recipe, rows)
    if recipe.form == "pairs":
        scene = _pairwise(scene)
    strengths: Hidden = {k: strength_for(k, v * recipe.noise_ut, scene) for k, v in recipe.hidden.items()}
    rng = np.random.default_rng(recipe.seed + 10_000_000)
    true = reading(scene, strengths) + noise.draw(scene.n, recipe.noise_ut, recipe.corner, rng)
    gain = recipe.lsb_per_ut * rng.uniform(0.85, 1.15, 3)
    bias = recipe.lsb_per_ut * rng.uniform(-15, 15, 3)
    return _columns(recipe, scene, gain[:, None] * true + bias[:, None])


def _pairwise(scene: Scene) -> Scene:
    """SET and RESET of one row see the same field, temperature and currents."""
    first = np.arange(scene.n) // 2 * 2
    return replace(
        scene,
        field_ut=scene.field_ut[:, first],
        temp_c=scene.temp_c[first],
        load_a=scene.load_a[first],
        i_ma=scene.i_ma[:, first],
        raw=True,
    )


def _columns(recipe: Recipe, scene: Scene, y: np.ndarray) -> dict[str, np.ndarray]:
    every = slice(None, None, 2) if recipe.form == "pairs" else slice(None)
    out = {"t_s": scene.t_s[every]}
    for i, a in enumerate("xyz"):
        if recipe.form == "pairs":
            out[f"{a}_set_lsb"], out[f"{a}_reset_lsb"] = y[i, ::2], -y[i, 1::2]
        else:
            out[f"{a}_lsb"] = y[i]
    if recipe.form in ("flips", "demodulated"):
        out["state"] = scene.state
    if recipe.reference == "vector":
        out |= {f"b{a}_ut": scene.field_ut[i, every] for i, a in enumerate("xyz")}
    if recipe.reference == "magnitude":
        out["b_ut"] = np.linalg.norm(scene.field_ut, axis=0)[every]
    out |= {"temp_c": scene.temp_c[every], "load_a": scene.load_a[every]}
    return out | {f"i{a}_ma": scene.i_ma[i, every] for i, a in enumerate("xyz")}


def rest(recipe: Recipe, slower: int = 1) -> dict[str, np.ndarray]:
    """60 s of the same sensor lying still, or `slower` times as long at a rate so much lower (every n-th sample)."""
    n = int(REST_S * FS_HZ) * slower
    rng = np.random.default_rng(recipe.seed + 20_000_000)
    y = recipe.lsb_per_ut * (noise.draw(n, recipe.noise_ut, recipe.corner, rng) + np.array([[20.0], [-10.0], [40.0]]))
    y = y[:, ::slower]
    return {"t_s": np.arange(n)[::slower] / FS_HZ} | {f"{a}_lsb": y[i] for i, a in enumerate("xyz")}


def write(columns: dict[str, np.ndarray], path: Path) -> Path:
    """The columns as CSV. Raises InputError as `write_atomic`."""
    write_atomic(path, write_csv(columns))
    return path
