"""The base class of solution methods. A new method is a new subclass; loading its module makes its name known."""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import ClassVar

from dolfinx import fem
from petsc4py import PETSc

from ..class_registry import enter, load_modules
from .context import SolveContext
from .convergence import Outcome


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


@dataclass
class Counts:
    """Iterations spent.

    Attributes:
        newton: Newton steps.
        linear: iterations of linear solvers.
        branch: convex steps.
    """

    newton: int = 0
    linear: int = 0
    branch: int = 0

    def add_outcome(self, step: Outcome) -> None:
        """Add the iterations of one solve of the active set solver."""
        self.newton += step.newton
        self.linear += step.linear

    def add(self, other: Counts) -> None:
        """Add the iterations of another method."""
        self.newton += other.newton
        self.linear += other.linear
        self.branch += other.branch


@dataclass(frozen=True, kw_only=True)
class Borne:
    """The last state that is borne, where the load path ends before the whole load.

    Attributes:
        u: the displacement in units of u0, ghosts updated.
        factor: of all loads and prescribed displacements.
    """

    u: fem.Function
    factor: float


@dataclass(frozen=True, kw_only=True)
class SolveResult:
    """What a method found.

    Attributes:
        u: the displacement in units of u0, ghosts updated.
        method: its name.
        converged: by the method's own test.
        reason: why it ended, for people.
        counts: iterations.
        energies: after each convex step, nondimensional.
        interrupted: whether it ended because it was asked to.
        levels: levels of the mesh hierarchy on which it was solved, one after the other.
        steady: whether the pieces and the active set of the start were the final ones, on every level.
        borne: what of the load is borne, where a load path was followed and says so.
        off_path: how the load path ended, where it ended before the whole load and this was found from another start.
    """

    u: fem.Function
    method: str
    converged: bool
    reason: str
    counts: Counts = field(default_factory=Counts)
    energies: tuple[float, ...] = ()
    interrupted: bool = False
    levels: int = 1
    steady: bool = False
    borne: Borne | None = None
    off_path: str | None = None
