"""The page as a user has it: clicks, keys, files, two windows. Screenshots are kept in out/workbench."""

import http.client
import re
from urllib.parse import urlsplit


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


def test_a_level_one_trial_is_solved_from_the_page_alone(window, shots):
    window.click("text=Level 1")
    window.click(".bp-card.named button:has-text('Add')")
    window.wait_for_selector("[aria-current=step]:has-text('+')")
    window.click("text=Answer with my model")
    window.wait_for_selector("[data-test=outcome]")
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
