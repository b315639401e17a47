"""Results with a manifest: what was lost, exchanged, cut or changed is told, and nothing else."""

import os
import shutil
import struct
import sys
import warnings
from pathlib import Path

import h5py
import numpy as np
import pytest
from polydem_post import NoManifest, ResultError, Trajectory
from polydem_post.command_line.main import main
from polydem_post.read import manifest as manifests

sys.path.insert(0, str(Path(os.environ["POLYDEM_SOURCE_DIR"]) / "tests" / "ranks"))
from seals import SLICE, mix


def words_of(data):
    """Words of eight bytes, filled up with zeros."""
    data += bytes(-len(data) % 8)
    return struct.unpack(f"<{len(data) // 8}Q", data)


def file_hash(data):
    words = struct.unpack(f"<{len(data) // 8}Q", data[: len(data) // 8 * 8])
    slices = [words[k : k + SLICE] for k in range(0, len(words), SLICE)]
    rest = int.from_bytes(data[len(words) * 8 :], "little")
    return f"{mix(len(data), [*(mix(len(part), part) for part in slices), rest]):016x}"


def write_manifest(folder, texts):
    """Write a manifest of these texts, each with its hash."""
    previous, lines = 0, []
    for text in texts:
        data = text.encode()
        previous = mix(mix(previous, [len(data)]), words_of(data))
        lines.append(f"{text} {previous:016x}\n")
    (folder / "manifest.txt").write_text("".join(lines))


def texts_of(folder):
    """What the manifest of a finished result says."""
    texts = ["polydem-manifest 1", "owns log.txt"]
    for path in sorted(folder.glob("trajectory_*.h5")):
        with h5py.File(path, "r") as file:
            steps = file["frames/step"][:]
        data = path.read_bytes()
        texts += [f"owns {path.name}",
                  f"closed {path.name} {len(data)} {file_hash(data)} {len(steps)} {steps[0]} {steps[-1]}"]
    data = (folder / "profile.h5").read_bytes()
    return [*texts, "owns profile.h5", f"closed profile.h5 {len(data)} {file_hash(data)}"]


@pytest.fixture
def result(finished, tmp_path):
    """A finished result of three segments with its manifest."""
    folder = tmp_path / "result"
    shutil.copytree(finished, folder)
    write_manifest(folder, texts_of(folder))
    return folder


def use(folder, **options):
    """Read all that there is."""
    run = Trajectory(folder, **options)
    for number in range(len(run)):
        run.frame(number), run.contacts(number), run.walls(number)
    return run.energy_balance, run.profile, run.counters, run.provenance, run.state_hash, run.status


@pytest.mark.parametrize("size", [0, 1, 7, 8, 9, 65528, 65536, 65537, 131072, 200001])
def test_hashes_are_those_of_the_program(tmp_path, size):
    data = np.random.default_rng(size).bytes(size)
    (tmp_path / "a").write_bytes(data)
    (tmp_path / "b").write_bytes(data[1:])
    assert manifests.file_hashes([tmp_path / "a", tmp_path / "b"]) == [file_hash(data), file_hash(data[1:])]


def test_a_file_of_more_slices_than_are_hashed_at_once_has_its_hash(tmp_path, monkeypatch):
    monkeypatch.setattr(manifests, "SLICES", 2)
    data = np.random.default_rng(1).bytes(5 * 65536 + 13)
    (tmp_path / "a").write_bytes(data)
    assert manifests.file_hashes([tmp_path / "a", tmp_path / "a"]) == 2 * [file_hash(data)]


def test_a_whole_result_is_read_without_a_word(result):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        use(result)
        use(result / "trajectory_0002.h5")


def test_a_result_without_a_manifest_is_read_with_one_warning(result):
    (result / "manifest.txt").unlink()
    with pytest.warns(NoManifest, match="an older version wrote it, or the file was removed") as caught:
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


def test_only_what_is_used_is_hashed(result, monkeypatch):
    monkeypatch.setattr("polydem_post.read.result_folder.CHECKED_AT_ONCE", 1)
    with h5py.File(result / NAMES[1], "r+") as file:
        at = file["frames/velocity"].id.get_chunk_info(0).byte_offset
    write_manifest(result, texts_of(result))
    flip(result / NAMES[1], at, 0)
    run = Trajectory(result)
    run.frame(0), run.frame(-1)
    for _ in range(2):
        with pytest.raises(ResultError, match="trajectory_0002.h5 is not what was written"):
            run.frame(4)
    monkeypatch.undo()
    run = Trajectory(result)
    run.frame(0)
    with pytest.raises(ResultError, match="trajectory_0002.h5 is not what was written"):
        run.frame(4)
    use(result, check=False)


@pytest.mark.parametrize("line", range(9))
def test_every_bit_of_the_manifest_counts(result, line):
    lines = (result / "manifest.txt").read_bytes().splitlines(keepends=True)
    for at in range(0, len(lines[line]) - 1, 3):
        changed = bytearray(lines[line])
        changed[at] ^= 1
        (result / "manifest.txt").write_bytes(b"".join([*lines[:line], bytes(changed), *lines[line + 1 :]]))
        with pytest.raises(ResultError, match=f"line {line + 1} of manifest.txt"):
            Trajectory(result)
    if line < 8:
        (result / "manifest.txt").write_bytes(b"".join([*lines[:line], *lines[line + 1 :]]))
        with pytest.raises(ResultError, match="manifest.txt"):
            Trajectory(result)


@pytest.mark.parametrize("length", range(1, 60, 7))
def test_a_torn_last_line_counts_for_nothing(result, length):
    with (result / "manifest.txt").open("a") as file:
        file.write("closed trajectory_0001.h5 1 0123456789abcdef 1 2 3 0123456789abcdef"[:length])
    use(result)


@pytest.mark.parametrize("text", ["owns", "closed a 1", "opened a", "closed a x 0123456789abcdef", "owns a b", ""])
def test_an_unknown_line_is_told(result, text):
    write_manifest(result, [*texts_of(result), text])
    with pytest.raises(ResultError, match="line 11 of manifest.txt is unknown"):
        Trajectory(result)


def test_a_manifest_of_a_newer_version_is_told(result):
    write_manifest(result, ["polydem-manifest 2"])
    with pytest.raises(ResultError, match="newer version"):
        Trajectory(result)


def test_a_run_that_goes_on_has_an_open_segment_that_is_not_closed(result):
    texts = [text for text in texts_of(result) if not text.startswith(f"closed {NAMES[2]}")]
    (result / NAMES[2]).rename(result / f"{NAMES[2]}.open")
    write_manifest(result, texts)
    use(result)
    (result / f"{NAMES[2]}.open").rename(result / NAMES[2])  # killed between the new name and its line
    use(result)


def test_what_was_removed_and_made_again_counts_as_it_is_now(result):
    texts = texts_of(result)
    last = [text for text in texts if NAMES[2] in text]
    write_manifest(result, [*texts, f"removed {NAMES[2]}", *last])
    use(result)
    write_manifest(result, [*texts, f"removed {NAMES[2]}"])
    with pytest.raises(ResultError, match=f"{NAMES[2]} does not belong"):
        Trajectory(result)
    (result / NAMES[2]).unlink()
    assert len(Trajectory(result)) == 6


def test_the_command_line_ends_with_code_2_and_one_sentence(result, capsys):
    (result / NAMES[1]).unlink()
    assert main(["table", str(result)]) == 2
    said = capsys.readouterr().err
    assert said.startswith("error: ") and said.count("\n") == 1 and "segment is missing" in said
