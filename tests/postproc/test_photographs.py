"""What a photograph asks for: uneven light, dents, the error of the threshold, and a picture to look at."""

import os
import re

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from polydem_post import ResultError
from polydem_post.bodies_file import import_array, import_bodies
from polydem_post.command_line.main import main
from polydem_post.pictures.imported import draw_import
from polydem_post.tracing import Tracing, trace
from test_tracing import bodies_of, circle, picture, placed, save, stones, whole

shapely = pytest.importorskip("shapely", reason="shapely is not installed: pip install 'postproc[test]'")
skimage_data = pytest.importorskip("skimage.data", reason="scikit-image is not installed: pip install 'postproc[test]'")
ezdxf = pytest.importorskip("ezdxf", reason="ezdxf is not installed: pip install 'postproc[test]'")

#: Discs of 9 to 26 pixels in five columns and three rows, and where the light comes from
RADII = np.linspace(9, 26, 15)
DISCS = [circle(radius, 45 + 70 * (k % 5), 40 + 65 * (k // 5)) for k, radius in enumerate(RADII)]


def lit(kind, noise=5.0):
    """A picture of the discs: a gradient that is added, or one that multiplies also what the grains have."""
    cover = picture(220, 380, *DISCS).sum(axis=0)
    share = np.linspace(0.0, 1.0, 380)
    grey = 30 + 60 * cover + 90 * share if kind == "added" else (40 + 60 * cover) * (0.6 + 1.4 * share)
    return np.clip(grey + np.random.default_rng(2).normal(0, noise, grey.shape), 0, 255).astype(np.uint8)


@pytest.mark.parametrize("kind", ["added", "multiplied"])
@pytest.mark.parametrize("dark", [False, True])
@pytest.mark.parametrize("width", [40, 80])
def test_uneven_light_changes_no_areas(kind, dark, width):
    grey = 255 - lit(kind) if dark else lit(kind)
    choices = {"threshold": "otsu", "smooth": 1.0, "dark": dark or None}
    found = trace(grey, Tracing(uneven=width, **choices), 1.0).outlines
    order = sorted(found, key=lambda each: whole([each.points])[0])
    assert len(found) == 15
    areas = np.array([whole([each.points])[0] for each in order])
    assert_allclose(areas, np.pi * RADII**2, rtol=0.08)
    assert_allclose(areas.sum(), (np.pi * RADII**2).sum(), rtol=0.01)
    one = trace(grey, Tracing(**choices), 1.0).outlines
    assert len(one) != 15 or abs(sum(whole([each.points])[0] for each in one) / areas.sum() - 1) > 0.05


def test_uneven_light_makes_no_grains_of_noise():
    """Half of the picture is empty."""
    grey = lit("added", 0.0).astype(float)
    grey[:, 220:] = 30 + 90 * np.linspace(0.0, 1.0, 380)[220:]
    grey += np.random.default_rng(4).normal(0, 15, grey.shape)
    assert len(trace(grey, Tracing(threshold="otsu", smooth=1.0, uneven=60), 1.0).outlines) == 9


def coins():
    if not os.path.exists(os.path.join(os.path.dirname(skimage_data.__file__), "coins.png")):
        pytest.skip("this scikit-image has the coins only by a download")
    return skimage_data.coins()


@pytest.mark.parametrize("width", [40, 70, 120])
def test_all_coins_are_found(width):
    found = trace(coins(), Tracing(threshold="otsu", smooth=1.0, uneven=width), 4.5e-4)
    assert len(found.outlines) == 24
    assert_allclose(sum(whole([each.points])[0] for each in found.outlines), 38700, rtol=0.01)


def test_coins_under_one_threshold_ask_for_more(tmp_path):
    said = []
    import_array(coins(), tmp_path / "out.h5", tracing=Tracing(threshold="otsu", smooth=1.0), say=said.append)
    assert "11 % of the picture (--border keeps them); uneven light? See --uneven" in "\n".join(said)


def test_convex_grains_are_their_hulls(tmp_path):
    """Discs with a notch each; of grains that touch, those whose hulls would overlap stay."""
    notch = placed([(0, -4), (12, -4), (12, 4), (0, 4)], 1, 0.0, 70, 60)
    cover = picture(120, 220, circle(30, 50, 60), circle(30, 150, 60), notch)
    grey = np.clip(200 * (cover[0] + cover[1] - cover[2]), 0, 200).astype(np.uint8)
    said = []
    import_array(grey, tmp_path / "a.h5", tracing=Tracing(threshold=100))
    pieces = [len(each) for each in bodies_of(tmp_path / "a.h5")]
    assert min(pieces) == 1 < max(pieces)
    import_array(grey, tmp_path / "b.h5", tracing=Tracing(threshold=100, convex=True), say=said.append)
    assert list(map(len, bodies_of(tmp_path / "b.h5"))) == [1, 1]
    assert_allclose([whole(pieces)[0] for pieces in bodies_of(tmp_path / "b.h5")], np.pi * 900, rtol=5e-3)
    assert "convex hulls: 2 of 2 grains, which adds 1.7 % to their area (greatest 3.1 %, grain 1 at" in "\n".join(said)
    labels = np.pad(stones(1), 40)
    labels[10:30, 10:30] = 1000
    touching = trace(labels, Tracing(convex=True), 1.0)
    assert re.search(r"convex hulls: \d+ of \d+ grains, .*; \d+ others keep their outlines, since their hulls would "
                     "overlap", "\n".join(touching.said))
    polygons = [shapely.Polygon(each.points) for each in touching.outlines]
    assert not shapely.STRtree(polygons).query(polygons, predicate="overlaps").size


def test_small_dents_make_no_pieces(tmp_path):
    """A disc with a noisy edge is one piece, with the area that it has in the picture."""
    angle = 2 * np.pi * np.arange(200) / 200
    rough = 40 * (1 + 0.012 * np.random.default_rng(0).standard_normal(200))
    outline = np.stack([60 + rough * np.cos(angle), 60 + rough * np.sin(angle)], axis=1)
    labels = (picture(120, 120, outline)[0] > 0.5).astype(int)
    import_array(labels, tmp_path / "out.h5", tracing=Tracing(tolerance=0.03))
    (pieces,) = bodies_of(tmp_path / "out.h5")
    assert len(pieces) == 1
    exact = trace(labels, Tracing(tolerance=1e-9), 1.0).outlines[0].points
    assert_allclose(whole(pieces)[0], whole([exact])[0], rtol=1e-9)


def test_the_error_of_the_threshold_is_told():
    """Discs of radius 30 with an edge 10 pixels wide: 5 % of the difference of the means is about half a pixel."""
    row, column = np.mgrid[:120, :120] + 0.5
    grey = 20 + 200 * np.clip(0.5 + (30 - np.hypot(row - 60, column - 60)) / 10, 0, 1)
    said = "\n".join(trace(grey, Tracing(threshold=120), 1.0).said)
    assert "change the total area of all grains by +3.0 % (grains: 1) and -2.8 % (grains: 1)" in said
    assert "total area of all grains, changed by the simplification: less than 0.01 %" in said
    assert "accuracy of the threshold" not in "\n".join(trace((grey > 120).astype(int), Tracing(), 1.0).said)


def test_noise_is_warned_of(tmp_path):
    noise = np.random.default_rng(0).integers(0, 255, (100, 150))
    with pytest.warns(UserWarning, match=r"\d+ pieces for \d+ bodies, so outlines are rough: smooth a grey picture"):
        import_array(noise, tmp_path / "out.h5", tracing=Tracing(threshold="otsu", least=50))


def test_steps_of_pixels_are_those_of_labels():
    """Thresholded discs of 15 pixels have no steps, whatever the tolerance."""
    cover = picture(60, 60, circle(15, 30, 30))[0]
    for values, choices, wanted in ((200 * cover, {"threshold": 100}, False), ((cover > 0.5).astype(int), {}, True)):
        found = trace(values, Tracing(tolerance=0.02, **choices), 1.0)
        assert ("steps of pixels stay as corners" in "\n".join(found.said)) == wanted


def test_arrays_and_files_of_numpy_are_pictures(tmp_path):
    labels = (picture(100, 200, circle(30, 50, 50), circle(30, 140, 50)) > 0.5) * np.array([3, 7])[:, None, None]
    labels = labels.sum(axis=0)
    np.save(tmp_path / "a.npy", labels)
    save(tmp_path / "a.png", labels.astype(np.uint8))
    (tmp_path / "a.labels").write_bytes((tmp_path / "a.npy").read_bytes())
    assert import_bodies(tmp_path / "a.npy", tmp_path / "a.h5", scale=1e-3) == 2
    assert import_bodies(tmp_path / "a.png", tmp_path / "b.h5", scale=1e-3) == 2
    assert import_bodies(tmp_path / "a.labels", tmp_path / "c.h5", form="picture", scale=1e-3) == 2
    assert import_array(labels.tolist(), tmp_path / "d.h5", scale=1e-3, fixed=[2]) == 2
    assert import_array(labels > 0, tmp_path / "e.h5", scale=1e-3) == 2
    vertices = []
    for name in "abcde":
        with h5py.File(tmp_path / f"{name}.h5") as file:
            vertices.append(file["vertex"][()])
    for each in vertices:
        assert_array_equal(each, vertices[0])


@pytest.mark.parametrize("values, message", [
    (np.array([{}], dtype=object), "a.npy: cannot be read"), (np.zeros((3, 3, 3)), "has the shape (3, 3, 3)"),
    (np.full((9, 9), -1), "has the label -1, but labels are whole numbers"), (np.full((9, 9), np.nan), "no finite"),
    (np.array([["a"]]), "the type <U1")])
def test_arrays_that_are_no_pictures_are_refused(values, message, tmp_path, capsys):
    np.save(tmp_path / "a.npy", values, allow_pickle=True)
    assert main(["import", str(tmp_path / "a.npy"), "-o", str(tmp_path / "out.h5")]) in (2, 3)
    assert message in capsys.readouterr().err


def test_a_picture_shows_the_outlines(tmp_path, capsys):
    cover = picture(100, 200, circle(30, 50, 50), placed([(0, 0), (40, 0), (40, 15), (15, 15), (15, 40), (0, 40)], 1,
                                                         0.3, 130, 30))
    path = save(tmp_path / "a.png", (200 * cover.sum(axis=0)).astype(np.uint8))
    command = ["import", str(path), "-o", str(tmp_path / "out.h5"), "--threshold", "100", "--scale", "1e-3",
               "--origin=1,2", "--picture"]
    assert main([*command, str(tmp_path / "check.gif")]) == 2
    assert "check.gif: cannot be written: the name must end with" in capsys.readouterr().err
    assert main([*command, str(path)]) == 2 and "did not make it" in capsys.readouterr().err
    assert not (tmp_path / "out.h5").exists()
    assert main([*command, str(tmp_path / "check.png")]) == 0
    assert f"{tmp_path / 'check.png'}: the outlines of the bodies" in capsys.readouterr().out
    (axes,) = draw_import(path, tmp_path / "out.h5", scale=1e-3).axes
    assert_allclose(axes.images[0].get_extent(), [0, 0.2, 0, 0.1])
    pieces, outlines = (lines.get_segments() for lines in axes.collections)
    several = [parts for parts in bodies_of(tmp_path / "out.h5") if len(parts) > 1]
    assert len(several) == 1 and len(pieces) == len(several[0]) and len(outlines) == 2 and len(axes.texts) == 2
    assert_allclose(outlines[0].mean(axis=0), [0.05, 0.05], atol=2e-3)
    drawing = tmp_path / "a.svg"
    drawing.write_text('<svg xmlns="http://www.w3.org/2000/svg"><circle r="5"/></svg>')
    assert main(["import", str(drawing), "-o", str(tmp_path / "b.h5"), "--picture", str(tmp_path / "b.pdf")]) == 0
    (axes,) = draw_import(drawing, tmp_path / "b.h5").axes
    assert not axes.images and len(axes.collections[1].get_segments()) == 1


def test_the_worst_grain_is_named(tmp_path, capsys):
    cover = picture(100, 200, circle(30, 50, 50), placed([(0, 0), (1, 0), (1, 1), (0, 1)], 50, 0.2, 120, 20))
    path = save(tmp_path / "a.png", (200 * cover.sum(axis=0)).astype(np.uint8))
    assert main(["import", str(path), "-o", str(tmp_path / "out.h5"), "--threshold", "100", "--tolerance", "0.1"]) == 0
    said = capsys.readouterr().out
    assert "(greatest less than 0.01 %), moment of inertia" in said and "e-1" not in said
    assert "moment of inertia" in said and ", grain 1 at pixel (50, 50))" in said
    assert "the scale is 1 m per pixel, because --scale is not given" in said
    assert "grains: 2, of 52 pixels = 51.6 m across" in said
    assert said.count("thickness of the thinnest") == 1 and "thinnest piece" not in said


def test_lines_of_a_drawing_join_end_to_end(tmp_path, capsys):
    document = ezdxf.new()
    space = document.modelspace()
    for begin, end in (((0, 0), (4, 0)), ((4, 3), (4, 0)), ((4, 3), (0, 0)), ((9, 9), (20, 9)), ((9, 9), (9, 20)),
                       ((30, 0), (40, 0)), ((40, 0), (40, 9)), ((40, 0), (30, 9)), ((40, 9), (30, 9)),
                       ((30, 9), (30, 0))):
        space.add_line(begin, end)
    space.add_line((50, 0), (60, 0))
    space.add_arc((55, 0), 5, 0, 180)
    document.saveas(tmp_path / "a.dxf")
    assert main(["import", str(tmp_path / "a.dxf"), "-o", str(tmp_path / "out.h5")]) == 0
    said = capsys.readouterr().out
    assert "closed lines: 2" in said and "joined of separate lines, end to end: 2, of 1 ARC, 4 LINE" in said
    assert "left out, since they are no closed lines: 7 LINE" in said
    areas = [whole(pieces)[0] for pieces in bodies_of(tmp_path / "out.h5")]
    assert_allclose(areas, [6, np.pi * 12.5], rtol=2e-3)


def test_svg_counts_texts_and_names_its_own_coordinates(tmp_path, capsys):
    path = tmp_path / "a.svg"
    path.write_text('<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 100 80"><text x="5" y="10">A</text>'
                    '<path d="M10 40 h20 v-6 h-14 v-14 h-6 z"/><path d="M50 50 h9"/><path d="M59 50 v9"/>'
                    '<path d="M59 59 L50 50"/></svg>')
    assert main(["import", str(path), "-o", str(tmp_path / "out.h5")]) == 2
    assert "it is concave at the vertex (16, 34)" in capsys.readouterr().err
    assert main(["import", str(path), "-o", str(tmp_path / "out.h5"), "--decompose"]) == 0
    said = capsys.readouterr().out
    assert "left out, since they are no closed lines: 1 text" in said and "end to end: 1, of 3 Path" in said


@pytest.mark.parametrize("words, message", [
    (["-o", "nodir/w.h5"], "w.h5: cannot be written (there is no folder"),
    (["-o", "w.txt"], "w.txt: cannot be written: the name must end with .h5 or .hdf5"),
    (["-o", "w.h5", "--scale", "1e-30"], "across with --scale 1e-30; bodies have 1e-09 to 1e+06 m"),
    (["-o", "w.h5", "--scale", "1e9"], "across with --scale 1e+09; bodies have")])
def test_outputs_and_scales_that_make_no_sense(words, message, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    np.save("a.npy", np.pad(np.ones((20, 20), dtype=int), 5))
    assert main(["import", "a.npy", *words]) in (2, 3)
    assert message in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["a.npy"]


def test_an_unknown_suffix_names_pictures_and_drawings(tmp_path):
    (tmp_path / "a.xyz").write_text("0 0")
    with pytest.raises(ResultError, match="give --from wkt, geojson, text, picture, dxf or svg"):
        import_bodies(tmp_path / "a.xyz", tmp_path / "out.h5")
