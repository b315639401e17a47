"""Reading bench folders: what counts, and how folders of several machines become one."""

import os
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest
from polydem_lab.bench import series
from polydem_lab.bench.samples import build_label, read_bench
from polydem_lab.bench.scene_kinds import OTHER, kind_of, settings_of
from polydem_lab.bench.statistics import median
from polydem_post.base.result_file import ResultError
from synthetic_bench import ENTRIES, Machine, Truth, input_of, kept_in_memory, truths, write_drums, write_sample

TRUTH = Truth(40.0, counts={"swaps": 0.25})


def test_the_warm_up_and_the_first_step_do_not_count_and_are_kept(tmp_path):
    for repeat in range(4):
        slow = Truth(4000.0) if repeat == 0 else TRUTH
        write_sample(tmp_path, "drum_1000", "quadtree", slow, 1000, repeat=repeat, noise=0.0, first=50.0)
    (case,) = read_bench([tmp_path]).cases
    assert list(case.time().values()) == pytest.approx([40.0] * 3)
    assert list(case.first_step().values()) == pytest.approx([2000.0] * 3)
    assert [sample.repeat for sample in case.samples] == [0, 1, 2, 3]
    assert case.samples[0].elapsed[1] == pytest.approx(4e-3)
    assert sum(
        list(case.phase(name).values())[0] for name in ("structure", "search", "filter", "order", "merge")
    ) == pytest.approx(40.0)


def test_counts_are_means_over_the_steps_but_the_first(tmp_path):
    write_sample(tmp_path, "drum_1000", "quadtree", TRUTH, 1000, repeat=0, first_counts={"swaps": 77})
    (case,) = read_bench([tmp_path]).cases
    assert (case.count("swaps"), case.count("swaps", first=True)) == (250.0, 77.0)
    assert np.isnan(case.count("unheard_of"))
    assert not median(list(case.time().values()))


def test_one_thread_is_timed_by_its_processor_and_more_by_the_clock(tmp_path):
    for threads in (1, 2):
        write_sample(tmp_path, "drum_1000", "quadtree", TRUTH, 1000, threads=threads, noise=0.0)
        with h5py.File(tmp_path / "samples" / f"drum_1000-quadtree-{threads}-1.h5", "a") as file:
            file["steps/processor"][...] = 0.5 * file["steps/elapsed"][...]
    one, two = read_bench([tmp_path]).select()
    assert list(one.time().values()) == pytest.approx([20.0])
    assert list(two.time().values()) == pytest.approx([40.0])
    assert list(series.elapsed_time(one).values()) == pytest.approx([40.0])


def test_live_samples_are_timed_by_their_stages(tmp_path):
    write_sample(tmp_path, "drum_1000", "quadtree", TRUTH, 1000, mode="live", noise=0.0)
    (case,) = read_bench([tmp_path]).cases
    assert list(case.time().values()) == pytest.approx([40.0])
    assert list(series.total_time(case).values()) == pytest.approx([44.0])


def test_what_is_being_written_is_left_out(tmp_path):
    write_sample(tmp_path, "drum_1000", "quadtree", TRUTH, 1000)
    (tmp_path / "samples" / "drum_1000-quadtree-1-2.h5.unfinished").write_bytes(b"half a file")
    (case,) = read_bench([tmp_path]).cases
    assert len(case.samples) == 1


def test_folders_of_two_machines_become_one_bench_of_two_machines(tmp_path):
    machines = [Machine(), Machine("beta", "AMD EPYC", slowness=1.5)]
    for machine in machines:
        write_drums(tmp_path / machine.host, {"quadtree": TRUTH}, machine, sizes=(1000, 2000), repeats=3)
    bench = read_bench([tmp_path / "alpha", tmp_path / "beta"])
    assert bench.named("machine") == ["Intel Xeon X1", "AMD EPYC"]
    assert len(bench.cases) == 4
    assert bench.on().named("machine") == ["Intel Xeon X1"]
    fast, slow = (bench.on(machine).select(boxes=2000)[0] for machine in bench.named("machine"))
    assert series.ratio(slow, fast).value == pytest.approx(1.5, rel=0.05)


def test_two_machines_with_one_processor_are_told_apart_by_their_hosts(tmp_path):
    for host in ("alpha", "beta"):
        write_sample(tmp_path / host, "drum_1000", "quadtree", TRUTH, 1000, Machine(host))
    assert read_bench([tmp_path / "alpha", tmp_path / "beta"]).named("machine") == [
        "Intel Xeon X1 (alpha)",
        "Intel Xeon X1 (beta)",
    ]


def test_a_second_folder_of_the_same_machine_adds_repeats_that_are_not_paired_with_the_first(tmp_path):
    for part in ("a", "b"):
        write_sample(tmp_path / part, "drum_1000", "quadtree", TRUTH, 1000)
    (case,) = read_bench([tmp_path / "a", tmp_path / "b"]).cases
    assert len(case.time()) == 2


