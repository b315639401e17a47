"""Pictures of frames: quantities, overlays, cells of the quadtree, layout and files."""

import io
import re
from dataclasses import replace

import h5py
import numpy as np
import pytest
from matplotlib.colors import Normalize, to_rgb
from matplotlib.figure import Figure
from matplotlib.image import imread
from polydem_post import Frame, ResultError, Trajectory
from polydem_post.command_line.main import help_text, main
from polydem_post.pictures import draw
from polydem_post.pictures.drawing import MATERIAL_COLOURS, OVERLAYS, Look, settle
from polydem_post.pictures.limits import Span
from polydem_post.pictures.plot import length_text, plot_frames, round_length
from polydem_post.pictures.quantities import QUANTITIES, pressure, range_of, stress
from polydem_post.pictures.tree_cells import cell_grid, tree_cells
from polydem_post.pictures.view_data import pack_run


@pytest.fixture(scope="module")
def run(small_drum):
    return Trajectory(small_drum)


def test_figures_say_time_and_units(finished):
    figure = plot_frames(Trajectory(finished), [1, 4], Look(colour="speed", show=("forces",)), columns=2)
    left, right, bar = figure.axes
    assert (left.get_title(), right.get_title()) == ("t = 1 s", "t = 2.5 s")
    assert (left.get_xlabel(), left.get_ylabel()) == ("x [m]", "y [m]")
    assert left.get_aspect() == 1.0
    assert bar.get_ylabel() == "speed [m/s]"
    walls, grains, forces = right.collections
    assert (len(walls.get_paths()), len(grains.get_paths()), len(forces.get_paths())) == (1, 2, 2)


def test_the_help_text_names_all_quantities_and_overlays():
    text = help_text("plot")
    assert [name for name in [*QUANTITIES, *OVERLAYS] if name not in text.replace(",", " ").split()] == []


@pytest.mark.parametrize("name", QUANTITIES)
def test_every_quantity_has_a_value_for_every_body(run, name):
    frame = run[-1]
    quantity = QUANTITIES[name]
    values = quantity.values(frame)
    free = ~frame.fixed
    assert values.shape == free.shape
    assert np.isfinite(values[free]).all()
    low, high = range_of(quantity, values[free])
    assert low < high
    assert np.mean((values[free] >= low) & (values[free] <= high)) > 0.98
    if quantity.constant:
        assert np.array_equal(values, quantity.values(run[0]), equal_nan=True)


def test_resultants_on_walls_are_the_stored_ones_and_bodies_are_compressed(run):
    frame, walls = run[-1], run.walls(-1)
    rows = np.searchsorted(frame.id, walls.id)
    assert np.abs(walls.force).max() > 1.0
    force = np.zeros((len(frame), 2))
    np.add.at(force, frame.contacts.first_index, frame.contacts.force)
    np.add.at(force, frame.contacts.second_index, -frame.contacts.force)
    assert np.allclose(force[rows], walls.force, rtol=0.0, atol=1e-9)
    assert np.allclose(force, frame.force, rtol=0.0, atol=1e-9)
    assert np.array_equal(QUANTITIES["force"].values(frame), np.hypot(*frame.force.T))
    free = ~frame.fixed
    assert np.mean(pressure(frame)[free] > 0.0) > 0.8
    tensor = stress(frame)
    assert np.array_equal(tensor, tensor.transpose(0, 2, 1))


def test_a_range_is_kept_for_bodies_at_rest_and_for_equal_bodies():
    assert range_of(QUANTITIES["speed"], np.zeros(5)) == (0.0, 1e-6)
    assert range_of(QUANTITIES["speed"], np.empty(0)) == (0.0, 1.0)
    low, high = range_of(QUANTITIES["mass"], np.full(5, 2.0))
    assert low < 2.0 < high
    assert range_of(QUANTITIES["velocity_x"], np.array([-1.0, 3.0]))[0] == -range_of(
        QUANTITIES["velocity_x"], np.array([-1.0, 3.0]))[1]


def test_the_cells_are_those_of_the_program(run):
    """The finder counted its nodes and levels in the last step."""
    cells = tree_cells(cell_grid(run[0]), run[-1].bounds)
    assert len(cells.side) == run.counters["finder nodes"]
    assert np.log2(cells.side.max() / cells.side.min()) + 1 == run.counters["finder depth"]


