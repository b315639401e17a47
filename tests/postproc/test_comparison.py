"""The whole comparison in one command, on scenes that take seconds: what it makes, reuses, resumes and refuses."""

import base64
import csv
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest
from polydem_lab.comparison.bench_file import number_of, read_bench_file
from polydem_lab.comparison.html_page import Page
from polydem_lab.comparison.plan import (
    BENCHES,
    QUICK_LIMIT,
    QUICK_PRECISION,
    QUICK_SCENES,
    ROOT,
    Piece,
    Rates,
    estimate,
    make_plan,
    threads_up_to,
)
from polydem_lab.comparison.publish import publish
from polydem_lab.comparison.published import read_points
from polydem_lab.comparison.run import FOR_THE_REPORT, Comparison, Tools
from polydem_lab.precision.scenes import SCENES
from polydem_post.base.emit import Table
from polydem_post.base.result_file import ResultError
from published_numbers import REVISION, disagreements, missing_numbers, paragraphs_of

PROGRAM = Path(os.environ["POLYDEM_PROGRAM"]).resolve()
VERIFIER = PROGRAM.parents[2] / "tests" / "verification" / "verify"
PLAN = Path(__file__).parent / "tiny_comparison" / "plan.json"
#: Speed of a usual machine
USUAL = Rates(5e-8, 5e-10, 1.2e-8)


def command(output, *options, plan=PLAN):
    return [sys.executable, "-m", "polydem_post", "paper", "--plan", str(plan), "--program", f"double={PROGRAM}",
            "--verifier", str(VERIFIER), "--output", str(output), *options]


def call(output, *options, plan=PLAN):
    """Exit code and output of a comparison."""
    environment = {**os.environ, "OMP_WAIT_POLICY": "passive"}
    done = subprocess.run(command(output, *options, plan=plan), capture_output=True, text=True, check=False,
                          env=environment, timeout=600)
    return done.returncode, done.stdout + done.stderr


def samples_of(output):
    """When each sample was written."""
    return {path: path.stat().st_mtime_ns for path in sorted((output / "quick").glob("*/samples/*.h5"))}


def small_plan(folder):
    """A plan of two pieces."""
    shutil.copytree(PLAN.parent, folder)
    few = {"gases": {"bench": "bench_gases.nml"}, "verification": {"kind": "verify", "options": ["B2"]}}
    (folder / "plan.json").write_text(json.dumps(few), encoding="utf-8")
    return folder / "plan.json"


@pytest.fixture(scope="module")
def output(tmp_path_factory):
    """A finished comparison, and what was said."""
    folder = tmp_path_factory.mktemp("comparison") / "paper"
    code, said = call(folder)
    assert code == 0, said
    return folder, said


def test_it_says_first_what_it_will_do_and_how_long_it_takes(output):
    _, said = output
    lines = said.splitlines()
    first = next(k for k, line in enumerate(lines) if line.startswith("drums: "))
    told = "\n".join(lines[:first])
    for name in json.loads(PLAN.read_text(encoding="utf-8")):
        assert re.search(rf"^  {name} +about \d+ s ", told, re.MULTILINE), told
    assert re.search(r"^about .* in all, and at most 15 minutes", told, re.MULTILINE), told


def test_every_figure_and_table_of_the_page_has_its_files(output):
    folder, _ = output
    text = (folder / "report.html").read_text(encoding="utf-8")
    figures = re.findall(r'<figure id="figure-([^"]+)"><img alt="[^"]*" src="data:image/svg\+xml;base64,([^"]+)"', text)
    assert len(figures) == text.count("<figure ") >= 10
    for name, data in figures:
        assert base64.b64decode(data) == (folder / "figures" / f"{name}.svg").read_bytes()
        assert (folder / "figures" / f"{name}.pdf").stat().st_size > 1000
        assert (folder / "figures" / f"{name}.png").stat().st_size > 1000
    tables = re.findall(r'<details id="table-([^"]+)"', text)
    assert {"claims", "machine", "pieces", "skipped", "verification", "fine_grained"} <= set(tables)
    for name in tables:
        for end in ("csv", "md", "tex", "txt"):
            assert (folder / "tables" / f"{name}.{end}").exists(), name


