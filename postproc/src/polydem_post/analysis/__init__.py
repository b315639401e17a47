"""Measures of granular matter: each function states its definition, its averaging volume and its source.

Functions of one time take a `Frame`, those of several times a `Trajectory` or any sequence of frames. All lengths,
forces and times are in SI units with unit depth. Only free bodies count unless a function says otherwise.
"""

from .blocks import BlockAverage, ShortSeries, block_average
from .fields import Fields, Kernel, coarse_grain, gaussian, lucy
from .flow import FlowRate, flow_rate, mass_beyond
from .fraction import solid_fraction
from .loops import ContactLoops, contact_loops
from .mixing import lacey_index
from .motion import Displacements, mean_squared_displacement
from .network import (
    Anisotropy,
    Distribution,
    anisotropy,
    coordination_number,
    fabric_tensor,
    force_distribution,
    rattlers,
)
from .profiles import Profile, profile
from .sample import inertial_number, sample_fraction, sample_stress, shear_rate, unbalanced_force
from .stress import Stress, body_stress, stress_tensor
from .surface import Surface, SurfaceAngle, free_surface, surface_angle
from .windows import Window, rectangle

__all__ = [
    "Anisotropy", "BlockAverage", "ContactLoops", "Displacements", "Distribution", "Fields", "FlowRate",
    "Kernel", "Profile", "ShortSeries", "Stress", "Surface", "SurfaceAngle", "Window", "anisotropy",
    "block_average", "body_stress", "coarse_grain", "contact_loops", "coordination_number", "fabric_tensor",
    "flow_rate", "force_distribution", "free_surface", "gaussian", "inertial_number", "lacey_index", "lucy",
    "mass_beyond", "mean_squared_displacement", "profile", "rattlers", "rectangle", "sample_fraction",
    "sample_stress", "shear_rate", "solid_fraction", "stress_tensor", "surface_angle", "unbalanced_force",
]
