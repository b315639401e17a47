"""What models cost, from samples that are made up, and with a program that is a stand-in."""

from dataclasses import replace
from pathlib import Path

import h5py
import pytest
from polydem_lab.costs import models as costs
from polydem_lab.costs.models import MODELS, Sample, Study, bytes_per_body, costs_table, read_samples, share_of_step
from polydem_post.base.result_file import ResultError
from polydem_post.read.trajectory import Trajectory

#: Models of the studies here: each kind of entry, one with groups, and two that refine another one
FEW = tuple(model for model in MODELS if model.name in (
    "nothing", "friction (Cundall-Strack)", "slip in mid-step", "two materials", "energy balance", "guard: energy"))
#: A drum without a motion
DRUM = "&scene name = 'drum' /\n"
PLAIN = Sample("nothing", "time", 1, 1000, 400, 1, 100.0, 5.0, 0, "polydem 1", "a machine")

class FakeStudy(Study):
    """Runs nothing: times and memory of its results depend on what is switched on."""

    calls: list = []
    version = "1"

    def count(self, namelist, folder, overrides):
        self.run(namelist, folder, overrides)
        steps = round(float(next(word for word in overrides if "duration" in word).split("=")[1]) / 2e-5)
        return 1000 + steps * (300 if "forces.friction=cundall_strack" in overrides else 200)

    def run(self, namelist, folder, overrides, **environment):
        self.calls.append(namelist)
        cost = 2.0 if "forces.friction=cundall_strack" in overrides else 1.0
        folder.mkdir(parents=True, exist_ok=True)
        with h5py.File(folder / "profile.h5", "w") as file:
            file.attrs["schema_version"] = 1
            file["profile/stage"] = ["forces"]
            for name, value in (("calls", 10), ("total", 1e-5 * cost), ("least", 0.0), ("most", 0.0)):
                file["profile/" + name] = [value]
            file["profile/seconds"] = 1.0
            file["profile/memory"] = int(1000 * cost)
            file["counters/name"] = ["steps", "bodies", "contacts"]
            file["counters/value"] = [10, 100, 30]
            file["status"] = "finished"
            for name in ("revision", "build_type", "compiler", "processor"):
                file["provenance/" + name] = name
            file["provenance/version"] = self.version
        return Trajectory(folder)


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A study of few models without a program."""
    monkeypatch.setattr(costs, "MODELS", FEW)
    FakeStudy.calls.clear()
    (tmp_path / "out").mkdir()
    (tmp_path / "inputs" / "bench").mkdir(parents=True)
    (tmp_path / "inputs" / "bench" / "drum.nml").write_text(
        DRUM + "&motion\n   name = 'turn'\n/\n", encoding="utf-8")
    return FakeStudy(tmp_path / "none", tmp_path / "inputs", tmp_path / "out")


def scenes(study, models):
    """Namelists that models are run with."""
    return [study.scene(model) for model in models]


def test_a_cost_is_the_median_of_the_ratios_within_turns():
    balance = next(model for model in MODELS if model.name == "energy balance")
    off = [replace(PLAIN, repeat=k, step=100.0 * k) for k in range(5)]
    on = [replace(PLAIN, model=balance.name, repeat=k, step=110.0 * k + (3.0 * k if k == 4 else 0.0)) for k in range(5)]
    share = share_of_step(off + on, balance)
    assert share.value == pytest.approx(10.0)
    assert share.low <= share.value <= share.high <= 13.001
    assert share.repeats == 4


def test_memory_is_a_difference_per_body():
    balance = next(model for model in MODELS if model.name == "energy balance")
    off = [replace(PLAIN, kind="memory", repeat=k, memory=5000) for k in (1, 2, 3)]
    memory = {1: 5100, 2: 5125, 3: 9999}
    on = [replace(PLAIN, kind="memory", model="energy balance", repeat=k, memory=memory[k]) for k in memory]
    assert bytes_per_body(off + on, balance) == pytest.approx(125 * 1.024)


def test_every_model_has_something_to_be_compared_with_before_it():
    seen = []
    for model in MODELS:
        assert model.off in [*seen, model.name]
        seen.append(model.name)
    assert len(set(seen)) == len(seen)


def test_models_run_in_turns_and_an_interrupted_study_goes_on(study):
    samples = costs.measure_costs(study, 2, say=lambda _: None)
    assert [sample.model for sample in samples[: len(FEW)]] == [model.name for model in FEW]
    assert len(samples) == len(FEW) * (3 + costs.WEIGHINGS + 1)
    # Instructions are the difference of two runs.
    counts = [scene for scene in scenes(study, FEW) for _ in range(2)]
    assert study.calls == ["bed.nml", *counts, *scenes(study, FEW) * (3 + costs.WEIGHINGS)]
    path = study.output / costs.FILE
    assert read_samples(path) == samples
    kept = path.read_text(encoding="utf-8").splitlines()[:5]
    path.write_text("\n".join(kept) + "\n", encoding="utf-8")
    study.calls.clear()
    assert costs.measure_costs(study, 2, say=lambda _: None) == samples
    # The four samples that were kept are of instructions.
    assert study.calls == [*counts[8:], *scenes(study, FEW) * (3 + costs.WEIGHINGS)]


def test_a_model_with_groups_has_a_namelist_of_its_own(study):
    model = next(model for model in MODELS if model.groups)
    text = Path(study.scene(model)).read_text(encoding="utf-8")
    assert text == DRUM + model.groups
    assert Path(study.scene(FEW[0])).read_text(encoding="utf-8") == DRUM


def test_a_study_says_what_it_will_do_and_how_far_it_is(study, monkeypatch):
    monkeypatch.setattr(costs, "SILENCE", 0.0)
    said = []
    count = len(costs.measure_costs(study, 0, say=said.append))
    assert said[0].startswith(f"{count} samples to take, 0 found in {study.output}")
    assert said[1:4] == [f"count 1: {number} of {len(FEW)} models" for number in (1, 2, 3)]
    said.clear()
    costs.measure_costs(study, 0, say=said.append)
    assert said[0].startswith(f"0 samples to take, {count} found") and not any("models" in line for line in said)


def test_the_table_tells_what_was_measured(study):
    table = costs.write_costs(costs.measure_costs(study, 2, say=lambda _: None), study.output)
    rows = {row[0]: row for row in table.rows}
    assert rows["nothing"][2:5] == ("1.00 [1.00, 1.00] us", "0.000200 million", "10240")
    assert rows["friction (Cundall-Strack)"][2:5] == ("+100.0 [+100.0, +100.0]", "+50.00", "+10240")
    assert rows["energy balance"][2:5] == ("+0.0 [+0.0, +0.0]", "+0.00", "+0")
    assert rows["guard: energy"][1] == "guards.energy=warn"
    assert "polydem 1 (revision)" in table.note and "processor" in table.note
    assert costs_table(read_samples(study.output / costs.FILE)).rows == table.rows
    assert {path.suffix for path in study.output.glob("costs.*")} == {".txt", ".md", ".tex", ".csv"}


def test_a_busy_machine_measures_no_times_but_all_the_rest(study):
    samples = costs.measure_costs(study, 0, say=lambda _: None)
    assert {sample.kind for sample in samples} == {"count", "memory"}
    table = costs_table(samples)
    rows = {row[0]: row for row in table.rows}
    assert rows["friction (Cundall-Strack)"][2:5] == ("-", "+50.00", "+10240")
    assert rows["slip in mid-step"][1:5] == ("forces.midstep_slip=.true.", "-", "+0.00", "+0")
    assert "Times: not measured" in table.note


def test_samples_of_another_build_and_damaged_ones_are_errors(study, monkeypatch):
    costs.measure_costs(study, 1, say=lambda _: None)
    monkeypatch.setattr(FakeStudy, "version", "2")
    with pytest.raises(ResultError, match="has samples of polydem 1 .*, not of polydem 2"):
        costs.measure_costs(study, 2, say=lambda _: None)
    path = study.output / costs.FILE
    path.write_text("model,kind\na,b\n", encoding="utf-8")
    with pytest.raises(ResultError, match="is not a file of ./polydem costs"):
        read_samples(path)


def test_a_run_that_fails_says_why(tmp_path):
    program = tmp_path / "program"
    program.write_text("#!/bin/sh\necho polydem: broken >&2\nexit 1\n", encoding="utf-8")
    program.chmod(0o755)
    with pytest.raises(ResultError, match="run .*bed.nml .*: polydem: broken"):
        Study(program, tmp_path, tmp_path).bed()