def test_the_leaves_are_the_largest_cells_with_one_box(run):
    frame, grid = run[-1], cell_grid(run[0])
    cells = tree_cells(grid, frame.bounds)
    centre = 0.5 * (frame.bounds[grid.bodies, :2] + frame.bounds[grid.bodies, 2:])
    offset = centre[:, None, :] - cells.low
    inside = ((offset >= 0.0) & (offset < cells.side[None, :, None])).all(axis=2)
    assert np.array_equal(inside.sum(axis=0), cells.count)
    assert (inside[:, cells.leaf].sum(axis=1) == 1).all()
    finest = cells.side <= 1.001 * grid.finest
    assert (cells.count[cells.leaf & ~finest] == 1).all()
    assert (cells.count[~cells.leaf] > 1).all()


def test_every_overlay_and_quantity_is_drawn_and_nothing_is_cut(run):
    look = Look(colour="pressure", show=tuple(OVERLAYS))
    for size in (None, (178, 90), (100, 220)):
        figure = plot_frames(run, [0, 5, -1], look, size)
        if size:
            assert np.allclose(figure.get_size_inches() * 25.4, size)
        renderer = figure.canvas.get_renderer()
        inside = figure.bbox
        box = figure.get_tightbbox(renderer).extents * figure.dpi
        assert (box[:2] > [-2.0, -2.0]).all()
        assert (box[2:] < [inside.width + 2.0, inside.height + 2.0]).all()
        for axis in figure.axes[:3]:
            x0, y0, x1, y1 = axis.get_window_extent().extents
            low, high = axis.get_xlim(), axis.get_ylim()
            assert (x1 - x0) / (low[1] - low[0]) == pytest.approx((y1 - y0) / (high[1] - high[0]), rel=1e-3)
        labels = [text.get_text() for text in figure.legends[0].get_texts()]
        assert len(labels) == 7
        assert any(label.startswith("force ") and label.endswith("N/m or more") for label in labels)


def test_up_to_three_frames_stand_in_a_row(run):
    """Finds two frames above a third one, beside which a place is empty."""
    for numbers, shape in (([0, 5], (1, 2)), ([0, 5, -1], (1, 3)), ([0, 3, 5, -1], (2, 3))):
        assert plot_frames(run, numbers, Look()).axes[0].get_gridspec().get_geometry() == shape
    wide = Look(limits=(-0.3, 0.3, -0.1, 0.05))
    assert plot_frames(run, [0, 5, -1], wide).axes[0].get_gridspec().get_geometry() == (3, 1)


def test_a_bar_of_a_round_length_stands_in_place_of_the_axes(run, small_drum, tmp_path):
    path = tmp_path / "bar.svg"
    assert main(["plot", str(small_drum), "--frames", "0,-1", "--no-title", "--scale-bar", "-o", str(path)]) == 0
    text = path.read_text(encoding="utf-8")
    assert ">20 mm<" in text or ">50 mm<" in text
    assert "x [m]" not in text and ">t = " not in text
    assert main(["plot", str(small_drum), "-o", str(path)]) == 0
    text = path.read_text(encoding="utf-8")
    assert ">x [m]<" in text and ">t = " in text and " mm<" not in text
    figure = plot_frames(run, [0, -1], Look(scale_bar=True, limits=(-0.1, 0.1, -0.1, 0.1)))
    bar, = (artist for axis in figure.axes for artist in axis.artists)
    drawn = bar.size_bar.get_children()[0].get_window_extent()
    ends = figure.axes[0].transData.inverted().transform(drawn.corners())
    assert np.ptp(ends[:, 0]) == pytest.approx(0.05, rel=1e-6)
    assert [round_length(most) for most in (0.05, 0.049, 1.0, 0.99, 7e5, 2.5e-7)] == pytest.approx(
        [0.05, 0.02, 1.0, 0.5, 5e5, 2e-7])
    assert [length_text(length) for length in (2e3, 5.0, 0.5, 1e-3, 2e-5, 5e-8)] == [
        "2 km", "5 m", "500 mm", "1 mm", "20 µm", "5e-08 m"]


def test_a_notebook_draws_a_frame(run):
    shown = imread(io.BytesIO(run[-1]._repr_png_()))
    figure = plot_frames(run, [len(run) - 1])
    figure.canvas.draw()
    wanted = np.asarray(figure.canvas.buffer_rgba())
    assert np.array_equal(np.round(255 * shown).astype(int), wanted)


