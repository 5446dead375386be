"""The methods by name. Every module of this room is loaded, so a new method needs a new file and no edit elsewhere."""

from __future__ import annotations

from ..class_registry import hint
from ..errors import InputError
from ..model.options import SolverTable
from ..system.system import System
from .context import SolverOptions
from .method import Method, load_all
from .quadratic import ConvexProgramme, LinearSolve, is_equation, is_quadratic
from .thresholds import DEFAULT, Thresholds


def available() -> tuple[str, ...]:
    """Names of all methods that a scene may name, the user's own among them, ``auto`` first."""
    load_all()
    return ("auto", *sorted(name for name in Method.registry if name != "auto"))


def find(name: str) -> type[Method]:
    """The method of this name.

    Raises:
        InputError: there is none; the message has the allowed names.
    """
    load_all()
    if name in Method.registry:
        return Method.registry[name]
    known = available()
    raise InputError(f"solver.method: unknown method {name!r}{hint(name, known)}; allowed: {', '.join(known)}")


def options_of(wanted: SolverTable, thresholds: Thresholds = DEFAULT) -> SolverOptions:
    """The options of a solver table.

    Args:
        wanted: the table.
        thresholds: the numbers that tune the methods.

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
    return SolverOptions.of(wanted, thresholds)


def choose(options: SolverOptions, system: System) -> type[Method]:
    """The method that solves a system: the one that is named, or the simplest that the effects allow.

    Args:
        options: with the name of the method.
        system: the assembled problem.

    Raises:
        InputError: there is no such method.
    """
    if options.method == "auto" and is_quadratic(system):
        return LinearSolve if is_equation(system) else ConvexProgramme
    return find(options.method)
