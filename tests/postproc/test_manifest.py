"""Results with a manifest: what was lost, exchanged, cut or changed is told, and nothing else."""

import os
import shutil
import subprocess
import sys
import warnings
import zlib

import h5py
import numpy as np
import pytest
from polydem_post import NoManifest, ResultError, Trajectory
from polydem_post.command_line.main import main
from polydem_post.read.manifest import HEADING, ManifestError, read_manifest


def write_manifest(folder, rows, heading=HEADING):
    """Write a manifest of these rows."""
    text = "".join(f"{row}\n" for row in (heading, *rows))
    (folder / "manifest.txt").write_text(f"{text}crc32 {zlib.crc32(text.encode()):08x}\n")


def closed_row(path, *frames):
    """The row of a closed file: a segment with its frames, first and last step."""
    data = path.read_bytes()
    frames = " ".join(map(str, frames or (0, 0, 0)))
    return f"{path.name} closed {len(data)} {zlib.crc32(data):08x} {frames}"


def open_row(name):
    """The row of a file that is not closed."""
    return f"{name} open 0 00000000 0 0 0"


def rows_of(folder):
    """What the manifest of a finished result has."""
    rows = [open_row("log.txt")]
    for path in sorted(folder.glob("trajectory_*.h5")):
        with h5py.File(path, "r") as file:
            steps = file["frames/step"][:]
        rows.append(closed_row(path, len(steps), steps[0], steps[-1]))
    return [*rows, closed_row(folder / "profile.h5")]


@pytest.fixture
def result(finished, tmp_path):
    """A finished result of three segments with its manifest."""
    folder = tmp_path / "result"
    shutil.copytree(finished, folder)
    write_manifest(folder, rows_of(folder))
    return folder


@pytest.mark.parametrize("name", ["manifest.txt", "trajectory_0002.h5", "profile.h5"])
def test_a_pipe_in_place_of_a_file_is_named(result, name):
    """Finds a reader that waits for ever for somebody to write into it."""
    (result / name).unlink()
    os.mkfifo(result / name)
    for words in (["table", result], ["plot", result, "--frame", "-4"]):
        done = subprocess.run([sys.executable, "-m", "polydem_post", *words], cwd=result.parent, capture_output=True,
                              text=True, check=False, timeout=600)
        assert "Traceback" not in done.stderr
        if name != "profile.h5" or words[0] == "table":
            assert done.returncode in (2, 3) and f"{name}" in done.stderr, done.stderr


def use(folder, **options):
    """Read all that there is."""
    run = Trajectory(folder, **options)
    for number in range(len(run)):
        run.frame(number), run.contacts(number), run.walls(number)
    return run.energy_balance, run.profile, run.counters, run.provenance, run.state_hash, run.status


def test_a_whole_result_is_read_without_a_word(result):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        use(result)
        use(result / "trajectory_0002.h5")


def test_a_result_without_a_manifest_is_read_with_one_warning(result):
    (result / "manifest.txt").unlink()
    with pytest.warns(NoManifest, match="the file was removed") as caught:
        use(result)
    assert len(caught) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        use(result, check=False)


def flip(path, at, bit):
    data = bytearray(path.read_bytes())
    data[at] ^= 1 << bit
    path.write_bytes(data)


def swap(folder, one, other):
    (folder / one).rename(folder / "aside")
    (folder / other).rename(folder / one)
    (folder / "aside").rename(folder / other)


NAMES = [f"trajectory_000{k}.h5" for k in (1, 2, 3)]
DAMAGES = {
    **{f"{name} is lost": (lambda folder, name=name: (folder / name).unlink(), "missing") for name in NAMES},
    **{f"{name} is cut": (lambda folder, name=name: os.truncate(folder / name, 5000), "cannot be read|was cut")
       for name in NAMES},
    **{f"{name} is longer": (lambda folder, name=name: (folder / name).open("ab").write(b"x"), "was cut, extended")
       for name in NAMES},
    **{f"{a} and {b} are exchanged": (lambda folder, a=a, b=b: swap(folder, a, b), "exchanged")
       for a, b in ((NAMES[0], NAMES[1]), (NAMES[1], NAMES[2]), (NAMES[0], NAMES[2]))},
    "the last is renumbered": (lambda folder: (folder / NAMES[2]).rename(folder / "trajectory_0004.h5"), "missing"),
    "all are renumbered": (
        lambda folder: [(folder / NAMES[k]).rename(folder / f"trajectory_000{k + 2}.h5") for k in (2, 1, 0)],
        "does not belong|missing"),
    "one comes from elsewhere": (
        lambda folder: shutil.copyfile(folder / NAMES[2], folder / "trajectory_0004.h5"), "do not ascend"),
    "one is there twice": (
        lambda folder: shutil.copyfile(folder / NAMES[0], folder / NAMES[1]), "ascend|exchanged|cut"),
    "a foreign open one": (
        lambda folder: shutil.copyfile(folder / NAMES[2], folder / "trajectory_0009.h5.open"), "segment is missing"),
    "profile.h5 is changed": (lambda folder: flip(folder / "profile.h5", -9, 3), "profile.h5"),
}


