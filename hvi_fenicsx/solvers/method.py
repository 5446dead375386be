"""The base class of solution methods, what a method is given and finds. A new method is a new subclass.

Loading its module makes its name known.
"""

from __future__ import annotations

import functools
from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Any, ClassVar, Self

from dolfinx import fem
from petsc4py import PETSc

from ..class_registry import enter, hint, load_modules
from ..errors import InputError
from ..model.content import SolverTable
from ..problem.compose import Formulation
from ..rigid import Solvability
from ..runtime.cost import Timer
from ..runtime.log import NewtonStep, newton_step
from ..system.held_solver import LinearSettings
from ..system.multigrid import Levels
from ..system.system import System
from .active_set import ActiveSetSolver
from .convergence import Counts, Outcome

Progress = Callable[[NewtonStep], None]
"""Called at each Newton step, on all ranks."""


def never() -> bool:
    """Never stop."""
    return False


@dataclass(frozen=True, kw_only=True)
class SolveTask:
    """What is to be solved on each level of a mesh hierarchy, and how.

    Attributes:
        model: the effects and their places.
        solvability: whether a solution can exist, and which rigid motions the supports leave.
        options: method, tolerance, limits.
        timer: where time goes.
        progress: called at each Newton step; by default it is logged.
        interrupted: whether to stop (collective, asked at each Newton step).
    """

    model: Formulation
    solvability: Solvability
    options: SolverTable
    timer: Timer
    progress: Progress = newton_step
    interrupted: Callable[[], bool] = never

    def with_options(self, **changes: Any) -> Self:
        """The same with some options changed.

        Args:
            changes: fields of :class:`.SolverTable` and their values.
        """
        return replace(self, options=self.options.model_copy(update=changes))


@dataclass(frozen=True, kw_only=True)
class SolveContext(SolveTask):
    """The context of a method.

    Attributes:
        system: the assembled problem.
        solver: solves with bounds on the system; keeps its preconditioner from solve to solve.
        steady: whether the pieces and the active set of a start from the coarser level are expected to be the final
            ones.
    """

    system: System
    solver: ActiveSetSolver
    steady: bool = False

    @classmethod
    def create(cls, task: SolveTask, system: System, levels: Levels = (), *, steady: bool = False) -> SolveContext:
        """The context of one solve, with a new solver.

        Args:
            task: what is solved.
            system: the assembled problem.
            levels: its coarser levels; none where there is no mesh hierarchy.
            steady: whether the pieces and the active set of the start are expected to be the final ones.
        """
        linear = LinearSettings.choose(system, task.options.linear_solver, levels=bool(levels))
        solver = ActiveSetSolver(system, levels, linear, task.timer, task.interrupted)
        return cls(**vars(task), system=system, solver=solver, steady=steady)

    def tell(self, method: str, epsilon: float | None, iteration: int, residual: float, contact: int) -> None:
        """Tell a Newton step to whom the progress is shown.

        Args:
            method: its name.
            epsilon: relative width of the smoothing; None for exact laws.
            iteration: counted from the start of the solve.
            residual: of the inequality, relative.
            contact: vertices in contact, of all ranks.
        """
        self.progress(
            NewtonStep(method=method, epsilon=epsilon, iteration=iteration, residual=residual, contact=contact)
        )

    @property
    def epsilon(self) -> float | None:
        """Relative width of the laws' smoothing; None for exact laws."""
        return relative_width(self.options, self.system)


def relative_width(options: SolverTable, system: System) -> float | None:
    """ε relative to the first law's energy scale; None for exact laws, or without a law.

    Args:
        options: with the width.
        system: the assembled problem.
    """
    if options.epsilon_absolute is None or not system.terms:
        return options.epsilon
    scales = system.problem.scales
    return options.epsilon_absolute / (system.terms[0].exact.energy_scale * scales.stress * scales.displacement)


def decides_stability(options: SolverTable, system: System) -> bool:
    """Whether the Hessian is factorised where a falling law leaves open if u is a local minimum.

    Args:
        options: what the user wants.
        system: that was solved.
    """
    if options.second_order is not None:
        return options.second_order
    return system.thresholds.is_direct(system.dofs, system.problem.dimension)


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
        if cls.__module__.rpartition(".")[0] != __package__:
            load_all()  # all names of the program are known then
        enter(Method.registry, cls, cls.name, "method")

    def __init__(self, context: SolveContext) -> None:
        self.context = context
        self.system, self.solver, self.options = context.system, context.solver, context.options

    def result(self, x: PETSc.Vec, outcome: Outcome, counts: Counts, **known: Any) -> SolveResult:
        """What was found, by how the last solve ended. Collective.

        Args:
            x: the displacement.
            outcome: of the last solve.
            counts: of all solves.
            known: further fields of the result.
        """
        return SolveResult(
            u=self.system.displacement(x),
            method=self.label,
            converged=outcome.converged,
            reason="stationary" if outcome.converged else outcome.reason,
            counts=counts,
            interrupted=outcome.interrupted,
            **known,
        )

    @abstractmethod
    def solve(self, start: PETSc.Vec | None = None) -> SolveResult:
        """A stationary point, or what the method found instead; the certificate judges it afterwards. Collective.

        Args:
            start: a displacement to begin at, from the coarser level; None unless the class has ``takes_start``.
        """


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


def available() -> tuple[str, ...]:
    """Names of all methods that a scene may name, the user's own among them, ``auto`` first."""
    load_all()
    return ("auto", *sorted(name for name, kind in Method.registry.items() if kind.in_scenes and name != "auto"))


def find(name: str) -> type[Method]:
    """The method of this name.

    Raises:
        InputError: there is none; the message has the allowed names.
    """
    known = available()
    if name in known:
        return Method.registry[name]
    raise InputError(f"solver.method: unknown method {name!r}{hint(name, known)}; allowed: {', '.join(known)}")


def checked(wanted: SolverTable) -> SolverTable:
    """The options of a solver, which its method takes.

    Args:
        wanted: the table.

    Raises:
        InputError: there is no such method, or it does not take what the table asks for.
    """
    method = find(wanted.method)
    if wanted.smoothing is not None and not method.takes_smoothing:
        raise InputError(
            f'solver.method: "{wanted.method}" solves the law without smoothing; leave out smoothing and epsilon, '
            'or use "auto"'
        )
    if wanted.start != "unbroken" and not method.takes_pieces:
        raise InputError(
            f'solver.start: is for the branch iteration; leave it out, or use method = "auto", not "{wanted.method}"'
        )
    return wanted
