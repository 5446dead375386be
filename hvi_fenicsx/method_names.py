"""Methods by name: what a scene may ask for, and how a method of one's own gets its name. Light: no PETSc is loaded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from .errors import InputError

if TYPE_CHECKING:
    from .solvers.active_set import ActiveSetSolver
    from .solvers.method import Settings, SolveResult

BUILT_IN = ("auto", "snes_vi", "branch", "tao", "ssls", "condensed")
_OWN: dict[str, type[CustomMethod]] = {}


class CustomMethod:
    """A method of one's own: a subclass with a ``name`` can be named in a scene as soon as its module is loaded.

    Class attributes:
        name: in scenes and in ``summary.json``. words: what it is, for ``hvi check``.
        takes_start: whether ``solve`` takes a displacement (a PETSc vector) to begin at, and so goes up the ladder.

    Attributes:
        solver: convex steps, linear solves and :attr:`system`, the assembled problem. settings: tolerance and limits.
    """

    name: str
    words: str = "a method of one's own"
    takes_start: bool = False

    def __init_subclass__(cls) -> None:
        if "name" not in cls.__dict__:
            return
        old = _OWN.get(cls.name)
        same = old is None or (old.__module__, old.__qualname__) == (cls.__module__, cls.__qualname__)
        if cls.name in BUILT_IN or not same:
            raise InputError(f"method class {cls.__name__}: the name {cls.name!r} is taken; choose another")
        _OWN[cls.name] = cls

    def __init__(self, solver: ActiveSetSolver, settings: Settings) -> None:
        self.solver, self.settings, self.system = solver, settings, solver.system

    def solve(self, *args: Any) -> SolveResult:
        """A stationary point, or what was reached. Collective. The certificate judges it afterwards.

        It is given a start (a PETSc vector) where ``takes_start`` says so and there is a coarser rung, else nothing.
        """
        raise NotImplementedError


def available() -> tuple[str, ...]:
    """Names of all methods, the user's own among them."""
    return (*BUILT_IN, *_OWN)


def own() -> dict[str, type[CustomMethod]]:
    """The user's own methods."""
    return dict(_OWN)
