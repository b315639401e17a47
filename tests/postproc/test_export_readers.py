"""Exported files, read back by the libraries of the programs that they are for: VTK (ParaView) and meshio.

Their packages are large, so they are installed for continuous integration only: POLYDEM_EXTRAS=test,readers.
"""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

vtk = pytest.importorskip("vtk")
meshio = pytest.importorskip("meshio")


@pytest.fixture(scope="module")
def run(heap_with_contacts):
    return heap_with_contacts


def arrays(data):
    """Points, cells as lists of points, and columns of a data set of VTK."""
    from vtk.util.numpy_support import vtk_to_numpy

    if data.IsA("vtkPartitionedDataSet"):
        data = data.GetPartition(0)
    if data.GetNumberOfCells() == 0:
        return np.empty((0, 3)), [], {}
    cells = [[data.GetCell(k).GetPointId(m) for m in range(data.GetCell(k).GetNumberOfPoints())]
             for k in range(data.GetNumberOfCells())]
    columns = data.GetCellData()
    found = {columns.GetArrayName(k): vtk_to_numpy(columns.GetArray(k)) for k in range(columns.GetNumberOfArrays())}
    return vtk_to_numpy(data.GetPoints().GetData()), cells, found


def assert_bodies(frame, points, cells, columns):
    assert len(cells) == len(frame)
    for outline, cell in zip(frame.vertices, cells):
        assert_array_equal(points[cell], np.column_stack([outline, np.zeros(len(outline))]))
    for name in ("id", "fixed", "angle", "angular_velocity", "speed", "area", "radius", "coordination"):
        assert_array_equal(columns[name], getattr(frame, name))
    assert_array_equal(columns["velocity"][:, :2], frame.velocity)
    assert_array_equal(columns["force"][:, :2], frame.force)
    assert_array_equal(columns["mass"], np.where(frame.fixed, 0.0, frame.mass))


def assert_contacts(frame, points, cells, columns):
    contacts = frame.contacts
    if len(contacts) == 0 and len(cells) == 1:  # the line without length that stands for no contacts
        assert (columns["first"][0], columns["second"][0], columns["normal_force"][0]) == (-1, -1, 0.0)
        assert_array_equal(points[0], points[1])
        return
    assert len(cells) == len(contacts)
    if not cells:
        return
    first = np.where(frame.fixed[contacts.first_index][:, None], contacts.point, frame.position[contacts.first_index])
    assert_array_equal(points[[cell[0] for cell in cells], :2], first)
    for name in ("first", "second", "normal_force", "tangential_force"):
        assert_array_equal(columns[name], getattr(contacts, name))
    assert_array_equal(columns["force"][:, :2], contacts.force)


@pytest.mark.parametrize("form, end", [("HDF", ".vtkhdf"), ("Xdmf", ".xdmf")])
def test_vtk_reads_the_series_of_one_file(run, exported, form, end):
    for name, check in (("heap", assert_bodies), ("heap_contacts", assert_contacts)):
        reader = getattr(vtk, f"vtk{form}Reader")()
        reader.SetFileName(str(exported / f"{name}{end}"))
        reader.UpdateInformation()
        information = reader.GetOutputInformation(0)
        key = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
        times = [information.Get(key, k) for k in range(information.Length(key))]
        assert times == list(run.times)
        for frame in [*run[::-1], *run]:
            reader.UpdateTimeStep(frame.time)
            check(frame, *arrays(reader.GetOutputDataObject(0)))


def test_vtk_reads_the_files_of_frames(run, exported):
    for number, frame in enumerate(run):
        for name, check in (("bodies", assert_bodies), ("contacts", assert_contacts)):
            reader = vtk.vtkXMLPolyDataReader()
            reader.SetFileName(str(exported / "heap_vtp" / f"{name}_{number:05d}.vtp"))
            reader.Update()
            check(frame, *arrays(reader.GetOutput()))


def test_meshio_reads_the_series_of_contacts(run, exported):
    with meshio.xdmf.TimeSeriesReader(exported / "heap_contacts.xdmf") as reader:
        reader.read_points_cells()
        assert reader.num_steps == len(run)
        for number, frame in enumerate(run):
            time, _, columns = reader.read_data(number)
            assert time == frame.time
            expected = frame.contacts.normal_force if len(frame.contacts) else [0.0]
            assert_array_equal(columns["normal_force"][0], expected)
