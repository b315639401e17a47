"""Worker for Yade: polyhedra of unit depth that move in the plane only; the force is proportional to the overlap.

Yade runs it by `yade -n -x`.
"""

import math

from worker import serve
from yade import polyhedra_utils
from yade.minieigenHP import Quaternion, Vector3
from yade.wrapper import (
    Bo1_Polyhedra_Aabb,
    ForceResetter,
    Ig2_Polyhedra_Polyhedra_PolyhedraGeom,
    InsertionSortCollider,
    InteractionLoop,
    Ip2_PolyhedraMat_PolyhedraMat_PolyhedraPhys,
    Law2_PolyhedraGeom_PolyhedraPhys_Volumetric,
    NewtonIntegrator,
    Omega,
    PolyhedraMat,
)

#: Half of the depth of moving and of fixed bodies [m]; tangential stiffness in units of the normal one
HALF, HALF_FIXED, TANGENTIAL = 0.5, 1.0, 2.0 / 7.0


def build(scene, dt, knobs):
    """The simulation of a scene, which takes the place of the last one."""
    simulation = Omega()
    simulation.reset()
    material = PolyhedraMat()
    material.density = scene["density"]
    material.young = knobs["stiffness"]
    material.poisson = knobs["stiffness"] * TANGENTIAL
    material.frictionAngle = math.atan(scene["friction"])
    simulation.materials.append(material)
    numbers = [simulation.bodies.append(_body(body, material)) for body in scene["bodies"]]
    simulation.engines = [
        ForceResetter(),
        InsertionSortCollider([Bo1_Polyhedra_Aabb()], verletDist=0.05),
        InteractionLoop([Ig2_Polyhedra_Polyhedra_PolyhedraGeom()], [Ip2_PolyhedraMat_PolyhedraMat_PolyhedraPhys()],
                        [Law2_PolyhedraGeom_PolyhedraPhys_Volumetric()]),
        NewtonIntegrator(damping=0.0, gravity=(*scene["gravity"], 0.0), exactAsphericalRot=False),
    ]
    simulation.dt = dt

    def step(count):
        simulation.run(count, True)

    def states():
        found = []
        for number, body in zip(numbers, scene["bodies"]):
            state = simulation.bodies[number].state
            found.append((state.pos[0], state.pos[1], body["angle"] + state.rot()[2], state.vel[0], state.vel[1],
                          state.angVel[2]))
        return found

    return step, states


def _body(body, material):
    half = HALF_FIXED if body["fixed"] else HALF
    corners = [Vector3(x, y, z) for x, y in body["vertices"] for z in (-half, half)]
    made = polyhedra_utils.polyhedra(material, v=corners, fixed=body["fixed"], color=(1, 1, 1))
    made.state.pos = Vector3(body["x"], body["y"], 0)
    made.state.ori = Quaternion((0, 0, 1), body["angle"]) * made.state.ori
    if not body["fixed"]:
        made.state.vel = Vector3(body["vx"], body["vy"], 0)
        made.state.angVel = Vector3(0, 0, body["spin"])
        made.state.blockedDOFs = "zXY"
    return made


if __name__ == "__main__":
    serve(build)
