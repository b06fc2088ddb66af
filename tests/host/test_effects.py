"""Every effect of the catalogue, held against its own contract."""

import dataclasses
import itertools
from pathlib import Path

import numpy as np
import pytest
from barberpole.chain import full
from barberpole.effects import ALIASES, STACK, Conditions, Effect, Setup, find_effect, in_order
from barberpole.effects.arithmetic import Bare
from barberpole.effects.effect import spread
from barberpole.errors import InputError

CATALOGUE = """
    bias scale misalignment soft_iron cross_field quadratic cubic saturation flip_asymmetry bias_temperature
    sensitivity_temperature drift lag hysteresis mains load_current coil_coupling coil_heating adc_inl outliers
"""

SETTINGS = {
    "soft_iron": ({"diagonal": True},),
    "lag": ({"axes": "common"},),
    "hysteresis": ({"plays": 3},),
    "bias_temperature": ({"order": 2},),
    "sensitivity_temperature": ({"order": 3},),
    "drift": ({"order": 2},),
    "coil_heating": ({"tau_s": 0.3, "share": 0.5},),
    "adc_inl": ({"form": "ripple", "harmonics": 3}, {"form": "ripple", "period_lsb": 16.0}),
    "mains": ({"frequency_hz": 7.3},),
}
N = 40

# Undoing costs a few roundings of numbers up to 150 LSB; lag divides by time steps of a tenth of tau.
UNDONE = 1e-11
SLOPES = 1e-11


def setups(effect: Effect):
    """Every list of parameters that the effect can have."""
    for reference, flipping in itertools.product(("vector", "constant"), ("none", "corrected", "raw")):
        for settings in ({}, *SETTINGS.get(effect.name, ())):
            yield Setup(settings, reference, flipping, lsb_per_ut=3.0, duration_s=0.5, interval_s=0.0125)


def conditions(flipping: str, n: int = N) -> Conditions:
    """Samples at irregular times, some repeated, with everything logged."""
    rng = np.random.default_rng(5)
    t = np.cumsum(rng.uniform(0.005, 0.02, n))
    t[7:10] = t[10]
    state = rng.choice([-1.0, 1.0], n) if flipping != "none" else 1.0
    return Conditions(
        state=state,
        t_s=t,
        temp_c=rng.uniform(10, 40, n),
        i_ma=rng.uniform(-5, 5, (3, n)),
        load_a=rng.uniform(0, 10, n),
        coil_ut=np.array([30.0, -20.0, 10.0]),
        raw_polarity=flipping == "raw",
    )


def fields(n: int = N) -> np.ndarray:
    return np.random.default_rng(6).uniform(-50, 50, (3, n))


def values(effect: Effect, setup: Setup) -> np.ndarray:
    """Parameters away from the null, of the size that a real sensor shows."""
    rng = np.random.default_rng(7)
    params = effect.params(setup)
    sizes = np.array([p.typical or 0.0 for p in params]) * rng.uniform(0.5, 1.5, len(params))
    return np.array([p.null if p.inner else p.null + size for p, size in zip(params, sizes, strict=True)])


def nulls(effect: Effect, setup: Setup) -> np.ndarray:
    return np.array([p.null for p in effect.params(setup)])


EVERY = [pytest.param(e, s, id=f"{e.name}-{i}") for e in STACK for i, s in enumerate(setups(e))]


def test_names_are_the_catalogue():
    assert sorted(e.name for e in STACK) == sorted(CATALOGUE.split())
    assert find_effect("hard_iron").name == ALIASES["hard_iron"] == "bias"


def test_every_effect_says_what_it_is():
    for effect in STACK:
        assert effect.equation, effect.name
        assert effect.source, effect.name
        assert effect.summary, effect.name
        assert not effect.summary.endswith("."), effect.name


def test_every_effect_has_its_page():
    page = (Path(__file__).parents[2] / "host/docs/physics.md").read_text()
    assert [line[4:] for line in page.splitlines() if line.startswith("### ")] == [e.name for e in STACK]


def test_unknown_name_is_refused_with_the_known_ones():
    with pytest.raises(InputError, match=r"effect must be one of soft_iron, .*; got 'gremlins'"):
        find_effect("gremlins")


@pytest.mark.parametrize(("effect", "setup"), EVERY)
def test_null_is_exactly_the_identity(effect: Effect, setup: Setup):
    at, field = conditions(setup.flipping), fields()
    if effect.name == "cross_field":
        at = dataclasses.replace(at, coil_ut=np.zeros(3))
    out = np.asarray(effect.forward(field, nulls(effect, setup), at))
    assert np.array_equal(np.broadcast_to(out, field.shape), field)


@pytest.mark.parametrize(("effect", "setup"), EVERY)
def test_undo_is_the_inverse(effect: Effect, setup: Setup):
    at, field, p = conditions(setup.flipping), fields(), values(effect, setup)
    assert effect.undo is not None
    back = effect.undo(tuple(np.asarray(effect.forward(field, p, at))), p, at)
    assert np.max(np.abs(np.asarray(back) - field)) < UNDONE


