"""Rigid motions: the kernel of a scene in words, and whether its load can be borne."""

from ..laws.convex_parts import Directional
from .kernel import Fixed, kernel, modes
from .motions import Body, Mode, describe, motion_at, rigid_fields
from .reduction import ContactCone, Resistance, RigidProblem
from .solvability import analyse, load_factors
from .verdict import LoadFactors, Paper, Solvability, State, combine, combine_factors

__all__ = [
    "Body",
    "ContactCone",
    "Directional",
    "Fixed",
    "LoadFactors",
    "Mode",
    "Paper",
    "Resistance",
    "RigidProblem",
    "Solvability",
    "State",
    "analyse",
    "combine",
    "combine_factors",
    "describe",
    "kernel",
    "load_factors",
    "modes",
    "motion_at",
    "rigid_fields",
]
