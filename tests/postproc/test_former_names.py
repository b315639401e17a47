"""Results of file layout 1 appear under the names of today."""

import shutil

import h5py
import pytest
from polydem_post.former_names import BALANCE_GROUPS, COUNTERS, ENTRIES, STAGES
from polydem_post.scene_kinds import settings_of
from polydem_post.trajectory import Trajectory


@pytest.fixture
def of_old(finished, tmp_path):
    """A finished result with the names of file layout 1 and without a manifest."""
    folder = shutil.copytree(finished, tmp_path / "old")
    (folder / "manifest.txt").unlink(missing_ok=True)
    for path in folder.glob("*.h5"):
        with h5py.File(path, "r+") as file:
            file.attrs["schema_version"] = 1
            if BALANCE_GROUPS[0] in file:
                file.move(*BALANCE_GROUPS)
    with h5py.File(folder / "profile.h5", "r+") as file:
        names = file["counters/name"].asstr()[:]
        del file["counters"]
        file["counters/name"] = [*names, *COUNTERS]
        file["counters/value"] = range(len(names) + len(COUNTERS))
        new = {name: old for old, name in STAGES.items()}
        stages = [new.get(str(name), str(name)) for name in file["profile/stage"].asstr()[:]]
        del file["profile/stage"]
        file["profile/stage"] = stages
    return folder


def test_an_old_result_has_the_names_of_today(of_old, finished):
    old, new = Trajectory(of_old), Trajectory(finished)
    assert old.profile["stage"] == new.profile["stage"]
    assert {name: list(values) for name, values in old.energy_balance.items()} == {
        name: list(values) for name, values in new.energy_balance.items()}
    assert old.balance_units == new.balance_units
    assert set(COUNTERS.values()) <= set(old.counters)
    assert not set(COUNTERS) & set(old.counters)


def test_entries_of_an_old_result_have_the_names_of_today():
    for old, new in ENTRIES.items():
        group, key = old.split(".")
        assert settings_of(f"&{group}\n   {key} = 1\n/\n") == {new: "1"}
