"""How the energy grows to first order in the directions that supports and bounds admit, and how the laws are curved.

To first order it grows by E'(u; v) = r·v + Σ w j'(x; v), r being the forces without the laws, j' their one-sided
derivatives. That is a sum over components (in local frames), except that a law of a length on a kink couples those of
its vertex by a term c δ(B v). A kink that lets the energy fall in no admissible direction spoils no minimum.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..laws import Length, Superpotential
from ..problem.law_term import LawTerm
from ..problem.problem import Bounds
from ..problem.references import References
from ..system import local_frames
from ..typing import Array, Entities, Mask
from . import force_attribution, shared_forces
from .coupled_growth import CoupledVertices, SideSlopes, coupled
from .thresholds import DEFAULT, CertificateThresholds


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


def growth(
    references: References, u: Array, forces: Array, tolerance: float, thresholds: CertificateThresholds = DEFAULT
) -> Growth:
    """The growth at a displacement.

    Args:
        references: of the problem, whose laws, bounds and supports count.
        u: nondimensional, a local array.
        forces: internal forces minus loads at the owned blocks, (blocks, d).
        tolerance: relative traction up to which a growth is none.
        thresholds: when a vertex is on a kink or a bound.
    """
    problem = references.problem
    local = local_frames.frames_of(problem)
    terms, bounds = problem.terms, problem.bounds
    if local is not None:
        u, forces = local.local_components(u), local.local_components(forces)
        terms, bounds = tuple(local.term(t) for t in terms), tuple(local.bounds(b) for b in bounds)
    near = thresholds.near * references.at(np.arange(len(forces)))
    found = _Collector(references, u, forces.ravel(), forces.shape[1], near, tolerance, thresholds)
    for term in terms:
        (found.enter_vector_law if term.radial else found.enter_law)(term)
    for one in bounds:
        found.enter_bounds(one)
    found.enter_supports(problem.fixed_here)
    return found.growth()


@dataclass
class _Collector:
    """The sums over laws, bounds and supports, by scalar dof (n,); couplings by vertex.

    Attributes:
        references: what tractions are relative to.
        u: the displacement in local components, a local array.
        forces: r, (n,).
        d: the dimension.
        near: distance from a kink or a bound that counts as being on it, by vertex.
        tolerance: relative traction up to which a growth is none.
        thresholds: up to when a jump is rounding.
        couplings: of the laws of a length.
    """

    references: References
    u: Array
    forces: Array
    d: int
    near: Array
    tolerance: float
    thresholds: CertificateThresholds
    couplings: list[CoupledVertices] = field(default_factory=list)

    def __post_init__(self) -> None:
        n = len(self.forces)
        self.up, self.down = self.forces.copy(), -self.forces
        self.jump, self.slack = np.zeros(n), np.zeros(n)
        self.curved_up, self.curved_down = np.zeros(n), np.zeros(n)
        self.bent = np.zeros(n, dtype=bool)

    def enter_law(self, term: LawTerm) -> None:
        """Enter a law of a signed displacement.

        Args:
            term: the law, in local components.
        """
        (dofs, sign), w = next(shared_forces.components(term)), term.weights
        near = term.reach(self.near[term.surface.blocks])
        x = _on_kink(term.law, term.argument(self.u), near)
        left, right = w * term.law.left(x), w * term.law.right(x)
        before, after = (w / term.stretch * _second(term.law, x + step) for step in (-2 * near, 2 * near))
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
        x = _on_kink(term.law, term.argument(self.u), near)
        moving = x > near
        size = np.where(moving, x, 1.0)
        unit = np.where(moving[:, None], term.gradient(slip), 0.0)
        left, right = np.where(moving, term.law.left(x), 0.0), term.law.right(x)
        force = np.einsum("m,mk,mkd->md", w * (left + right) / 2, unit, term.directions)
        across = np.where(moving, np.minimum(left, right) / size, np.inf)
        sides = [_second(term.law, x + step) for step in (np.where(moving, -2, 2) * near, 2 * near)]
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
        self.couplings.append(CoupledVertices(term.surface.blocks[on], factors[on], rows[on], length))

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
        for dofs, lowest, pair in coupled(self.couplings, SideSlopes(self.up, self.down, self.jump), self.d):
            least[dofs], opposite[dofs], self.bent[dofs] = lowest, pair, True
        up, down = np.where(free_up, self.curved_up, np.inf), np.where(free_down, self.curved_down, np.inf)
        rounding = self.thresholds.no_jump / self.tolerance * self.slack
        return Growth(least, opposite, self.slack, rounding, np.minimum(up, down), self.bent)


def _on_kink(law: Superpotential, x: Array, near: Array) -> Array:
    """Arguments, those near a kink put on it."""
    if not len(law.kinks):
        return x
    nearest = law.kinks[np.argmin(np.abs(x[:, None] - law.kinks), axis=1)]
    return np.where(np.abs(x - nearest) <= near, nearest, x)


def _second(law: Superpotential, x: Array) -> Array:
    return law.convex.second(x) - law.concave.second(x)
