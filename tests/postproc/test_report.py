"""Tables and figures of a whole report."""

import csv
import os
import re
from dataclasses import replace
from pathlib import Path

import pytest
from matplotlib.image import imread
from polydem_lab.bench.samples import read_bench
from polydem_lab.claims.targets import targets
from polydem_lab.costs import complexity
from polydem_lab.report import bench_report
from polydem_lab.report.bench_figures import bench_drawings
from polydem_lab.report.files import write_figures
from polydem_lab.report.own_figures import own_drawings
from polydem_lab.report.paper_figures import paper_drawings
from polydem_lab.report.style import LOOKS
from polydem_lab.tables import bench_tables, paper_tables
from polydem_lab.tables.slope_tables import slopes
from polydem_post.command_line.main import main
from synthetic_bench import Machine, input_of, kept_in_memory, truths, write_drums, write_hard_scenes, write_sample

FIGURES = (
    "all_scenes",
    "own_over_size",
    "local_exponents",
    "fine_grained",
    "fine_grained_limits",
    "figure_01_idle_swaps",
    "figure_08_13_machines",
    "figure_09_total",
    "figure_10_update",
    "figure_11_inlining",
    "figure_12_interpreted",
    "finders_over_size",
    "speed_up",
    "cache_misses",
    "work_over_size",
)
TABLES = (
    "reasons",
    "skipped",
    "local_exponents",
    "fine_grained",
    "fine_grained_limits",
    "table_1",
    "table_2",
    "table_3",
    "times",
    "phases",
    "counters",
    "first_step",
    "scenes",
    "speed_up",
    "list_cost",
    "slopes",
    "builds",
    "cache",
    "claims",
)
SIZES = (2522, 5058, 12651, 100000)
CACHE = """scene,boxes,finder,few,more,instructions,accesses,first_level,last_level,mispredictions,model,hardware
drum_2522,2522,quadtree,2,12,200.0,90.0,2.9,0.2,-1.0,"D1 32 KiB 8-way, LL 1 MiB 16-way",not available
drum_5058,5058,quadtree,2,12,200.0,90.0,3.1,0.9,-1.0,"D1 32 KiB 8-way, LL 1 MiB 16-way",not available
"""


@pytest.fixture(scope="module", autouse=True)
def in_memory():
    """The samples; test_bench.py reads those of files."""
    with kept_in_memory():
        yield


@pytest.fixture(scope="module")
def folders(tmp_path_factory):
    """Two machines, the first with two builds, hard scenes and counted misses."""
    folder = tmp_path_factory.mktemp("benches")
    finders = truths()
    write_drums(folder / "a", finders, sizes=SIZES, repeats=3)
    write_hard_scenes(folder / "a", finders)
    (folder / "a" / "cache.csv").write_text(CACHE, encoding="utf-8")
    write_drums(folder / "b", finders, Machine("beta", "AMD EPYC", slowness=1.3), SIZES, repeats=3)
    write_drums(folder / "c", finders, Machine(options="-O2"), SIZES, repeats=2)
    return [folder / name for name in "abc"]


@pytest.fixture(scope="module")
def bench(folders):
    return read_bench(folders)


