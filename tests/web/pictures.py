"""Pictures of the docs, made by the commands of the page that shows them: python tests/web/pictures.py FOLDER."""

import os
import sys
import tempfile
from pathlib import Path

from barberpole.cli import run
from playwright.sync_api import Browser, sync_playwright

CHROMIUM = next((name for name in ("/usr/bin/chromium", "/usr/bin/chromium-browser") if Path(name).exists()), None)
STORY = (  # host/docs/missing-effect.md
    "challenge new -o game --level 1 --seed 23",
    "report game/log.csv --model game/model.toml -o report.html",
)
FIGURES = {"fails": "fails most against", "falls": "The error falls"}  # picture -> words of its title


def shoot(browser: Browser, page: Path, folder: Path) -> None:
    """Each figure of the report as a picture of its own."""
    tab = browser.new_page(viewport={"width": 900, "height": 1200}, device_scale_factor=1.5)
    tab.goto(page.as_uri())
    tab.wait_for_selector(".js-plotly-plot .main-svg")
    tab.add_style_tag(content=".modebar{display:none!important}")
    for name, words in FIGURES.items():
        figure = tab.locator("figure", has=tab.locator("h3", has_text=words)).first
        figure.scroll_into_view_if_needed()
        tab.wait_for_timeout(1500)
        figure.screenshot(path=folder / f"{name}.png")


def main() -> None:
    """Run the story in a folder of its own, and take the pictures."""
    folder = Path(sys.argv[1]).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as work, sync_playwright() as playwright:
        os.chdir(work)
        for line in STORY:
            if run(line.split()):
                raise SystemExit(f"failed: {line}")
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        shoot(browser, Path("report.html").resolve(), folder)
        browser.close()
        os.chdir(folder)


if __name__ == "__main__":
    main()
