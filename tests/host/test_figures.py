"""Pictures: they answer in their title, keep the peaks that they thin out, and look the same to every eye."""

import json

import numpy as np
import plotly.graph_objects as go
import pytest
from barberpole.calibration import Step, Value
from barberpole.challenge.record import Recipe, record
from barberpole.diagnose import compare, diagnose
from barberpole.figures import (
    DARK,
    LIGHT,
    Stage,
    coverage,
    gains,
    parameters,
    points,
    residual_against,
    residual_axes,
    residual_curves,
    residual_spectrum,
    sphere,
    stages_of_diagnosis,
    stages_of_history,
    suspects,
    traces,
    waterfall,
)
from barberpole.figures.decimate import extremes, scattered
from barberpole.figures.theme import AXES, DARK_GROUND, GREY, LIGHT_GROUND
from barberpole.fit.fit import fit_log
from barberpole.numbers import plain, signed, strict, uncertain
from truth.trials import BASE, log_of, model_of

NO_UNIT = ("axis", "suspect", "point", "power-up", "")  # names and counts


@pytest.fixture(scope="module")
def bent():
    """A log whose y answers with a square: fit, comparison, diagnosis."""
    log = log_of(record(Recipe({"quadratic": 4.0}, seed=2)))
    fit = fit_log(log, model_of(BASE))
    return fit, compare(fit), diagnose(log, model_of(BASE))


@pytest.fixture(scope="module")
def all_figures(bent):
    """One of each kind."""
    fit, found, said = bent
    seen = fit.problem.seen
    left = fit.problem.residual(fit.p)
    values = {"bias.x": Value(3.0, 0.1, "LSB"), "bias.y": Value(-0.1, 0.1, "LSB")}
    return [
        traces(seen.at.t_s, seen.y, seen.y - left),
        residual_axes(found.rms_by_axis_lsb, found.noise_lsb),
        residual_against(left, seen.b_ut[1], "the y field, µT", noise_lsb=2.0, pattern=found.patterns[0]),
        residual_curves(found, "field_x*field_y"),
        residual_spectrum(found),
        sphere(found.sphere),
        coverage(seen.b_ut),
        suspects(said),
        waterfall(stages_of_diagnosis(said), said.noise_lsb),
        parameters(values),
        parameters(values, {"bias.x": Value(2.0, 0.1, "LSB")}),
        gains(["a", "b"], np.array([[1.01, 1.0, 1.0], [1.02, 1.0, 0.99]]), 0.05),
        points(np.ones((3, 20))),
    ]


def test_every_figure_says_what_it_shows_in_words(all_figures):
    for figure in all_figures:
        assert isinstance(figure.plot, go.Figure)
        assert len(figure.title) > 10
        assert figure.sentence.endswith(".")
        assert "nan" not in figure.title + figure.sentence


def test_every_axis_has_a_name_and_every_figure_a_fixed_height(all_figures):
    for figure in all_figures:
        layout = figure.plot.to_plotly_json()["layout"]
        assert layout["height"] == figure.height > 100
        named = [axis["title"]["text"] for name, axis in layout.items() if "axis" in name and "title" in axis]
        assert named, figure.title
        assert all(
            any(c in name for c in ",°") or name in ("axis", "suspect", "point", "power-up", "") for name in named
        )


def test_the_ground_changes_the_template_and_nothing_else(all_figures):
    for figure in all_figures:
        dark = figure.on(dark=True)
        assert dark.plot.layout.template.layout.font.color == DARK_GROUND.ink
        assert figure.plot.layout.template.layout.font.color == LIGHT_GROUND.ink
        drawn = [json.loads(one.plot.to_json())["data"] for one in (dark, figure)]
        assert drawn[0] == drawn[1]
    assert DARK != LIGHT


def luminance(colour: str) -> float:
    """Relative luminance of #rrggbb (WCAG 2.2)."""
    parts = [int(colour[at : at + 2], 16) / 255 for at in (1, 3, 5)]
    linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in parts]
    return float(np.dot((0.2126, 0.7152, 0.0722), linear))


def contrast(one: str, other: str) -> float:
    high, low = sorted((luminance(one), luminance(other)), reverse=True)
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("ground", [LIGHT_GROUND, DARK_GROUND])
def test_contrast_is_enough_on_both_grounds(ground):
    for colour in (*(how.colour for how in AXES.values()), GREY):
        assert contrast(colour, ground.paper) >= 3.0  # WCAG 1.4.11: graphics
    for letters in (ground.ink, ground.quiet):
        assert contrast(letters, ground.paper) >= 4.5  # WCAG 1.4.3: text
        assert contrast(letters, ground.raised) >= 4.5


def test_axes_differ_by_more_than_hue():
    shapes = [(how.symbol, how.dash) for name, how in AXES.items() if name in "xyz"]
    assert len({symbol for symbol, _ in shapes}) == len({dash for _, dash in shapes}) == 3


