"""A scene as what the program solves: a model of effects and places, and solver options."""

from __future__ import annotations

import functools

from .errors import InputError
from .laws import smoothing
from .problem.compose import Model
from .problem.interface_sides import Sides
from .problem.part_laws import Modification, unchanged
from .scene import Scene, SolverTable
from .solvers import registry
from .solvers.context import SolverOptions
from .solvers.thresholds import DEFAULT, Thresholds


def model_of(scene: Scene) -> Model:
    """The effects of a scene and their places, its laws smoothed where it says so."""
    return Model(
        scene.parts,
        [(placed.where, placed.effect) for placed in scene.effects()],
        _modification(scene.solver),
        {name: Sides(first=i.between[0], second=i.between[1], tied=i.tied) for name, i in scene.interface.items()},
        scene.solver.degree or 1,
    )


def _modification(wanted: SolverTable) -> Modification:
    """What the solver table does to a law: smooth it, or nothing."""
    if wanted.smoothing is None:
        return unchanged
    return functools.partial(
        smoothing.create, wanted.smoothing, epsilon=wanted.epsilon, epsilon_absolute=wanted.epsilon_absolute
    )


def options_of(wanted: SolverTable, thresholds: Thresholds = DEFAULT) -> SolverOptions:
    """The options of a scene's solver table.

    Args:
        wanted: the table.
        thresholds: the numbers that tune the methods.

    Raises:
        InputError: there is no such method, or it does not take what the table asks for.
    """
    method = registry.find(wanted.method)
    if wanted.smoothing is not None and not method.takes_smoothing:
        raise InputError(
            f'solver.method: "{wanted.method}" solves the law without smoothing; leave out smoothing and epsilon, '
            'or use "auto"'
        )
    if wanted.start != "unbroken" and not method.takes_pieces:
        raise InputError(
            f'solver.start: is for the branch iteration; leave it out, or use method = "auto", not "{wanted.method}"'
        )
    return SolverOptions(
        method=wanted.method,
        epsilon=wanted.epsilon,
        epsilon_absolute=wanted.epsilon_absolute,
        start=wanted.start,
        tolerance=wanted.tolerance,
        linear_solver=wanted.linear_solver,
        second_order=wanted.second_order,
        max_iterations=wanted.max_iterations,
        thresholds=thresholds,
    )