@pytest.mark.parametrize("damage", list(DAMAGES))
def test_a_damage_is_told_in_a_sentence(result, damage):
    harm, words = DAMAGES[damage]
    harm(result)
    with warnings.catch_warnings(), pytest.raises(ResultError, match=words) as caught:
        warnings.simplefilter("error")
        use(result)
    assert str(result) in str(caught.value)


@pytest.mark.parametrize("name", NAMES)
def test_no_flipped_bit_of_a_segment_stays_unseen(result, name, capsys):
    random = np.random.default_rng(3)
    whole = (result / name).read_bytes()
    for at, bit in zip(random.integers(0, len(whole), 12), random.integers(0, 8, 12)):
        flip(result / name, int(at), int(bit))
        with pytest.raises(ResultError):
            use(result)
        (result / name).write_bytes(whole)
    use(result)


def test_only_what_is_used_is_compared(result):
    with h5py.File(result / NAMES[1], "r+") as file:
        at = file["frames/velocity"].id.get_chunk_info(0).byte_offset
    write_manifest(result, rows_of(result))
    flip(result / NAMES[1], at, 0)
    run = Trajectory(result)
    run.frame(0), run.frame(-1)
    for _ in range(2):
        with pytest.raises(ResultError, match="trajectory_0002.h5 is not what was written"):
            run.frame(4)
    use(result, check=False)


def test_every_byte_of_the_manifest_counts(result):
    whole = (result / "manifest.txt").read_bytes()
    for at in range(len(whole)):
        for damaged in (whole[:at] + bytes([whole[at] ^ 1]) + whole[at + 1 :], whole[:at]):
            (result / "manifest.txt").write_bytes(damaged)
            with pytest.raises(ManifestError, match="manifest.txt is not what was written"):
                read_manifest(result)
            # Whoever opens a result reads its manifest.
            if at % 100 == 0:
                with pytest.raises(ResultError, match="manifest.txt is not what was written"):
                    Trajectory(result)


def test_a_manifest_of_another_version_is_told(result):
    write_manifest(result, [], "polydem-manifest 2")
    with pytest.raises(ResultError, match="another version"):
        Trajectory(result)


def test_a_run_that_goes_on_has_an_open_segment_that_is_not_closed(result):
    rows = [open_row(NAMES[2]) if row.startswith(NAMES[2]) else row for row in rows_of(result)]
    (result / NAMES[2]).rename(result / f"{NAMES[2]}.open")
    write_manifest(result, rows)
    use(result)
    (result / f"{NAMES[2]}.open").rename(result / NAMES[2])  # killed between the new name and its line
    use(result)


@pytest.mark.parametrize("suffix", ["", ".open"])
@pytest.mark.parametrize("changed", ["run", "file"])
def test_a_segment_of_another_run_or_name_that_is_not_closed_is_told(result, changed, suffix):
    rows = [open_row(NAMES[2]) if row.startswith(NAMES[2]) else row for row in rows_of(result)]
    write_manifest(result, rows)
    with h5py.File(result / NAMES[2], "r+") as file:
        file[f"provenance/{changed}"][()] = "another"
    (result / NAMES[2]).rename(result / f"{NAMES[2]}{suffix}")
    with pytest.raises(ResultError, match=f"{NAMES[2]}.* was written by another run, or under another name"):
        Trajectory(result)


def test_what_is_not_in_the_manifest_is_no_part_of_the_result(result):
    write_manifest(result, [row for row in rows_of(result) if NAMES[2] not in row])
    with pytest.raises(ResultError, match=f"{NAMES[2]} does not belong"):
        Trajectory(result)
    (result / NAMES[2]).unlink()
    assert len(Trajectory(result)) == 6


def test_the_command_line_ends_with_code_2_and_one_sentence(result, capsys):
    (result / NAMES[1]).unlink()
    assert main(["table", str(result)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1 and "segment is missing" in said
