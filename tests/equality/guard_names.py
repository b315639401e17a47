"""Names that differ between the base revision and the present tree; the guard knows them from here alone.

Cases and comparisons use the names of the base revision. Whoever renames something adds one line to PRESENT in the same
commit: the name in the base revision, then the name of today, or None if it was removed or changed on purpose. Cases
that need a removed name are skipped, data that were removed or changed are not compared; both are listed at the end.

    entries     "output.ledger": "output.balance"         entry of the namelist, group.key or group.name.key
    groups      "exchange": "decomposition"               all entries of a group that are not in `entries`
    words       "forces.damping=book": "matuttis_chen"    value of an entry; also "--finder=quadtree_o2"
    options     "--samples": "--record"                   option of the command line
    files       "profile": "report.h5"                    file of a result, see Names.FILES
    data        "trajectory/ledger/": "balance/"          data set, or group with a / at its end: kind of file, path
    counters    "settlements": "redistributions"          counter of the profile, column of steps and samples
    places      "program": "src/cli/polydem"              file of the build or of the sources, see Names.PLACES
"""

import re
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Names:
    """Names of one revision, by those of the base."""

    entries: dict = field(default_factory=dict)
    groups: dict = field(default_factory=dict)
    words: dict = field(default_factory=dict)
    options: dict = field(default_factory=dict)
    files: dict = field(default_factory=dict)
    data: dict = field(default_factory=dict)
    counters: dict = field(default_factory=dict)
    places: dict = field(default_factory=dict)

    #: Files of a result by kind: patterns within its folder
    FILES = {"trajectory": "trajectory_*.h5", "profile": "profile.h5", "trace": "trace.h5", "steps": "steps.h5",
             "overlaps": "overlaps.csv", "checkpoint": "checkpoint_?.h5", "sample": "*.h5"}
    #: The programs in a build folder, the namelists in the sources, among them that of the bed to pack drums from
    PLACES = {"program": "src/app/polydem", "laboratory": "src/app/polydem", "inputs": "inputs",
              "patch": "bench/patch.nml"}

    def entry(self, name):
        """An entry group.key; None if it was removed."""
        if name in self.entries:
            return self.entries[name]
        group, _, key = name.partition(".")
        group = self.groups.get(group, group)
        return group and f"{group}.{key}"

    def word(self, entry, value):
        """The value of an entry or option; None if it was removed. Quotes and other text stay as they are."""
        bare = value.strip("'")
        name = self.words.get(f"{entry}={bare}", bare)
        return name and value.replace(bare, name)

    def option(self, name):
        """An option of the command line."""
        return self.options.get(name, name)

    def file(self, kind):
        """The pattern of a file of a result."""
        return self.files.get(kind, self.FILES[kind])

    def place(self, what):
        """A file of the build or of the sources."""
        return self.places.get(what, self.PLACES[what])

    def old_data(self, kind, path):
        """The base revision's path of a data set that this revision calls so: kind/path."""
        for old, new in sorted(self.data.items(), key=lambda pair: -len(pair[1] or "")):
            if new is not None and old.startswith(f"{kind}/"):
                if path == new or (new.endswith("/") and path.startswith(new)):
                    return old + path[len(new):]
        return f"{kind}/{path}"

    def new_data(self, old):
        """What this revision calls a data set kind/path of the base, without its kind; None if it was removed."""
        for prefix, new in sorted(self.data.items(), key=lambda pair: -len(pair[0])):
            if old == prefix or (prefix.endswith("/") and old.startswith(prefix)):
                return None if new is None else new + old[len(prefix):]
        return old.split("/", 1)[1]

    def old_counter(self, name):
        """The base revision's name of a counter, also of one with something before it."""
        for old, new in self.counters.items():
            if new and re.fullmatch(f"(.* )?{re.escape(new)}", name):
                return name[:len(name) - len(new)] + old
        return name

    def is_removed(self, found):
        """Whether something that the base revision found was removed on purpose."""
        kind, _, rest = found.partition(" ")
        if kind == "counter":
            return any(new is None and re.fullmatch(f"(.* )?{re.escape(old)}", rest)
                       for old, new in self.counters.items())
        return self.new_data(found) is None


BASE = Names()

#: What the present tree calls what the base revision called otherwise
PRESENT = Names(entries={"decomposition.partition": None, "scene.fraction": "scene.solid_fraction",
                         "integrate.fraction": "integrate.safety_factor", "guards.passing": "guards.tunnelling",
                         "guards.relaxed_depth": "scene.remove_overlap",
                         "checkpoint.elapsed": "checkpoint.wall_interval", "cell.obeys": "cell.stress_controlled",
                         # Two entries became one of two values; `words` has those of the cases
                         **{f"scene.{key}_{end}": f"scene.{key}" for key in ("corners", "long_axis")
                            for end in ("min", "max")},
                         # The group in the drums of inputs
                         "scene.motion": "motion.turn.kind",
                         **{f"scene.motion_{key}": f"motion.turn.{key}" for key in (
                             "bodies", "pivot", "rate", "velocity", "amplitude", "frequency", "start", "ramp")}},
                words={"scene.corners_min=3": "3, 12", "scene.corners_max=20": "7, 20",
                       "scene.long_axis_min=9e-3": "9e-3, 11e-3", "scene.long_axis_max=15e-3": "8e-3, 15e-3"},
                # The settings of a sample, as text; points and normals of contacts, and what follows from points
                data={"trajectory/frames/slid": "frames/shear_offset", "checkpoint/bodies/slid": "bodies/shear_offset",
                      # The present one counts no more
                      "checkpoint/run/attempts": None,
                      "sample/case/input": None, "trajectory/contacts/point": None, "trajectory/contacts/normal": None,
                      **{f"trajectory/series/{name}": None for name in (
                          "stress_xx", "stress_xy", "stress_yx", "stress_yy", "inertial_number")}},
                places={"laboratory": "src/app/polydem_lab"})
