"""The hierarchical complement of degree p in degree 2p: what a space of twice the degree has between the nodes.

Each function belongs to a multi-index a of sum 2p over the corners of a cell; its point has the barycentric coordinates
a/2p. The points at which all of a is even are the nodes of degree p. A bubble is the function of degree 2p that is 1 at
its own point and 0 at all others. At degree 1 there is one for every edge, 4 λ_a λ_b.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import basix
import basix.ufl
import numpy as np
import numpy.typing as npt
import ufl
from dolfinx import fem, la
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ..mesh import nodes
from ..problem.problem import Problem
from ..problem.vectors import nodal
from ..runtime import forms
from ..runtime.mpi import agree, total
from ..typing import Array, Entities

LocalForces = tuple[npt.NDArray[np.integer], Array]
"""Local blocks of a space in any order, also several times, (k,), and the forces there, (k, d)."""


def collected(space: fem.FunctionSpace, parts: Iterable[LocalForces]) -> Array:
    """The sum of forces of all ranks at the owned blocks, (n, d). Collective.

    Args:
        space: of the blocks.
        parts: of this rank, at owned blocks and ghosts.
    """
    field = fem.Function(space)
    forces = field.x.array.reshape(-1, space.dofmap.index_map_bs)
    for blocks, values in parts:
        np.add.at(forces, blocks, values)
    field.x.scatter_reverse(la.InsertMode.add)
    return forces[: space.dofmap.index_map.size_local]


Index = tuple[int, ...]
"""A multi-index over the corners of a cell or of a facet."""


def indices(degree: int, corners: Sequence[int], count: int) -> list[Index]:
    """The bubbles that some corners have together: those on the edge, on the face or in the cell between them.

    Args:
        degree: p.
        corners: of the edge, face or cell.
        count: of all corners of the cell or facet.
    """
    found = []
    for parts in itertools.product(range(2 * degree, 0, -1), repeat=len(corners)):
        if sum(parts) == 2 * degree and any(part % 2 for part in parts):
            at = dict(zip(corners, parts, strict=True))
            found.append(tuple(at.get(corner, 0) for corner in range(count)))
    return found


def of_facet(degree: int, dimension: int) -> list[Index]:
    """The bubbles of a facet, over its corners.

    Args:
        degree: p.
        dimension: of space.
    """
    sets = (ends for size in range(2, dimension + 1) for ends in itertools.combinations(range(dimension), size))
    return [index for corners in sets for index in indices(degree, corners, dimension)]


def of_cell(degree: int, cell: str) -> list[Index]:
    """The bubbles of a cell over its corners, in the order of the element's degrees of freedom.

    Args:
        degree: p.
        cell: the name of its shape.
    """
    return [index for entities in _by_entity(degree, cell) for found in entities for index in found]


def _by_entity(degree: int, cell: str) -> list[list[list[Index]]]:
    topology: Any = basix.topology(basix.CellType[cell])
    return [[indices(degree, corners, len(topology)) for corners in entities] for entities in topology]


def shape(index: Index, barycentric: Array, by: int | None = None) -> Array:
    """The values of a bubble at points, or of its derivative by one of the barycentric coordinates, (q,).

    Args:
        index: of the bubble.
        barycentric: the points, (q, corners).
        by: number of the coordinate.
    """
    factors = [_factor(order, sum(index)) for order in index]
    if by is not None:
        factors[by] = factors[by].deriv()
    values: Any = [factor(barycentric[:, i]) for i, factor in enumerate(factors)]
    return np.prod(values, axis=0)


@functools.cache
def _factor(order: int, degree: int) -> np.polynomial.Polynomial:
    """The factor of a bubble of one barycentric coordinate: 1 at order/degree, 0 at the points before it."""
    found = np.polynomial.Polynomial([1.0])
    for step in range(order):
        found = found * np.polynomial.Polynomial([-step, degree]) / (step + 1)
    return found


@functools.cache
def element(cell: str, degree: int) -> Any:
    """The bubbles of a triangle or tetrahedron, a scalar element.

    Args:
        cell: the name of its shape.
        degree: p.
    """
    kind = basix.CellType[cell]
    corners = np.asarray(basix.geometry(kind), dtype=np.float64)
    by_entity, d = _by_entity(degree, cell), corners.shape[1]
    where: list[Any] = [[_points(found, corners) for found in entities] for entities in by_entity]
    what = [[np.eye(len(found)).reshape(len(found), 1, len(found), 1) for found in entities] for entities in by_entity]
    empty: list[Any] = [[]] * (3 - d)
    smooth, standard, none = basix.SobolevSpace.H1, basix.PolysetType.standard, -1  # no Lagrange space is contained
    coefficients, highest, identity = _coefficients(cell, degree), 2 * degree, basix.MapType.identity
    made: Any = basix.ufl.custom_element(
        kind, [], coefficients, where + empty, what + empty, 0, identity, smooth, False, none, highest, standard
    )
    return made


def _points(found: Sequence[Index], corners: Array) -> Array:
    """The points of bubbles in a cell, (bubbles, d)."""
    if not found:
        return np.zeros((0, corners.shape[1]))
    return np.array(found) / sum(found[0]) @ corners


def _coefficients(cell: str, degree: int) -> Array:
    """The bubbles in the orthonormal polynomials of degree 2p, (bubbles, polynomials)."""
    found = of_cell(degree, cell)
    barycentric, weights = nodes.quadrature(len(found[0]), 4 * degree)
    kind, points = basix.CellType[cell], barycentric[:, 1:]
    legendre: Any = basix.tabulate_polynomials(basix.PolynomialType.legendre, kind, 2 * degree, points)
    values = [shape(index, barycentric) for index in found]
    volume = 1.0 / math.factorial(barycentric.shape[1] - 1)
    return np.einsum("iq,q,jq->ij", np.array(values), volume * weights, legendre)


def space(mesh: dmesh.Mesh, degree: int) -> fem.FunctionSpace:
    """Vector-valued bubbles. Collective.

    Args:
        mesh: the mesh.
        degree: p, that of the solution.
    """
    mesh.topology.create_entities(1)
    scalar = element(mesh.topology.cell_name(), degree)
    return fem.functionspace(mesh, basix.ufl.blocked_element(scalar, shape=(mesh.geometry.dim,)))


_WEAK = 0.05
"""Springs below this part of a bubble's own stiffness need not hold it."""


