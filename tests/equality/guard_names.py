"""Names that differ between the base revision and the present tree; the guard knows them from here alone.

Cases and comparisons use the names of the present tree. Whoever renames something adds one line to BASE in the same
commit: the name of today, then the former one, which counts for a base that does not know that of today. A case with
an entry, a word or a namelist that the base does not have is skipped, data that were removed or changed on purpose are
not compared; both are listed at the end.

    entries     "output.balance": "output.ledger"         entry of the namelist, group.key or group.name.key; several
                                                          former names have one of its values each
    words       "forces.damping=matuttis_chen": "book"    value of an entry; also "--finder=quadtree"
    options     "--record": "--samples"                   option of the command line
    files       "report": "profile.h5"                    file of a result, see Names.FILES
    data        "trajectory/balance/": "ledger/"          data set, or group with a / at its end: kind of file, path
    counters    "redistributions": "settlements"          counter of the profile, column of steps and samples
    removed     "trajectory/contacts/point"               data of the base, in its names, that are gone or changed
    places      "program": "src/cli/polydem"              file of the build or of the sources, see Names.PLACES
"""

import re
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Names:
    """Names of one revision, by those of the present tree."""

    entries: dict = field(default_factory=dict)
    words: dict = field(default_factory=dict)
    options: dict = field(default_factory=dict)
    files: dict = field(default_factory=dict)
    data: dict = field(default_factory=dict)
    counters: dict = field(default_factory=dict)
    removed: frozenset = frozenset()
    places: dict = field(default_factory=dict)

    #: Files of a result by kind: patterns within its folder
    FILES = {"trajectory": "trajectory_*.h5", "profile": "profile.h5", "trace": "trace.h5", "steps": "steps.h5",
             "overlaps": "overlaps.csv", "checkpoint": "checkpoint_?.h5", "sample": "*.h5"}
    #: The programs in a build folder, the namelists in the sources, among them that of the bed to pack drums from
    PLACES = {"program": "src/app/polydem", "laboratory": "src/app/polydem_lab", "inputs": "inputs",
              "patch": "bench/patch.nml"}

    def pairs(self, entry, value):
        """What this revision is given for an entry and its value: pairs of entry and value."""
        names = self.entries.get(entry, entry)
        if isinstance(names, str):
            return [(names, self.word(entry, value))]
        return list(zip(names, value.split(", "), strict=True))

    def word(self, entry, value):
        """The value of an entry or option. Quotes and other text stay as they are."""
        bare = value.strip("'")
        return value.replace(bare, self.words.get(f"{entry}={bare}", bare))

    def option(self, name):
        """An option of the command line."""
        return self.options.get(name, name)

    def file(self, kind):
        """The pattern of a file of a result."""
        return self.files.get(kind, self.FILES[kind])

    def place(self, what):
        """A file of the build or of the sources."""
        return self.places.get(what, self.PLACES[what])

    def present_data(self, kind, path):
        """What the present tree calls a data set of this revision: kind/path."""
        for new, old in sorted(self.data.items(), key=lambda pair: -len(pair[1])):
            if new.startswith(f"{kind}/") and (path == old or (old.endswith("/") and path.startswith(old))):
                return new + path[len(old):]
        return f"{kind}/{path}"

    def own_data(self, name):
        """What this revision calls a data set kind/path of the present tree, without its kind."""
        for new, old in sorted(self.data.items(), key=lambda pair: -len(pair[0])):
            if name == new or (new.endswith("/") and name.startswith(new)):
                return old + name[len(new):]
        return name.split("/", 1)[1]

    def present_counter(self, name):
        """The present name of a counter of this revision, also of one with something before it."""
        for new, old in self.counters.items():
            if re.fullmatch(f"(.* )?{re.escape(old)}", name):
                return name[:len(name) - len(old)] + new
        return name

    def is_removed(self, found):
        """Whether the present tree has no longer, or otherwise on purpose, what this revision found."""
        return any(found == name or (name.endswith("/") and found.startswith(name)) for name in self.removed)


PRESENT = Names()

#: What the base revision calls otherwise
BASE = Names(entries={"cell.stress_controlled": "cell.obeys",
                      "scene.corners": ("scene.corners_min", "scene.corners_max"),
                      "scene.long_axis": ("scene.long_axis_min", "scene.long_axis_max"),
                      # The group in the drums of inputs
                      **{f"motion.turn.{key}": f"scene.motion_{key}" for key in (
                          "bodies", "pivot", "rate", "velocity", "amplitude", "frequency", "start", "ramp")},
                      "motion.turn.kind": "scene.motion"},
             data={"trajectory/frames/shear_offset": "frames/slid"},
             # The settings of a sample, as text
             removed=frozenset({"sample/case/input"}),
             places={"laboratory": "src/app/polydem"})
