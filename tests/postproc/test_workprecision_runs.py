"""A small study of speed against error with the program itself, which stands for all precisions."""

import os
from dataclasses import replace
from pathlib import Path

import pytest
from polydem_lab.precision import samples as precision_samples
from polydem_lab.precision.samples import Study, read_samples
from polydem_lab.precision.scenes import SCENES, Model
from polydem_lab.precision.work_precision import read_study
from polydem_post.base.result_file import ResultError

PROGRAM = Path(os.environ["POLYDEM_PROGRAM"])


@pytest.fixture(scope="module")
def scene():
    models = (Model("area", "rate", "none"), Model("area", "unheard_of", "none"))
    return replace(SCENES["flat_impact"], models=models, steps=(32, 64, 128), reference=1024)


@pytest.fixture(scope="module")
def study(tmp_path_factory, scene):
    """Folder of a finished study, and what was said meanwhile."""
    folder = tmp_path_factory.mktemp("study")
    said = []
    Study(folder, {"double": PROGRAM, "quadruple": PROGRAM}, said.append).measure([scene], 1)
    return folder, said


def test_damping_from_touch_is_of_second_order_and_less_wrong(study):
    curves = {curve.numerics: curve for curve in read_study(study[0]).curves}
    assert set(curves) == set(precision_samples.NUMERICS)
    assert curves["velocity_verlet, second order"].order(0.0) == pytest.approx(2.0, abs=0.35)
    assert curves["velocity_verlet"].order(0.0) == pytest.approx(1.0, abs=0.35)
    assert curves["velocity_verlet, second order"].points[-1].rms < 0.2 * curves["velocity_verlet"].points[-1].rms
    assert all(point.least > 0.0 and 0.0 < point.share < 1.0 for curve in curves.values() for point in curve.points)


def test_the_converged_restitution_is_that_of_theory(study):
    reference = read_study(study[0]).references["flat_impact", "area/rate/none"]
    scene = SCENES["flat_impact"]
    assert scene.quantity(reference.values) == pytest.approx(scene.target(Model("area", "rate", "none")), abs=1e-3)


def test_what_the_program_does_not_know_is_told(study):
    folder, said = study
    refused = {(sample.scene, sample.model) for sample in read_study(folder).left_out()}
    assert refused == {("flat_impact", "area/unheard_of/none")}
    assert sum("unheard_of" in line for line in said) == 1


def test_an_interrupted_study_goes_on_where_it_was(study, scene, monkeypatch):
    folder, _ = study
    path = folder / "samples.csv"
    whole = path.read_text(encoding="utf-8")
    lines = whole.splitlines(keepends=True)
    path.write_text("".join(lines[:-1]) + lines[-1][:20], encoding="utf-8")
    calls = []
    call = precision_samples._call
    monkeypatch.setattr(precision_samples, "_call", lambda *words: calls.append(words) or call(*words))
    Study(folder, {"double": PROGRAM, "quadruple": PROGRAM}, lambda line: None).measure([scene], 1)
    assert len(calls) == 1
    kept = [replace(sample, seconds=0.0, share=0.0) for sample in read_samples(folder)]
    path.write_text(whole, encoding="utf-8")
    assert kept == [replace(sample, seconds=0.0, share=0.0) for sample in read_samples(folder)]


def test_samples_of_another_input_are_not_mixed(study, scene):
    folder, _ = study
    fewer = replace(scene, bodies=lambda: SCENES["stack"].bodies())
    again = Study(folder, {"double": PROGRAM, "quadruple": PROGRAM}, lambda line: None)
    with pytest.raises(ResultError, match="another program or of another input"):
        again.measure([fewer], 1)


def test_a_program_that_is_missing_is_named(tmp_path):
    with pytest.raises(ResultError, match="quadruple"):
        Study(tmp_path, {"double": PROGRAM})
    with pytest.raises(ResultError, match="cannot be run"):
        Study(tmp_path, {"double": PROGRAM, "quadruple": tmp_path / "nothing"})
