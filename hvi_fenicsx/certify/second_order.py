"""Is an equilibrium a local minimiser of the energy? First the directional derivatives, then the curvature.

Where the energy falls to first order in an admissible direction, it is none. Else, where no law softens, it is one.
Otherwise the inertia of the true Hessian on the active subspace decides, if it is asked for: by Sylvester's law the
number of negative pivots of an LDLᵀ factorisation is the number of negative eigenvalues, so the sign of the smallest is
known without computing it. Components in which the energy grows to first order in each admissible direction cannot move
and are held; other ones at a bound or a kink may move one way only: positive with them free means a minimiser, negative
with them held means none, anything else stays undecided.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

import numpy as np
from dolfinx import fem

from ..laws import Length
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds, Problem
from ..problem.references import References
from ..runtime.cost import Timer
from ..runtime.mpi import agree
from ..system import local_frames
from ..system.equations import Cells, VertexModel
from ..system.factorisation import Factorisation, form_of
from ..system.system import System
from ..typing import Array, Entities, Integers, Mask
from . import force_attribution
from .thresholds import DEFAULT

LOCAL_MINIMISER, NO_MINIMISER, UNDECIDED = "local minimiser", "not a minimiser", "undecided"
_PREFIX = "inertia_"


def status(references: References, u: fem.Function, forces: Array, tolerance: float, *, inertia: bool) -> str:
    """Whether a certified u is a local minimiser. Collective.

    Args:
        references: of the problem, with the laws that were solved.
        u: nondimensional, ghosts updated.
        forces: internal forces minus loads at the owned blocks, (blocks, d).
        tolerance: relative traction up to which a growth of the energy is none.
        inertia: whether to factorise the Hessian where the laws leave it open.
    """
    problem = references.problem
    comm = problem.comm
    found = growth(references, problem.relative(u.x.array), forces, tolerance)
    if any(agree(comm, found.falls.any())):
        return NO_MINIMISER
    if not any(agree(comm, found.softens.any())):
        return LOCAL_MINIMISER
    return _by_inertia(problem, u, found) if inertia else UNDECIDED


def _by_inertia(problem: Problem, u: fem.Function, found: Growth) -> str:
    """The status by one or two factorisations. Collective."""
    system = System(problem, Timer())
    x = system.unknowns(u)
    models = []
    for term in system.terms:
        argument = term.argument(x.array_r)
        models.append(VertexModel(term.law, Cells.around(term.law.convex, argument, radial=term.radial)))
    system.jacobian.set_rates(system.equations.tangents(x, models))
    strong, weak = np.flatnonzero(found.strong), np.flatnonzero(found.weak)
    with negative_eigenvalues(system) as negative:
        if negative(strong) == 0:
            status = LOCAL_MINIMISER
        else:
            status = NO_MINIMISER if (negative(np.union1d(strong, weak)) or 0) > 0 else UNDECIDED
    system.free()
    return status


@contextmanager
def negative_eigenvalues(system: System) -> Iterator[Callable[[Integers], int | None]]:
    """How many eigenvalues of a system's matrix are negative, by factorisations.

    The function takes the dofs (local, owned) that are held, and says None where the factorisation failed. Collective.

    Args:
        system: the system, with the tangents that are set.
    """
    form = form_of(system, _PREFIX)

    def negative(held: Integers) -> int | None:
        factors = Factorisation(form, form.matrix(), own_prefix=_PREFIX)
        factors.allow_negative()
        factors.factorise(held)
        count = None if factors.failure else factors.negative
        factors.free()
        return count

    yield negative
    form.free()


@dataclass(frozen=True)
class Growth:
    """Growth and curvature at a displacement, by owned scalar dof in local components, (n,) each.

    Attributes:
        least: the least growth in the admissible directions of this component, or of those coupled with it.
        opposite: the least sum of the growths in a direction and in the opposite one: negative on a concave kink.
        slack: growth up to this size is none.
        rounding: the opposite growths are none up to this size, since no residual is in them.
        curvature: of the laws, the least.
        bent: whether a bound, a support or a kink is here.
    """

    least: Array
    opposite: Array
    slack: Array
    rounding: Array
    curvature: Array
    bent: Mask

    @property
    def falls(self) -> Mask:
        """Where the energy falls in an admissible direction."""
        return self.bent & ((self.least < -self.slack) | (self.opposite < -self.rounding))

    @property
    def strong(self) -> Mask:
        """Where it rises in all of them."""
        return self.bent & (self.least > self.slack)

    @property
    def weak(self) -> Mask:
        """Where a bound or a kink leaves the matter to the curvature."""
        return self.bent & ~self.strong

    @property
    def softens(self) -> Mask:
        """Where the curvature of a law is negative and counts."""
        return (self.curvature < 0.0) & ~self.strong


def growth(references: References, u: Array, forces: Array, tolerance: float) -> Growth:
    """The growth at a displacement.

    Args:
        references: of the problem, whose laws, bounds and supports count.
        u: nondimensional, a local array.
        forces: internal forces minus loads at the owned blocks, (blocks, d).
        tolerance: relative traction up to which a growth is none.
    """
    problem = references.problem
    local = local_frames.frames_of(problem)
    found = _Collector(references, local.local_components(u), local.local_components(forces), tolerance)
    for term in map(local.term, problem.terms):
        (found.enter_vector_law if term.radial else found.enter_law)(term)
    for one in map(local.bounds, problem.bounds):
        found.enter_bounds(one)
    found.enter_supports(problem.fixed_here)
    return found.growth()


class _Collector:
    """The sums over laws, bounds and supports, by scalar dof (n,), and the kinks of lengths by vertex.

    Args:
        references: what tractions are relative to.
        u: the displacement in local components, a local array.
        forces: internal forces minus loads in local components, (blocks, d).
        tolerance: relative traction up to which a growth of the energy is none.
    """

    def __init__(self, references: References, u: Array, forces: Array, tolerance: float) -> None:
        self.references, self.u, self.tolerance, self.d = references, u, tolerance, forces.shape[1]
        self.near = DEFAULT.near * references.at(np.arange(len(forces)))
        self.up, self.down, n = forces.ravel().copy(), -forces.ravel(), forces.size
        self.jump, self.slack = np.zeros(n), np.zeros(n)
        self.curved_up, self.curved_down = np.zeros(n), np.zeros(n)
        self.bent = np.zeros(n, dtype=bool)
        self.lengths: dict[int, list[tuple[float, Array, Length]]] = {}

    def enter_law(self, term: LawTerm) -> None:
        """Enter a law of a signed displacement.

        Args:
            term: the law, in local components.
        """
        (dofs, sign), w = next(force_attribution.components(term)), term.weights
        near = term.reach(self.near[term.surface.blocks])
        x = on_places(term.argument(self.u), term.law.kinks, near)
        left, right = w * term.law.left(x), w * term.law.right(x)
        before, after = (w / term.stretch * term.law.derivatives(x + step)[1] for step in (-2 * near, 2 * near))
        ahead = sign > 0
        np.add.at(self.up, dofs, np.where(ahead, right, -left))
        np.add.at(self.down, dofs, np.where(ahead, -left, right))
        np.add.at(self.jump, dofs, right - left)
        np.add.at(self.curved_up, dofs, np.where(ahead, after, before))
        np.add.at(self.curved_down, dofs, np.where(ahead, before, after))
        np.add.at(self.slack, dofs, self.tolerance * w * self.references.traction_scale(term))
        self.bent[dofs] |= np.isin(x, term.law.kinks)

    def enter_vector_law(self, term: LawTerm) -> None:
        """Enter a law of a length: its force along the vector, the jump of a kink, and the stiffness across it.

        Args:
            term: the law, in local components.
        """
        w, slip, distance = term.weights, term.slip(self.u), self.near[term.surface.blocks]
        near = term.reach(distance)
        x = on_places(term.argument(self.u), term.law.kinks, near)
        moving = x > near
        size = np.where(moving, x, 1.0)
        unit = np.where(moving[:, None], term.gradient(slip), 0.0)
        left, right = np.where(moving, term.law.left(x), 0.0), term.law.right(x)
        force = np.einsum("m,mk,mkd->md", w * (left + right) / 2, unit, term.directions)
        across = np.where(moving, np.minimum(left, right) / size, np.inf)
        sides = [term.law.derivatives(x + step)[1] for step in (np.where(moving, -2, 2) * near, 2 * near)]
        curvature = w / term.stretch * np.minimum(np.minimum(*sides), across)
        touched = np.any(term.directions != 0.0, axis=1)
        dofs = term.surface.dofs
        self.up[dofs] += force
        self.down[dofs] -= force
        for side in (self.curved_up, self.curved_down):
            np.add.at(side, dofs[touched], np.repeat(curvature, self.d).reshape(touched.shape)[touched])
        slack = self.tolerance * w * self.references.traction_scale(term)
        np.add.at(self.slack, dofs[touched], np.repeat(slack, self.d).reshape(touched.shape)[touched])
        on = np.isin(x, term.law.kinks)
        ahead = np.einsum("mk,mkd->md", unit, term.directions)[:, None]
        self._couple(term, on & moving, w * (right - left) / 2, ahead, Length.plain(1))
        counting = term.directions * term.counts(self.u, distance)[:, :, None]
        self._couple(term, on & ~moving, w * right, counting, term.length or Length.plain(1))

    def _couple(self, term: LawTerm, on: Mask, factors: Array, rows: Array, length: Length) -> None:
        """Enter the growth factor times length of rows times direction at vertices on a kink."""
        for i in np.flatnonzero(on):
            self.lengths.setdefault(int(term.surface.blocks[i]), []).append((float(factors[i]), rows[i], length))

    def enter_bounds(self, bounds: Bounds) -> None:
        """Directions beyond a reached bound are not admissible.

        Args:
            bounds: of one part, in local components.
        """
        dofs, sign = bounds.component()
        near = self.near[bounds.surface.blocks]
        lower, upper = force_attribution.on_bounds(bounds, sign * self.u.ravel()[dofs], near)
        ahead = sign > 0
        self.up[dofs[np.where(ahead, upper, lower)]] = np.inf
        self.down[dofs[np.where(ahead, lower, upper)]] = np.inf
        np.add.at(self.slack, dofs, self.tolerance * self.references.at(bounds.surface.blocks) * bounds.surface.weights)
        self.bent[dofs] |= lower | upper

    def enter_supports(self, fixed: Entities) -> None:
        """Prescribed components do not move.

        Args:
            fixed: their scalar dofs.
        """
        self.up[fixed] = self.down[fixed] = np.inf
        self.bent[fixed] = True

    def growth(self) -> Growth:
        """What was collected."""
        free_up, free_down = np.isfinite(self.up), np.isfinite(self.down)
        opposite = np.where(free_up & free_down, self.jump, np.inf)
        least = np.minimum(self.up, self.down)
        for vertex, lengths in self.lengths.items():
            moved = np.flatnonzero(np.any(np.vstack([rows for _, rows, _ in lengths]) != 0.0, axis=0))
            dofs = vertex * self.d + moved
            bends = [(factor, rows[:, moved], length) for factor, rows, length in lengths]
            least[dofs], opposite[dofs] = _least(self.up[dofs], self.down[dofs], self.jump[dofs], bends)
            self.bent[dofs] = True
        up, down = np.where(free_up, self.curved_up, np.inf), np.where(free_down, self.curved_down, np.inf)
        rounding = DEFAULT.near / self.tolerance * self.slack
        return Growth(least, opposite, self.slack, rounding, np.minimum(up, down), self.bent)


def on_places(x: Array, places: Array, near: Array) -> Array:
    """Arguments of a law, those that are at one of some places but for rounding put on it.

    Args:
        x: the arguments, (m,).
        places: such as the law's kinks, (k,).
        near: what is rounding, (m,).
    """
    if not len(places):
        return x
    nearest = places[np.argmin(np.abs(x[:, None] - places), axis=1)]
    return np.where(np.abs(x - nearest) <= near, nearest, x)


_DIRECTIONS = 256
"""How many directions are tried where components are coupled, beside that of steepest descent."""


def _least(up: Array, down: Array, jump: Array, bends: Sequence[tuple[float, Array, Length]]) -> tuple[float, float]:
    """The least growth of coupled components over their admissible directions, and of opposite ones together."""
    v = _admissible(np.vstack([_steepest(up, down), _sphere(len(up))]), np.isfinite(up), np.isfinite(down))
    ahead, behind = (
        np.sum([factor * length.of(side @ rows.T) for factor, rows, length in bends], axis=0) for side in (v, -v)
    )
    one_way = np.where(v > 0, np.where(np.isfinite(up), up, 0.0), np.where(np.isfinite(down), down, 0.0))
    both = np.all((v == 0.0) | (np.isfinite(up) & np.isfinite(down)), axis=1)
    rises = np.sum(one_way * np.abs(v), axis=1) + ahead
    pairs = np.abs(v) @ jump + ahead + behind
    return float(np.min(rises, initial=np.inf)), float(np.min(pairs[both], initial=np.inf))


def _steepest(up: Array, down: Array) -> Array:
    """The direction of steepest descent without the coupling."""
    with np.errstate(invalid="ignore"):  # both infinite: the next line
        middle = (down - up) / 2
    found = np.where(np.isfinite(up) & np.isfinite(down), middle, np.where(np.isfinite(up), -up, down))
    return np.where(np.isfinite(found), found, 0.0)


def _admissible(directions: Array, up: Mask, down: Mask) -> Array:
    """Unit directions (q, k) without the components that are not admissible; those left empty are left out."""
    v = np.where(((directions > 0) & ~up) | ((directions < 0) & ~down), 0.0, directions)
    length = np.linalg.norm(v, axis=1)
    return v[length > 0.0] / length[length > 0.0, None]


def _sphere(k: int) -> Array:
    """Directions spread over the sphere in k = 1, 2 or 3 dimensions, the axes among them."""
    axes = np.vstack([np.eye(k), -np.eye(k)])
    if k == 1:
        return axes
    turns = np.arange(_DIRECTIONS) * (np.pi * (3.0 - np.sqrt(5.0)))
    height = np.zeros(_DIRECTIONS) if k == 2 else 1.0 - (2.0 * np.arange(_DIRECTIONS) + 1.0) / _DIRECTIONS
    circle = np.sqrt(1.0 - height**2)
    spread = np.column_stack([circle * np.cos(turns), circle * np.sin(turns), height])
    return np.vstack([axes, spread[:, :k]])