@pytest.mark.parametrize(
    "facts, label",
    [
        ({"options": "-O3 -fopenmp -march=x86-64"}, "-O3"),
        ({"options": "-O2 -march=native"}, "-O2 -march=native"),
        ({"options": "-O3", "precision": "single", "build_type": "Debug"}, "-O3 single Debug"),
        ({}, "unknown"),
    ],
)
def test_builds_are_told_apart_by_what_changes_the_program(facts, label):
    assert build_label(facts) == label


def test_samples_of_one_name_and_different_scenes_are_refused(tmp_path):
    for repeat, pair_hash in ((1, "00ab"), (2, "00cd")):
        write_sample(tmp_path, "drum_1000", "quadtree", TRUTH, 1000, repeat=repeat, pair_hash=pair_hash)
    with pytest.raises(ResultError, match="differ in pair_hash: 00ab, 00cd"):
        read_bench([tmp_path])


def test_a_folder_without_samples_is_explained(tmp_path):
    with pytest.raises(ResultError, match="holds no samples of a bench .* ./polydem bench"):
        read_bench([tmp_path])


def test_a_broken_sample_and_a_foreign_file_are_named(tmp_path):
    write_sample(tmp_path, "drum_1000", "quadtree", TRUTH, 1000)
    path = tmp_path / "samples" / "drum_1000-quadtree-1-1.h5"
    with h5py.File(path, "a") as file:
        del file["steps/elapsed"]
    with pytest.raises(ResultError, match=r"drum_1000-quadtree-1-1.h5: cannot be read"):
        read_bench([tmp_path])
    with h5py.File(path, "a") as file:
        file.attrs["content"] = "trajectory"
    with pytest.raises(ResultError, match="is not a sample of a bench"):
        read_bench([tmp_path])


@pytest.mark.parametrize("kind", list(ENTRIES))
@pytest.mark.parametrize("name", ["drum_1000", "gas_0.3", "x"])
def test_the_kind_of_a_scene_is_what_its_samples_record_whatever_its_name(tmp_path, kind, name):
    write_sample(tmp_path, name, "quadtree", TRUTH, 1000, made_by=input_of(kind, 1000, 2.0))
    (case,) = read_bench([tmp_path]).cases
    assert series.kind(case) == kind


@pytest.mark.parametrize("made_by", [False, "", "drum", "&scene\n/\n", "&boxes\n   margin = 0.0\n/\n"])
def test_a_scene_of_which_nothing_is_recorded_is_unknown(tmp_path, made_by):
    write_sample(tmp_path, "drum_1000", "quadtree", TRUTH, 1000, made_by=made_by)
    (case,) = read_bench([tmp_path]).cases
    assert series.kind(case) == "unknown"


#: Changes of a recorded input that make another kind of it
CHANGES = [
    ("drum", "&motion\n   name = 'turn'\n   kind = 'rotation'\n   rate = 0.25\n/\n", ""),
    ("drum", "rate = 0.25", "rate = 0.0"),
    ("drum", "margin = 0.0", "margin = 0.01"),
    ("drum", "name = 'drum'", "name = 'file'"),
    ("bed", "trace_start = 0.9", "trace_start = 0.0"),
    ("bed", "margin = 0.0", "margin = 0.01"),
    ("gas", "speed = 0.5", "speed = 0.0"),
    ("gas", "gravity = 0.0, 0.0", "gravity = 0.0, -9.81"),
    ("soft", "solid_fraction = 2.0", "solid_fraction = 0.3"),
    ("range", "margin = 2.0", "margin = 1e-6"),
]


@pytest.mark.parametrize("kind, old, new", CHANGES)
def test_a_scene_that_is_made_otherwise_is_of_another_kind(kind, old, new):
    text = input_of(kind, 1000, 2.0)
    assert old in text
    assert kind_of(settings_of(text)) == kind
    assert kind_of(settings_of(text.replace(old, new))) == OTHER


def test_a_scene_of_an_earlier_revision_is_refused():
    with pytest.raises(ResultError, match="`long_axis_max` in its &scene are the two values of `long_axis` today"):
        kind_of(settings_of(input_of("rods", 1000).replace("long_axis = 25e-3, 25e-3", "long_axis_min = 25e-3")))


@pytest.mark.parametrize("kind, rate, expected", [("drum", 0.25, "drum"), ("drum", 0.0, OTHER), ("bed", 0.25, OTHER)])
def test_walls_of_which_one_turns_make_a_drum_and_no_bed(kind, rate, expected):
    text = input_of(kind, 1000).replace("rate = 0.25", "rate = 0.0")
    groups = "".join(f"&motion\n   name = '{name}'\n   rate = {each}\n/\n" for name, each in (("a", rate), ("b", 0.0)))
    settings = settings_of(text + groups)
    assert settings["motion.a.rate"] == str(rate) and settings["motion.b.rate"] == "0.0"
    assert kind_of(settings) == expected


def test_drums_of_another_rate_do_not_join_a_series(tmp_path):
    for boxes in (1000, 2000, 4000):
        write_sample(tmp_path, f"drum_{boxes}", "quadtree", TRUTH, boxes)
    fast = input_of("drum", 8000).replace("rate = 0.25", "rate = 2.0")
    write_sample(tmp_path, "drum_8000", "quadtree", TRUTH, 8000, made_by=fast)
    cases = series.over_size(read_bench([tmp_path]).on(), "quadtree")
    assert [case.boxes for case in cases] == [1000, 2000, 4000]