class BubbleStiffness:
    """The elastic stiffness of the bubbles, nondimensional: its products and its diagonal. Creation is collective.

    It is not stored. In space it would take 9 kB a vertex at degree 1, more than all else of a run, and take longer to
    assemble than the few products that are wanted of it.

    Attributes:
        problem: whose elastic operator it is.
        space: the bubbles.
        comm: the ranks.
        inverse: that of the diagonal, (n, d).
    """

    def __init__(self, problem: Problem, bubbles: fem.FunctionSpace) -> None:
        self.problem, self.space = problem, bubbles
        self.comm: MPI.Comm = bubbles.mesh.comm
        self.inverse = diagonal(problem, bubbles)  # first: the vectors take the memory that it frees
        np.reciprocal(self.inverse, out=self.inverse)
        self._in, self._out = fem.Function(bubbles), fem.Function(bubbles)
        self._action = forms.compiled(problem.bulk.between(self._in, ufl.TestFunction(bubbles)))
        self._springs: Callable[[fem.Function], Array] | None = None
        self._sprung: tuple[Entities, Array] = np.empty(0, np.int32), np.empty((0, self.inverse.shape[1]))

    def hold(self, rates: Array, springs: Callable[[fem.Function], Array]) -> bool:
        """Add springs to the stiffness, in the place of those before; say whether there are strong ones. Collective.

        Args:
            rates: forces for a unit of each bubble, (n, d). None are added where all are weaker than a twentieth of
                the bubbles that they hold.
            springs: the forces of bubbles whose ghosts are updated, (n, d).
        """
        at, elastic = self._sprung
        self.inverse[at] = elastic
        strong = any(agree(self.comm, bool(np.any(rates * self.inverse > _WEAK))))
        self._springs = springs if strong else None
        at = np.flatnonzero(np.any(rates, axis=1) & strong).astype(np.int32)
        self._sprung = at, self.inverse[at]
        self.inverse[at] = 1.0 / (1.0 / self.inverse[at] + rates[at])
        return strong

    def _product(self) -> Array:
        """A e of what the owned values are that products are made of; overwritten by the next one. Collective."""
        self._in.x.scatter_forward()
        self._out.x.array[:] = 0.0
        fem.assemble_vector(self._out.x.array, self._action)
        self._out.x.scatter_reverse(la.InsertMode.add)
        result = self._owned(self._out)
        if self._springs is not None:
            result += self._springs(self._in)
        return result

    def _owned(self, field: fem.Function) -> Array:
        """The owned values of a field of bubbles, (n, d), in place."""
        return field.x.array[: self.inverse.size].reshape(self.inverse.shape)

    def descent(self, r: Array, project: Callable[[Array], None], at: Entities) -> Array:
        """P D⁻¹ P r, D being the diagonal and P taking out what is held; overwritten by the next product.

        Args:
            r: (n, d).
            project: takes what is held out of a residual, in place.
            at: the blocks where something is, (k,).
        """
        z = np.multiply(r, self.inverse, out=self._owned(self._out))
        z[at] = r[at]
        project(z)
        z[at] *= self.inverse[at]
        project(z)
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
        if not any(agree(self.comm, bool(step.any()))):
            return 0.0
        p = self._owned(self._in)
        p[:] = 0.0
        p[at] = step
        q = self._product()
        return self.dot(p, q) + self._moved(r, e, 1.0, p, q)

    def _moved(self, r: Array, e: Array, alpha: float, p: Array, q: Array) -> float:
        """Add α p to e, and -α q to r, q being A p: 2 e·A (α p) before. Collective."""
        mixed = 2 * alpha * self.dot(e, q)
        e += alpha * p
        r -= alpha * q
        return mixed

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
            rho, before = self.dot(r, z), rho
            if rho <= goal:
                break
            p[:] = z + rho / before * p if step else z
            q = self._product()
            alpha = rho / self.dot(p, q)
            growth += alpha * rho + self._moved(r, e, alpha, p, q)
        return growth

    def dot(self, a: Array, b: Array) -> float:
        """The product of two vectors over all ranks. Collective.

        Args:
            a: the one, (n, d).
            b: the other, (n, d).
        """
        return total(self.comm, float(np.vdot(a, b)))


