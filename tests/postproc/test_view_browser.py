"""The viewer in a real browser: pictures, numbers and what the user does. Skipped if there is none."""

import os
import subprocess

import numpy as np
import pytest
from browser import need_browser, open_browser, open_view, picture_of
from matplotlib import colormaps
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from polydem_post import Trajectory
from polydem_post.pictures.drawing import SettledLook, cell_lines
from polydem_post.pictures.quantities import QUANTITIES
from polydem_post.pictures.tree_cells import cell_grid, tree_cells
from polydem_post.pictures.view import write_view

need_browser()

from selenium.webdriver.common.action_chains import ActionChains  # noqa: E402
from selenium.webdriver.common.actions.wheel_input import ScrollOrigin  # noqa: E402
from selenium.webdriver.common.keys import Keys  # noqa: E402
from selenium.webdriver.support.ui import Select, WebDriverWait  # noqa: E402

FRAME = 6


@pytest.fixture(scope="module")
def run(small_drum):
    return Trajectory(small_drum)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    with open_browser(tmp_path_factory.mktemp("profile")) as browser:
        yield browser


@pytest.fixture
def page(browser, view):
    """The page as it is when it was just opened."""
    open_view(browser, view)
    assert browser.execute_script("return window.failure ? String(window.failure.stack) : ''") == ""
    yield browser
    assert browser.get_log("browser") == []


def js(browser, code, *arguments):
    return browser.execute_script(code, *arguments)


def test_the_browser_has_the_numbers_of_the_run(page, run):
    js(page, "viewer.show(arguments[0])", FRAME)
    facts = js(page, "return viewer.run.facts")
    assert facts["times"] == list(run.times)
    frame = run[FRAME]
    quantum = facts["series"]["x"]["quantum"]
    for axis, name in enumerate("xy"):
        there = np.array(js(page, f"return Array.from(viewer.run.{name})"))
        assert np.abs(there - frame.position[:, axis]).max() <= 0.51 * quantum
    free = ~frame.fixed
    for name, quantity in QUANTITIES.items():
        there = js(page, f"return Array.from(viewer.run.id, (_, i) => COLUMNS.{name}(viewer.run, i))")
        there = np.array(there, dtype=float)[free]
        true = quantity.values(frame)[free]
        if name == "angle":
            there = true + (there - true + np.pi) % (2.0 * np.pi) - np.pi
        scale = np.abs(true).max()
        assert np.abs(there - true).max() <= 0.02 * scale, name
        assert np.median(np.abs(there - true)) <= 0.005 * scale, name


def test_the_browser_finds_the_cells_of_the_tree_and_the_boxes(page, run):
    js(page, "viewer.show(viewer.run.frames - 1)")
    cells = tree_cells(cell_grid(run[0]), run[-1].bounds)
    there = np.array(js(page, "const c = new Texels(); cellBoxes(viewer.run, c); "
                              "return Array.from(c.data.subarray(0, 4 * c.n))")).reshape(-1, 4)
    assert len(there) == pytest.approx(len(cells.side), abs=4)  # a centre may be rounded into the next cell
    assert (there[:, 2] - there[:, 0]).max() == pytest.approx(cells.side.max())
    there[:, 2] -= there[:, 0]
    there[:, :2] += js(page, "return viewer.run.origin")
    places = [{tuple(row) for row in np.rint(rows / cells.side.min()).astype(int)}
              for rows in (there[:, :3], np.column_stack((cells.low, cells.side)))]
    assert len(places[0] & places[1]) >= len(cells.side) - 4
    boxes = np.array(js(page, "return Array.from(viewer.run.boxes())")).reshape(-1, 4)
    assert np.abs(boxes - run[-1].bounds).max() < 2e-3 * np.median(run[0].equivalent_diameter)


def reference(run, number, facts, shown, size, colour):
    """The same picture by matplotlib."""
    frame = run[number]
    width, height = size
    figure = Figure(figsize=(width / 100, height / 100), dpi=100)
    canvas = FigureCanvasAgg(figure)
    axis = figure.add_axes((0, 0, 1, 1))
    half = np.array([0.5 * shown["height"] * width / height, 0.5 * shown["height"]])
    axis.set(xlim=(shown["x"] - half[0], shown["x"] + half[0]), ylim=(shown["y"] - half[1], shown["y"] + half[1]))
    axis.axis("off")
    fact = facts["quantities"][colour]
    values = QUANTITIES[colour].values(run[number])
    colours = colormaps[fact["map"]](np.clip((values - fact["range"][0]) / np.ptp(fact["range"]), 0, 1))
    colours[frame.fixed] = (0.62, 0.62, 0.62, 1)
    axis.add_collection(PolyCollection(frame.vertices, facecolor=colours, edgecolor=(0.1, 0.1, 0.1), linewidth=0.72))
    canvas.draw()
    return np.asarray(canvas.buffer_rgba())[..., :3].astype(int)


