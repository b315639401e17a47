"""What a scene may have: the words of its capabilities, and which of them are alternatives."""

#: Length of walls that span a cell, also one of three copies of the largest one
LONG = 0.5
CONTAINERS = ("plane", "periodic_x", "periodic_y", "periodic_xy", "sheared", "stress_controlled")
WITHOUT_WALLS = {"periodic_xy", "sheared", "stress_controlled"}
LAWS = ("conservative", "area")
DAMPINGS = ("restitution", "rate", "hunt_crossley", "matuttis_chen", "none")
FRICTIONS = ("cundall_strack", "cundall_strack", "exact", "none")
SCHEMES = ("velocity_verlet", "velocity_verlet", "compensated", "gear", "gear_3_20")
#: What a scene may have beside container and model of contacts
EXTRAS = ("materials", "pieces", "motion_constant", "motion_table", "motion_oscillation", "motion_rotation",
          "motion_conveyor", "load", "load_hinged", "gate", "stages", "source", "sink", "cohesion", "rolling", "drag",
          "local_damping", "shaken", "turning", "start_checkpoint", "start_frame", "until", "sample")
DRIVEN = {"motion_constant", "motion_table", "motion_oscillation", "motion_rotation", "motion_conveyor", "load",
          "load_hinged"}
STARTS = {"start_checkpoint", "start_frame"}
#: Of what one scene has one or two
ALTERNATIVES = [(STARTS, 1), (DRIVEN, 2)]
#: All capabilities, of which each pair that is possible acts on touching bodies
CAPABILITIES = (*CONTAINERS, *EXTRAS, "walls", *(f"law_{name}" for name in LAWS),
                *(f"damping_{name}" for name in DAMPINGS), *(f"friction_{name}" for name in dict.fromkeys(FRICTIONS)),
                *(f"scheme_{name}" for name in dict.fromkeys(SCHEMES)))
#: Of these a scene has one each
EXCLUSIVE = (set(CONTAINERS), STARTS, *({name for name in CAPABILITIES if name.startswith(kind)}
                                        for kind in ("law_", "damping_", "friction_", "scheme_")))
#: Every so many seeds, the scene is an impact that is compared by its restitution
IMPACTS = 8


def alternatives(pair):
    """Whether two capabilities are alternatives of one choice."""
    return any(set(pair) <= group for group in EXCLUSIVE)
