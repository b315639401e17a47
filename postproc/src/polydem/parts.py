"""What a simulation is made of: columns of its bodies and contacts, its walls and loads."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from .errors import InputError

if TYPE_CHECKING:
    from .simulation import Simulation

#: Columns of the bodies, by the names of a `polydem_post` frame
BODY_COLUMNS = ("id", "fixed", "position", "angle", "velocity", "angular_velocity", "mass", "inertia", "material",
                "image", "vertex_start", "force", "torque", "damping_work", "friction_work")
#: Columns of the contacts, likewise
CONTACT_COLUMNS = ("first", "second", "area", "point", "normal", "length", "force", "couple")


class Named(dict[str, Any]):
    """Values by name; a wrong name is an error that lists the others."""

    def __init__(self, what: str, values: Mapping[str, Any]):
        super().__init__(values)
        self._what = what

    def __missing__(self, name: str) -> Any:
        raise InputError(f"there is no {self._what} {name!r}" + (f"; there are {', '.join(self)}" if self else ""))


class Strict:
    """An object to which no new attributes can be given from outside: a slip of the pen is an error."""

    def __setattr__(self, name: str, value: Any) -> None:
        known = getattr(type(self), name, None)
        if name.startswith("_") or (isinstance(known, property) and known.fset is not None):
            super().__setattr__(name, value)
        elif isinstance(known, property) or name in getattr(self, "_names", ()):
            raise AttributeError(f"{name} can be read, but not set")
        else:
            raise AttributeError(f"{type(self).__name__} has no attribute {name}")


class Columns(Strict):
    """Columns of bodies or contacts, in ascending order of identifiers; each is copied when it is asked for."""

    def __init__(self, simulation: Simulation, group: str, names: tuple[str, ...]):
        self._simulation, self._group, self._names = simulation, group, names

    def __getattr__(self, name: str) -> npt.NDArray[Any]:
        if name.startswith("_") or name not in self._names:
            raise AttributeError(f"{self._group} have no column {name}, but {', '.join(self._names)}")
        found = self._simulation._handle.array(f"{self._group}/{name}")
        if found is None:
            raise AttributeError(f"the {self._group} of this simulation have no column {name}")
        return found.astype(bool) if name == "fixed" else found

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._names]

    def __len__(self) -> int:
        """Number of rows."""
        return self._simulation._handle.integer(self._group)


class Bodies(Columns):
    """Columns of the bodies."""

    def apply_force(self, ids: npt.ArrayLike, force: npt.ArrayLike, torque: npt.ArrayLike = 0.0) -> None:
        """Let a force (2) or (n, 2) [N/m] and a torque [N] act on each of some free bodies, from the next step on.

        They hold until the body is given others; a force of 0 ends them. Their work is among `wall_work` of the energy
        balance.
        """
        which = np.asarray(ids, dtype=np.int64).ravel()
        try:
            values = np.column_stack([np.broadcast_to(np.asarray(force, dtype=float), (which.size, 2)),
                                      np.broadcast_to(np.asarray(torque, dtype=float), which.shape)])
        except ValueError as error:
            raise InputError(f"a force is (2) or ({which.size}, 2) numbers, a torque 1 or {which.size}") from error
        if which.size:
            self._simulation._handle.act("force", bodies=which, values=values)


class Wall(Strict):
    """A group &wall: its bodies, and the force and torque on it."""

    def __init__(self, simulation: Simulation, name: str, ids: npt.NDArray[np.int64]):
        self._simulation, self._name, self._id = simulation, name, ids

    @property
    def name(self) -> str:
        """Its name."""
        return self._name

    @property
    def id(self) -> npt.NDArray[np.int64]:
        """Identifiers of its bodies."""
        return self._id

    def _rows(self) -> npt.NDArray[np.intp]:
        return np.searchsorted(self._simulation.bodies.id, self.id)

    @property
    def position(self) -> npt.NDArray[np.float64]:
        """Mean of the centres of its bodies, (2) [m]."""
        return np.asarray(self._simulation.bodies.position[self._rows()].mean(axis=0))

    @property
    def force(self) -> npt.NDArray[np.float64]:
        """Force of the other bodies on it in this step, (2) [N/m]."""
        return np.asarray(self._simulation.bodies.force[self._rows()].sum(axis=0))

    @property
    def velocity(self) -> npt.NDArray[np.float64]:
        """Mean velocity of its bodies, (2) [m/s]; set it to move the wall from the next step on."""
        return np.asarray(self._simulation.bodies.velocity[self._rows()].mean(axis=0))

    @velocity.setter
    def velocity(self, velocity: npt.ArrayLike) -> None:
        self.move(velocity)

    def move(self, velocity: npt.ArrayLike = (0.0, 0.0), spin: float = 0.0,
             pivot: npt.ArrayLike | None = None) -> None:
        """Give it a velocity [m/s] and an angular velocity [rad/s] about a point that it takes along [m].

        They hold until it is given others, in place of its motions of the namelist. Without `pivot` it turns about the
        mean of the centres of its bodies. A wall with a load has no velocity of its own.
        """
        place = self.position if pivot is None else pivot
        self._simulation._handle.act("wall_velocity", self.name, values=[
            *numbers(velocity, 2, "a velocity"), float(spin), *numbers(place, 2, "a pivot")])


class Load(Strict):
    """A group &load: what it does, and its force."""

    def __init__(self, simulation: Simulation, name: str, number: int):
        self._simulation, self._name, self._number = simulation, name, number

    @property
    def name(self) -> str:
        """Its name."""
        return self._name

    def _value(self, k: int) -> float:
        values = self._simulation._handle.array("loads/value")
        return float("nan") if values is None else float(values.reshape(-1, 4)[self._number, k])

    @property
    def displacement(self) -> float:
        """Displacement of the wall by the load [m], or its angle [rad]."""
        return self._value(0)

    @property
    def velocity(self) -> float:
        """Its rate [m/s, rad/s]."""
        return self._value(1)

    @property
    def contacts(self) -> float:
        """Force [N/m] or torque [N] of the contacts along its direction."""
        return self._value(3)

    @property
    def force(self) -> float:
        """Present force [N/m] or torque [N], with the weight of the wall.

        Set it to change the load from the next step on: it holds until it is set again, without ramp, in place of the
        force or stress of the namelist.
        """
        return self._value(2)

    @force.setter
    def force(self, force: float) -> None:
        self._simulation._handle.act("load", self.name, values=[float(force)])


def numbers(values: npt.ArrayLike, n: int, what: str) -> npt.NDArray[np.float64]:
    """Some real numbers, as many as there must be."""
    found = np.asarray(values, dtype=np.float64).ravel()
    if found.size != n:
        raise InputError(f"{what} has {n} numbers, not {found.size}")
    return found


def walls_of(text: str) -> list[tuple[str, npt.NDArray[np.int64]]]:
    """Names and identifiers of the bodies of the walls: 'floor 101-103; lid 104 107'."""
    found = []
    for wall in filter(None, text.split("; ")):
        name, *ranges = wall.split()
        ids = [np.arange(int(low), int(high or low) + 1)
               for low, _, high in (each.partition("-") for each in ranges)]
        found.append((name, np.concatenate(ids) if ids else np.empty(0, dtype=np.int64)))
    return found
