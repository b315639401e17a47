"""What a scene may have: the words of its capabilities, and which of them are alternatives."""

#: Length of walls that span a cell, also one of three copies of the largest one
LONG = 0.5
CONTAINERS = ("plane", "periodic_x", "periodic_y", "periodic_xy", "sheared", "stress_controlled")
WITHOUT_WALLS = {"periodic_xy", "sheared", "stress_controlled"}
LAWS = ("polar", "conservative", "area")
#: What a model of contacts has one each of
KINDS = tuple(tuple(f"{kind}_{name}" for name in names) for kind, names in (
    ("scheme", ("velocity_verlet", "compensated", "gear", "gear_3_20")),
    ("friction", ("cundall_strack", "exact", "none")),
    ("damping", ("restitution", "rate", "hunt_crossley", "matuttis_chen", "none")), ("law", LAWS)))
#: What a scene may have beside container and model of contacts
EXTRAS = ("materials", "pieces", "motion_constant", "motion_table", "motion_oscillation", "motion_rotation",
          "motion_conveyor", "load", "load_hinged", "gate", "stages", "source", "sink", "cohesion", "rolling", "drag",
          "local_damping", "shaken", "turning", "start_checkpoint", "start_frame", "until", "sample")
DRIVEN = {"motion_constant", "motion_table", "motion_oscillation", "motion_rotation", "motion_conveyor", "load",
          "load_hinged"}
STARTS = {"start_checkpoint", "start_frame"}
#: Of what one scene has one or two
ALTERNATIVES = [(STARTS, 1), (DRIVEN, 2), (set(CONTAINERS), 1), *((set(kind), 1) for kind in KINDS)]
#: Share of the scenes with a capability in which it acts on a touching body; of others nearly all
SELDOM = {"source": 0.6, "sink": 0.7, "gate": 0.7, "sheared": 0.8,
          "periodic_x": 0.7, "periodic_y": 0.7, "periodic_xy": 0.8,
          **dict.fromkeys(DRIVEN, 0.8), "load": 0.6, "motion_table": 0.6}
#: All capabilities, of which each pair that is possible acts on touching bodies
CAPABILITIES = (*CONTAINERS, *EXTRAS, "walls", *(name for kind in KINDS[::-1] for name in kind))
#: Every so many seeds, the scene is an impact that is compared by its restitution
IMPACTS = 12


def alternatives(pair):
    """Whether two capabilities are alternatives of one choice."""
    return any(most == 1 and set(pair) <= group for group, most in ALTERNATIVES)
