"""What a run leaves, under the names of the present tree, and how two of them differ."""

import re
from pathlib import Path

import h5py
import numpy as np

#: Data that are no results: where they come from, times, memory
IGNORED = re.compile(r"\w+/provenance/.*|profile/(profile/.*|status|counters/scope)|"
                     r"steps/steps/(stage|phase)(_name)?|sample/steps/(elapsed|processor|(phase|stage)(_name)?)|"
                     r"sample/case/(trace|load|clock_cost|time_utc)")
#: Counters that a restart continues
CONTINUED = {f"counter profile {name}" for name in ("steps", "contacts", "bodies")}
#: Counters that do not depend on which rank has which body
OF_THE_WHOLE_RUN = CONTINUED | {f"counter profile {name}" for name in
                                ("contacts without direction", "pair contradictions", "ranks")}
#: Data of a trajectory that do not grow from frame to frame
STANDING = re.compile(r"trajectory/(bodies/.*|walls/id)")


def read_file(path, kind, names):
    """All data sets of one file, by kind/path."""
    found = {}

    def take(path_, entry):
        name = names.present_data(kind, path_)
        if isinstance(entry, h5py.Dataset) and not IGNORED.fullmatch(name):
            found[name] = np.asarray(entry.asstr()[()] if h5py.check_string_dtype(entry.dtype) else entry[()])

    with h5py.File(path, "r") as file:
        file.visititems(take)
    spread_counters(found, names)
    return found


def spread_counters(found, names):
    """Replace arrays of counters by one value, or column, per name."""
    for labels, values in (("profile/counters/name", "profile/counters/value"),
                           ("steps/steps/count_name", "steps/steps/count"),
                           ("sample/steps/count_name", "sample/steps/count")):
        if labels in found and values in found:
            counted = zip(found.pop(labels), np.moveaxis(found.pop(values), -1, 0))
            for label, value in counted:
                found[f"counter {values.split('/')[0]} {names.present_counter(str(label))}"] = np.asarray(value)


def read_trajectory(folder, names):
    """All frames of a result, wherever its segments begin."""
    parts = []
    for path in sorted(Path(folder).glob(names.file("trajectory"))):
        part = read_file(path, "trajectory", names)
        start = part.pop("trajectory/contacts/start", None)
        if start is not None:
            part["trajectory/contacts/per frame"] = np.diff(start)
        flatten_frames(part)
        parts.append(part)
    if not parts:
        return {}
    return {name: value if STANDING.fullmatch(name) else np.concatenate([part[name] for part in parts])
            for name, value in parts[0].items()}


def flatten_frames(part):
    """One row per body of each frame, also of an older segment with one row per frame."""
    if part.pop("trajectory/frames/start", None) is not None or "trajectory/frames/angle" not in part:
        return
    frame = part["trajectory/frames/angle"].shape[:2]
    for name, values in part.items():
        if (name.startswith("trajectory/frames/") and not name.endswith(("/cell_low", "/cell_size"))
                and values.shape[:2] == frame):
            part[name] = values.reshape(-1, *values.shape[2:])


def read_result(folder, names, whole=True, ranks=1):
    """What a run left, by name; not `whole`: only what does not depend on where it was interrupted.

    On several ranks, counters of boxes, pairs, searches and messages are left out. They depend on which rank has which
    body, and the two revisions may divide the bodies differently: older ones divide a scene by the work of its bodies,
    which the root rank has counted; newer ones give all bodies equal work first, and count the pairs that a
    redistribution ends. Frames, contacts, ledger, walls and state hash depend on no division, so their bits are
    compared for every number of ranks. One rank divides nothing, so there all counters are compared.
    """
    found = read_trajectory(folder, names)
    if whole:
        segments = [path.name for path in Path(folder).glob(names.file("trajectory"))]
        found["trajectory/segments"] = np.asarray(len(segments))
        overlaps = Path(folder) / names.file("overlaps")
        if overlaps.exists():
            lines = overlaps.read_text(encoding="utf-8").splitlines()
            found["overlaps/rows"] = np.asarray([line for line in lines if re.match(r"\s*[-+.\d]", line)])
    for kind in ("profile", "trace", "steps") if whole else ("profile",):
        path = Path(folder) / names.file(kind)
        if path.exists():
            found.update(read_file(path, kind, names))
    if not whole or ranks > 1:
        kept = OF_THE_WHOLE_RUN if whole else CONTINUED
        found = {name: value for name, value in found.items() if not name.startswith("counter") or name in kept}
    return found


def read_samples(folder, names):
    """What the first, counted pass of a replay left: lists of pairs and counts, no times."""
    found = {}
    for path in sorted(Path(folder).rglob(names.file("sample"))):
        sample = read_file(path, "sample", names)
        if sample["sample/case/repeat"] == 0:
            found.update(sample)
    return found


def differences(expected, found, names):
    """Two lists of sentences: what differs, and what else is to be known; `expected` and `names` are of the base."""
    wrong, notes = [], []
    missing = [name for name in expected if name not in found]
    added = [name for name in found if name not in expected]
    for name in missing:
        if names.is_removed(name):
            notes.append(f"{name} was removed")
        else:
            hint = f"; new are {', '.join(added[:4])}: if it is one of them, name it in guard_names.py" if added else ""
            wrong.append(f"{name} is missing{hint}")
    notes += [f"{name} is new" for name in added]
    for name in expected:
        if name in found and not same_bits(expected[name], found[name]):
            sentence = f"{name}: {describe(expected[name], found[name])}"
            if names.is_removed(name):
                notes.append(f"on purpose, {sentence}")
            else:
                wrong.append(sentence)
    return wrong, notes


def same_bits(one, other):
    """Whether two arrays have the same type, shape and bits."""
    if one.dtype.kind in "OU":
        return one.shape == other.shape and one.tolist() == other.tolist()
    return one.dtype == other.dtype and one.shape == other.shape and one.tobytes() == other.tobytes()


def describe(one, other):
    """Where two arrays differ first."""
    if one.shape != other.shape or one.dtype.kind != other.dtype.kind:
        return f"{one.dtype} {one.shape} became {other.dtype} {other.shape}"
    if one.dtype != other.dtype:
        return f"{one.dtype} became {other.dtype}"
    if one.dtype.kind in "OU":
        places = np.argwhere(one != other)
    else:
        size = one.dtype.itemsize
        bits = [np.frombuffer(array.tobytes(), dtype=np.uint8).reshape(*array.shape, size) for array in (one, other)]
        places = np.argwhere((bits[0] != bits[1]).any(axis=-1))
    first = tuple(places[0])
    place = f" at [{', '.join(map(str, first))}]" if first else ""
    return f"{one[first]!r} became {other[first]!r}{place}, {len(places)} of {one.size} values"
