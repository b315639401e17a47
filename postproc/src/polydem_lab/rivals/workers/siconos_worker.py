"""Worker for Siconos (Moreau-Jean time stepping, contacts of Bullet in the plane) in the system's Python."""

import numpy as np
import siconos.kernel as kernel
import siconos.numerics as numerics
from siconos.mechanics.collision import (
    RigidBody2dDS,
    SiconosBox2d,
    SiconosContactor,
    SiconosContactorSet,
    SiconosConvexHull2d,
)
from siconos.mechanics.collision.bullet import SICONOS_BULLET_2D, SiconosBulletCollisionManager, SiconosBulletOptions
from worker import area_and_inertia, serve

#: Margin of Bullet within each shape [m], and place of a shape in its body (seven numbers also in the plane)
MARGIN, HERE = 0.02, [0, 0, 0, 1, 0, 0, 0]

#: Parameter of the theta scheme; tolerance and most iterations of the solver; longest simulated time [s]
THETA, TOLERANCE, ITERATIONS, LONGEST = 0.5, 1e-8, 1000, 1000.0


def build(scene, dt, knobs):
    """The simulation of a scene."""
    manager = _manager()
    system = kernel.NonSmoothDynamicalSystem(0.0, LONGEST)
    moving = [_add(system, manager, body, scene) for body in scene["bodies"]]
    scheme = kernel.MoreauJeanOSI(THETA)
    scheme.setConstraintActivationThreshold(0.0)
    simulation = kernel.TimeStepping(system, kernel.TimeDiscretisation(0.0, dt))
    simulation.insertIntegrator(scheme)
    simulation.insertNonSmoothProblem(_solver())
    manager.insertNonSmoothLaw(kernel.NewtonImpactFrictionNSL(scene["restitution"], 0.0, scene["friction"], 2), 0, 0)
    simulation.insertInteractionManager(manager)
    simulation.setNewtonOptions(kernel.SICONOS_TS_LINEAR)
    simulation.setNewtonMaxIteration(1)
    simulation.initialize()

    def step(count):
        for _ in range(count):
            simulation.computeOneStep()
            simulation.nextStep()

    def states():
        return [(body["x"], body["y"], body["angle"], 0.0, 0.0, 0.0) if each is None else (*each.q(), *each.velocity())
                for each, body in zip(moving, scene["bodies"])]

    return step, states


def _manager():
    options = SiconosBulletOptions()
    options.dimension = SICONOS_BULLET_2D
    options.contactBreakingThreshold = MARGIN
    options.perturbationIterations = 0
    options.minimumPointsPerturbationThreshold = 0
    return SiconosBulletCollisionManager(options)


def _solver():
    options = kernel.solver_options_create(numerics.SICONOS_FRICTION_2D_NSGS)
    options.iparam[numerics.SICONOS_IPARAM_MAX_ITER] = ITERATIONS
    options.dparam[numerics.SICONOS_DPARAM_TOL] = TOLERANCE
    problem = kernel.FrictionContact(2, options)
    problem.setMaxSize(30000)
    problem.setMStorageType(numerics.NM_SPARSE_BLOCK)
    problem.setKeepLambdaAndYState(True)
    return problem


def _add(system, manager, body, scene):
    corners = np.asarray(body["vertices"])
    if len(corners) == 4 and abs(corners[0, 1] - corners[1, 1]) + abs(corners[1, 0] - corners[2, 0]) < 1e-14:
        shape = SiconosBox2d(list(corners[2] - corners[0]))
    else:
        shape = SiconosConvexHull2d(corners)
    shape.setInsideMargin(MARGIN)
    shape.setOutsideMargin(0.0)
    contactors = SiconosContactorSet()
    contactors.append(SiconosContactor(shape, HERE, 0))
    place = [body["x"], body["y"], body["angle"]]
    if body["fixed"]:
        manager.insertStaticContactorSet(contactors, place)
        return None
    mass, inertia = (scene["density"] * moment for moment in area_and_inertia(corners))
    added = RigidBody2dDS(place, [body["vx"], body["vy"], body["spin"]], mass, inertia)
    added.setUseContactorInertia(False)
    added.setContactors(contactors)
    added.weight = np.array([mass * scene["gravity"][0], mass * scene["gravity"][1], 0.0])
    added.setFExtPtr(added.weight)  # Siconos only points to it
    system.insertDynamicalSystem(added)
    return added


if __name__ == "__main__":
    serve(build)
