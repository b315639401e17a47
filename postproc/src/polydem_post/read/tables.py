"""Frames, contacts and trajectories as tables of pandas and data sets of xarray, which are optional packages.

Contacts, frames and trajectories import this module, so their types are not named here.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from ..base.columns import columns_of
from ..base.optional import need
from ..base.result_file import ResultError

#: Why a column of all frames cannot be one array, and what to do
OTHER_BODIES = ("the bodies are not the same in all frames, since some enter, leave or vanish; take frame by frame and "
                "its id, or frames between which none does, as in run[10:20]; run.departures has each body that left")

#: Columns of bodies in tables: those that need no contacts and no settings
BODY_COLUMNS = ("fixed", "position", "angle", "velocity", "angular_velocity", "mass", "inertia", "area", "density",
                "material", "radius", "corners")

#: Columns of bodies in tables that change from frame to frame
MOVING_COLUMNS = ("position", "angle", "velocity", "angular_velocity")

#: Columns of contacts in tables
CONTACT_COLUMNS = ("first", "second", "first_index", "second_index", "area", "depth", "point", "normal", "length",
                   "force", "couple", "normal_force", "tangential_force", "branch", "with_fixed")


def insist_on_frames(run: Any) -> None:
    """A table needs a frame."""
    if len(run) == 0:
        raise ResultError(f"{run.folder}: there are no frames")


def flat(columns: dict[str, npt.NDArray[Any]]) -> dict[str, npt.NDArray[Any]]:
    """Columns of vectors as two columns each, with _x and _y behind their names."""
    found: dict[str, npt.NDArray[Any]] = {}
    for name, values in columns.items():
        if values.ndim == 2:
            found[f"{name}_x"], found[f"{name}_y"] = values[:, 0], values[:, 1]
        else:
            found[name] = values
    return found


def body_columns(frame: Any, names: tuple[str, ...] = BODY_COLUMNS) -> dict[str, npt.NDArray[Any]]:
    """Columns of the bodies of a frame by name, vectors as two columns."""
    return flat({name: np.asarray(getattr(frame, name)) for name in names})


def contact_columns(contacts: Any) -> dict[str, npt.NDArray[Any]]:
    """Columns of contacts by name, vectors as two columns."""
    return flat({**{name: np.asarray(getattr(contacts, name)) for name in CONTACT_COLUMNS}, **contacts.others})


def body_table(frame: Any) -> Any:
    """A pandas table of the bodies of a frame."""
    pandas = need("pandas", "tables", "to_pandas()")
    return pandas.DataFrame(body_columns(frame), index=pandas.Index(frame.id, name="id"))


def contact_table(contacts: Any) -> Any:
    """A pandas table of contacts."""
    return need("pandas", "tables", "to_pandas()").DataFrame(contact_columns(contacts))


def trajectory_table(run: Any) -> Any:
    """A pandas table of the bodies of all frames."""
    pandas = need("pandas", "tables", "to_pandas()")
    insist_on_frames(run)
    return pandas.concat([body_table(frame) for frame in run], keys=run.times, names=["time", "id"])


def trajectory_dataset(run: Any) -> Any:
    """An xarray data set of a run: columns of bodies and the energy balance, with units and meanings."""
    xarray = need("xarray", "tables", "to_xarray()")
    insist_on_frames(run)
    first = run.frame(0)
    described = columns_of(type(first))

    def attributes(name: str) -> dict[str, str]:
        return {"units": described[name].unit, "long_name": described[name].meaning}

    variables: dict[str, Any] = {}
    parts: dict[str, list[npt.NDArray[Any]]] = {name: [] for name in MOVING_COLUMNS}
    for frame in run:
        if not np.array_equal(frame.id, first.id):
            raise ResultError(f"{run.folder}: {OTHER_BODIES}")
        for name, column in parts.items():
            column.append(getattr(frame, name))
    for name in BODY_COLUMNS:
        values = np.stack(parts[name]) if name in parts else np.asarray(getattr(first, name))
        dimensions = ("time", "id") if name in parts else ("id",)
        extra = ("axis",) if values.ndim > len(dimensions) else ()
        variables[name] = (dimensions + extra, values, attributes(name))
    for name, values in run.energy_balance.items():
        variables[name] = (("time",), values, {"units": run.balance_units.get(name, "")})
    coordinates = {"time": ("time", run.times, {"units": "s"}), "id": ("id", first.id), "axis": ("axis", ["x", "y"]),
                   "step": ("time", run.steps)}
    return xarray.Dataset(variables, coords=coordinates, attrs={"source": str(run.folder)})