def test_every_number_in_the_text_is_found_in_its_table(output):
    folder, _ = output
    text = (folder / "report.html").read_text(encoding="utf-8")
    found = paragraphs_of(text)
    assert len(found) >= 20
    for words, tables in found:
        assert missing_numbers(words, [folder / "tables" / f"{name}.csv" for name in tables]) == [], words


def test_a_number_that_no_table_has_is_found(output):
    folder, _ = output
    claims = folder / "tables" / "claims.csv"
    assert missing_numbers("C1: 123.456 of 0.992", [claims]) == ["123.456"]


def test_the_page_needs_nothing_else(output):
    folder, _ = output
    text = (folder / "report.html").read_text(encoding="utf-8")
    outer = [each for each in re.findall(r'(?:src|href)="([^"]*)"', text) if not each.startswith(("data:", "#"))]
    assert outer == []
    assert "<script" not in text and "@import" not in text and "url(" not in text


def test_the_page_opens_in_a_browser_without_errors(output, tmp_path):
    browser = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
    if browser is None:
        pytest.skip("no Chromium is installed: whether the page opens in it was not tested")
    folder, _ = output
    done = subprocess.run(
        [browser, "--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--v=0",
         f"--user-data-dir={tmp_path}", "--dump-dom", (folder / "report.html").as_uri()],
        capture_output=True, text=True, check=False, timeout=600)
    assert done.returncode == 0, done.stderr[-2000:]
    assert "Verdicts on the claims" in done.stdout and done.stdout.count("<figure ") >= 10
    assert not [line for line in done.stderr.splitlines() if "CONSOLE" in line]


def test_every_claim_has_a_verdict_and_the_quick_one_may_be_undecided(output):
    folder, _ = output
    rows = (folder / "tables" / "claims.csv").read_text(encoding="utf-8").splitlines()[1:]
    rows = [row for row in rows if row.split(",")[0][1:].isdigit()]
    assert [row.split(",")[0] for row in rows] == [f"C{k}" for k in range(1, 20)]
    text = "\n".join(rows)
    assert "undecided (quick)" in text and text.count("not measured") == 1 and ",not measured," in rows[9]


