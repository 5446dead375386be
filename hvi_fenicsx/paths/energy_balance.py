"""The energy balance of a path: what the loads put in, what is stored, and what is lost, from the laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ..reduced.condensed_problem import CondensedProblem
from ..typing import Array, Integers
from .branch import Branch, Move
from .contact_points import ContactPoints, Values
from .curve import CurvedBranch
from .events import CurveStep, displacement_rate
from .vertex_laws import VertexLaw, shares


@dataclass(frozen=True, kw_only=True)
class Stored:
    """The energies of one state.

    Attributes:
        energy: ½ a(u, u) - <g, u> + what the bonds would give back.
        potential: <g, u>.
        constant: the part of the energy that x does not change.
        dissipated: lost in bonds with memory.
        lost: by each bond with memory, for 1 at its mode, (b,).
        scales: of the bonds' energies by mode, (b,).
    """

    energy: float
    potential: float
    constant: float
    dissipated: float
    lost: Array
    scales: Array


class EnergyBalance:
    """Work and dissipation, added up from state to state.

    Args:
        problem: the problem.
        points: its points.
        values: of the points where it starts.
        factor: λ there.
        work: done before.
        dissipated: before.

    Attributes:
        work: done by the loads and by what moves prescribed displacements.
        stored: the energies of the last state.
    """

    def __init__(
        self,
        problem: CondensedProblem,
        points: ContactPoints,
        values: Values,
        factor: float,
        *,
        work: float = 0.0,
        dissipated: float = 0.0,
    ) -> None:
        self._problem, self._points, self.work = problem, points, work
        remember = {law.group for law in points.vertices if law.laws.memory is not None}
        self._numbers = sorted(remember | {n for n, bonds in enumerate(problem.bonds) if bonds.mixity})
        self._laws = [[law for law in points.vertices if law.group == n] for n in self._numbers]
        self._at: list[Integers] = [points.point_of[[law.unknowns[0] for law in laws]] for laws in self._laws]
        self._potential, self._lost = not any(b.mixity for b in problem.bonds), dissipated
        self.stored = self.at(values, factor)

    def at(self, values: Values, factor: float) -> Stored:
        """The energies of a state.

        Args:
            values: of the points.
            factor: λ.
        """
        problem, x = self._problem, values.x
        elastic, load = 0.5 * float(x @ (problem.elastic @ x)), float(problem.load(factor) @ x)
        constant = problem.constant_at(factor)
        plain = sum(b.energy(x) for n, b in enumerate(problem.bonds) if n not in self._numbers)
        back, lost, scales = self._of_bonds(values)
        return Stored(
            energy=elastic - load + constant + plain + back,
            potential=problem.potential(x, factor),
            constant=constant,
            dissipated=float(scales @ lost) if self._potential else self._lost,
            lost=lost,
            scales=scales,
        )

    def go(self, branch: Branch, move: Move) -> None:
        """Along a step.

        Args:
            branch: after it.
            move: the step.
        """
        before, after = self.stored, self.at(branch.values, branch.factor)
        if not self._potential:  # the bonds have no energy but the frozen one: what the work leaves is lost
            assert isinstance(branch, CurvedBranch)
            assert isinstance(move, CurveStep)
            driven = self._driven(branch, move)
            self._lost += after.constant - before.constant - driven - (after.energy - before.energy)
            after = replace(after, dissipated=self._lost)
        self.work += after.energy + after.potential + after.dissipated
        self.work -= before.energy + before.potential + before.dissipated
        self.stored = after

    def _driven(self, branch: CurvedBranch, arc: CurveStep) -> float:
        """∫ f1ᵀx dλ along a step, both as cubic polynomials of the way along its first tangent between its points."""
        rate, first, unit = self._problem.force_rate, arc.before.tangent, branch.unit
        done = 0.0
        for places in pairwise((arc.before, *arc.between, arc.after)):
            way = float(first @ (places[1].y - places[0].y))
            (x0, x1), (l0, l1) = [float(rate @ p.values.x) for p in places], [unit * p.y[-1] for p in places]
            slopes = [way / float(first @ p.tangent) for p in places]
            dx0, dx1 = np.multiply(slopes, [float(rate @ displacement_rate(self._points, p)) for p in places])
            dl0, dl1 = np.multiply(slopes, [unit * p.tangent[-1] for p in places])
            ends = (dx0 - dx1) * (l1 - l0) - (dl0 - dl1) * (x1 - x0)
            done += 0.5 * (x0 + x1) * (l1 - l0) + ends / 10.0 + (dx1 * dl0 - dx0 * dl1) / 60.0
        return float(done)

    def leap(self, values: Values, factor: float) -> float:
        """To another state at the same factor; returns the energy that is released.

        Bonds whose energy depends on the mode lose what they break by at the mode of that state.

        Args:
            values: of the points.
            factor: λ.
        """
        before, after = self.stored, self.at(values, factor)
        if not self._potential:
            self._lost += float(after.scales @ (after.lost - before.lost))
            after = replace(after, dissipated=self._lost)
        self.stored = after
        self.work += self.stored.potential - before.potential
        return before.energy + before.dissipated - self.stored.energy - self.stored.dissipated

    def _of_bonds(self, values: Values) -> tuple[float, Array, Array]:
        """What bonds give back, what each has lost for 1 at its mode, and the scales by mode, (b,)."""
        back, lost, scales = 0.0, list[Array](), list[Array]()
        for vertices, at in zip(self._laws, self._at, strict=True):
            x, scale, laws = values.lengths[at], values.energies[at], vertices[0].laws
            traction = self._tractions(values, vertices, at)
            back += float(scale @ laws.recoverable(x, traction))
            lost.append(laws.dissipated(x, traction))
            scales.append(scale)
        return back, np.concatenate([np.zeros(0), *lost]), np.concatenate([np.zeros(0), *scales])

    def _tractions(self, values: Values, vertices: Sequence[VertexLaw], at: Integers) -> Array:
        """What each vertex has of the force of all laws at its point, (r,)."""
        forces = self._points.bond_forces(values)
        found = forces[at] / vertices[0].laws.weights
        for row, (law, k) in enumerate(zip(vertices, at, strict=True)):
            several = self._points.laws[k]
            if len(several) > 1:
                parts = shares(several, float(values.lengths[k]), float(forces[k]))
                found[row] = next(part for other, part in zip(several, parts, strict=True) if other is law)
        return found
