"""The composed model: order, states, derivatives, and the way back."""

import time
from dataclasses import dataclass, replace

import numpy as np
import pytest
from barberpole.effects import STACK, Conditions, Setup
from barberpole.errors import InputError
from barberpole.model import Model, compose

N = 60
SEVEN = (
    "misalignment",
    "cross_field",
    "sensitivity_temperature",
    "scale",
    "flip_asymmetry",
    "bias",
    "bias_temperature",
)
EVERY = tuple(e.name for e in STACK)
SETUP = Setup(flipping="raw", lsb_per_ut=3.0, duration_s=0.6, interval_s=0.01)


def numbers(model: Model, seed: int = 3) -> np.ndarray:
    """Parameters of the size that a real sensor shows."""
    rng = np.random.default_rng(seed)
    size = np.array([0.0 if p.inner else p.typical for p in model.params])
    return model.first + size * rng.uniform(0.5, 1.5, len(model.params))


def field(n: int = N) -> np.ndarray:
    return np.random.default_rng(1).uniform(-50, 50, (3, n))


def conditions(state=0.0, n: int = N) -> Conditions:
    rng = np.random.default_rng(2)
    return Conditions(
        state=np.broadcast_to(np.asarray(state, float), (n,)),
        t_s=np.cumsum(rng.uniform(0.005, 0.015, n)),
        temp_c=rng.uniform(10, 40, n),
        i_ma=rng.uniform(-5, 5, (3, n)),
        load_a=rng.uniform(0, 10, n),
        raw_polarity=True,
    )


def alternating(n: int = N) -> np.ndarray:
    return np.where(np.arange(n) % 2, -1.0, 1.0)


