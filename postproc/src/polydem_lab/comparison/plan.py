"""What `./polydem paper` measures: the pieces of the quick and of the full comparison, in the order they need.

Both come from the namelists of the benches in inputs; the quick one takes fewer scenes, finders and repeats.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, replace
from pathlib import Path

from polydem_post.base.result_file import ResultError, insist_on_file

from ..bench.paper import SIZES
from .bench_file import RECORDED, BenchFile, number_of, read_bench_file

#: The repository
ROOT = Path(__file__).resolve().parents[4]

#: Benches in an order in which each finds the traces that it needs
BENCHES = ("sizes", "threads", "motion", "scenes", "order", "gas", "live", "channel", "oracle", "verify")

#: Benches of the quick comparison, and what they keep: scenes, finders, and other entries
QUICK_SCENES = {
    "sizes": ("drum_2522", "drum_5058", "drum_7599", "drum_10014", "drum_12651", "drum_30000", "drum_100000"),
    "threads": ("drum_2522", "drum_12651", "drum_100000"),
    "motion": ("drum_12651_slow", "drum_12651_fast"),
    "scenes": ("bed_static", "gas_0.1", "gas_0.6", "hopper", "sizes_3", "sizes_10", "soft", "range_0.01", "range_0.03"),
    "order": ("worst_order_2500", "worst_order_5000"),
    "gas": ("even_2500", "even_10000", "even_40000"),
    "live": ("drum_2522", "drum_5058", "drum_7599", "drum_10014", "drum_12651"),
}
QUICK_REPEATS = 5

#: What else is less in the quick comparison: of whole steps those of the paper's finders on one thread, in drums that
#: have turned for a shorter time
QUICK_CHANGES = {"live": {"finders": ("quadtree", "sort_and_sweep"), "threads": (1,), "steps": 100}}
QUICK_ENTRIES = {"live": ("output.trace_start=0.1", "integrate.duration=0.1025")}

#: Scenes of speed against error that the quick comparison runs, and repeats of their times
QUICK_PRECISION, QUICK_PRECISION_REPEATS = ("flat_impact",), 2
FULL_PRECISION_REPEATS = 3

#: Drums and finders whose cache misses are simulated
CACHE_SCENES = ("drum_2522", "drum_5058", "drum_7599", "drum_10014", "drum_12651", "drum_30000")
CACHE_FINDERS = ("quadtree", "quadtree_called", "sort_and_sweep", "linked_cells", "verlet")

#: Time of the quick comparison [s]
QUICK_LIMIT = 15.0 * 60.0


@dataclass(frozen=True)
class Piece:
    """One part of the comparison, which is made as a whole and reused as a whole."""

    name: str
    #: bench, cache, verify or precision
    kind: str
    #: What it makes, for people
    purpose: str
    bench: BenchFile | None = None
    #: Names of pieces that it needs
    needs: tuple = ()
    #: Words that its kind understands: scenes, repeats, benchmarks
    options: tuple = ()

    def settings(self, folder: Path) -> str:
        """All that decides over its result, as one text."""
        lines = [self.kind, self.name, *map(str, self.options)]
        if self.bench is not None:
            lines.append(self.bench.written(folder))
            files = {text.split()[0] for text in (*self.bench.prepare, *self.bench.scenes.values())}
            lines += [path.read_text(encoding="utf-8") for path in map(ROOT.joinpath, sorted(files))
                      if path.suffix == ".nml" and path.is_file()]
        return "\n".join(lines)


def make_plan(mode: str, folder: Path, cores: int, file: Path | None = None) -> list[Piece]:
    """All pieces of the comparison `quick` or `full`, whose benches lie in a folder; or those of a file."""
    if file is not None:
        return plan_of_file(file, folder)
    pieces = []
    for name in BENCHES:
        if mode == "quick" and name not in QUICK_SCENES:
            continue
        bench = read_bench_file(ROOT / "inputs" / f"bench_{name}.nml")
        pieces.append(bench_piece(adapted(bench, mode, cores), folder))
    kinds = {"quick": ("--quick",), "full": ("--full",)}[mode]
    pieces.append(Piece("verification", "verify", "runs against theory and publications", options=kinds))
    scenes = QUICK_PRECISION if mode == "quick" else ()
    repeats = QUICK_PRECISION_REPEATS if mode == "quick" else FULL_PRECISION_REPEATS
    pieces.append(Piece("precision", "precision", "speed against error", options=(repeats, *scenes)))
    wanted = CACHE_SCENES[:5] if mode == "quick" else CACHE_SCENES
    finders = CACHE_FINDERS[:3:2] if mode == "quick" else CACHE_FINDERS
    pieces.append(Piece("cache", "cache", "simulated cache misses", needs=("sizes",),
                        options=(",".join(wanted), ",".join(finders))))
    return pieces


def plan_of_file(file: Path, folder: Path) -> list[Piece]:
    """The pieces of a JSON file: benches by the paths of their namelists from the file on, and options of others."""
    try:
        insist_on_file(file)
        listed = json.loads(file.read_text(encoding="utf-8"))
        pieces = []
        for name, what in listed.items():
            if "bench" in what:
                bench = read_bench_file(file.parent / what["bench"])
                pieces.append(bench_piece(replace(bench, name=name), folder))
            else:
                pieces.append(Piece(name, what["kind"], what.get("purpose", name), needs=tuple(what.get("needs", ())),
                                    options=tuple(what.get("options", ()))))
        return pieces
    except (OSError, ValueError, KeyError, AttributeError, TypeError) as error:
        raise ResultError(f"{file}: is not a plan of ./polydem paper ({error!r})") from error


def adapted(bench: BenchFile, mode: str, cores: int) -> BenchFile:
    """A bench of inputs for this machine: threads up to all its cores, and in the quick comparison less of it."""
    if max(bench.threads) > 1 and bench.name != "verify":
        bench = replace(bench, threads=threads_up_to(cores, 2 if bench.name == "live" else cores))
    if mode == "quick":
        bench = bench.only(QUICK_SCENES[bench.name],
                           **{"repeats": min(bench.repeats, QUICK_REPEATS), **QUICK_CHANGES.get(bench.name, {})})
        bench = bench.with_entries(*QUICK_ENTRIES.get(bench.name, ()))
    return bench


def threads_up_to(cores: int, most: int) -> tuple:
    """1, 2, 4, ... and all cores there are."""
    powers = [2**k for k in range(10) if 2**k <= min(cores, most)]
    return tuple(sorted({*powers, min(cores, most)}))


def bench_piece(bench: BenchFile, folder: Path) -> Piece:
    """A bench whose traces, and those of the benches that it needs, lie in a folder."""
    needs = tuple(sorted(bench.sources()))
    scenes = {name: _moved(text, folder) for name, text in bench.scenes.items()}
    packing = folder / "patch"
    if bench.prepare:
        scenes = {name: f"{text} scene.packing={packing}" if _is_packed(text) else text
                  for name, text in scenes.items()}
    prepare = tuple(f"{text} output.folder={packing}" for text in bench.prepare)
    return Piece(bench.name, "bench", PURPOSES.get(bench.name, "a bench"),
                 replace(bench, scenes=scenes, prepare=prepare), needs)


PURPOSES = {
    "sizes": "finders over size: the drums of the paper and larger ones",
    "threads": "speed-up by threads",
    "motion": "the fine-grained sweep over threads, sizes and motion",
    "scenes": "scenes that separate the claims",
    "order": "the worst start of a sweep",
    "gas": "finders over size at one speed",
    "live": "whole time steps",
    "channel": "a scene of one dimension",
    "oracle": "all pairs",
    "verify": "lists of all finders against all pairs",
}


def _moved(text: str, folder: Path) -> str:
    """A scene whose trace lies in the folder of this comparison."""
    match = RECORDED.match(text)
    return f"{folder / match[1]}/traces/{match[2]}/trace.h5" if match else text


def _is_packed(text: str) -> bool:
    """Whether a scene is tiled from the patch that a bench prepares."""
    path = ROOT / text.split()[0]
    return path.suffix == ".nml" and path.is_file() and "'results/patch'" in path.read_text(encoding="utf-8")


@dataclass(frozen=True)
class Rates:
    """Speed of this machine, from a short calibration."""

    #: Time on one thread of one body in one step of a run, of the comparison of one pair, and of one box in one step of
    #: a finder [s]
    body_step: float
    pair: float
    box_step: float


#: How much longer steps of a packing take than those of the gas of the calibration
PACKED = 4.0

#: How much longer a step of the mean of all finders takes than one of the paper's in that gas; beyond so many boxes
#: this grows with the root of their number, as the drums turn faster at their rims
ALL_FINDERS, EVEN = 2.5, 10000.0

#: How much longer its first step takes: by a sweep that begins unsorted as many times the number of boxes
FIRST_STEP, UNSORTED = 30.0, 0.8

#: Seconds of the pieces that are no benches on a usual machine: quick, full
OTHERS = {"verification": (30.0, 600.0), "precision": (50.0, 800.0), "cache": (40.0, 300.0)}


def estimate(piece: Piece, rates: Rates, cores: int, mode: str) -> float:
    """Seconds that a piece takes on this machine."""
    if piece.bench is None:
        return OTHERS.get(piece.name, (1.0, 1.0))[0 if mode == "quick" else 1]
    seconds = sum(_run_seconds(text, rates, cores) for text in piece.bench.prepare)
    return seconds + sum(_scene_seconds(piece.bench, name, text, rates, cores)
                         for name, text in piece.bench.scenes.items())


def _run_seconds(text: str, rates: Rates, cores: int) -> float:
    """Seconds of the run that makes the boxes of a scene."""
    steps = (number_of(text, "integrate.duration", ROOT) or 0.0) / (number_of(text, "integrate.dt", ROOT) or 2.5e-5)
    factor = 1.0 if "gas" in text else PACKED
    return factor * rates.body_step * boxes_of("", text) * steps / min(cores, 4)


def _scene_seconds(bench: BenchFile, name: str, text: str, rates: Rates, cores: int) -> float:
    boxes, made_by = boxes_of(name, text), _recorded_scene(text)
    steps = bench.steps or number_of(made_by, "output.trace_steps", ROOT) or 200.0
    all_pairs = 0.5 * rates.pair * boxes**2
    compared = steps if boxes <= 20000 else 3
    seconds = all_pairs * compared / cores
    passes = len(bench.threads) * (bench.repeats + 2)
    if bench.mode == "live":
        each = PACKED * rates.body_step * boxes * steps * passes * len(bench.finders)
        return _run_seconds(text, rates, cores) + each
    each = ALL_FINDERS * max(1.0, boxes / EVEN) ** 0.5 * steps + FIRST_STEP
    first = UNSORTED * boxes * ("unsorted_sweep" in bench.finders)
    seconds += all_pairs * steps * passes * ("all_pairs" in bench.finders)
    made = 0.0 if text.endswith(".h5") else _run_seconds(text, rates, cores)
    return made + seconds + rates.box_step * boxes * passes * (each * len(bench.finders) + first)


def _recorded_scene(text: str) -> str:
    """The scene that a bench of inputs recorded, of a trace; other scenes as they are."""
    path = Path(text)
    place = ROOT / "inputs" / f"bench_{path.parent.parent.parent.name}.nml"
    if path.suffix != ".h5" or not place.is_file():
        return text
    return read_bench_file(place).scenes.get(path.parent.name, text)


def boxes_of(name: str, text: str) -> float:
    """About how many boxes a scene has."""
    found = number_of(text, "scene.boxes", ROOT) or number_of(text, "scene.bodies", ROOT)
    if found:
        return found
    digits = [float(word) for word in name.split("_") if word.isdigit()]
    return digits[0] if digits else float(SIZES[1])
