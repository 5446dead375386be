"""Rigid motions: the kernel of a scene, the name of each motion, and whether the load can be borne."""

from ..laws.convex_parts import Directional
from .analyse import analyse, gives_way, load_factors
from .kernel import FixedDirections, kernel, modes, null_space
from .least_energy import OneSidedSupports, Rest, least_energy
from .motions import (
    AnyBody,
    JoinedBodies,
    Mode,
    MotionFields,
    Movable,
    RigidBody,
    fields_at,
    rigid_fields,
)
from .pressed import pressed, without_obstacles
from .reduction import ContactCone, Resistance, RigidProblem
from .solvability import ExistenceState, LoadFactors, PaperConditions, Solvability, combine, combine_factors, undecided
from .thresholds import RigidThresholds

__all__ = [
    "AnyBody",
    "ContactCone",
    "Directional",
    "ExistenceState",
    "FixedDirections",
    "JoinedBodies",
    "LoadFactors",
    "Mode",
    "MotionFields",
    "Movable",
    "OneSidedSupports",
    "PaperConditions",
    "Resistance",
    "Rest",
    "RigidBody",
    "RigidProblem",
    "RigidThresholds",
    "Solvability",
    "analyse",
    "combine",
    "combine_factors",
    "fields_at",
    "gives_way",
    "kernel",
    "least_energy",
    "load_factors",
    "modes",
    "null_space",
    "pressed",
    "rigid_fields",
    "undecided",
    "without_obstacles",
]
