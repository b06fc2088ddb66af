"""The page as a user has it: clicks, keys, files, two windows. Screenshots are kept in out/workbench."""

import http.client
import re
from urllib.parse import urlsplit

import pytest
from barberpole.calibration import read_calibration
from barberpole.challenge.record import Recipe, record
from barberpole.challenge.record import write as write_log
from barberpole.modelfile import read_model


def figure(page, test):
    """The first number in an element."""
    return float(re.search(r"[-+]?\d+(\.\d+)?(e[-+]?\d+)?", page.text_content(f"[data-test={test}]")).group())


def open_log(page, path):
    page.set_input_files("input[type=file]", str(path))
    page.wait_for_selector("[data-test=heldout]:has-text('LSB')")


def named(page, effect):
    page.wait_for_selector(f".bp-card.named:has-text('{effect}')")


def test_the_hidden_effect_is_seen_added_undone_and_redone(window, crossed, shots):
    open_log(window, crossed)
    named(window, "cross_field")
    assert "cross_field is missing" in window.text_content("[data-test=verdict]")
    window.wait_for_selector(".bp-chip[aria-pressed=true]:has-text('flip state × field')")  # where it fails worst
    window.wait_for_selector("[data-test=figure-residual] h3:has-text('flip state × field')")
    before, noise = (
        figure(window, "heldout"),
        float(re.search(r"[\d.]+", window.text_content("[data-test=noise]")).group()),
    )
    window.screenshot(path=shots / "before.png", full_page=True)
    window.click("button[aria-label='Add cross_field']")
    window.wait_for_selector(".bp-fall.floor")
    after = figure(window, "heldout")
    assert after < 1.1 * noise < before / 5
    window.wait_for_selector("text=The model is adequate")
    window.screenshot(path=shots / "after.png", full_page=True)
    window.keyboard.press("z")
    window.wait_for_selector(".bp-fall:not(.floor)")
    assert figure(window, "heldout") == before
    window.keyboard.press("y")
    window.wait_for_selector(".bp-fall.floor")
    assert figure(window, "heldout") == after
    window.click(".bp-step:has-text('start')")
    window.wait_for_selector(".bp-fall:not(.floor)")


def test_a_narrow_window_has_one_column_and_what_is_not_drawn_is_empty(window, crossed, shots):
    open_log(window, crossed)
    named(window, "cross_field")
    window.set_viewport_size({"width": 390, "height": 850})
    try:
        window.wait_for_function("() => document.documentElement.scrollWidth <= innerWidth")
        boxes = window.evaluate(
            "() => [...document.querySelector('.bp-main').children].map(e => e.getBoundingClientRect())"
        )
        assert all(box["left"] >= 0 and box["width"] == boxes[0]["width"] for box in boxes)
        window.screenshot(path=shots / "narrow.png", full_page=True)
        empty = window.locator(".js-plotly-plot:not(:has(.trace))")
        assert empty.count() > 0
        assert empty.locator(".xtick").count() == 0
    finally:
        window.set_viewport_size({"width": 1280, "height": 900})


def test_a_level_one_trial_is_solved_from_the_page_alone(window, server, shots):
    window.goto(f"{server}?seed=3")
    window.click("text=Level 1")
    window.click(".bp-card.named button:has-text('Add')")
    window.wait_for_selector("[aria-current=step]:has-text('+')")
    window.click("text=Answer with my model")
    window.wait_for_selector("[data-test=outcome]")
    window.wait_for_selector("[data-test=trial] td:has-text('LSB')")
    window.screenshot(path=shots / "trial.png")
    assert window.text_content("[data-test=outcome]") == "Right."  # three clicks


def test_bad_and_empty_files_give_one_clear_message(window, tmp_path):
    for name, text, said in (
        ("empty.csv", "", "empty file"),
        ("words.csv", "t_s,x_lsb,y_lsb,z_lsb\n0,a,b,c\n", "must be"),
        ("gauss.csv", "x_gauss,y_gauss,z_gauss\n1,2,3\n", "must be"),
    ):
        path = tmp_path / name
        path.write_text(text)
        window.set_input_files("input[type=file]", str(path))
        window.wait_for_selector(f".q-notification:has-text('{said}')")
        assert window.locator(".q-notification").count() == 1
        window.click(".q-notification button")
        window.wait_for_selector(".q-notification", state="detached")
    assert window.is_visible("text=Find a hidden effect")


