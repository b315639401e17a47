"""Measures that other packages compute: graphs, systems of freud, loops of contacts, and runs as functions."""

import os
from pathlib import Path

import numpy as np
import polydem
import pytest
from polydem_post import Trajectory
from polydem_post.analysis import contact_loops, coordination_number

ROOT = Path(os.environ["POLYDEM_SOURCE_DIR"])


@pytest.fixture(scope="module")
def dense():
    """A dense sample in a sheared cell."""
    with polydem.Simulation(ROOT / "inputs/pressed.nml") as sim:
        sim.friction_scale = 0
        sim.run(until=0.4)
        yield sim.frame()


def test_loops_fill_a_periodic_cell(dense):
    loops = contact_loops(dense)
    assert loops.area.sum() == pytest.approx(dense.cell_size.prod(), rel=1e-12)
    bodies = np.unique(loops.index).size
    edges = loops.sides.sum() // 2
    # Euler's formula on a torus
    assert bodies - edges + len(loops.sides) == 0
    assert np.array_equal(np.diff(loops.start), loops.sides)
    assert loops.sides.min() == 3


def test_loops_of_a_heap_obey_euler_without_the_outside():
    with polydem.Simulation(ROOT / "inputs/first.nml") as sim:
        sim.run(until=0.6)
        frame = sim.frame()
        loops, graph = contact_loops(frame), frame.to_networkx()
    networkx = pytest.importorskip("networkx")
    free = networkx.k_core(networkx.Graph(graph.subgraph(frame.id[frame.free].tolist())), 2)
    parts = networkx.number_connected_components(free)
    assert len(loops.sides) == free.number_of_edges() - free.number_of_nodes() + parts


def test_a_graph_has_bodies_and_contacts(dense):
    networkx = pytest.importorskip("networkx")
    graph = dense.to_networkx()
    assert graph.number_of_nodes() == len(dense.id)
    assert graph.number_of_edges() == len(dense.contacts)
    degree = np.array([len(set(graph[int(body)])) for body in dense.id])
    assert degree.mean() == pytest.approx(coordination_number(dense))
    force = networkx.get_edge_attributes(graph, "normal_force")
    assert sum(force.values()) == pytest.approx(dense.contacts.normal_force.sum())
    assert np.array_equal(graph.nodes[int(dense.id[7])]["position"], dense.position[7])


def test_freud_takes_the_system(dense):
    freud = pytest.importorskip("freud")
    system, neighbours = dense.to_freud()
    distance = np.hypot(*dense.contacts.branch.T)
    assert len(neighbours) == 2 * len(dense.contacts)
    assert np.allclose(np.sort(neighbours.distances)[::2], np.sort(distance), rtol=1e-5)
    order = freud.order.Hexatic(k=6).compute(system, neighbors=neighbours)
    assert len(order.particle_order) == dense.free.sum()
    found = freud.locality.AABBQuery(*system).query(system[1], {"r_max": float(distance.max()), "exclude_ii": True})
    assert len(found.toNeighborList()) >= len(neighbours)


def test_a_run_is_a_function_of_its_entries():
    def height(frame):
        return frame.position[:, 1].max()

    heights = [polydem.evaluate(ROOT / "inputs/first.nml", {"scene.bodies": n}, height, until=0.02)
               for n in (50, 50, 100)]
    assert heights[0] == heights[1] < heights[2]


@pytest.mark.parametrize(("scene", "time"), [("first", 0.15), ("steady_hopper", 0.4), ("plane_shear", 0.1)])
def test_works_on_bodies_sum_to_the_balance(tmp_path, scene, time):
    overrides = {"integrate.duration": time, "output.body_works": True, "output.frame_interval": time / 2}
    with polydem.Simulation(ROOT / f"inputs/{scene}.nml", overrides, folder=tmp_path / "r") as sim:
        sim.run(until=time / 2)
        frame, energy = sim.frame(), sim.energy
        left = energy.get("departed_energy", 0.0)
        for name in ("damping_work", "friction_work"):
            found = getattr(frame, name)
            assert np.array_equal(found[frame.free], getattr(sim.bodies, name)[~sim.bodies.fixed])
            if not left:
                assert found.sum() == pytest.approx(energy[name], rel=1e-11)
        assert (frame.damping_work[frame.free] < 0).sum() > 5
        sim.run()
    stored = Trajectory(tmp_path / "r")
    assert np.array_equal(stored[1].friction_work, frame.friction_work)
    if not left and "departed_energy" not in stored.energy_balance:
        assert stored[-1].damping_work.sum() == pytest.approx(stored.energy_balance["damping_work"][-1], rel=1e-11)


def test_works_need_the_balance():
    with pytest.raises(polydem.InputError, match=r"body_works' in &output needs 'energy_balance'"):
        polydem.Simulation(ROOT / "inputs/first.nml", {"output.body_works": True, "output.energy_balance": False})