def test_the_cost_of_waiting_is_measured(output):
    with (output[0] / "tables" / "waiting.csv").open(newline="", encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    assert row["threads"] == "2"
    assert float(row["barrier"]) > 0.02 and float(row["start and join threads"]) > 0.1  # us


def test_what_is_there_is_not_made_again(output):
    folder, _ = output
    before = samples_of(folder)
    code, said = call(folder, "--dry-run")
    assert code == 0 and said.count(" is there (") == 4, said
    assert "about 0 s in all" in said and samples_of(folder) == before


def test_another_program_or_machine_makes_all_again_and_a_changed_setting_one_piece(tmp_path):
    folder, plan = tmp_path / "paper", small_plan(tmp_path / "plan")
    assert call(folder, plan=plan)[0] == 0
    gases = plan.parent / "bench_gases.nml"
    gases.write_text(gases.read_text(encoding="utf-8").replace("repeats = 2", "repeats = 1"), encoding="utf-8")
    code, said = call(folder, "--dry-run", plan=plan)
    assert code == 0 and "gases: its settings changed, so it is made again" in said, said
    assert said.count(" is there (") == 1 and (folder / "quick" / "gases").exists(), "a dry run changes nothing"
    code, said = call(folder, plan=plan)
    assert code == 0 and {path.name[-5:] for path in samples_of(folder)} == {"-0.h5", "-1.h5"}
    state = folder / "quick" / "state.json"
    state.write_text(state.read_text(encoding="utf-8").replace('"digest": "', '"digest": "0'), encoding="utf-8")
    before = samples_of(folder)
    code, said = call(folder, plan=plan)
    assert code == 0 and "made by another program or machine" in said and " is there (" not in said, said
    after = samples_of(folder)
    assert set(after) == set(before) and not set(after.items()) & set(before.items())


def test_what_is_published_is_one_page_that_its_tables_confirm_of_other_machines_too(output, tmp_path):
    place, other = tmp_path / "verdicts", tmp_path / "other"
    for path in (output[0] / "quick" / "drums" / "samples").glob("*.h5"):
        copy = other / "quick" / "drums" / "samples" / path.name
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(path, copy)
        with h5py.File(copy, "a") as file:
            del file["provenance/processor"]
            file["provenance/processor"] = np.bytes_("Abacus 7 @ 1.00GHz")
    code, said = call(output[0], "--report-only", "--other", str(other), "--publish", str(place))
    assert code == 0 and disagreements(place) == [], said
    assert len(list(place.glob("*.png"))) >= 10 and REVISION.findall((place / "README.md").read_text(encoding="utf-8"))
    assert "\nAbacus 7," in (place / "tables" / "table_1.csv").read_text(encoding="utf-8")
    (place / "README.md").write_text("# Another page\n", encoding="utf-8")
    with pytest.raises(ResultError, match="is another page"):
        publish(None, "quick", output[0], place)
    code, said = call(output[0], "--report-only", "--other", str(tmp_path / "nowhere"))
    assert code == 2 and "holds no benches" in said


def test_a_comparison_that_was_killed_goes_on_where_it_was(tmp_path):
    folder, plan = tmp_path / "paper", small_plan(tmp_path / "plan")
    environment = {**os.environ, "OMP_WAIT_POLICY": "passive"}
    before = {}
    # At once, and nothing goes on beside the next call; then by a signal that it hears
    for number, sample, expected in (signal.SIGKILL, "*-1-0.h5", -9), (signal.SIGTERM, "*-1-2.h5", 75):
        with subprocess.Popen(command(folder, plan=plan), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              env=environment) as process:
            while not list((folder / "quick" / "gases" / "samples").glob(sample)):
                assert process.poll() is None
                time.sleep(0.02)
            process.send_signal(number)
            said = process.communicate(timeout=600)[0]
        assert process.returncode == expected, said
        after = samples_of(folder)
        assert {path: after[path] for path in before} == before and len(after) > len(before)
        before = after
    assert "the same command goes on" in said, said
    code, said = call(folder, plan=plan)
    assert code == 0 and said.count(" finished after ") == 2, said
    after = samples_of(folder)
    assert {path: after[path] for path in before} == before and len(after) > len(before)


def test_a_folder_of_somebody_else_is_left_alone(tmp_path):
    place = tmp_path / "quick"
    place.mkdir()
    (place / "thesis.tex").write_text("years", encoding="utf-8")
    code, said = call(tmp_path)
    assert code == 2 and "choose another --output" in said
    assert (place / "thesis.tex").read_text(encoding="utf-8") == "years"
    code, said = call(tmp_path / "nowhere", "--report-only")
    assert code == 2 and "nothing to report" in said


def test_a_piece_that_fails_does_not_lose_the_others(tmp_path):
    shutil.copytree(PLAN.parent, tmp_path / "plan")
    gases = tmp_path / "plan" / "bench_gases.nml"
    gases.write_text(gases.read_text(encoding="utf-8").replace("'verlet'", "'no_such_finder'"), encoding="utf-8")
    plan = tmp_path / "plan" / "plan.json"
    listed = json.loads(plan.read_text(encoding="utf-8"))
    del listed["threads"]
    plan.write_text(json.dumps({"gases": listed.pop("gases"), **listed}), encoding="utf-8")
    code, said = call(tmp_path / "paper", plan=plan)
    assert code == 0 and "gases: failed" in said and "no_such_finder" not in said, said
    with (tmp_path / "paper" / "tables" / "pieces.csv").open(newline="", encoding="utf-8") as file:
        states = {row["piece"]: row["state"] for row in csv.DictReader(file)}
    assert states == {"gases": "failed", "drums": "finished", "verification": "finished"}


def test_pieces_may_be_left_out_and_the_page_says_so(tmp_path):
    code, said = call(tmp_path / "paper", "--without", "drums,threads,verification")
    assert code == 0 and re.search("^  drums +is left out ", said, re.MULTILINE), said
    with (tmp_path / "paper" / "tables" / "pieces.csv").open(newline="", encoding="utf-8") as file:
        states = {row["piece"]: row["state"] for row in csv.DictReader(file)}
    assert states == {"drums": "left out", "threads": "left out", "gases": "finished", "verification": "left out"}
    assert not (tmp_path / "paper" / "quick" / "drums").exists()
    code, said = call(tmp_path / "paper", "--without", "drums,rods", "--dry-run")
    assert code == 2 and "--without rods: no such piece; the pieces are drums, " in said, said


@pytest.mark.parametrize("text", ["", "[]", '{"a": {}}', '{"a": {"bench": "no_such_file.nml"}}', '{"a": 3}'])
def test_a_bad_plan_is_an_error_that_names_the_file(tmp_path, text):
    plan = tmp_path / "plan.json"
    plan.write_text(text, encoding="utf-8")
    code, said = call(tmp_path / "paper", "--dry-run", plan=plan)
    if text == "[]":
        assert code == 2
    else:
        assert code == 2 and ("plan.json" in said or "no_such_file.nml" in said), said


def test_pieces_run_in_the_same_environment_of_python(tmp_path):
    comparison = Comparison(tmp_path, "quick", [], Tools({"double": PROGRAM}))
    log = tmp_path / "log.txt"
    assert comparison._call([sys.executable, "-c", "import sys; print(sys.prefix)"], log, tmp_path) == 0
    assert log.read_text(encoding="utf-8").strip() == sys.prefix


def test_a_slow_machine_makes_some_of_every_piece(tmp_path, monkeypatch):
    pieces = [Piece(name, "verify", name, options=(name,)) for name in ("one", "two", "three")]
    said, made = [], []
    comparison = Comparison(tmp_path / "quick", "quick", pieces, Tools({"double": PROGRAM}, VERIFIER),
                            time.monotonic() + FOR_THE_REPORT + 300.0, said.append)
    monkeypatch.setattr(comparison, "calibrate", lambda: USUAL)
    monkeypatch.setattr(comparison, "_make", lambda piece: made.append((piece.name, comparison._left())) or "cut")
    comparison.open()
    comparison.run()
    assert [name for name, _ in made] == ["one", "two", "three"] * 2
    assert [left for _, left in made[:3]] == pytest.approx([100.0, 150.0, 300.0], abs=20.0)
    assert {comparison.status(piece) for piece in pieces} == {"cut"}


def test_a_bench_leaves_out_scenes_whose_traces_are_missing_and_is_not_finished(output, tmp_path):
    folder = tmp_path / "paper"
    shutil.copytree(PLAN.parent, tmp_path / "plan")
    plan = tmp_path / "plan" / "bench_threads.nml"
    text = plan.read_text(encoding="utf-8").replace("names = 'drum_1200'", "names = 'drum_1200', 'drum_9'")
    text = text.replace("trace.h5'", "trace.h5', 'results/bench_drums/traces/drum_9/trace.h5'")
    plan.write_text(text, encoding="utf-8")
    (piece,) = [each for each in make_plan("quick", folder, 2, plan.parent / "plan.json") if each.name == "threads"]
    comparison = Comparison(folder, "quick", [piece], Tools({"double": PROGRAM}, VERIFIER), say=lambda line: None)
    trace = folder / "drums" / "traces" / "drum_1200" / "trace.h5"
    trace.parent.mkdir(parents=True)
    shutil.copyfile(output[0] / "quick" / "drums" / "traces" / "drum_1200" / "trace.h5", trace)
    assert comparison._make(piece) == "cut"
    assert {path.name.split("-")[0] for path in (folder / "threads" / "samples").glob("*.h5")} == {"drum_1200"}


# --- The plan ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("mode", ["quick", "full"])
def test_pieces_come_after_what_they_need(mode):
    made = set()
    for piece in make_plan(mode, Path("results/paper") / mode, 2):
        assert set(piece.needs) <= made, piece.name
        made.add(piece.name)
    assert {"sizes", "threads", "motion", "scenes", "live", "verification", "precision", "cache"} <= made


def test_the_quick_comparison_fits_into_its_time_on_two_cores():
    pieces = make_plan("quick", Path("results/paper/quick"), 2)
    assert sum(estimate(piece, USUAL, 2, "quick") for piece in pieces) < QUICK_LIMIT


def test_what_the_quick_comparison_names_exists():
    assert set(QUICK_SCENES) <= set(BENCHES) and set(QUICK_PRECISION) <= set(SCENES)
    for name, scenes in QUICK_SCENES.items():
        assert set(scenes) <= set(read_bench_file(ROOT / "inputs" / f"bench_{name}.nml").scenes), name


@pytest.mark.parametrize("path", sorted((ROOT / "inputs").glob("bench_*.nml")), ids=lambda path: path.stem)
def test_a_bench_is_read_and_written_without_loss(path, tmp_path):
    bench = read_bench_file(path)
    again = tmp_path / path.name
    again.write_text(bench.written(tmp_path), encoding="utf-8")
    assert read_bench_file(again) == bench
    # The bench of the page on performance is no part of the comparison.
    assert bench.name in (*BENCHES, "steps") and len(bench.scenes) >= 1


def test_traces_and_packings_lie_in_the_folder_of_the_comparison():
    folder = Path("results/paper/full")
    for piece in make_plan("full", folder, 4):
        if piece.bench:
            text = piece.bench.written(folder / piece.name)
            assert "results/bench_" not in text and "'results/patch" not in text
            assert piece.bench.prepare == () or f"output.folder={folder}/patch" in text


def test_entries_of_a_scene_count_before_those_of_its_file():
    assert number_of("inputs/bench/drum.nml", "scene.boxes", ROOT) == 2522.0
    assert number_of("inputs/bench/drum.nml scene.boxes=7 scene.boxes=1d3", "scene.boxes", ROOT) == 1000.0
    assert number_of("inputs/bench/drum.nml", "integrate.dt", ROOT) == 2.5e-5
    assert number_of("inputs/bench/drum.nml", "scene.solid_fraction", ROOT) is None


@pytest.mark.parametrize("cores, most, expected", [(1, 1, (1,)), (2, 2, (1, 2)), (6, 6, (1, 2, 4, 6)), (8, 2, (1, 2))])
def test_threads_go_up_to_all_cores(cores, most, expected):
    assert threads_up_to(cores, most) == expected


def test_a_page_shows_what_it_is_given_and_nothing_steers_it():
    page = Page("a <title>")
    page.heading("One & two")
    table = Table("numbers", "Numbers <b>", ("name", "value"))
    table.add("<script>alert(1)</script>", 3)
    page.table(table)
    page.paragraph('3 "quoted"', ("numbers",), "C1:")
    text = page.written()
    assert "<script" not in text and "&lt;script&gt;" in text and "a &lt;title&gt;" in text
    assert 'data-table="numbers"' in text and '<li><a href="#section-1">One &amp; two</a></li>' in text


def test_published_points_name_their_source_and_place():
    points = read_points()
    assert len(points) >= 13
    assert all(point.source and point.figure.startswith("Fig.") and point.stated_in for point in points)
    assert all(float(point.value) > 0.0 for point in points)
