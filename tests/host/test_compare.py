"""The comparison of model and measurement."""

import json

import numpy as np
import pytest
from barberpole.challenge.record import Recipe, record
from barberpole.diagnose import Comparison, compare
from barberpole.fit.fit import fit_log
from truth.trials import BASE, log_of, model_of


def comparison(recipe: Recipe) -> Comparison:
    return compare(fit_log(log_of(record(recipe)), model_of(BASE)))


def test_noise_alone_shows_no_pattern():
    said = comparison(Recipe({}, seed=1))
    assert said.patterns == ()
    assert said.noise_lsb == pytest.approx(2.0, rel=0.05)  # of every recipe
    assert set(said.rms_by_axis_lsb) == {"x", "y", "z"}


@pytest.mark.parametrize(
    ("effect", "against", "shape"),
    [
        ("quadratic", "field_x", "quadratic"),
        ("bias_temperature", "temp_c", "linear"),
        ("drift", "t_s", "linear"),
        ("triple", "field_x*field_y*field_z", "product"),
        ("load_current", "load_a", "linear"),
    ],
)
def test_a_pattern_is_named_by_its_covariate_and_shape(effect, against, shape):
    said = comparison(Recipe({effect: 2.0}, seed=2))
    on_x = [p for p in said.patterns if p.axis == "x"]
    assert on_x[0].against == against
    assert on_x[0].shape.startswith(shape)


def test_a_shape_says_how_large_it_is():
    said = comparison(Recipe({"drift": 2.0}, seed=2))
    shape = next(p.shape for p in said.patterns if p.against == "t_s" and p.axis == "x")
    kind, size = shape.split(", ")
    assert kind == "linear in time"
    curve = next(c for c in said.curves if (c.axis, c.against) == ("x", "t_s"))
    assert float(size.split()[0]) == pytest.approx(curve.mean_lsb[-1] - curve.mean_lsb[0], rel=0.15)  # of bin middles
    assert size.endswith("from 0 to 75 s")


@pytest.mark.parametrize("effect", ["quadratic", "flip_asymmetry", "triple", "ripple", "lag", "coil_coupling"])
def test_the_strongest_pattern_can_be_drawn(effect):
    said = comparison(Recipe({effect: 2.0}, seed=2))
    drawn = {(c.axis, c.against): c for c in said.curves}
    curve = drawn[said.patterns[0].axis, said.patterns[0].against]
    assert max(abs(m) / e for m, e in zip(curve.mean_lsb, curve.error_lsb, strict=True) if e > 0) > 5


@pytest.mark.parametrize("effect", ["cross_field", "flip_asymmetry"])
def test_a_group_of_products_is_drawn_against_its_best_combination(effect):
    said = comparison(Recipe({effect: 2.0}, form="pairs", seed=2))
    curve = next(c for c in said.curves if (c.axis, c.against) == ("x", "state*field"))
    slope, *_ = np.polyfit(curve.x, curve.mean_lsb, 1)
    assert slope == pytest.approx(1.0, abs=0.05)  # the group explains all there is
    assert "best combination" in curve.x_name


def test_a_rate_that_mostly_rests_is_drawn_where_it_moves():
    said = comparison(Recipe({"lag": 2.0}, seed=2))
    curve = next(c for c in said.curves if (c.axis, c.against) == ("x", "rate_x"))
    assert max(curve.x) > 20 > 1 > min(abs(x) for x in curve.x)


def test_curves_follow_the_distortion():
    said = comparison(Recipe({"bias_temperature": 2.0}, seed=3))
    curve = next(c for c in said.curves if (c.axis, c.against) == ("x", "temp_c"))
    slope, *_ = np.polyfit(curve.x, curve.mean_lsb, 1)
    assert abs(slope) > 5 * max(curve.error_lsb) / np.ptp(curve.x)


def test_everything_is_json():
    said = json.loads(json.dumps(comparison(Recipe({"cubic": 1.0}, reference="constant", seed=4)).to_json()))
    assert set(said["rms_by_axis_lsb"]) == {"norm"}
    assert said["rms_norm_percent"] > 0
    assert len(said["sphere"]["norm"]) == 12
    assert set(said["spectrum"]) == {"f_per_sample", "norm"}