@pytest.mark.parametrize("colour", ["speed", "pressure"])
def test_the_picture_is_that_of_matplotlib(page, run, colour):
    js(page, "viewer.setColour(arguments[0]); viewer.show(arguments[1])", colour, FRAME)
    picture = picture_of(page)
    facts, shown = js(page, "return [viewer.run.facts, viewer.painter.shown]")
    expected = reference(run, FRAME, facts, shown, picture.shape[1::-1], colour)
    far = (np.abs(picture - expected) > 48).any(axis=2)
    assert far.mean() < 0.02
    assert (np.abs(expected - 255) > 48).any(axis=2).mean() > 0.15  # there is something to see
    frame = run[FRAME]
    height, width = picture.shape[:2]
    found = 0
    for x, y in frame.position[~frame.fixed]:
        row = round(0.5 * height - (y - shown["y"]) * height / shown["height"])
        column = round(0.5 * width + (x - shown["x"]) * height / shown["height"])
        assert np.abs(picture[row, column] - expected[row, column]).max() <= 12
        found += 1
    assert found > 80


def test_overlays_are_drawn_and_taken_away(page):
    js(page, "viewer.show(arguments[0])", FRAME)
    plain = picture_of(page)
    for name, colour in (("forces", (160, 16, 32)), ("contacts", (213, 94, 0)), ("boxes", (0, 114, 178)),
                         ("cells", (122, 61, 184))):
        page.find_element("id", f"show-{name}").click()
        drawn = picture_of(page)
        assert (np.abs(drawn - colour).max(axis=2) < 30).sum() > 30, name
        page.find_element("id", f"show-{name}").click()
        assert np.array_equal(picture_of(page), plain), name


def test_overlays_are_made_once_per_frame(page):
    js(page, """window.made = {};
        for (const [name, each] of Object.entries(OVERLAYS)) {
          const make = each.make;
          each.make = (run, list) => { made[name] = (made[name] || 0) + 1; make(run, list); };
          viewer.setOverlay(name, true);
        }
        viewer.show(arguments[0])""", FRAME)
    there = picture_of(page)
    js(page, "window.made = {}; viewer.redraw(); viewer.painter.shown.height *= 1.1; viewer.redraw()")
    assert js(page, "return made") == {}
    js(page, "viewer.painter.fit(); viewer.show(arguments[0] + 1)", FRAME)
    assert js(page, "return made") == {"forces": 1, "contacts": 1, "boxes": 1, "cells": 1}
    assert not np.array_equal(picture_of(page), there)
    js(page, "viewer.show(arguments[0])", FRAME)
    assert np.array_equal(picture_of(page), there)


def test_a_click_picks_a_body_and_shows_its_numbers(page, run):

    js(page, "viewer.show(arguments[0])", FRAME)
    frame = run[FRAME]
    chosen = int(np.flatnonzero(~frame.fixed)[40])
    left, top = js(page, """const p = viewer.painter, i = arguments[0], step = p.shown.height / p.canvas.clientHeight;
        return [(viewer.run.x[i] - p.shown.x) / step, (p.shown.y - viewer.run.y[i]) / step]""", chosen)
    canvas = page.find_element("id", "scene")
    ActionChains(page).move_to_element_with_offset(canvas, round(left), round(top)).click().perform()
    assert js(page, "return viewer.chosen") == chosen
    cells = [cell.text for cell in page.find_elements("css selector", "#body td")]
    numbers = dict(zip(cells[::2], cells[1::2]))
    assert numbers["identifier"] == str(frame.id[chosen])
    assert float(numbers["mass per depth [kg/m]"]) == pytest.approx(frame.mass[chosen], rel=1e-3)
    assert float(numbers["number of contacts"]) == frame.coordination[chosen]
    assert (np.abs(picture_of(page) - (255, 0, 255)).max(axis=2) < 60).sum() > 5
    ActionChains(page).move_to_element_with_offset(canvas, -330, -250).click().perform()
    assert js(page, "return viewer.chosen") == -1


def test_pan_zoom_and_double_click(page):

    canvas = page.find_element("id", "scene")
    whole = js(page, "return viewer.painter.shown")
    ActionChains(page).move_to_element(canvas).click_and_hold().move_by_offset(60, 30).release().perform()
    moved = js(page, "return viewer.painter.shown")
    step = whole["height"] / canvas.size["height"]
    assert (moved["x"] - whole["x"], moved["y"] - whole["y"]) == pytest.approx((-60 * step, 30 * step), rel=0.05)
    assert js(page, "return viewer.chosen") == -1
    ActionChains(page).scroll_from_origin(ScrollOrigin.from_element(canvas, 100, 50), 0, -400).perform()
    zoomed = js(page, "return viewer.painter.shown")
    assert zoomed["height"] < 0.7 * whole["height"]
    assert zoomed["x"] + 100 * zoomed["height"] / canvas.size["height"] == pytest.approx(
        moved["x"] + 100 * step, abs=2 * step)
    ActionChains(page).double_click(canvas).perform()
    assert js(page, "return viewer.painter.shown") == whole


