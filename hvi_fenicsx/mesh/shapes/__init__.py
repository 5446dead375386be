"""The shapes of bodies: importing this registers those that come with the program, in the order users see them in."""

# isort: off
from ...class_registry import load_modules
from .base import DomainShape
from .built_in import Rectangle, Box
from .built_in import LShape, Disk, HalfDisk, NotchedStrip, PlaneShape
from .given import FixedMesh, MeshFile, Refinements, GivenMesh, OnlyMesh
from .several import SeveralBodies
# isort: on

load_modules(__name__)
