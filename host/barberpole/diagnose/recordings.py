"""Recordings that could be made next, each simulated from the log's own fitted model: conditions and fields, no noise.

All are of ROWS samples. What a recording does not change stays as in the log: the way it is flipped, its mean
temperature, no load and no coil current, fields of the log's own size, slow turns through all directions.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from barberpole.effects import Conditions
from barberpole.fit.fit import Fit
from barberpole.observations import Observations

ROWS = 400
FLIPPED = 25  # samples between two flips
HELD = 20  # samples of a station
WARMER_K = 10.0
WARMING_S = 1200.0
LATER_S = 3600.0
LOAD_A, COIL_MA = 10.0, 10.0  # where the log holds none
OFF_MULTIPLES = 1.137  # ratio of sampling intervals


@dataclass(frozen=True)
class Scene:
    """One recording: field (3, ROWS) in µT, conditions, whether the field vectors are known; load and coil currents
    that can be had."""

    field: np.ndarray
    at: Conditions
    known: bool
    load_a: float = LOAD_A
    coil_ma: float = COIL_MA


@dataclass(frozen=True)
class Recording:
    """What to do, in words, and how that changes the scene of an ordinary recording."""

    words: str
    change: Callable[[Scene], Scene]


def directions(turns: int = 8) -> np.ndarray:
    """(3, ROWS): a slow spiral from pole to pole and about."""
    z = np.linspace(1.0, -1.0, ROWS)
    angle = 2 * np.pi * turns * np.linspace(0, 1, ROWS)
    flat = np.sqrt(1.0 - z * z)
    return np.stack([flat * np.cos(angle), flat * np.sin(angle), z])


def ordinary(fit: Fit) -> Scene:
    """More of the same: a tumble under the log's own conditions, after its end."""
    seen = fit.problem.seen
    at, size = seen.at, float(np.mean(np.linalg.norm(_field(fit), axis=0)))
    state = np.resize(np.broadcast_to(np.asarray(at.state, float), (seen.y.shape[1],)), ROWS)
    step, end = 1.0, float(seen.y.shape[1])
    if at.t_s is not None:
        step, end = float(np.ptp(at.t_s)) / max(at.t_s.size - 1, 1), float(at.t_s[-1])
    calm = replace(
        at,
        state=state,
        t_s=None if at.t_s is None else end + step * np.arange(1, ROWS + 1),
        temp_c=None if at.temp_c is None else np.full(ROWS, float(np.mean(at.temp_c))),
        i_ma=None if at.i_ma is None else np.zeros((3, ROWS)),
        load_a=None if at.load_a is None else np.zeros(ROWS),
        supply_v=None if at.supply_v is None else np.full(ROWS, float(np.mean(at.supply_v))),
    )
    return Scene(size * directions(), calm, fit.problem.vector, _most(at.load_a, LOAD_A), _most(at.i_ma, COIL_MA))


def _most(values: np.ndarray | None, otherwise: float) -> float:
    """The largest magnitude logged."""
    return otherwise if values is None else float(np.max(np.abs(values))) or otherwise


def _field(fit: Fit) -> np.ndarray:
    seen = fit.problem.seen
    return fit.field() if seen.b_ut is None else seen.b_ut


def observed(fit: Fit, scene: Scene) -> Observations:
    """What the fitted model would report of a scene."""
    y = fit.model.predict(scene.field, fit.p, scene.at)
    size = None if scene.known else np.linalg.norm(scene.field, axis=0)
    kind = "vector" if scene.known else "magnitude"
    b_ut = scene.field if scene.known else None
    return Observations(y, scene.at, b_ut, size, np.arange(ROWS), kind, scene.at.raw_polarity)