@pytest.fixture(scope="module")
def report(folders, tmp_path_factory):
    output = tmp_path_factory.mktemp("report")
    assert main(["tables", *map(str, folders), "--output", str(output)]) == 0
    return output


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_is_there_in_three_forms_and_not_empty(report, name):
    pixels = imread(report / "figures" / f"{name}.png")
    assert min(pixels.shape[:2]) > 500
    assert pixels[..., :3].std() > 0.02
    assert (report / "figures" / f"{name}.pdf").read_bytes().startswith(b"%PDF")
    assert "</svg>" in (report / "figures" / f"{name}.svg").read_text(encoding="utf-8")
    assert f"**{name}**" in (report / "figures" / "captions.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("name", TABLES)
def test_every_table_is_there_in_four_forms(report, name):
    with (report / "tables" / f"{name}.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    if name != "table_3" or complexity.counter() is not None:
        assert len(rows) > 1
    assert len({len(row) for row in rows}) == 1
    for end in ("txt", "md", "tex"):
        assert (report / "tables" / f"{name}.{end}").stat().st_size > 0


def test_every_table_and_the_claims_name_what_made_their_numbers(report):
    made = "Samples of polydem unknown (revision abc, Release)."
    texts = [*(report / "tables").glob("*.md"), *(report / "tables").glob("*.txt"), report / "claims.md"]
    assert len(texts) > 20
    for path in [*texts, report / "tables" / "revision.txt"]:
        assert made in path.read_text(encoding="utf-8"), path


def test_a_report_is_the_same_every_time(report, folders, monkeypatch, tmp_path):
    """All tables, and two figures; POLYDEM_FULL=1 writes all figures again."""
    if not os.environ.get("POLYDEM_FULL"):
        monkeypatch.setattr(bench_report, "write_figures",
                            lambda drawn, folder: write_figures(drawn[:2], folder)[:-1])
    assert main(["tables", *map(str, folders), "--output", str(tmp_path)]) == 0
    files = sorted(path.relative_to(tmp_path) for path in tmp_path.rglob("*.*") if path.name != "captions.md")
    assert len(files) > 80
    for path in files:
        assert (report / path).read_bytes() == (tmp_path / path).read_bytes(), path


def rows_of(table):
    """Rows as dictionaries."""
    return [dict(zip(table.heading, row)) for row in table.rows]


def test_table_1_shows_the_papers_machines_and_ours(bench):
    rows = rows_of(paper_tables.machines(bench))
    assert [row["machine"] for row in rows[-2:]] == ["Intel Xeon X1", "AMD EPYC"]
    assert rows[-2]["clock [GHz]"] == "2.4"
    assert any("E5-2680v4" in row["machine"] for row in rows)


def test_table_2_sets_used_nodes_beside_reserved_ones(bench):
    rows = rows_of(paper_tables.depth_and_nodes(bench.on()))
    row = next(row for row in rows if row["boxes"] == "12651" and row["finder"] == "quadtree")
    assert (row["depth, paper"], row["nodes, paper"]) == ("10", "349525")
    assert (row["full tree of our depth"], row["nodes per box"]) == ("349525", "1.60")


@pytest.mark.parametrize("time, reached", [(45.0, "yes"), (60.0, "undecided"), (70.0, "no")])
def test_targets_are_judged_on_the_drum_of_12651_boxes(tmp_path, time, reached):
    finders = {"quadtree": replace(truths()["quadtree"], time=time), "verlet": truths()["quadtree"]}
    write_drums(tmp_path, finders, sizes=(12651,), repeats=7, threads=(1,))
    (row,) = rows_of(targets(read_bench([tmp_path])))
    assert row["reached"] == reached
    assert float(row["over verlet, same run"].split()[0]) == pytest.approx(time / 45.0, rel=0.05)


def test_the_speed_up_is_that_of_the_truth(bench):
    rows = rows_of(bench_tables.speed_up(bench.on()))
    found = {row["finder"]: float(row["speed-up"].split()[0]) for row in rows}
    assert found["quadtree"] == pytest.approx(1.7, rel=0.05)
    assert found["partitioned_sweep"] == pytest.approx(0.8, rel=0.05)


def test_the_best_finder_of_a_scene_is_marked(bench):
    rows = rows_of(bench_tables.scenes(bench.on()))
    soft = next(row for row in rows if row["scene"] == "soft_3")
    assert soft["linked_cells"].endswith("*") and not soft["quadtree"].endswith("*")


def test_the_figure_of_total_times_tells_fitted_slopes_and_the_papers(bench):
    drawing = next(each for each in paper_drawings(bench) if each.name == "figure_09_total")
    left, _, below = sorted(drawing.figure.axes, key=lambda axis: axis.get_legend() is not None)
    texts = [text.get_text() for text in below.get_legend().get_texts()]
    (text,) = [text for text in texts if text.startswith("quadtree: exponent ") and text.endswith("; paper 0.994")]
    assert float(text.split()[2]) == pytest.approx(1.0, abs=0.02)
    assert (left.get_xlabel(), left.get_ylabel()) == ("boxes", "time per step [ms]")
    assert "paper: about 0.9" in texts


def test_threads_are_compared_in_one_figure(bench):
    drawing = next(each for each in bench_drawings(bench) if each.name == "speed_up")
    (legend,) = [axis.get_legend() for axis in drawing.figure.axes if axis.get_legend()]
    labels = [text.get_text() for text in legend.get_texts()]
    assert {"sweep, partitioned lists", "quadtree, search", "linked cells, scan"} <= set(labels)


def test_one_machine_alone_is_told_in_the_caption(folders):
    alone, both = (
        next(each.caption for each in paper_drawings(read_bench(some)) if "machines" in each.name)
        for some in (folders[:1], folders[:2])
    )
    assert "Only one machine" in alone and "Only one machine" not in both


def test_the_smallest_bench_gives_a_report_too(tmp_path):
    write_drums(tmp_path / "a", {"verlet": truths()["quadtree"]}, sizes=(1000,), repeats=1)
    assert main(["tables", str(tmp_path / "a")]) == 0
    assert "not measured" in (tmp_path / "a" / "report" / "claims.md").read_text(encoding="utf-8")


def test_scenes_of_ones_own_have_a_figure_of_time_over_size_and_what_is_missing_is_said(tmp_path):
    for boxes in (500, 2000):
        for finder in ("quadtree", "verlet"):
            for repeat in range(3):
                write_sample(tmp_path / "a", f"mine_{boxes}", finder, truths()["quadtree"], boxes, repeat=repeat,
                             made_by=input_of("other", boxes))
    assert main(["tables", str(tmp_path / "a")]) == 0
    report = tmp_path / "a" / "report"
    assert {path.stem for path in (report / "figures").glob("*.png")} == {"own_over_size", "all_scenes"}
    (drawing,) = [each for each in own_drawings(read_bench([tmp_path / "a"])) if each.name == "own_over_size"]
    (axis,) = [each for each in drawing.figure.axes if each.get_xlabel()]
    assert (axis.get_xlabel(), axis.get_title(), len(axis.containers)) == ("boxes", "mine", 2)
    text = (report / "tables" / "skipped.csv").read_text(encoding="utf-8")
    assert 'figure_09_total,figure,"rotating drums' in text and "\nC1,claim," in text


def test_a_curve_over_size_joins_scenes_recorded_at_one_time(tmp_path):
    for name, boxes, start in (("even_500", 500, 0.01), ("even_1000", 1000, 0.01), ("even_2000", 2000, 0.01),
                               ("gas", 1005, 0.1)):
        made_by = input_of("gas", boxes) + f"&output\n  trace_start = {start}\n/\n"
        write_sample(tmp_path, name, "verlet", truths()["quadtree"], boxes, made_by=made_by)
    (drawing,) = [each for each in own_drawings(read_bench([tmp_path])) if each.name == "own_over_size"]
    (axis,) = [each for each in drawing.figure.axes if each.get_xlabel()]
    assert axis.get_title() == "even"
    assert list(axis.containers[0].lines[0].get_xdata()) == [500, 1000, 2000]


def test_samples_on_several_threads_without_a_time_give_no_figure(tmp_path):
    write_drums(tmp_path / "a", {"quadtree": truths()["quadtree"]}, sizes=(1000,), threads=(1,))
    write_sample(tmp_path / "a", "drum_1000", "quadtree", truths()["quadtree"], 1000, threads=2, steps=1)
    assert "speed_up" not in {each.name for each in bench_drawings(read_bench([tmp_path / "a"]))}


@pytest.mark.parametrize("options, told", [({"mode": "live"}, "whole time steps"), ({"threads": 2}, "2 threads")])
@pytest.mark.parametrize("kind", ["drum", "other"])
def test_whole_steps_and_samples_on_several_threads_alone_have_figures_too(tmp_path, kind, options, told):
    for boxes in (500, 2000):
        write_sample(tmp_path, f"{kind}_{boxes}", "verlet", truths()["quadtree"], boxes,
                     made_by=input_of(kind, boxes), **options)
    drawn = {each.name: each for each in own_drawings(read_bench([tmp_path]))}
    assert set(drawn) == {"own_over_size", "all_scenes"}
    assert all(told in each.caption for each in drawn.values())
    (axis,) = [each for each in drawn["own_over_size"].figure.axes if each.get_xlabel()]
    assert len(axis.containers[0].lines[0].get_xdata()) == 2


def test_whole_steps_stand_beside_the_replay_in_figure_9(tmp_path):
    finders = {name: truths()[name] for name in ("quadtree", "sort_and_sweep")}
    write_drums(tmp_path / "a", finders, sizes=SIZES, repeats=2, threads=(1,))
    few, many = ([tmp_path / "a", tmp_path / name] for name in ("few", "many"))
    write_drums(few[1], finders, sizes=SIZES[:2], repeats=2, threads=(1,), mode="live")
    write_drums(many[1], finders, sizes=SIZES[:3], repeats=2, threads=(1,), mode="live")
    for folders, there in ((few, False), (many, True)):
        (drawing,) = [each for each in paper_drawings(read_bench(folders)) if each.name == "figure_09_total"]
        labels = " ".join(text.get_text() for axis in drawing.figure.axes if axis.get_legend()
                          for text in axis.get_legend().get_texts())
        assert ("with boxes" in labels) is there and ("Open:" in drawing.caption) is there


def test_no_two_finders_look_alike():
    text = "".join((Path(os.environ["POLYDEM_SOURCE_DIR"]) / "src" / layer / "entries.txt").read_text(encoding="utf-8")
                   for layer in ("config", "laboratory"))
    lists = dict(re.findall(r"^list (\w+) = (.*)$", text, re.MULTILINE))
    words = " ".join(lists.values()).split()
    finders = [word for word in words if word.startswith(("quadtree", "sort_and", "linked", "verlet", "two_level")) or
               word.endswith(("_sweep", "_tree", "_quadtree", "_grid", "all_pairs"))]
    assert len(set(finders)) >= 14 and set(finders) <= set(LOOKS), set(finders) - set(LOOKS)
    assert len({marker for _, marker, _ in LOOKS.values()}) == len(LOOKS)
    assert len({(colour, line) for colour, _, line in LOOKS.values()}) == len(LOOKS)


def test_a_missing_folder_ends_with_code_2(capsys):
    assert main(["tables", "no/such/folder"]) == 2
    assert "holds no samples" in capsys.readouterr().err


def test_complexity_follows_uses_and_includes(tmp_path):
    pytest.importorskip("lizard")
    (tmp_path / "nodes.inc").write_text(
        "subroutine insert(a)\nif (a > 0) a = 1\nend subroutine insert\n", encoding="utf-8"
    )
    (tmp_path / "tree_nodes.f90").write_text(
        "module polydem_tree_nodes\ncontains\ninclude 'nodes.inc'\nend module\n", encoding="utf-8"
    )
    (tmp_path / "tree.f90").write_text(
        "module polydem_tree\nuse polydem_tree_nodes, only: insert\ntype, extends(finder_t) :: tree_t\nend "
        "type\ncontains\n"
        "subroutine search(n)\ninteger :: n, k\ndo k = 1, n\nif (k > 3 .and. k < 5) exit\nend do\nend "
        "subroutine search\n"
        "end module polydem_tree\n",
        encoding="utf-8",
    )
    assert [path.name for path in complexity.sources_of("tree", tmp_path)] == [
        "tree.f90",
        "tree_nodes.f90",
        "nodes.inc",
    ]
    assert complexity.finders_in(tmp_path) == ["tree"]
    assert complexity.totals("tree", tmp_path) == {
        "initialization": 0,
        "updating data structure": 2,
        "updating contact list": 4,
        "total": 6,
    }


def test_without_the_tool_the_table_of_complexity_says_how_to_get_it(monkeypatch, tmp_path):
    monkeypatch.setattr(complexity, "counter", lambda: None)
    (table,) = complexity.complexity_tables(tmp_path)
    assert table.rows == [] and "pip install" in table.note


def test_slopes_tell_how_time_and_counted_work_grow(tmp_path):
    finders = truths()
    write_drums(tmp_path, {"quadtree": replace(finders["quadtree"], exponent=1.2)}, sizes=SIZES, repeats=3)
    table = slopes(read_bench([tmp_path]))
    row = dict(zip(table.heading, table.rows[0]))
    assert (row["scenes"], row["finder"], row["sizes"]) == ("drum", "quadtree", "2522 to 100000")
    assert abs(float(row["all sizes"].split()[0]) - 1.2) < 0.02
    assert abs(float(row["visits (counted)"]) - 1.0) < 0.02