def test_benches_in_other_folders_have_the_same_scenes(tmp_path):
    for part in ("a", "b"):
        made_by = input_of("drum", 1000).replace("drum_1000", f"results/{part}/traces/drum_1000")
        write_sample(tmp_path / part, "drum_1000", "quadtree", TRUTH, 1000, made_by=made_by)
    (case,) = read_bench([tmp_path / "a", tmp_path / "b"]).cases
    assert len(case.samples) == 2
    other = input_of("drum", 1000).replace("rate = 0.25", "rate = 2.0")
    write_sample(tmp_path / "c", "drum_1000", "quadtree", TRUTH, 1000, made_by=other)
    with pytest.raises(ResultError, match="that were made with different settings"):
        read_bench([tmp_path / "a", tmp_path / "c"])


def test_finders_on_different_boxes_of_one_name_are_not_compared(tmp_path):
    write_sample(tmp_path / "a", "drum_1000", "quadtree", TRUTH, 1000)
    other = input_of("drum", 1000).replace("rate = 0.25", "rate = 2.0")
    write_sample(tmp_path / "b", "drum_1000", "sort_and_sweep", TRUTH, 1000, made_by=other)
    bench = read_bench([tmp_path / "a", tmp_path / "b"])
    assert series.pairs_of(bench.select(finder="quadtree"), bench.select(finder="sort_and_sweep")) == []


def test_the_slope_of_a_series_and_its_counts_are_those_of_the_truth(tmp_path):
    write_drums(tmp_path, {"quadtree": Truth(40.0, 1.1, counts={"tests": 3.0})}, repeats=5)
    cases = series.over_size(read_bench([tmp_path]).on(), "quadtree")
    law = series.law(cases)
    assert law.exponent.low < 1.1 < law.exponent.high
    assert law.at(10000.0) == pytest.approx(40e-6 * 10000.0**1.1, rel=0.02)
    assert series.count_slope(cases, "tests", "swaps") == pytest.approx(1.0, abs=1e-3)


def test_a_tree_that_is_deeper_than_any_is_refused(tmp_path):
    write_sample(tmp_path, "drum_1000", "quadtree", Truth(40.0, counts={"depth": 65}), 1000, repeat=0)
    with pytest.raises(ResultError, match="no tree has more than 64 levels"):
        read_bench([tmp_path])


def test_the_caches_of_a_machine_are_those_for_data():
    levels = series.cache_levels({"caches": "L1d 32K, L1i 64K, L2 1024K, L3 32M"})
    assert levels == [("L1", 2**15), ("L2", 2**20), ("L3", 2**25)]


def test_all_finders_of_the_fixture_have_positive_shares():
    for truth in truths().values():
        assert sum(truth.shares[:5]) == pytest.approx(1.0)


#: Namelists in inputs/bench and what they make
SCENES_OF_BENCHES = {
    "bed_static": "bed",
    "channel": "line",
    "column": "column",
    "drum": "drum",
    "gas": "gas",
    "hopper": "hopper",
    "one_mover": "rest",
    "patch": OTHER,
    "range": "range",
    "rods": "rods",
    "sizes": "sizes",
    "soft": "soft",
    "worst_order": "worst",
}


@pytest.mark.parametrize("name, kind", SCENES_OF_BENCHES.items())
def test_the_scenes_of_the_benches_are_of_their_kinds(name, kind):
    program, root = os.environ["POLYDEM_PROGRAM"], Path(os.environ["POLYDEM_SOURCE_DIR"])
    scene = root / "inputs" / "bench" / f"{name}.nml"
    command = [program, "check", str(scene)] + (["--set", "scene.packing=''"] if name in ("column", "drum") else [])
    told = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    assert kind_of(settings_of(told)) == kind
    assert sorted(path.stem for path in scene.parent.glob("*.nml")) == sorted(SCENES_OF_BENCHES)


def test_a_fact_that_is_a_list_is_an_error(tmp_path):
    write_sample(tmp_path, "drum_1000", "quadtree", TRUTH, 1000)
    with h5py.File(next(tmp_path.rglob("*.h5")), "a") as file:
        del file["case/bodies"]
        file["case/bodies"] = [0.0]
    with pytest.raises(ResultError, match="case/bodies is not one text or number"):
        read_bench([tmp_path])


@pytest.mark.parametrize("options", [{"repeat": 0, "first_counts": {"swaps": 7}}, {"mode": "live"}, {"made_by": False}])
def test_a_sample_kept_in_memory_is_the_one_of_the_file(tmp_path, options):
    def sample(folder):
        write_sample(folder, "drum_2522", "quadtree", truths()["quadtree"], 2522, **options)
        return [each for case in read_bench([folder]).cases for each in case.samples][0]

    with kept_in_memory():
        kept = sample(tmp_path)
    np.testing.assert_equal(vars(sample(tmp_path)), vars(kept))