def test_a_frame_is_drawn_into_axes_of_ones_own(run):
    figure = Figure(layout="compressed")
    left, right = figure.subplots(1, 2)
    right.plot([0, 1], [1, 0])
    left.set_title("mine")
    limits = (-0.1, 0.1, -0.1, 0.05)
    grains = draw(run[-1], left, colour="pressure", show=("forces",), limits=limits, colour_range=(0.0, 50.0))
    assert left.get_title() == "mine" and left.get_xlabel() == "" and len(right.lines) == 1
    assert (*left.get_xlim(), *left.get_ylim()) == limits and left.get_aspect() == 1.0
    free = run[-1].free
    assert np.array_equal(grains.get_array(), QUANTITIES["pressure"].values(run[-1])[free])
    assert grains.get_clim() == (0.0, 50.0) and len(grains.get_paths()) == free.sum()
    figure.colorbar(grains, ax=left, label="pressure")
    plain = draw(Frame.from_polygons([np.array([(0, 0), (2, 0), (2, 1), (0, 1)])]), right)
    assert plain.get_array() is None and right.get_xlim() == pytest.approx((-0.04, 2.04))
    with pytest.raises(ResultError, match="there is no colour red"):
        draw(run[-1], left, colour="red")


def test_colours_of_materials_differ_in_grey_too():
    """Finds colours that a printer without colours makes alike; lightness of CIE 1976."""
    rgb = np.array([to_rgb(colour) for colour in MATERIAL_COLOURS])
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    lightness = 116.0 * np.cbrt(linear @ [0.2126, 0.7152, 0.0722]) - 16.0
    assert np.diff(np.sort(lightness)).min() > 5.0
    assert np.diff(np.sort(lightness[1:6])).min() > 12.0
    quantity = QUANTITIES["material"]
    shown = Look(colour="material").colour_map(quantity)(Normalize(*range_of(quantity, np.empty(0)))(np.arange(10.0)))
    assert np.allclose(shown[:, :3], rgb)


def test_a_figure_that_is_too_small_says_so(run):
    with pytest.raises(ResultError, match="30 mm x 30 mm is too small"):
        plot_frames(run, [0, 5, 9], Look(colour="speed"), (30, 30))


def test_frames_share_one_scale(run):
    together = settle(run, [0, -1], Look(colour="speed"))
    first, last = plot_frames(run, [0], together), plot_frames(run, [-1], together)
    for figure in (first, last):
        assert figure.axes[0].collections[1].get_clim() == together.colour_range
        assert figure.axes[0].get_xlim() == together.limits[:2]


class Driven:
    """Says which fixed bodies are driven, in place of a run."""

    def __init__(self, ids):
        self.ids = ids

    def driven_of(self, frame):
        return np.isin(frame.id, self.ids)


def scene(grains, walls, driven):
    """Unit squares with these lower left corners; the last `driven` walls are driven."""
    corners = np.array([(0, 0), (1, 0), (1, 1), (0, 1)])
    places = [*grains, *walls]
    fixed = [False] * len(grains) + [True] * len(walls)
    frame = Frame.from_polygons([corners + place for place in places], fixed=fixed)
    return replace(frame, _source=Driven(frame.id[len(places) - driven:]))


def corners_of(start, *frames):
    span = Span(start)
    for frame in frames:
        span.add(frame)
    return span.corners().ravel().tolist()


def test_a_driven_wall_that_goes_far_away_does_not_count():
    """Finds a gate that makes the silo tiny, a drum or piston that is cut, and an early picture of a late one."""
    floor, start = (9, 0), scene([(0, 0)], [(9, 0), (4, 9)], 1)
    gone = scene([(0, 0)], [floor, (4, 900)], 1)
    assert corners_of(start, start) == [0, 0, 10, 10]
    assert corners_of(start, start, gone) == corners_of(start, gone) == [0, 0, 10, 11]
    assert corners_of(start, scene([(0, 0)], [floor, (4, 2)], 1)) == [0, 0, 10, 3]
    assert corners_of(start, start, scene([(0, 0)], [floor, (4, 9.5)], 1)) == [0, 0, 10, 10.5]
    # All walls are driven: a cart takes its grains along.
    cart = [scene([(x, 0)], [(x - 1, 0), (x + 1, 0)], 2) for x in (0, 50)]
    assert corners_of(cart[0], *cart) == [-1, 0, 52, 1]


def test_grains_that_fall_for_ever_count_as_far_below_as_the_scene_is_large():
    """Finds a silo without a floor that gets tiny, and a run without walls that is cut."""
    start, late = scene([(0, 5)], [(9, 0)], 0), scene([(0, -500)], [(9, 0)], 0)
    assert corners_of(start, start, late) == [0, -10, 10, 6]
    assert corners_of(scene([(0, 5)], [], 0), scene([(0, -500)], [], 0)) == [0, -500, 1, -499]