def recordings(fit: Fit) -> list[Recording]:
    """Those that this sensor and this log allow."""
    at = fit.problem.seen.at
    found = [
        Recording("turn through all directions with SET and RESET readings in turns", _flips),
        Recording("log x_set_lsb .. z_reset_lsb as they come, RESET with its own sign, while turning", _as_they_come),
        Recording("record at half and at one and a half times the field as well, its magnitude logged", _magnitudes),
        Recording("keep the sensor still for a minute", _still),
        Recording("sweep the field up and down to different turning points, slowly", _sweep),
        Recording("step between orientations and hold each instead of turning smoothly", _holds),
        *(Recording(f"turn about the {a} axis", _about(i)) for i, a in enumerate("xyz")),
    ]
    if not fit.problem.vector:
        found.append(Recording("apply known field vectors and log them (bx_ut, by_ut, bz_ut)", _known))
    if at.t_s is not None:
        found.append(Recording("record once more an hour later at the same temperature", _later))
        found.append(Recording("sample at a rate that is no multiple or part of the mains frequency", _off_multiples))
    if at.temp_c is not None and at.t_s is not None:
        found.append(Recording("warm the sensor by 10 K and let it come back, twice, while turning it", _warm))
    if at.load_a is not None:
        found.append(Recording("switch the load on and off at several orientations", _load))
    if at.i_ma is not None:
        found.append(Recording("step each coil's current in turn, up and down", _coils))
        found.append(Recording("hold a large current in all coils for a minute, then none for a minute", _heat))
    return found


def _flips(s: Scene) -> Scene:
    return replace(s, at=replace(s.at, state=np.where(np.arange(ROWS) // FLIPPED % 2 == 0, 1.0, -1.0)))


def _as_they_come(s: Scene) -> Scene:
    return replace(s, at=replace(_flips(s).at, raw_polarity=True))


def _magnitudes(s: Scene) -> Scene:
    return replace(s, field=s.field * np.where(np.arange(ROWS) // 10 % 2 == 0, 0.5, 1.5))


def _still(s: Scene) -> Scene:
    return replace(s, field=np.repeat(s.field[:, ROWS // 3, None], ROWS, axis=1))


def _sweep(s: Scene) -> Scene:
    """Along one diagonal, to turning points that grow and shrink."""
    phase = np.linspace(0, 8.0, ROWS)
    triangle = 2.0 * np.abs(2.0 * (phase - np.floor(phase + 0.5))) - 1.0
    reach = 0.4 + 0.6 * np.abs(np.sin(phase))
    size = np.linalg.norm(s.field[:, 0])
    return replace(s, field=size * triangle * reach * np.array([[0.6], [-0.5], [0.62]]))


def _holds(s: Scene) -> Scene:
    order = np.random.default_rng(0).permutation(ROWS)[: ROWS // HELD]
    return replace(s, field=np.repeat(s.field[:, order], HELD, axis=1))


def _about(axis: int) -> Callable[[Scene], Scene]:
    def turned(s: Scene) -> Scene:
        angle = np.linspace(0, 6 * np.pi, ROWS)
        ring = [np.full(ROWS, 0.5), np.sqrt(0.75) * np.cos(angle), np.sqrt(0.75) * np.sin(angle)]
        return replace(s, field=np.linalg.norm(s.field[:, 0]) * np.stack([ring[(i - axis) % 3] for i in range(3)]))

    return turned


def _known(s: Scene) -> Scene:
    return replace(s, known=True)


def _later(s: Scene) -> Scene:
    return replace(s, at=replace(s.at, t_s=np.asarray(s.at.t_s) + LATER_S))


def _off_multiples(s: Scene) -> Scene:
    t_s = np.asarray(s.at.t_s)
    return replace(s, at=replace(s.at, t_s=t_s[0] + OFF_MULTIPLES * (t_s - t_s[0])))


def _warm(s: Scene) -> Scene:
    phase = np.linspace(0, 4 * np.pi, ROWS)
    warmer = np.asarray(s.at.temp_c) + 0.5 * WARMER_K * (1.0 - np.cos(phase))
    t_s = np.asarray(s.at.t_s)[0] + np.linspace(0, 2 * WARMING_S, ROWS)
    return replace(s, at=replace(s.at, temp_c=warmer, t_s=t_s))


def _load(s: Scene) -> Scene:
    return replace(s, at=replace(s.at, load_a=s.load_a * (np.arange(ROWS) // HELD % 2)))


def _coils(s: Scene) -> Scene:
    place = np.arange(ROWS) // HELD
    level = s.coil_ma * np.array([-1.0, 1.0, 0.5, -0.5])[place // 3 % 4]
    return replace(s, at=replace(s.at, i_ma=np.stack([level * (place % 3 == i) for i in range(3)])))


def _heat(s: Scene) -> Scene:
    t_s = None if s.at.t_s is None else s.at.t_s[0] + np.linspace(0, 240.0, ROWS)
    level = s.coil_ma * (np.arange(ROWS) // (ROWS // 4) % 2 == 0)
    return replace(s, at=replace(s.at, i_ma=np.tile(level, (3, 1)), t_s=t_s))