def diagonal(problem: Problem, bubbles: fem.FunctionSpace) -> Array:
    """The diagonal of the bubbles' stiffness at the blocks that this rank owns, (n, d). Collective.

    On a cell in which the material is constant it is Σ G_ab a(x_a, x_b), G_ab being the mean of the product of a
    bubble's derivatives by the reference coordinates x_a and x_b; what a foundation adds is that of a constant, by the
    mean of the bubble's square. At a bubble's own point no other bubble has a value, so a linear form whose quadrature
    points are these takes to each bubble its share of each energy.

    Args:
        problem: whose elastic operator it is.
        bubbles: the space of bubbles.
    """
    d, v, integrals = problem.dimension, ufl.TestFunction(bubbles), []
    for form, heights, shares in _energies(problem):
        each = [_energy(problem, form, heights, axis) for axis in range(d)]
        for along in zip(*each, strict=True):
            density = ufl.dot(ufl.as_vector([integral.integrand() for integral in along]), v)
            for share in sorted(set(shares.values()) - {0.0}):
                rule = _rule([index for index, own in shares.items() if own == share])
                integrals.append(along[0].reconstruct(integrand=share * density, metadata=rule))
    return nodal(ufl.Form(integrals))


def _energies(problem: Problem) -> Iterator[tuple[Any, tuple[Any, Any], dict[Index, float]]]:
    """The forms whose sum is a bubble's energy, the two functions that each is taken of, and the bubbles' shares."""
    mesh, d = problem.space.mesh, problem.dimension
    cell, degree = mesh.topology.cell_name(), nodes.degree(problem.space)
    barycentric, weights = nodes.quadrature(d + 1, 4 * degree)
    values = {index: shape(index, barycentric) for index in of_cell(degree, cell)}
    slopes = {
        index: [shape(index, barycentric, a) - shape(index, barycentric, 0) for a in range(1, d + 1)]
        for index in values
    }
    place = ufl.JacobianInverse(mesh) * (ufl.SpatialCoordinate(mesh) - ufl.classes.CellVertices(mesh)[0, :])
    for a, b in itertools.combinations_with_replacement(range(d), 2):
        count = 1.0 if a == b else 2.0
        means = {index: round(count * float(weights @ (own[a] * own[b])), 12) for index, own in slopes.items()}
        yield problem.bulk.material, (place[a], place[b]), means
    if problem.bulk.foundation is not None:
        squares = {index: round(float(weights @ own**2), 12) for index, own in values.items()}
        yield problem.bulk.foundation, (1.0, 1.0), squares


