"""Easy axes without a sensor file: taken from the log where it shows them, and the usual ones where it does not."""

from dataclasses import replace

import numpy as np
import pytest
from barberpole.adding import change
from barberpole.board import load_sensor
from barberpole.challenge import world
from barberpole.challenge.record import Recipe, record
from barberpole.diagnose import diagnose
from barberpole.fit.easy_axes import with_easy_axes
from barberpole.observations import observations
from truth.trials import BASE, log_of, model_of

USUAL = (1, 0, 1)


@pytest.fixture(params=[(1, 0, 0), (2, 0, 1), (2, 2, 0)], ids=str)
def easy(request, monkeypatch):
    monkeypatch.setattr(world, "EASY", request.param)
    return request.param


def seen_of(**recipe):
    return observations(log_of(record(Recipe(**recipe))))


@pytest.mark.parametrize(
    ("reference", "form"),
    [(kind, form) for kind in ("vector", "constant") for form in ("flips", "pairs")]
    + [("vector", "unflipped"), ("vector", "demodulated")],  # on one sphere H_i^2 H_j^2 is the same for i, j and j, i
)
def test_a_cross_field_shows_its_easy_axes(easy, reference, form):
    size = 3.0 if form == "demodulated" else 1.0
    seen = seen_of(hidden={"cross_field": size}, form=form, reference=reference, seed=8)
    assert with_easy_axes(seen).at.easy_axis == easy


@pytest.mark.parametrize("reference", ["vector", "constant"])
def test_the_effect_is_named_and_added_whatever_the_axes(easy, reference):
    log = log_of(record(Recipe({"cross_field": 1.0}, reference=reference, seed=21)))
    said = diagnose(log, model_of(BASE))
    assert (said.verdict, [s.effect for s in said.suspects]) == ("missing", ["cross_field"])
    made = change(observations(log), model_of(BASE), model_of((*BASE, "cross_field")), "cross_field")
    assert made.pays
    assert made.after.heldout_rms_lsb < 1.05 * made.noise_lsb


@pytest.mark.parametrize("name", [n for n in world.CATALOGUE if n != "cross_field"])
def test_other_effects_leave_the_usual_axes(name):
    for reference in ("vector", "constant"):
        assert with_easy_axes(seen_of(hidden={name: 1.0}, reference=reference, seed=5)).at.easy_axis == USUAL


def test_a_sensor_file_is_believed(monkeypatch):
    monkeypatch.setattr(world, "EASY", (1, 0, 0))
    log = log_of(record(Recipe({"cross_field": 3.0}, seed=8)))
    assert with_easy_axes(observations(log, load_sensor("hmc1021_1022"))).at.easy_axis == USUAL


def test_a_log_that_cannot_tell_is_left_alone():
    seen = seen_of(hidden={}, rows=40, reference="constant", planar=True)
    assert with_easy_axes(seen).at.easy_axis == USUAL
    still = replace(seen, y=np.ones_like(seen.y))
    assert with_easy_axes(still) is still