def test_pictures_and_the_viewer_show_the_same_part_of_the_plane(run):
    low, high = run[0].bounds[:, :2].min(axis=0), run[0].bounds[:, 2:].max(axis=0)
    margin = 0.02 * max(high - low)
    limits = settle(run, [-1], Look()).limits
    expected = [low[0] - margin, high[0] + margin, low[1] - margin, high[1] + margin]
    assert np.allclose(limits, expected, atol=0.2 * margin)
    assert np.array_equal(pack_run(run, [-1]).facts["limits"], np.array(limits)[[0, 2, 1, 3]])


def test_bodies_are_drawn_where_they_are_in_their_colour(run, tmp_path):
    """Compare picture elements at the centres of bodies with the scale of colours."""
    look = Look(colour="id", limits=(-0.08, 0.08, -0.08, 0.08))
    figure = plot_frames(run, [-1], look, (100, 90), dpi=200)
    path = tmp_path / "picture.png"
    figure.savefig(path, dpi=200)
    pixels = imread(path)
    frame = run.frame(-1)
    colours = look.colour_map(look.quantity)(np.mod(frame.id, 20) / 20.0 + 1e-3)
    axis, found = figure.axes[0], 0
    for k in np.flatnonzero(~frame.fixed & (np.abs(frame.position) < 0.078).all(axis=1)):
        x, y = axis.transData.transform(frame.position[k])
        found += 1
        assert np.allclose(pixels[round(pixels.shape[0] - y - 0.5), round(x - 0.5), :3], colours[k, :3], atol=0.02), k
    assert found > 20


@pytest.mark.parametrize("words", [["--limits", "-0.1,0.05,-.2,1e-1"], ["--limits=-0.1,0.05,-.2,1e-1"]])
def test_limits_and_frames_may_begin_with_a_minus_sign(run, small_drum, tmp_path, words, monkeypatch):
    seen = []
    monkeypatch.setattr("polydem_post.pictures.plot.plot_frames",
                        lambda run, numbers, look, *rest, **more: seen.append((numbers, look)) or plot_frames(
                            run, numbers, look, *rest, **more))
    out = str(tmp_path / "p.png")
    assert main(["plot", str(small_drum), *words, "--frames", "-1,0", "-o", out, "--dpi", "40"]) == 0
    (numbers, look), = seen
    assert [number % len(run) for number in numbers] == [len(run) - 1, 0]
    assert look.limits == (-0.1, 0.05, -0.2, 0.1)


def test_frames_by_time_slice_and_file(run, small_drum, tmp_path, capsys):
    out = tmp_path / "f.pdf"
    assert main(["plot", str(small_drum), "--frames", "0:11:5", "--separate", "-o", str(out), "--dpi", "50"]) == 0
    assert capsys.readouterr().out.split() == [str(tmp_path / f"f_{k:04d}.pdf") for k in (0, 5, 10)]
    assert main(["plot", str(small_drum), "--times", "0.1,0.21", "-o", str(tmp_path / "t.svg"), "--colour", "load",
                 "--range", "0,50", "--map", "magma"]) == 0
    text = (tmp_path / "t.svg").read_text(encoding="utf-8")
    times = [float(time) for time in re.findall(r">t = ([\d.]+) s<", text)]
    assert times == pytest.approx([0.1, 0.2], abs=0.011)
    assert "sum of the contact forces" in text


@pytest.mark.parametrize("form", ["png", "pdf", "svg"])
def test_pictures_in_every_form_are_reproducible(small_drum, tmp_path, form):
    paths = [tmp_path / f"{name}.{form}" for name in ("first", "second")]
    for path in paths:
        assert main(["plot", str(small_drum), "-o", str(path), "--show", "forces,cells", "--dpi", "60"]) == 0
    assert paths[0].read_bytes() == paths[1].read_bytes()


def test_a_result_without_contacts_says_so(small_drum, tmp_path):
    for path in small_drum.iterdir():
        (tmp_path / path.name).write_bytes(path.read_bytes())
    for path in tmp_path.glob("trajectory_*.h5"):
        with h5py.File(path, "r+") as file:
            del file["contacts"]
    bare = Trajectory(tmp_path, check=False)
    for look in (Look(colour="load"), Look(show=("stress",))):
        with pytest.raises(ResultError, match="holds no contacts, which (load|stress) needs; run with"):
            plot_frames(bare, [0], look)
    plot_frames(bare, [0], Look(colour="speed", show=("boxes", "cells")))
