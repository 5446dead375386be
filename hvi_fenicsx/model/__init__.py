"""The model: a body and the effects on it, from Python (:class:`Model`) or a scene file (:func:`read_scene`)."""

from .body import Body
from .content import PathTable, SolverTable
from .model import Mistakes, Model, dump_scene, is_portable
from .reader import read_tables
from .scene_file import read_scene, with_place