@pytest.mark.parametrize(("effect", "setup"), EVERY)
def test_slopes_meet_the_complex_step(effect: Effect, setup: Setup):
    at, field = conditions(setup.flipping), fields()
    for p in (values(effect, setup), nulls(effect, setup)):
        out, d_in, d_p = effect.linearise(field, p, at)
        step_in, step_p = effect.complex_step(field, p, at)
        assert np.allclose(out, np.asarray(effect.forward(field, p, at)), rtol=1e-14, atol=0)
        by_p = np.broadcast_to(spread(d_p) if d_p.ndim == 2 else d_p, step_p.shape)
        assert np.all(np.abs(by_p - step_p) <= SLOPES * np.max(np.abs(step_p), axis=(0, 2), keepdims=True))
        if effect.tangent is None:
            by_in = full(np.ones((3, 1)) if d_in is None else d_in, N)
            assert np.max(np.abs(by_in - step_in)) < SLOPES


@pytest.mark.parametrize(("effect", "setup"), [e for e in EVERY if e.values[0].tangent])
def test_tangent_carries_derivatives_of_the_whole_series(effect: Effect, setup: Setup):
    at, field, p = conditions(setup.flipping), fields(), values(effect, setup)
    chain = np.random.default_rng(8).normal(size=(3, 4, N))
    carried = effect.tangent(field, p, at, chain)
    for k in range(4):
        step = np.asarray(effect.forward(field + 1e-30j * chain[:, k], p, at)).imag / 1e-30
        assert np.max(np.abs(carried[:, k] - step)) < SLOPES
    assert np.array_equal(effect.tangent(field, nulls(effect, setup), at, chain), chain)


@pytest.mark.parametrize(("effect", "setup"), EVERY)
def test_bounds_contain_null_start_and_typical(effect: Effect, setup: Setup):
    for p in effect.params(setup):
        assert p.lower <= p.null <= p.upper, p.name
        assert p.lower <= p.first <= p.upper, p.name
        assert p.typical, p.name
        size = p.typical if p.inner else p.null + p.typical
        assert p.lower <= size <= p.upper, p.name


@pytest.mark.parametrize(("effect", "setup"), EVERY)
def test_shapes_name_their_own_parameters(effect: Effect, setup: Setup):
    for shape in effect.forms(setup):
        asked = dataclasses.replace(setup, settings={**setup.settings, **shape.settings})
        names = {p.name: p for p in effect.params(asked)}
        assert set(shape.columns) <= set(names)
        assert set(shape.inner) <= {n for n, p in names.items() if p.inner}
        for name, value in shape.inner.items():
            assert names[name].lower <= value <= names[name].upper


@pytest.mark.parametrize(("effect", "setup"), [e for e in EVERY if e.values[0].compilable])
def test_undo_needs_arithmetic_only(effect: Effect, setup: Setup):
    """What the firmware generator traces gives the same numbers as the arrays."""
    p = [float(v) for v in values(effect, setup)]
    field, gain, coil = (31.0, -22.0, 40.0), (1.02, 0.97, 1.01), (5.0, -8.0, 13.0)
    for state in (1.0, -1.0):
        at = Conditions(state=state, temp_c=33.0, gain=gain, coil_ut=coil)
        plain = effect.undo(field, p, at)
        bare = dataclasses.replace(at, temp_c=Bare(33.0), gain=tuple(map(Bare, gain)), coil_ut=tuple(map(Bare, coil)))
        traced = effect.undo(tuple(map(Bare, field)), p, bare)
        assert [v.value for v in traced] == pytest.approx([float(v) for v in plain], rel=1e-13)


def test_what_cannot_be_compiled_says_why():
    left_out = {e.name for e in STACK if not e.compilable}
    assert left_out == {"lag", "hysteresis", "drift", "mains", "load_current", "adc_inl"}
    assert all(e.off_board for e in STACK if not e.compilable)


@pytest.mark.parametrize(
    ("name", "settings"),
    [
        ("lag", {"axes": "both"}),
        ("drift", {"order": 0}),
        ("drift", {"order": 1.5}),
        ("hysteresis", {"plays": 99}),
        ("adc_inl", {"form": "wavy"}),
        ("cross_field", {"form": "flopped"}),
    ],
)
def test_settings_are_checked(name: str, settings: dict):
    with pytest.raises(InputError, match=f"setting {next(iter(settings))} must be"):
        find_effect(name).params(Setup(settings))


def test_a_users_effect_takes_its_place():
    own = Effect("own", "", "", lambda setup: (), lambda xyz, p, at: xyz)
    late = dataclasses.replace(own, name="late", stage="reading")
    names = [e.name for e in in_order((late, own))]
    assert names.index("own") == names.index("cross_field") - 1
    assert names[-1] == "late"