def test_two_windows_do_not_disturb_each_other(window, chromium, server, crossed):
    other = chromium.new_page()
    other.goto(server)
    open_log(other, crossed)
    open_log(window, crossed)
    named(window, "cross_field")
    named(other, "cross_field")
    window.click("button[aria-label='Add cross_field']")
    window.wait_for_selector(".bp-fall.floor")
    assert other.locator(".bp-fall.floor").count() == 0
    assert other.locator(".bp-step").count() == 1
    other.close()


def test_other_hosts_and_origins_are_refused(server):
    address = urlsplit(server)

    def status(method, path, **headers):
        line = http.client.HTTPConnection(address.hostname, address.port, timeout=10)
        line.request(method, path, headers=headers)
        return line.getresponse().status

    assert status("GET", "/") == 200
    assert status("GET", "/", Host="evil.example") == 403
    assert status("POST", "/_nicegui/client/x/upload/1", Origin="http://evil.example") == 403
    upgrade = {"Upgrade": "websocket", "Connection": "Upgrade", "Sec-WebSocket-Version": "13"}
    upgrade["Sec-WebSocket-Key"] = "AAAAAAAAAAAAAAAAAAAAAA=="
    path = "/_nicegui_ws/socket.io/?EIO=4&transport=websocket"
    assert status("GET", path, Origin="http://evil.example", **upgrade) == 403
    assert status("GET", path, Origin=server.rstrip("/"), **upgrade) in (101, 400)
    for path in ("/../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/_nicegui/../../../etc/passwd"):
        assert status("GET", path) in (400, 403, 404)


PICTURES_WITH_A_CHOICE = """
Array.from(document.querySelectorAll('.js-plotly-plot'))
    .filter(e => (e.data || []).some(t => t.selectedpoints && t.selectedpoints.length)).length
"""

BEND = """
import numpy as np
from barberpole.effects.effect import per_axis

EQUATION = "y_i = x_i (1 + c_i x_e^2)"


def params(setup):
    return per_axis("1/uT^2", typical=0.005 / setup.span_ut**2)


def forward(xyz, p, at):
    x, y, z = xyz
    return x * (1 + p[0] * y * y), y * (1 + p[1] * x * x), z * (1 + p[2] * y * y)
"""


def write(page, text):
    page.locator(".cm-content").fill(text)
    page.click("button:has-text('Try it')")


def test_an_effect_of_ones_own_is_refused_with_its_line_and_joins_once_it_is_right(window, crossed, folder, shots):
    open_log(window, crossed)
    window.click("text=Write an effect of your own")
    window.fill("input[aria-label*='Name']", "my_bend")
    write(window, BEND.replace("x * (1 + p[0] * y * y)", "x * (1 + p[0] * why)"))
    window.wait_for_selector("[data-test=effect-error]:has-text(\"name 'why' is not defined\")")
    assert "line 14" in window.text_content("[data-test=effect-error]")
    assert window.locator(".bp-wrong").count() == 1
    assert not (folder / "my_bend.py").exists()
    window.screenshot(path=shots / "editor.png")
    write(window, BEND.replace("1 + p[0]", "2 + p[0]"))
    window.wait_for_selector("[data-test=effect-error]:has-text('identity while all parameters are at null')")
    write(window, BEND)
    window.wait_for_selector(".bp-eff:has-text('my_bend')")
    assert (folder / "my_bend.py").read_text().strip() == BEND.strip()
    window.wait_for_selector(".bp-card:has-text('my_bend')")
    window.click("button[aria-label='Add my_bend']")
    window.wait_for_selector("[aria-current=step]:has-text('+ my_bend')")