def test_thinning_keeps_peaks_and_order():
    y = np.random.default_rng(0).normal(size=1_000_000)
    y[123_456], y[777_777] = 50.0, -60.0
    for pick in (extremes, scattered):
        at = pick(y)
        assert at.size <= 1700
        assert np.all(np.diff(at) > 0)
        assert {123_456, 777_777} <= set(at.tolist())
        assert np.array_equal(pick(y[:100]), np.arange(100))


def test_a_cloud_keeps_its_spread():
    y = np.random.default_rng(1).normal(size=200_000)
    kept = y[scattered(y)]
    assert np.median(np.abs(kept)) == pytest.approx(np.median(np.abs(y)), rel=0.15)  # giants are a twentieth


def test_a_picture_of_a_million_rows_is_small():
    n = 1_000_000
    t, y = np.arange(n) / 100.0, np.random.default_rng(2).normal(size=(3, n))
    assert len(traces(t, y, 0.9 * y).plot.to_json()) < 400_000
    assert len(residual_against(y, y[0], "the x field, µT").plot.to_json()) < 400_000


def test_what_a_magnitude_leaves_is_a_share_of_it_and_not_of_its_scatter():
    t = np.arange(1000.0)
    norm = 50.0 + 0.5 * np.sqrt(2.0) * np.sin(t)
    drawn = traces(t, norm[None], np.full((1, 1000), 50.0), ("norm",), "µT")
    assert drawn.title == "The model leaves 1 % of the field"
    assert "the field is 50 µT" in drawn.sentence
    assert "90" not in traces(t, norm[None], norm[None] - 0.001, ("norm",), "µT").title


def test_the_pattern_is_the_title_and_the_means_follow_it(bent):
    fit, found, _ = bent
    pattern = found.patterns[0]
    figure = residual_against(fit.problem.residual(fit.p), fit.problem.seen.b_ut[1], "the y field, µT", pattern=pattern)
    assert figure.title == f"{pattern.axis} fails against {pattern.against}: {pattern.shape}"
    mean = next(trace for trace in figure.plot.data if trace.name == "y, mean")
    bend = np.polyfit(np.asarray(mean.x), np.asarray(mean.y), 2)[0]
    assert bend * 59.0**2 == pytest.approx(float(pattern.shape.split("+")[1].split()[0]), rel=0.15)


def test_selected_points_know_their_rows():
    figure = residual_against(np.arange(3.0)[None], np.arange(3.0), "time, s", ["norm"], rows=np.array([7, 8, 9]))
    assert list(figure.plot.data[0].customdata) == [7, 8, 9]


def test_noise_alone_is_called_noise():
    left = np.random.default_rng(3).normal(size=(3, 2000))
    figure = residual_against(left, np.linspace(0, 1, 2000), "time, s")
    assert figure.title == "No mean residual follows time"
    assert residual_axes({"x": 1.0}, 1.0).title == "Every axis is at the noise"


def test_the_waterfall_reaches_the_floor():
    history = [Step(50.0, 51.0), Step(2.0, 2.05, added="cross_field"), Step(3.0, 3.1, removed="bias")]
    stages = stages_of_history(history)
    assert [s.name for s in stages] == ["first model", "+ cross_field", "− bias"]
    assert waterfall(stages[:2], 2.0).title == "The error falls from 51 to 2.05 LSB, the noise floor"
    assert waterfall(stages[:2], 2.0).plot.layout.yaxis.type == "log"
    assert waterfall([Stage("a", 3.0, 3.0), Stage("b", 2.5, 2.5)], 2.4).plot.layout.yaxis.type != "log"
    assert "times the noise floor" in waterfall(stages[:1], 2.0).title


def test_an_adequate_log_has_no_suspect():
    log = log_of(record(Recipe({}, seed=5, rows=1500)))
    assert suspects(diagnose(log, model_of(BASE))).title.startswith("No effect is missing")


def test_the_change_since_the_factory_is_in_standard_errors():
    now, then = {"scale.x": Value(10.5, 0.03, "LSB/uT")}, {"scale.x": Value(10.0, 0.04, "LSB/uT")}
    assert parameters(now, then).title.endswith("scale.x most (+10 standard errors)")
    same = parameters(now, {"scale.x": Value(10.5, 0.04, "LSB/uT")})
    assert same.title.startswith("No parameter has changed")


def test_never_seen_directions_are_marked():
    up = np.array([[0.0], [0.0], [1.0]])
    figure = coverage(np.repeat(up, 5, axis=1))
    assert len(figure.plot.data[1].x) == 12 * 24 - 1
    assert json.loads(figure.plot.to_json())  # NaN does not break it


def test_numbers_for_people():
    assert [plain(v) for v in (303_212.0, 6.2718, 0.00123456, 0.0, 12.0)] == ["303200", "6.272", "0.001235", "0", "12"]
    assert plain(5280.0, 3) == "5280"
    assert plain(1.23e9) == "1.23e+09"
    assert plain(float("nan")) == plain(None) == "not known"
    assert (signed(38.2, 2), signed(-0.5)) == ("+38", "-0.5")
    assert uncertain(65.7231, 0.031) == "65.723 ± 0.031"
    assert strict({"a": [np.float64(1.5), float("inf")]}) == {"a": [1.5, None]}
