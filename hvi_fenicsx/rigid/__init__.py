"""Rigid motions: the kernel of a scene, the name of each motion, and whether the load can be borne."""

from ..laws.base import Directional
from .least_energy import OneSidedSupports, RestingPosition, least_energy
from .limit_analysis import analyse, gives_way, load_factors
from .motions import (
    JoinedBodies,
    Mode,
    RigidBody,
    kernel,
    modes,
    null_space,
    rigid_fields,
    works,
)
from .reduction import Resistance, RigidProblem, pressed, without_obstacles
from .solvability import ExistenceState, LoadFactors, PaperConditions, Solvability, combine, combine_factors, undecided
