"""Parts of the boundary: sides of a domain, the piece of them where inequalities hold, two sides that meet."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from ..errors import InputError
from ..formula import COMPARISONS, Formula, parsed
from ..typing import Array, Entities, Mask

if TYPE_CHECKING:
    from .domain import Domain

_JOIN: Mapping[type[ast.boolop], Any] = {ast.And: np.logical_and, ast.Or: np.logical_or}
_NONE = '"{}" is no inequality; write one like "x > 0.3" or "0.1 < x < 0.2 and y < 1"'
_DIGITS = 12
"""Midpoints are rounded to so many digits of the body's length, so that all ranks see the same."""


class Inequalities:
    """Where comparisons of formulas in x, y, z hold (SI): ``"x > 0.3"``, ``"0.1 < x < 0.2 and y < 1"``.

    Args:
        source: comparisons by < <= > >=, joined by ``and``, ``or``, ``not``.

    Raises:
        InputError: it is something else.

    Attributes:
        source: as given.
    """

    def __init__(self, source: str) -> None:
        if not isinstance(source, str):
            raise InputError('must be a text, like "x > 0.3"')
        self.source = source.strip()
        self._holds = self._read(parsed(self.source))

    def __repr__(self) -> str:
        return f"Inequalities({self.source!r})"

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Inequalities) and other.source == self.source

    def __hash__(self) -> int:
        return hash(self.source)

    def at(self, points: Array) -> Mask:
        """Whether they hold at points (n, 3), m; (n,)."""
        return self._holds(points)

    def _read(self, node: ast.expr) -> Callable[[Array], Mask]:
        match node:
            case ast.BoolOp(op=op, values=values):
                parts = [self._read(value) for value in values]
                return lambda points: _JOIN[type(op)].reduce([part(points) for part in parts])
            case ast.UnaryOp(op=ast.Not(), operand=operand):
                inner = self._read(operand)
                return lambda points: ~inner(points)
            case ast.Compare(left=left, ops=ops, comparators=others) if all(type(op) in COMPARISONS for op in ops):
                sides = [Formula(ast.get_source_segment(self.source, side) or "") for side in (left, *others)]
                signs = [COMPARISONS[type(op)] for op in ops]
                return lambda points: _hold([side.at(points) for side in sides], signs)
        raise InputError(_NONE.format(self.source))


def _hold(values: list[Array], signs: list[Callable[[Array, Array], Any]]) -> Mask:
    pairs = zip(signs, values[:-1], values[1:], strict=True)
    return np.logical_and.reduce([sign(one, other) for sign, one, other in pairs])


@dataclass(frozen=True)
class BoundaryPart:
    """A part of the boundary.

    Attributes:
        on: the sides.
        where: which piece of them; None: all of them.
    """

    on: tuple[str, ...]
    where: Inequalities | None = None

    def facets(self, domain: Domain) -> Entities:
        """Its local facets, sorted: those of the sides whose midpoint lies in the piece.

        Args:
            domain: the body on its mesh.

        Raises:
            InputError: a side that the domain does not have (the same on all ranks).
        """
        from dolfinx import mesh as dmesh  # a scene is read without it

        found = domain.facets(self.on)
        if self.where is None or not len(found):  # dolfinx divides by their number
            return found
        middles = dmesh.compute_midpoints(domain.mesh, domain.dimension - 1, found)
        rounded = np.round(middles / domain.length, _DIGITS) * domain.length
        return found[self.where.at(rounded)]


@dataclass(frozen=True, kw_only=True)
class InterfaceSides:
    """What is said of an interface, where two sides meet.

    Attributes:
        first: the side that carries contact and laws.
        second: the other one.
        tied: whether the sides are glued for ever.
    """

    first: str
    second: str
    tied: bool = False
