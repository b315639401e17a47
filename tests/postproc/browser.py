"""A headless Chromium without a network for tests of pages; what is missing is said."""

import io
import shutil
from contextlib import contextmanager

import numpy as np
import pytest
from PIL import Image

#: Options of a browser that starts nothing of its own and draws in software
OPTIONS = ("--headless=new", "--no-sandbox", "--disable-quic", "--no-first-run", "--disable-background-networking",
           "--disable-component-update", "--disable-sync", "--use-angle=swiftshader", "--enable-unsafe-swiftshader",
           "--force-device-scale-factor=1", "--hide-scrollbars", "--disable-dev-shm-usage",
           "--host-resolver-rules=MAP * ~NOTFOUND")

#: Debian's programs and the packages that have them
PROGRAMS = {"chromium": "chromium", "chromedriver": "chromium-driver"}


def need_browser():
    """Skip a whole module if there is no browser, its driver or what drives it."""
    missing = [package for program, package in PROGRAMS.items() if not shutil.which(program)]
    if missing:
        pytest.skip(f"no browser: install the Debian packages {' '.join(missing)}", allow_module_level=True)
    pytest.importorskip("selenium", reason="no selenium: pip install 'postproc[test]'")


@contextmanager
def open_browser(folder, width=1000, height=700):
    """A browser with a new profile in a folder."""
    from selenium import webdriver

    options = webdriver.ChromeOptions()
    options.binary_location = shutil.which("chromium")
    for option in (*OPTIONS, f"--user-data-dir={folder}", f"--window-size={width},{height}"):
        options.add_argument(option)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    service = webdriver.ChromeService(shutil.which("chromedriver"))
    browser = webdriver.Chrome(options=options, service=service)
    try:
        browser.set_script_timeout(600)
        yield browser
    finally:
        browser.quit()


def open_view(browser, path):
    """Open a page of the viewer and wait until it has read its data."""
    browser.get(path.resolve().as_uri())
    browser.execute_async_script("window.ready.then(arguments[0])")


def picture_of(browser):
    """The canvas of the bodies as it is on the screen: red, green and blue from 0 to 255."""
    browser.execute_async_script("requestAnimationFrame(() => requestAnimationFrame(arguments[0]))")
    shot = np.asarray(Image.open(io.BytesIO(browser.get_screenshot_as_png())).convert("RGB"), dtype=int)
    width, height = browser.execute_script("const c = viewer.painter.canvas; return [c.clientWidth, c.clientHeight]")
    return shot[:height, :width]
