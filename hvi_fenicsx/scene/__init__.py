"""The scene: what the user asked for, from a TOML file (:func:`read_scene`) or Python (:class:`Scene`)."""

from .effect_tables import BodyTable, BoundaryTable, InterfaceTable, MaterialTable
from .path_table import PathTable
from .reader import read_scene, with_place
from .scene import PlacedEffect, Scene
from .solver_table import SolverTable
from .writer import dump_scene

__all__ = [
    "BodyTable",
    "BoundaryTable",
    "InterfaceTable",
    "MaterialTable",
    "PathTable",
    "PlacedEffect",
    "Scene",
    "SolverTable",
    "dump_scene",
    "read_scene",
    "with_place",
]
