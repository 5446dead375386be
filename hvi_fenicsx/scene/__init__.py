"""The scene: what the user asked for, from a TOML file (:func:`read_scene`) or Python (:class:`Scene`)."""

from .effect_tables import Body, Boundary, Material
from .model import Placed, Scene
from .plane_shapes import Disk, HalfDisk, LShape, NotchedStrip
from .reader import read_scene
from .shapes import Box, MeshFile, Rectangle
from .solver_table import Solver
from .writer import dump_scene

__all__ = [
    "Body",
    "Boundary",
    "Box",
    "Disk",
    "HalfDisk",
    "LShape",
    "Material",
    "MeshFile",
    "NotchedStrip",
    "Placed",
    "Rectangle",
    "Scene",
    "Solver",
    "dump_scene",
    "read_scene",
]