def _energy(problem: Problem, form: Any, heights: tuple[Any, Any], axis: int) -> list[Any]:
    """The integrals over cells of a bilinear form of two functions along an axis, in UFL."""
    d, arguments = problem.dimension, problem.bulk.form.arguments()
    moved = (ufl.as_vector([height if i == axis else 0.0 for i in range(d)]) for height in heights)
    found = ufl.replace(form, dict(zip(arguments, moved, strict=True)))
    return [integral for integral in found.integrals() if integral.integral_type() == "cell"]


def _rule(places: list[Index]) -> dict[str, Any]:
    """A quadrature rule of the points of some bubbles, each with the whole cell for its weight."""
    points = [[part / sum(index) for part in index[1:]] for index in places]
    weights = [1 / math.factorial(len(point)) for point in points]
    return {"quadrature_rule": "custom", "quadrature_points": points, "quadrature_weights": weights}


@dataclass(frozen=True, kw_only=True)
class EstimateThresholds:
    """How accurately the estimates are computed.

    Attributes:
        facet_degree: of the quadrature of the laws on a facet, at degree 1 and 2: a drop within an edge is met to a
            fourteenth of its length at degree 1, to a thirty-second at degree 2, whose edges are longer. On the
            intersections of the facets of two bodies, which are smaller, half of it.
        tolerance: of a solve for bubbles, in the energy norm, and of one with the system's matrix, relative residual:
            an energy is right to about its square.
        rough_tolerance: the same where the answer is a small part or is taken up by a next round: what the solver left,
            and bubbles that are found again beside nodes that moved, at degree 1; such bubbles at degree 2, and nodes
            among those rounds.
        bubble_steps: conjugate gradient steps at most of a solve for bubbles; bisections of the body's motion along a
            normal, where a gap varies within facets.
        rounds: of the active set of the bounds between the nodes, and of corrections of the nodes' answer to bubbles by
            the laws, at most.
        vertex_tolerance: the same, where conjugate gradients on the bubbles solve for the nodes at each step.
        data_degree: of the modes by which the data on a facet are sampled, in the plane and in space.
        coupled_rounds: times at most that bubbles and nodes are solved for in turns; sweeps over a facet's points for a
            shift of a gap.
        rounding: nondimensional norms up to this are rounding: a body that meets no force has no error, not 100 % of
            nothing.
        coupled: error of the bubbles alone, relative to |||u_h|||, from which the nodes are found with them, at degree
            1 and 2: at degree 2 always, or up to 40 % of the error is not seen.
        coupled_change: relative change in energy norm of both, and of the laws' force, up to which no further round is
            needed.
        answer_change: relative change in energy norm of that answer up to which no further round is needed.
        coarse: the mesh's error over the norm of the solution, above which the numbers are rough.
    """

    facet_degree: tuple[int, int] = (12, 30)
    tolerance: float = 0.1
    rough_tolerance: tuple[float, float] = (0.3, 0.2)
    bubble_steps: int = 30
    rounds: int = 4
    vertex_tolerance: float = 1e-6
    data_degree: tuple[int, int] = (14, 6)
    coupled_rounds: int = 12
    rounding: float = 1e-12
    coupled: tuple[float, float] = (0.3, 0.0)
    coupled_change: float = 0.02
    answer_change: float = 0.05
    coarse: float = 0.1


DEFAULT = EstimateThresholds()
