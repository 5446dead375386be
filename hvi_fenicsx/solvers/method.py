"""The base class of solution methods. A new method is a new subclass; loading its module makes its name known."""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from typing import ClassVar

from petsc4py import PETSc

from ..class_registry import enter, load_modules
from .context import SolveContext
from .result import SolveResult


@functools.cache
def load_all() -> None:
    """Load every module of this room, so that all its methods are known."""
    load_modules(__package__ or "")


class Method(ABC):
    """A way to solve the inequality on a system; one instance solves once.

    Class attributes:
        name: the method's name in scenes (``solver.method``) and in ``summary.json``.
        description: what it is, for ``hvi check``.
        takes_start: whether :meth:`solve` can begin at a displacement; it is then used for nested iteration.
        takes_pieces: whether it begins on pieces of the laws that the user chooses (``solver.start``).
        takes_smoothing: whether it solves smoothed laws.
        in_scenes: whether a scene may name it.
        label: its name in ``summary.json`` and on the progress display, where that is another one.

    Attributes:
        context: the system and how to solve it.
        system: the assembled problem: matrix, load, bounds, laws.
        solver: solves with bounds on the system.
        options: method, tolerance, limits.
    """

    name: ClassVar[str]
    description: ClassVar[str] = "a method of the user's own"
    takes_start: ClassVar[bool] = False
    takes_pieces: ClassVar[bool] = True
    takes_smoothing: ClassVar[bool] = True
    in_scenes: ClassVar[bool] = True
    label: ClassVar[str]
    registry: ClassVar[dict[str, type[Method]]] = {}

    def __init_subclass__(cls) -> None:
        if "name" not in cls.__dict__:
            return
        cls.label = cls.__dict__.get("label", cls.name)
        if not cls.in_scenes:
            return
        if cls.__module__.rpartition(".")[0] != __package__:
            load_all()  # all names of the program are known then
        enter(Method.registry, cls, cls.name, "method")

    def __init__(self, context: SolveContext) -> None:
        self.context = context
        self.system, self.solver, self.options = context.system, context.solver, context.options

    @abstractmethod
    def solve(self, start: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point, or what the method found instead; the certificate judges it afterwards. Collective.

        Args:
            start: a displacement to begin at, from the coarser level; None unless the class has ``takes_start``.
        """
