"""How far a scene is from its limits in the time step and in the stiffness, and which entries keep a tolerance."""

from .study import study_accuracy

__all__ = ["study_accuracy"]
