"""The shapes of bodies: importing this registers those that come with the program, in the order users see them in."""

# isort: off
from ...class_registry import load_modules
from .base import DomainShape
from .block import Box, Rectangle
from .plane import LShape
from .plane import Disk
from .plane import HalfDisk
from .plane import NotchedStrip
from .fixed_mesh import FixedMesh, MeshFile, Refinements
from .fixed_mesh import GivenMesh
from .fixed_mesh import OnlyMesh
from .plane import PlaneShape
from .several import PlacedShape, SeveralBodies
# isort: on

load_modules(__name__)
