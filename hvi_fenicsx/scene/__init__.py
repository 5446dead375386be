"""The scene: what the user asked for, from a TOML file (:func:`read_scene`) or Python (:class:`Scene`)."""

from .curved import Disk, HalfDisk, LShape, NotchedStrip
from .model import Placed, Scene
from .parts import Body, Boundary, Material
from .reader import read_scene
from .settings import Solver
from .shapes import Box, MeshFile, Rectangle
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