def pairs(n: int = N) -> tuple[np.ndarray, Conditions]:
    """Interleaved SET and RESET of n/2 rows: same field, same time."""
    at, b = conditions(alternating(n), n), np.repeat(field(n // 2), 2, axis=1)
    twice = {name: np.repeat(getattr(at, name)[..., ::2], 2, axis=-1) for name in ("t_s", "temp_c", "i_ma", "load_a")}
    return b, replace(at, **twice)


def test_effects_are_composed_in_physical_order():
    model = compose(("bias", "scale", "cross_field", "soft_iron"), SETUP)
    assert model.effects == ("soft_iron", "cross_field", "scale", "bias")
    assert model.names[:3] == ("soft_iron.xy", "soft_iron.xz", "soft_iron.yz")
    assert [t.at.start for t in model.terms] == [0, 3, 6, 9]


def test_an_alias_is_the_same_effect_once():
    assert compose(("hard_iron", "bias"), SETUP).effects == ("bias",)


def test_null_model_reports_the_field():
    model = compose(EVERY, Setup())
    assert np.array_equal(model.predict(field(), model.null, conditions()), field())


@pytest.mark.parametrize("names", [SEVEN, EVERY])
def test_demodulated_is_the_mean_of_set_and_reset(names):
    model = compose(names, SETUP)
    p = numbers(model)
    after_set, after_reset = (model.predict(field(), p, conditions(s)) for s in (1.0, -1.0))
    assert np.allclose(model.predict(field(), p, conditions(0.0)), 0.5 * (after_set + after_reset), rtol=1e-14)
    assert np.max(np.abs(after_set - after_reset)) > 1.0


def test_states_may_be_mixed_in_one_log():
    model = compose(SEVEN, SETUP)
    p, mixed = numbers(model), np.arange(N) % 3 - 1.0
    y = model.predict(field(), p, conditions(mixed))
    for state in (-1.0, 0.0, 1.0):
        rows = mixed == state
        assert np.allclose(y[:, rows], model.predict(field(), p, conditions(state))[:, rows], rtol=1e-14)


def test_unknown_state_may_be_taken_as_one_magnetisation():
    setups = {"cross_field": replace(SETUP, settings={"form": "unflipped"}), "scale": SETUP}
    model = compose(("cross_field", "scale"), setups)
    p = numbers(model)
    assert model.unflipped
    assert np.array_equal(model.predict(field(), p, conditions(0.0)), model.predict(field(), p, conditions(1.0)))


@pytest.mark.parametrize("state", [0.0, 1.0, alternating()])
@pytest.mark.parametrize("names", [SEVEN, EVERY])
def test_derivatives_by_parameters_meet_the_complex_step(names, state):
    model, at = compose(names, SETUP), conditions(state)
    p = numbers(model)
    y, columns, _ = model.linearise(field(), p, at)
    assert np.allclose(y, model.predict(field(), p, at), rtol=1e-14)
    for j in range(len(p)):
        moved = p.astype(complex)
        moved[j] += 1e-30j
        step = model.predict(field(), moved, at).imag / 1e-30
        assert np.max(np.abs(columns[:, j] - step)) <= 1e-11 * np.max(np.abs(step)), model.names[j]


@pytest.mark.parametrize("state", [0.0, 1.0, alternating()])
def test_derivatives_by_field_meet_the_complex_step(state):
    model, at = compose(EVERY, SETUP).still, conditions(state)
    p = numbers(compose(EVERY, SETUP))
    slope = model.linearise(field(), p, at, field_too=True)[2]
    assert slope is not None
    for j in range(3):
        moved = field() + 1e-30j * np.eye(3)[:, j, None]
        assert np.max(np.abs(slope[:, j] - model.predict(moved, p, at).imag / 1e-30)) < 1e-11


@pytest.mark.parametrize("state", [0.0, 1.0, -1.0, alternating()])
@pytest.mark.parametrize("names", [("scale",), SEVEN, EVERY])
def test_invert_finds_the_field(names, state):
    model, at = compose(names, SETUP), conditions(state)
    p = numbers(model)
    back = model.invert(model.predict(field(), p, at), p, at)
    assert np.max(np.abs(back - field())) < 1e-9  # undoing the lag multiplies rounding by tau over the time step


def test_invert_of_an_impossible_reading_is_not_a_number():
    model = compose(("saturation",), SETUP)
    p = np.full(3, model.bounds()[1][0])
    found = model.invert(np.full((3, 2), [1.0, 1e6]), p, conditions(n=2))
    assert np.isfinite(found[:, 0]).all()
    assert np.isnan(found[:, 1]).all()


def test_memory_of_pairs_runs_in_each_state_apart():
    """A row's SET and RESET readings follow the same field, and neither is the other's past."""
    model = compose(("lag", "hysteresis", "scale"), SETUP)
    p = numbers(model)
    b, at = pairs()
    single = Conditions(t_s=at.t_s[::2])
    rows = model.predict(b[:, ::2], p, single)
    assert np.array_equal(model.predict(b, p, at), np.repeat(rows, 2, axis=1))
    assert model.memory
    assert model.still.effects == ("scale",)


@pytest.mark.parametrize("names", [("scale", "bias"), SEVEN, ("lag", *SEVEN)])
def test_pairs_are_undone_exactly(names):
    model = compose(names, SETUP)
    p = numbers(model)
    b, at = pairs()
    y = model.predict(b, p, at)
    assert np.max(np.abs(model.invert(y, p, at) - b)) < 1e-9
    rows = replace(at, t_s=at.t_s[::2], temp_c=at.temp_c[::2], i_ma=None, load_a=None, state=0.0)
    back = model.undo_pair(tuple(y[:, 0::2]), tuple(y[:, 1::2]), p, rows)
    assert np.max(np.abs(np.asarray(back) - b[:, ::2])) < 1e-9


def test_gain_of_today_is_undone_where_it_entered():
    model = compose(SEVEN, SETUP)
    p, at = numbers(model), replace(conditions(1.0), gain=(1.03, 0.98, 1.01))
    y = model.predict(field(), p, at)
    assert np.max(np.abs(np.asarray(model.undo(tuple(y), p, at)) - field())) < 1e-11
    assert np.max(np.abs(np.asarray(model.undo(tuple(y), p, conditions(1.0))) - field())) > 0.5


def test_coil_field_acts_on_its_own_die_only():
    model = compose(("cross_field", "scale"), SETUP)
    p = numbers(model)
    coil = np.array([40.0, -30.0, 20.0])
    at = replace(conditions(1.0), coil_ut=coil)
    y = model.predict(field(), p, at)
    # the die's own field is ambient plus coil; along its easy axis there is the ambient alone
    k, own, easy = p[0], field()[0] + coil[0], field()[1]
    angle = np.arcsin(y[0] / p[3] * 2.0 * k) / 2.0
    assert np.allclose(np.sin(angle) * np.cos(angle), k * (own * np.cos(angle) - easy * np.sin(angle)), atol=1e-13)
    assert np.max(np.abs(np.asarray(model.undo(tuple(y), p, at)) - field())) < 1e-11


@dataclass(frozen=True)
class Symbol:
    """Stands for the generator's symbols: not a number."""


def test_what_the_board_cannot_undo_is_refused_for_symbols():
    model = compose(("lag", "scale"), SETUP)
    with pytest.raises(
        InputError, match="a model for the board must be of effects that it can undo; got lag, and its undo"
    ):
        compose(("lag",), SETUP).undo((Symbol(),) * 3, [0.1, 0.1, 0.1], Conditions())
    assert np.shape(model.undo(tuple(field()), numbers(model), conditions(1.0))) == (3, N)


@pytest.mark.bench
def test_speed_of_derivatives_and_inverse(capsys: pytest.CaptureFixture):
    """100 000 rows, seven effects, 30 parameters, as a multiple of one plain linear least-squares fit of them."""
    n, model = 100_000, compose(SEVEN, SETUP)
    p, b, at = numbers(model), field(n), conditions(n=n)
    chunks = [slice(first, min(first + 4096, n)) for first in range(0, n, 4096)]
    y = model.predict(b, p, at)
    plain = _seconds(lambda: np.linalg.lstsq(np.vstack([b, np.ones(n)]).T, y.T, rcond=None))
    slopes = _seconds(lambda: [model.linearise(b[:, r], p, at.take(r)) for r in chunks])
    back = _seconds(lambda: [model.invert(y[:, r], p, at.take(r)) for r in chunks])
    with capsys.disabled():
        print(f"\nderivatives {slopes / plain:.1f}, inverse {back / plain:.1f} of a plain fit ({1e3 * plain:.0f} ms)")
    assert slopes < 50 * plain
    assert back < 80 * plain


def _seconds(work, times: int = 3) -> float:
    spent = []
    for _ in range(times):
        began = time.perf_counter()
        work()
        spent.append(time.perf_counter() - began)
    return min(spent)
