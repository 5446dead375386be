"""The stiffness of the bubbles: its products, and a solve with it.

It is spectrally equivalent to its diagonal, whatever the mesh width, so a handful of conjugate gradient steps solve it
(Bank and Smith 1993).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Protocol

import numpy as np
import ufl
from dolfinx import fem, la
from mpi4py import MPI

from ...problem.problem import Problem
from ...runtime import forms
from ...typing import Array, Entities
from .block_forces import BlockForces
from .bubble_diagonal import diagonal

_WEAK = 0.05
"""Springs below this part of a bubble's own stiffness need not hold it."""

_PIECE = 8192
"""Blocks of which a few vectors fit into a processor's cache."""


class Held(Protocol):
    """What holds bubbles at some blocks, as the bounds of a part do."""

    def project(self, r: Array) -> None:
        """Take out of r (n, d) what is held, in place."""
        ...


class Springs(Protocol):
    """What holds bubbles elastically, as laws do."""

    def diagonal(self) -> BlockForces:
        """Forces for a unit of each bubble, at the owned blocks. Collective."""
        ...

    def times(self, e: fem.Function) -> BlockForces:
        """Forces of bubbles, at the owned blocks. Collective.

        Args:
            e: the bubbles, ghosts updated.
        """
        ...


class BubbleStiffness:
    """The elastic stiffness of the bubbles, nondimensional: its products and its diagonal. Creation is collective.

    It is not stored. In space it would take 9 kB a vertex at degree 1, more than all else of a run, and take longer to
    assemble than the few products that are wanted of it.

    Attributes:
        problem: whose elastic operator it is.
        space: the bubbles.
        comm: the ranks.
    """

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace) -> None:
        self.problem, self.space = problem, bubbles
        self.comm: MPI.Comm = bubbles.mesh.comm
        self._inverse = diagonal(problem, bubbles)  # first: the vectors take the memory that it frees
        np.reciprocal(self._inverse, out=self._inverse)
        self._in, self._out = fem.Function(bubbles), fem.Function(bubbles)
        self._action = forms.compiled(problem.bulk.between(self._in, ufl.TestFunction(bubbles)))
        self._springs: Springs | None = None
        self._sprung: tuple[Entities, Array] = np.empty(0, np.int32), np.empty((0, self._inverse.shape[1]))

    def hold(self, springs: Springs) -> bool:
        """Add springs to the stiffness, in the place of those before; say whether there are strong ones. Collective.

        Args:
            springs: none are added where all are weaker than a twentieth of the bubbles that they hold.
        """
        at, elastic = self._sprung
        self._inverse[at] = elastic
        rates = springs.diagonal()
        matter = bool(np.any(rates.values * self._inverse[rates.blocks] > _WEAK))
        strong = bool(self.comm.allreduce(matter, op=MPI.LOR))
        self._springs = springs if strong else None
        at = rates.blocks if strong else rates.blocks[:0]
        self._sprung = at, self._inverse[at]
        self._inverse[at] = 1.0 / (1.0 / self._inverse[at] + rates.values[: len(at)])
        return strong

    def times(self, e: Array) -> Array:
        """A e of owned values (n, d), overwritten by the next product. Collective."""
        self._owned(self._in)[:] = e
        return self._product()

    def _product(self) -> Array:
        """A e of what the owned values are that products are made of; overwritten by the next one. Collective."""
        self._in.x.scatter_forward()
        self._out.x.array[:] = 0.0
        fem.assemble_vector(self._out.x.array, self._action)
        self._out.x.scatter_reverse(la.InsertMode.add)
        result = self._owned(self._out)
        if self._springs is not None:
            force = self._springs.times(self._in)
            result[force.blocks] += force.values
        return result

    def _owned(self, field: fem.Function) -> Array:
        """The owned values of a field of bubbles, (n, d), in place."""
        return np.asarray(field.x.array[: self._inverse.size].reshape(self._inverse.shape))

    def work(self, e: Array, force: BlockForces) -> float:
        """The work of a force on bubbles. Collective.

        Args:
            e: the bubbles, (n, d).
            force: on them.
        """
        return self._dot(e[force.blocks], force.values)

    def diagonal_solve(self, r: Array, at: Entities) -> Array:
        """The diagonal's inverse times r at some blocks, (k, d).

        Args:
            r: there, (k, d).
            at: the owned blocks, (k,).
        """
        return np.asarray(r * self._inverse[at])

    def descent(self, r: Array, held: Sequence[Held], at: Entities) -> Array:
        """P D⁻¹ P r, D being the diagonal and P taking out what is held; overwritten by the next product.

        Args:
            r: (n, d).
            held: what is.
            at: the blocks where something is, (k,).
        """
        z = np.multiply(r, self._inverse, out=self._owned(self._out))
        z[at] = r[at]
        for part in held:
            part.project(z)
        z[at] *= self._inverse[at]
        for part in held:
            part.project(z)
        return z

    def move(self, r: Array, e: Array, at: Entities, step: Array) -> float:
        """Change e at some blocks and the residual with it, in place. Collective.

        Args:
            r: the residual load - A e, (n, d).
            e: (n, d).
            at: the owned blocks, (k,).
            step: of e there, (k, d).

        Returns:
            By how much e·A e grows.
        """
        if not self.comm.allreduce(bool(step.any()), op=MPI.LOR):
            return 0.0
        p = self._owned(self._in)
        p[:] = 0.0
        p[at] = step
        q = self._product()
        return self._dot(p, q) + self._moved(r, e, 1.0, p, q)

    def _moved(self, r: Array, e: Array, alpha: float, p: Array, q: Array) -> float:
        """Add α p to e, and -α q to r, q being A p: 2 e·A (α p) before. Collective."""
        mixed = 2 * alpha * self._dot(e, q)
        _add(e, alpha, p)
        _add(r, -alpha, q)
        return mixed

    def square(self, r: Array, descent: Callable[[Array], Array]) -> float:
        """The square of a residual's norm. Collective.

        Args:
            r: (n, d).
            descent: as :meth:`descent`.
        """
        return self._dot(r, descent(r))

    def solve(self, r: Array, e: Array, descent: Callable[[Array], Array], *, goal: float, max_steps: int) -> float:
        """A e = load among e + the range of a symmetric projection, by conjugate gradients; in place. Collective.

        Args:
            r: the residual load - A e, what is not free included, (n, d).
            e: start and result, (n, d).
            descent: of a residual, as :meth:`descent`.
            goal: square of the residual's norm at which to end.
            max_steps: of the conjugate gradients.

        Returns:
            By how much e·A e grows.
        """
        p, rho, growth = self._owned(self._in), 0.0, 0.0  # in place: they are large
        for step in range(max_steps):
            z = descent(r)
            rho, before = self._dot(r, z), rho
            if rho <= goal:
                break
            _combine(p, z, rho / before if step else 0.0)
            q = self._product()
            alpha = rho / self._dot(p, q)
            growth += alpha * rho + self._moved(r, e, alpha, p, q)
        return growth

    def _dot(self, a: Array, b: Array) -> float:
        return float(self.comm.allreduce(float(np.vdot(a, b)), op=MPI.SUM))


def _pieces(count: int) -> Iterator[slice]:
    """Slices of so few blocks that what is done with one stays in the processor's cache."""
    return (slice(start, start + _PIECE) for start in range(0, count, _PIECE))


def _add(y: Array, factor: float, x: Array) -> None:
    """Add factor x to y, without a temporary array of their size."""
    for at in _pieces(len(y)):
        y[at] += factor * x[at]


def _combine(p: Array, z: Array, factor: float) -> None:
    """Set p to z + factor p; p is not read where the factor is 0."""
    if factor == 0.0:
        np.copyto(p, z)
        return
    for at in _pieces(len(p)):
        p[at] *= factor
        p[at] += z[at]