def test_what_was_found_is_kept(window, crossed, folder):
    open_log(window, crossed)
    named(window, "cross_field")
    window.click("button[aria-label='Add cross_field']")
    window.wait_for_selector(".bp-fall.floor")
    window.click("button:has-text('Save')")
    window.click("button[aria-label='Save model']")
    window.wait_for_selector("[data-test=kept]:has-text('model.toml written')")
    assert "cross_field" in read_model(folder / "model.toml").effects
    window.click("button[aria-label='Save calibration']")
    window.wait_for_selector("[data-test=kept]:has-text('calibration.toml written')")
    saved = read_calibration(folder / "calibration.toml")
    assert [step.added for step in saved.history] == [None, "cross_field"]
    assert saved.residual.heldout_rms_lsb == pytest.approx(figure(window, "heldout"), rel=1e-3)
    window.click("button[aria-label='Save report']")
    window.wait_for_selector("[data-test=kept]:has-text('report.html written')")
    report = (folder / "report.html").read_text()
    assert report.startswith("<!doctype html>")
    assert "adequate" in report
    assert "cross_field" in report
    assert len(report) < 8e6
    window.fill("input[aria-label=Model]", "../outside.toml")
    window.click("button[aria-label='Save model']")
    window.wait_for_selector(".q-notification:has-text('must be within')")
    assert not (folder.parent / "outside.toml").exists()


def test_firmware_is_built_from_the_page(window, crossed, folder):
    open_log(window, crossed)
    window.click("button:has-text('Save')")
    window.click("button:has-text('Build')")
    window.wait_for_selector("[data-test=kept]:has-text('Built in build')")
    assert figure(window, "kept") > 1000  # bytes of flash
    assert list((folder / "build").rglob("*.mpy"))
    window.fill("input[aria-label=Folder]", "../elsewhere")
    window.click("button:has-text('Build')")
    window.wait_for_selector(".q-notification:has-text('must be within')")
    assert not (folder.parent / "elsewhere").exists()


def test_a_long_fit_is_cancelled_and_the_page_goes_on(window, tmp_path):
    path = write_log(record(Recipe({"cross_field": 10.0}, rows=30_000, seed=5)), tmp_path / "long.csv")
    open_log(window, path)
    window.click("[aria-label=mains]")  # its frequency is searched for over the whole log
    window.wait_for_selector(".bp-busy:has-text('putting mains in')")
    window.click(".bp-busy button:has-text('Cancel')")
    window.wait_for_selector(".q-notification:has-text('stopped while putting mains in')")
    assert window.locator(".bp-step").count() == 1
    window.wait_for_selector("[aria-label=mains][aria-checked=false]")  # it is not in
    window.click("[title='temperature, °C']")
    window.wait_for_selector("[data-test=figure-residual] h3:has-text('temperature')")
    window.click("[aria-label=drift]")
    window.wait_for_selector("[aria-current=step]:has-text('+ drift')")


def test_two_models_are_compared_on_held_out_data(window, crossed):
    open_log(window, crossed)
    named(window, "cross_field")
    window.click("button[aria-label='Add cross_field']")
    window.wait_for_selector(".bp-fall.floor")
    window.click("text=Compare two models")
    window.wait_for_selector("[data-test=rivals]:has-text('the first is better')")
    assert "the second is better" not in window.inner_text("[data-test=rivals]")


def test_a_box_in_one_picture_shows_in_all_and_its_rows_can_be_left_out(window, crossed):
    open_log(window, crossed)
    named(window, "cross_field")
    window.wait_for_selector("[data-test=figure-residual] .nsewdrag")
    box = window.locator("[data-test=figure-residual] .nsewdrag").first.bounding_box()
    left, top = box["x"] + 0.2 * box["width"], box["y"] + 2
    window.mouse.move(left, top)
    window.mouse.down()
    window.mouse.move(left + 0.4 * box["width"], top + box["height"] - 6, steps=4)
    window.mouse.up()
    window.wait_for_selector(".bp-brush:has-text('samples chosen')")
    chosen = int(re.sub(r"\D", "", window.text_content(".bp-brush span")))
    assert 300 < chosen < 2500
    assert window.evaluate(PICTURES_WITH_A_CHOICE) >= 2
    window.click("text=Leave them out")
    window.wait_for_selector("[aria-current=step]:has-text('rows left out')")
    left_out = int(re.sub(r"\D", "", window.text_content("[aria-current=step] span")))
    assert left_out == chosen
