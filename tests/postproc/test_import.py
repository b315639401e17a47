"""Polygons of other programs as the bodies of a run."""

import csv
import json
import os
import subprocess
import time

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from polydem_post import Frame, ResultError
from polydem_post.base.convex import concave_vertices, decompose
from polydem_post.base.polygons import area_of, join, moments
from polydem_post.bodies_file import import_bodies, import_shapely, origin_of, pieces_of, write_bodies
from polydem_post.command_line.main import main
from polydem_post.read.trajectory import Trajectory

PROGRAM = os.environ["POLYDEM_PROGRAM"]
SQUARE = [(0.0, 0.0), (0.01, 0.0), (0.01, 0.01), (0.0, 0.01)]
FLOOR = [(-0.05, -0.01), (0.05, -0.01), (0.05, 0.0), (-0.05, 0.0)]
# An L, a star with five points, and combs with four and with 250 teeth.
L_SHAPE = [(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)]
STAR = [(np.cos(k * np.pi / 5) * (2 - k % 2), np.sin(k * np.pi / 5) * (2 - k % 2)) for k in range(10)]
STAR[1::2] = [(0.4 * x, 0.4 * y) for x, y in STAR[1::2]]
COMB, LONG_COMB = ([(0, 0), (2 * teeth - 1, 0), *[(2 * k + right, y) for k in range(teeth)[::-1]
                                                  for right, y in ((1, 3), (0, 3), (0, 1), (-1, 1))][:-2]]
                   for teeth in (4, 250))


def wkt(points):
    return "POLYGON ((" + ", ".join(f"{x!r} {y!r}" for x, y in [*points, points[0]]) + "))"


def geojson(points, **properties):
    ring = [list(point) for point in [*points, points[0]]]
    return {"type": "Feature", "properties": properties, "geometry": {"type": "Polygon", "coordinates": [ring]}}


def text(points, *words):
    return "\n".join([*words, *(f"{float(x)!r} {float(y)!r}" for x, y in points)])


def contents(path):
    with h5py.File(path) as file:
        return {name: file[name][()] for name in file}


@pytest.fixture(params=["wkt", "geojson", "text"])
def source(request, tmp_path):
    """A square above a fixed floor, in every format."""
    if request.param == "wkt":
        path = tmp_path / "two.wkt"
        path.write_text(f"# comment\n{wkt(SQUARE)}\n\nSRID=4326;{wkt(FLOOR[::-1]).lower()}\n")
    elif request.param == "geojson":
        path = tmp_path / "two.geojson"
        path.write_text(json.dumps({"type": "FeatureCollection", "features": [geojson(SQUARE), geojson(FLOOR)]}))
    else:
        path = tmp_path / "two.txt"
        path.write_text(f"# x y\n{text(SQUARE)}\n\n\n{text(FLOOR)}".replace(" ", ", "))
    return path