def test_play_shows_no_frame_while_the_last_one_is_drawn(page):
    js(page, "viewer.show(0); viewer.painter.isDrawing = () => true; viewer.play(true)")
    page.execute_async_script("setTimeout(arguments[0], 300)")
    assert js(page, "return [viewer.frame, viewer.playing]") == [0, True]
    js(page, "delete viewer.painter.isDrawing")
    WebDriverWait(page, 20).until(lambda _: js(page, "return viewer.frame > 0 && !viewer.painter.isDrawing()"))


def test_play_scrub_keys_and_curves(page, run):

    last = len(run) - 1
    Select(page.find_element("id", "speed")).select_by_visible_text("60")
    page.find_element("id", "play").click()
    WebDriverWait(page, 20).until(lambda _: js(page, "return viewer.frame === arguments[0] && !viewer.playing", last))
    assert js(page, "return viewer.drawn") >= len(run)
    body = page.find_element("tag name", "body")
    body.send_keys(Keys.ARROW_LEFT, Keys.ARROW_LEFT)
    assert js(page, "return viewer.frame") == last - 2
    js(page, "const s = document.getElementById('scrub'); s.value = 3; s.dispatchEvent(new Event('input'))")
    assert js(page, "return viewer.frame") == 3
    assert "frame 3" in page.find_element("id", "time").text
    Select(page.find_element("id", "colour")).select_by_visible_text("pressure [N/m²]")
    assert js(page, "return viewer.colour") == "pressure"
    curve = page.find_elements("css selector", "#curves canvas")[0]
    ActionChains(page).move_to_element_with_offset(curve, curve.size["width"] // 2 - 6, 0).click().perform()
    assert js(page, "return viewer.frame") >= last - 1
    kinetic = js(page, "return viewer.run.facts.curves.kinetic.values")
    assert kinetic == pytest.approx(list(run.energy_balance["kinetic"]), rel=1e-6)


def rounding_of_pressure(frame, force, reach):
    """Greatest error of the pressure of each body where the page rounds forces and arms of contacts [N/m2]."""
    contacts, bound = frame.contacts, np.full(len(frame), 1e-6)
    size = contacts.force_magnitude
    # The root of the share in the greatest force of the film has 255 steps, a direction 256, a part of an arm 127.
    of_force = np.sqrt(size * force) / 255 + force / 255**2 + size * np.pi / 256
    for index, arm in ((contacts.first_index, contacts.first_arm), (contacts.second_index, contacts.second_arm)):
        length = np.hypot(arm[:, 0], arm[:, 1])
        error = 0.5 * (of_force * (length + reach / 127) + size * reach / 127)
        bound += np.bincount(index, error / frame.area[index], len(frame))
    return bound


def test_a_sheared_cell_has_its_border_and_contacts_across_it(browser, tmp_path):
    (tmp_path / "cell.nml").write_text(
        "&cell periodic = 'xy' low = 0.01, 0 size = 0.06, 0.05 shear_rate = -30 profile = .true. /\n"
        "&grains name = 'sample' region = 'box' low = 0, 0 high = 0.06, 0.05 number = 12 speed = 3 spin = 100 /\n"
        "&forces gravity = 0, 0 stiffness = 2e5 /\n&integrate dt = 2e-5 duration = 0.06 /\n"
        "&output frame_interval = 1e-3 contacts = .true. /\n", encoding="utf-8")
    subprocess.run([os.environ["POLYDEM_PROGRAM"], "run", "cell.nml"], cwd=tmp_path, check=True, capture_output=True)
    run = Trajectory(tmp_path / "results" / "cell")
    write_view(run, list(range(len(run))), tmp_path / "view.html")
    open_view(browser, tmp_path / "view.html")
    lines = js(browser, "viewer.show(30); return viewer.run.cellLines()")
    look = SettledLook(limits=(0.0, 1.0, 0.0, 1.0))
    assert np.array(lines) == pytest.approx(np.array([line.ravel() for line in cell_lines(run[30], look)]))
    assert (np.abs(picture_of(browser)).max(axis=2) < 60).sum() > 100
    greatest = max(frame.contacts.force_magnitude.max(initial=0.0) for frame in run), max(run[0].radius)
    for number, frame in enumerate(run):
        there = js(browser, "viewer.show(arguments[0]); "
                            "return Array.from(viewer.run.id, (_, i) => COLUMNS.pressure(viewer.run, i))", number)
        error = there - QUANTITIES["pressure"].values(frame)
        assert (np.abs(error) <= rounding_of_pressure(frame, *greatest)).all(), number


def test_without_webgl_the_page_says_so(browser, view):
    script = browser.execute_cdp_cmd("Page.addScriptToEvaluateOnNewDocument", {
        "source": "HTMLCanvasElement.prototype.getContext = () => null"})["identifier"]
    try:
        open_view(browser, view)
        message = browser.find_element("id", "message").text
    finally:
        browser.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", {"identifier": script})
    assert message.startswith("This browser has no WebGL 2, which the viewer needs")
    assert "./polydem movie" in message