def test_the_program_takes_the_bodies(source, tmp_path, capsys):
    output = tmp_path / "bodies.h5"
    assert main(["import", str(source), "-o", str(output), "--fixed", "2"]) == 0
    assert f"{output}: 2 bodies; in the namelist: &scene name = 'file'" in capsys.readouterr().out
    found = contents(output)
    assert_array_equal(found["vertex_start"], [0, 4, 8])
    assert_array_equal(found["vertex"], SQUARE + FLOOR)
    assert_array_equal(found["fixed"], [0, 1])
    (tmp_path / "scene.nml").write_text(f"&scene\n name = 'file'\n bodies_file = '{output}'\n/\n"
                                        "&integrate\n duration = 0.001\n/\n")
    check = subprocess.run([PROGRAM, "check", "scene.nml"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert check.returncode == 0, check.stdout + check.stderr


def test_scales_give_metres(tmp_path):
    (tmp_path / "one.xy").write_text(text([(1e3 * x, 1e3 * y) for x, y in SQUARE]))
    import_bodies(tmp_path / "one.xy", tmp_path / "out.h5", scale=1e-3)
    assert_allclose(contents(tmp_path / "out.h5")["vertex"], SQUARE)


def test_the_origin_of_far_bodies_comes_near_and_back(tmp_path, capsys):
    east, north = 5.0e5, 5.4e6
    far = [[(east + x, north + y) for x, y in ((0, 0), (1e-3, 0), (1e-3, 1e-3), (0, 1e-3))],
           [(east - 2, north - 4), (east + 2, north - 4), (east + 2, north), (east - 2, north)]]
    (tmp_path / "far.txt").write_text("\n\n".join([text(far[0]), text(far[1], "fixed")]))
    scene = tmp_path / "scene.nml"
    scene.write_text(f"&scene name = 'file' bodies_file = '{tmp_path}/bodies.h5' /\n"
                     "&integrate duration = 1e-4 /\n&output contacts = .true. /\n")
    command = ["import", str(tmp_path / "far.txt"), "-o", str(tmp_path / "bodies.h5"), "--force"]
    warning = "warning: the lightest free body sinks by about"
    for words, shift, is_far in (([], (0.0, 0.0), True), (["--origin", "centre"], (east, north - 2), False),
                                 ([f"--origin={east + 8},{north - 9}"], (east + 8, north - 9), False)):
        assert main(command + words) == 0
        assert ("its origin is at" in capsys.readouterr().out) != is_far
        assert origin_of(tmp_path / "bodies.h5") == shift
        assert_allclose(contents(tmp_path / "bodies.h5")["vertex"], np.concatenate(far) - np.array(shift), atol=1e-9)
        done = subprocess.run([PROGRAM, "run", "scene.nml", "--force"], cwd=tmp_path, capture_output=True, text=True,
                              check=True)
        assert (warning in done.stdout) == is_far, done.stdout
        run = Trajectory(tmp_path / "results" / "scene")
        assert run.origin == shift
        assert len(run[-1].contacts) == 1
        assert_array_equal(run[-1].position + shift, run.in_world()[-1].position)
        assert main(["export", str(run.folder), "--to", "csv", "-o", str(tmp_path / "far.csv"), "--force"]) == 0
        capsys.readouterr()
        for name, x, y in (("far.csv", "position_x", "position_y"), ("far_contacts.csv", "point_x", "point_y")):
            with (tmp_path / name).open(newline="") as file:
                row = next(csv.DictReader(file))
            assert_allclose([float(row[x]), float(row[y])], [east, north], rtol=0, atol=1e-3)


@pytest.mark.parametrize("origin, message", [
    ("middle", "must be 'centre' or a point"), ((1.0,), "two finite numbers"), ((1.0, np.nan), "two finite numbers")])
def test_an_origin_is_a_point(tmp_path, origin, message):
    with pytest.raises(ResultError, match=message):
        write_bodies([SQUARE], tmp_path / "bodies.h5", origin=origin)


def test_materials_go_by_name_from_a_file_to_a_run_and_back(tmp_path):
    features = [geojson(SQUARE, material="wood"), geojson(FLOOR, fixed=True)]
    (tmp_path / "two.json").write_text(json.dumps({"features": features}))
    import_bodies(tmp_path / "two.json", tmp_path / "out.h5")
    assert_array_equal(contents(tmp_path / "out.h5")["material"], [1, 0])
    (tmp_path / "scene.nml").write_text(
        f"&scene name = 'file' bodies_file = '{tmp_path}/out.h5' wall_material = 'iron' /\n&material name = 'iron' /\n"
        "&material name = 'wood' density = 600 stiffness = 1e6 /\n&integrate duration = 1e-4 /\n")
    subprocess.run([PROGRAM, "run", "scene.nml"], cwd=tmp_path, capture_output=True, check=True)
    frame = Trajectory(tmp_path / "results" / "scene")[-1]
    assert_array_equal(frame.material, [2, 1])
    assert frame.material_names == ("iron", "wood")
    assert_allclose(frame.density[0], 600.0)
    frame.write_bodies(tmp_path / "again.h5")
    with h5py.File(tmp_path / "again.h5") as file:
        names = file["material_names"].asstr()[()].split()
        assert [names[number - 1] for number in file["material"]] == ["wood", "iron"]
    with pytest.raises(ResultError, match="the material is 7, but must be a name"):
        write_bodies([SQUARE], tmp_path / "bad.h5", material=7)


def test_geojson_gives_properties(tmp_path):
    features = [geojson(SQUARE, velocity=[0.5, -1], density=1000, name="a", id=7),
                geojson(FLOOR, fixed=True, density=2000, id=3)]
    (tmp_path / "two.json").write_text(json.dumps({"features": features}))
    import_bodies(tmp_path / "two.json", tmp_path / "out.h5")
    found = contents(tmp_path / "out.h5")
    assert set(found) == {"vertex", "vertex_start", "fixed", "velocity", "density", "id"}
    assert_array_equal(found["velocity"], [[0.5, -1], [0, 0]])
    assert_array_equal(found["density"], [1000, 2000])
    assert_array_equal(found["id"], [7, 3])


def test_plain_text_has_fixed_bodies(tmp_path):
    (tmp_path / "two.txt").write_text(f"{text(SQUARE)}\n\n{text(FLOOR, 'fixed')}\n")
    import_bodies(tmp_path / "two.txt", tmp_path / "out.h5")
    assert_array_equal(contents(tmp_path / "out.h5")["fixed"], [0, 1])


def test_multipolygons_are_several_bodies(tmp_path):
    rings = wkt(SQUARE)[8:], wkt(FLOOR)[8:]
    (tmp_path / "many.wkt").write_text(f"MULTIPOLYGON ({rings[0]}, {rings[1]})")
    assert import_bodies(tmp_path / "many.wkt", tmp_path / "out.h5") == 2


def test_geometries_of_shapely(tmp_path):
    shapely = pytest.importorskip("shapely", reason="shapely is not installed: pip install shapely")
    both = shapely.MultiPolygon([shapely.Polygon(SQUARE), shapely.Polygon(FLOOR)])
    assert import_shapely(both, tmp_path / "out.h5", fixed=[2]) == 2
    assert_allclose(contents(tmp_path / "out.h5")["vertex"], SQUARE + FLOOR)
    assert import_shapely([shapely.Point(0, 0).buffer(1.0), *both.geoms], tmp_path / "more.h5") == 3
    with pytest.raises(ResultError, match="geometry 1: is a LineString, not a polygon"):
        import_shapely(shapely.LineString(SQUARE), tmp_path / "line.h5")
    with pytest.raises(ResultError, match="geometry 1: the polygon has a hole"):
        import_shapely(shapely.Polygon(FLOOR, [[(0, -2e-3), (1e-3, -2e-3), (0, -4e-3)]]), tmp_path / "hole.h5")


@pytest.mark.parametrize("shape, fewest", [(L_SHAPE, 2), (STAR, 6), (COMB, 5), (LONG_COMB, 251)])
@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_concave_outlines_become_convex_pieces(shape, fewest, turn):
    turned = np.array(shape) @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    pieces = decompose(turned)
    assert all(not concave_vertices(piece) and area_of(piece) > 0.0 for piece in pieces)
    assert_allclose(sum(map(area_of, pieces)), area_of(turned), rtol=1e-12)
    area, centre, _ = moments(*join(pieces))
    assert_allclose(area @ centre / area.sum(), moments(*join([turned]))[1][0], atol=1e-12 * np.abs(turned).max())
    # A decomposition needs at least half as many cuts as there are reflex vertices.
    assert fewest <= len(pieces) <= len(concave_vertices(turned)) + 1


def test_a_concave_outline_is_named_or_decomposed(tmp_path, capsys):
    path, output = tmp_path / "l.wkt", tmp_path / "out.h5"
    path.write_text(f"{wkt(SQUARE)}\n{wkt(L_SHAPE)}\n")
    assert main(["import", str(path), "-o", str(output)]) == 2
    assert f"{path}:2: the outline cannot be a body: it is concave at the vertex (1, 1); --decompose makes a body " \
        "of several convex pieces of it" in capsys.readouterr().err
    assert not output.exists()
    assert import_bodies(path, output, decomposed=True, fixed=[2]) == 2
    assert_array_equal(contents(output)["fixed"], [0, 1])
    assert_array_equal(contents(output)["piece"], [0] * 4 + [0] * 4 + [1] * 4)


def test_the_number_of_pieces_and_the_thinnest_are_told(tmp_path, capsys):
    """Finds thicknesses of whole bodies or of those in one piece, and pieces that count as bodies."""
    path, output = tmp_path / "stones.wkt", tmp_path / "out.h5"
    thin = [(0, 0), (3, 0), (3, 0.01), (0, 0.01)]
    path.write_text(f"{wkt(SQUARE)}\n{wkt(L_SHAPE)}\n{wkt(thin)}\n")
    assert main(["import", str(path), "-o", str(output), "--decompose", "--scale", "1e-2"]) == 0
    assert capsys.readouterr().out.startswith(f"{output}: bodies of several pieces: 1; most pieces of a body: 2; "
                                              "thickness of the thinnest piece: 0.00889 m,")
    assert pieces_of(output) == (1, 2, pytest.approx(0.02 * 4 / 9))  # centre of a trapezium
    write_bodies([SQUARE], tmp_path / "one.h5")
    assert pieces_of(tmp_path / "one.h5") == (0, 1, np.inf)


# A square with a vertex on an edge, turned in single precision; the like in Lambert 93 coordinates; a closing vertex
# that is off by rounding; a vertex within the tolerance of an edge.
NEARLY_CONVEX = [
    [(-8.470019340515137, 0.5455836057662964), (-7.678089141845703, 0.658928632736206),
     (-7.084141731262207, 0.7439373731613159), (-7.367504119873047, 2.723762035369873),
     (-9.347329139709473, 2.440399646759033), (-9.063966751098633, 0.4605748653411865)],
    [(1051174.0, 6839999.9), (1051178.8, 6839991.7), (1051183.7, 6839994.6), (1051178.8, 6840002.7),
     (1051176.4, 6840001.3)],
    [(0.0, 0.0), (1.0, 0.0), (1.0, 0.5), (0.0, 0.5), (1e-10, -1e-10)],
    [(0.0, 0.0), (0.5, 0.5e-9), (1.0, 0.0), (0.5, 1.0)],
]
# Deviations beyond the tolerance, at the origin and far from it, and an outline that crosses itself
CONCAVE = [
    [(0.0, 0.0), (0.5, 3e-9), (1.0, 0.0), (0.5, 1.0)],
    [(6e6, 6e6), (6e6 + 0.5, 6e6 + 3e-8), (6e6 + 1.0, 6e6), (6e6 + 0.5, 6e6 + 1.0)],
    [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0), (0.5, 1.0)],
]


def program_says(points, folder):
    """The messages of `check` on one free body of these vertices, just as they are."""
    with h5py.File(folder / "raw.h5", "w") as file:
        file["vertex"], file["vertex_start"] = np.array(points), [0, len(points)]
        file["fixed"] = np.zeros(1, dtype=np.int8)
    (folder / "raw.nml").write_text("&scene\n name = 'file'\n bodies_file = 'raw.h5'\n/\n"
                                    "&integrate\n duration = 0.001\n/\n")
    check = subprocess.run([PROGRAM, "check", "raw.nml"], cwd=folder, capture_output=True, text=True, check=False)
    return check.returncode, check.stdout + check.stderr


@pytest.mark.parametrize("points", NEARLY_CONVEX)
def test_what_the_program_takes_is_imported(points, tmp_path):
    assert program_says(points, tmp_path)[0] == 0
    assert write_bodies([points], tmp_path / "out.h5") == 1


@pytest.mark.parametrize("points", CONCAVE)
def test_what_the_program_refuses_is_refused(points, tmp_path):
    code, said = program_says(points, tmp_path)
    assert code == 2 and ("convex" in said or "crosses" in said), said
    with pytest.raises(ResultError, match="cannot be a body"):
        write_bodies([points], tmp_path / "out.h5")


def test_coordinates_that_cannot_be_computed_with_are_refused(tmp_path):
    with pytest.raises(ResultError, match=r"cannot be a body: a coordinate is beyond 1e\+50 m"):
        write_bodies([[(0, 0), (1e200, 0), (0, 1)]], tmp_path / "out.h5")


def test_a_small_deviation_is_visible_at_large_coordinates(tmp_path):
    with pytest.raises(ResultError, match=r"concave at the vertex \(6000000.5, 6000000.00000003"):
        write_bodies([CONCAVE[1]], tmp_path / "out.h5")


def features(*properties):
    """GeoJSON of triangles with these properties."""
    triangle = {"type": "Polygon", "coordinates": [[[0, 0], [1, 0], [0, 1]]]}
    return json.dumps({"features": [{"type": "Feature", "properties": each, "geometry": triangle}
                                    for each in properties]})


@pytest.mark.parametrize("name, content, message", [
    ("a.wkt", "POINT (1 2)", "a.wkt:1: is not a POLYGON or MULTIPOLYGON of WKT: 'POINT (1 2)'"),
    ("a.wkt", "POLYGON ((0 0, 1 0, x 1))", "a.wkt:1: a vertex is not a pair of numbers"),
    ("a.wkt", "\nPOLYGON ((0 0, 1 0, 1 1)", "a.wkt:2: the brackets of the geometry do not match"),
    ("a.wkt", "POLYGON((\n0 0,\n1 0,\n0 1,\n0 0))\n",
     "a.wkt:1: the brackets of the geometry do not match; a geometry must stand on one line"),
    ("a.wkt", "POLYGON (0 0, 1 0, 0 1, 0 0)", "a.wkt:1: a bracket pair is missing: POLYGON ((x y, ...)) was expected"),
    ("a.wkt", "MULTIPOLYGON ((0 0, 1 0, 0 1))", "a bracket pair is missing: MULTIPOLYGON (((x y, ...))) was expected"),
    ("a.wkt", "POLYGON (((0 0, 1 0, 0 1)))", "a.wkt:1: a bracket pair is too many: POLYGON ((x y, ...)) was expected"),
    ("a.wkt", "POLYGON EMPTY", "a.wkt:1: the polygon is empty; remove this line"),
    ("a.wkt", "POLYGON ((0 0, 9 0, 9 9, 0 9), (1 1, 2 1, 2 2))", "a.wkt:1: the polygon has a hole"),
    ("a.wkt", "", "a.wkt: holds no polygons"),
    ("a.wkt", "POLYGON ((0 0, 1e200 0, 0 1))", "a.wkt:1: would be 1e+200 m across with --scale 1; bodies have 1e-09"),
    ("a.json", "{", "a.json:1: is not JSON"),
    ("a.json", "[" * 100000, "a.json: its lists are nested too deeply"),
    ("a.json", '{"type": "Feature", "geometry": null}', "a.json: has no geometry"),
    ("a.json", '{"type": "Point", "coordinates": [0, 0]}', "a.json: is a Point, not a Polygon or MultiPolygon"),
    ("a.json", '{"type": "Polygon", "coordinates": [[0, 0], [1, 0], [0, 1]]}',
     "a.json: the coordinates have 2 list levels, but those of a Polygon have 3: [[[x, y], ...]]"),
    ("a.json", '{"type": "MultiPolygon", "coordinates": [[[0, 0], [1, 0], [0, 1]]]}',
     "a.json: the coordinates have 3 list levels, but those of a MultiPolygon have 4: [[[[x, y], ...]]]"),
    ("a.json", features({"fixed": "true"}), "a.json: the fixed is 'true', but must be true or false, without quotes"),
    ("a.json", '{"type": "Polygon", "coordinates": [[[0], [1, 0], [1, 1]]]}', "the vertices are not pairs of numbers"),
    ("a.json", features({}, {"velocity": "fast"}), "a.json: feature 2: the velocity is 'fast', not 2 number(s)"),
    ("a.json", features({"id": 3}, {}), "a.json: feature 2: has no id, which other polygons have"),
    *(("a.json", features({"density": 1.0}, {"density": 1.0, name: value}),
       f"a.json: feature 2: the {name} is {value!r}, but must be {wanted}")
      for name, value, wanted in (
          ("fixed", 2, "true or false"), ("density", 0, "a number above 0"), ("mass", -1.0, "a number not below 0"),
          ("inertia", float("inf"), "a number not below 0"), ("velocity", [float("nan"), 1], "finite"))),
    *(("a.json", features({"id": 3}, {"id": wrong}), f"feature 2: the id is {wrong}, but must be a whole number from 0")
      for wrong in (1.5, -1, 2**31)),
    ("a.json", features({"id": 3}, {"id": 3}), "feature 2: the id 3 is that of"),
    ("a.json", '{"features": 3}', "a.json: its features are no list"),
    ("a.json", features({}, [1]), "a.json: feature 2: its properties are no object of GeoJSON"),
    ("a.txt", "0 0\n1 0\n1 one\n", "a.txt:3: is neither a vertex such as '0.1 0.2' nor the word fixed: '1 one'"),
    ("a.txt", "0 0\n1 0\n", "a.txt:1: the outline cannot be a body: it has 2 different vertices"),
    ("a.txt", "# first\n0 0\n1 0\n1 1\n# second\n2 0\n3 0\n3 1\n",
     "cross. The comment in line 5 does not end an outline; an empty line between outlines does"),
    ("a.txt", "\n0 0\n1 0\n2 0\n", "a.txt:2: the outline cannot be a body: it has 2 different vertices"),
    ("a.txt", "0 0\n1 1\n1 0\n0 1\n", "a.txt:1: the outline cannot be a body"),
    ("a.txt", text([STAR[k] for k in (0, 4, 8, 2, 6)]), "its edges 1 and 3 cross"),
    ("a.txt", "0 0\n1 0\n1 1e999\n", "a coordinate is not a finite number"),
    ("a.xyz", "0 0", "its name does not say the format; give --from wkt, geojson, text"),
    ("a.dwg", "0 0", "import reads polygons, wkt, geojson, text, but this is a drawing; convert it to WKT or GeoJSON"),
    ("a.PDF", "0 0", "but this is a picture in a page; save it as PNG, which import traces"),
    ("a.stl", "0 0", "but this is a body in space; cut it"),
])
def test_errors_name_the_place(tmp_path, capsys, name, content, message):
    (tmp_path / name).write_text(content)
    assert main(["import", str(tmp_path / name), "-o", str(tmp_path / "out.h5")]) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out.h5").exists()


def test_nothing_is_replaced_unless_asked(tmp_path, capsys):
    (tmp_path / "one.txt").write_text(text(SQUARE))
    (tmp_path / "out.h5").write_text("mine")
    command = ["import", str(tmp_path / "one.txt"), "-o", str(tmp_path / "out.h5")]
    assert main(command) == 2
    assert "exists already; --force replaces it" in capsys.readouterr().err
    assert (tmp_path / "out.h5").read_text() == "mine"
    assert main(["import", str(tmp_path / "one.txt"), "-o", str(tmp_path / "one.txt"), "--force"]) == 2
    assert "one.txt: is the file that is imported" in capsys.readouterr().err
    assert main([*command, "--force"]) == 0
    assert main([*command, "--force", "--fixed", "2"]) == 2
    assert "there is no outline 2, only 1" in capsys.readouterr().err


def test_arrays_become_bodies(tmp_path):
    assert write_bodies([np.array(SQUARE), FLOOR], tmp_path / "out.h5", fixed=[2]) == 2
    with h5py.File(tmp_path / "out.h5") as file:
        assert list(file["fixed"]) == [0, 1]
    write_bodies([np.array(SQUARE), FLOOR], tmp_path / "out.h5", fixed=np.array([True, False]), overwrite=True)
    with h5py.File(tmp_path / "out.h5") as file:
        assert list(file["fixed"]) == [1, 0]
    with pytest.raises(ResultError, match="one truth value for each of 2 outlines"):
        write_bodies([np.array(SQUARE), FLOOR], tmp_path / "out.h5", fixed=[True], overwrite=True)


def run_of(path, folder, *settings, groups=""):
    """A run from a bodies file, with more groups: its trajectory."""
    (folder / "again.nml").write_text(f"&scene\n name = 'file'\n bodies_file = '{path}'\n/\n"
                                      f"&integrate\n duration = 1e-4\n/\n{groups}")
    done = subprocess.run([PROGRAM, "run", "again.nml", "--force", *settings], cwd=folder, capture_output=True,
                          text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return Trajectory(folder / "results" / "again")


def assert_same_start(first, frame):
    """The first frame of a run has the bodies of another frame: to the last bit but for positions and angles."""
    for name in ("id", "fixed", "mass", "inertia", "vertex_start"):
        assert_array_equal(getattr(first, name), getattr(frame, name), err_msg=name)
    for name in ("velocity", "angular_velocity"):
        assert_array_equal(getattr(first, name)[frame.free], getattr(frame, name)[frame.free], err_msg=name)
    rounding = 8 * np.finfo(float).eps * np.abs(frame.vertex).max()  # of a coordinate
    assert_allclose(first.position, frame.position, rtol=0, atol=rounding)
    assert_allclose(first.vertex, frame.vertex, rtol=0, atol=rounding)
    assert_allclose(first.density[frame.free], frame.density[frame.free], rtol=8 * rounding / frame.thickness.min())
    assert not first.angle.any() and first.time == 0.0


def test_a_run_starts_from_a_frame_of_another(small_drum, tmp_path):
    run = Trajectory(small_drum)
    frame = run[-1]
    assert frame.write_bodies(tmp_path / "late.h5") == len(frame)
    assert_array_equal(contents(tmp_path / "late.h5")["vertex"], frame.vertex)
    assert np.ptp(frame.angle[frame.free]) > 1.0 and frame.speed[frame.free].max() > 0.01
    again = run_of(tmp_path / "late.h5", tmp_path, "--set=output.contacts=.true.")
    assert_same_start(again[0], frame)
    # The contacts are the same, too: the bodies lie where they lay.
    for one, other in zip(*([each.contacts.first, each.contacts.second] for each in (again[0], frame))):
        assert_array_equal(one, other)
    with pytest.raises(ResultError, match="overwrite=True"):
        frame.write_bodies(tmp_path / "late.h5")
    assert run[0].write_bodies(tmp_path / "late.h5", overwrite=True) == len(frame)


def test_a_frame_keeps_masses_moving_walls_and_the_origin(tmp_path):
    # Bodies with identifiers, masses and inertias of their own; a wall with a mass that moves, and one without.
    outlines = [SQUARE, [(x + 0.02, y + 0.001) for x, y in SQUARE], FLOOR, [(x, y + 0.1) for x, y in FLOOR]]
    write_bodies(np.array(outlines[:2]).tolist() + outlines[2:], tmp_path / "one.h5", fixed=[3, 4],
                 velocity=[[0.1, 0.2], [1 / 3, 0], [0, 0], [0, 0]], angular_velocity=[2 / 7, -1.0, 0, 0],
                 density=[1000.0, 1234.5, np.inf, np.inf], mass=[0.0, 0.77, np.inf, 3.0],
                 inertia=[0.0, 1.1e-5, np.inf, np.inf], id=[9, 4, 2, 7], origin=(100.0, 50.0), scale=1.0)
    moved = "&motion name = 'push' kind = 'translation' bodies = 2 velocity = 0.3, 0 /\n"
    first = run_of(tmp_path / "one.h5", tmp_path, groups=moved)
    frame = first[-1]
    assert_array_equal(frame.id, [2, 4, 7, 9])
    assert_array_equal(frame.mass[:3], [np.inf, 0.77, 3.0])
    assert frame.mass[3] == pytest.approx(1000.0 * 1e-4, rel=1e-12) and frame.inertia[1] == 1.1e-5
    assert np.isinf(frame.inertia[[0, 2]]).all()
    assert frame.speed[0] == pytest.approx(0.3)
    frame.write_bodies(tmp_path / "two.h5")
    assert origin_of(tmp_path / "two.h5") == (100.0, 50.0)
    (tmp_path / "second").mkdir()
    again = run_of(tmp_path / "two.h5", tmp_path / "second")
    assert again.origin == (100.0, 50.0)
    assert_same_start(again[0], frame)
    assert not again[0].speed[0]
    # In the world the coordinates have the origin, so there is none to store.
    far = first.in_world()[-1]
    far.write_bodies(tmp_path / "far.h5")
    assert origin_of(tmp_path / "far.h5") == (0.0, 0.0)
    assert_array_equal(contents(tmp_path / "far.h5")["vertex"], far.vertex)


def test_columns_of_bodies(tmp_path):
    write_bodies([SQUARE, FLOOR], tmp_path / "out.h5", velocity=(0.5, -1.0), density=1500, id=np.array([3, 1]))
    found = contents(tmp_path / "out.h5")
    assert set(found) == {"vertex", "vertex_start", "fixed", "velocity", "density", "id"}
    assert_array_equal(found["velocity"], [[0.5, -1.0], [0.5, -1.0]])
    assert_array_equal(found["density"], [1500.0, 1500.0])
    assert_array_equal(found["id"], [3, 1])
    made = Frame.from_polygons([np.array(SQUARE), np.array(FLOOR)], fixed=[False, True], velocity=[[1, 2], [0, 0]])
    assert made.write_bodies(tmp_path / "made.h5") == 2
    assert_same_start(run_of(tmp_path / "made.h5", tmp_path)[0], made)


@pytest.mark.parametrize("columns, message", [
    ({"speed": 1.0}, "no column speed; its columns are fixed, velocity"),
    ({"velocity": [1.0, 2.0, 3.0]}, r"velocity has the shape \(3,\), but must have \(2, 2\), one value for each of 2"),
    ({"mass": [1.0]}, r"mass has the shape \(1,\)"),
    ({"mass": [np.inf, 1.0]}, "outline 1: the mass is inf, but must be a number not below 0"),
    ({"density": [1.0, 0.0]}, "outline 2: the density is 0.0, but must be a number above 0"),
    ({"id": 5}, "the id 5 is that of outline 1, too")])
def test_wrong_columns_are_errors(columns, message, tmp_path):
    with pytest.raises(ResultError, match=message):
        write_bodies([SQUARE, FLOOR], tmp_path / "out.h5", **columns)
    assert not (tmp_path / "out.h5").exists()


def test_outlines_of_100_000_corners_take_seconds(tmp_path):
    """A circle becomes a body, and a flower with as many corners is refused."""
    angle = np.linspace(0.0, 2.0 * np.pi, 100_000, endpoint=False)
    circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    began = time.process_time()
    assert write_bodies([circle], tmp_path / "circle.h5") == 1
    # Vertices between their neighbours on one line go.
    assert 10_000 < len(contents(tmp_path / "circle.h5")["vertex"]) < 100_000
    with pytest.raises(ResultError, match="it is concave at the vertex"):
        write_bodies([circle * (1.0 + 0.1 * np.cos(7.0 * angle))[:, None]], tmp_path / "flower.h5")
    circle[[500, 90_000]] = circle[[90_000, 500]]
    with pytest.raises(ResultError, match=r"its edges \d+ and \d+ cross"):
        write_bodies([circle], tmp_path / "crossing.h5")
    # A test of all pairs took minutes.
    assert time.process_time() - began < 60.0


@pytest.mark.parametrize("digits", [400, 5000])
def test_coordinates_may_have_hundreds_of_digits(tmp_path, digits):
    for name, number in (("good", "0." + digits * "3"), ("great", digits * "3")):
        (tmp_path / f"{name}.wkt").write_text(f"POLYGON ((0 0, {number} 0, 1 1, 0 1, 0 0))\n")
        (tmp_path / f"{name}.txt").write_text(f"0 0\n{number} 0\n1 1\n0 1\n")
        (tmp_path / f"{name}.geojson").write_text(
            f'{{"type": "Polygon", "coordinates": [[[0, 0], [{number}, 0], [1, 1], [0, 1], [0, 0]]]}}')
    for suffix in ("wkt", "txt", "geojson"):
        assert import_bodies(tmp_path / f"good.{suffix}", tmp_path / f"{suffix}.h5") == 1
        assert_array_equal(contents(tmp_path / f"{suffix}.h5")["vertex"][1], [1.0 / 3.0, 0.0])
        with pytest.raises(ResultError, match=f"great.{suffix}.*a coordinate is not a finite number"):
            import_bodies(tmp_path / f"great.{suffix}", tmp_path / "no.h5")
