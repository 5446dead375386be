"""Force and mean displacement of each driven part, as functions of the condensed unknowns and the factor.

Both are affine in them, so that no state needs the displacement of the whole body.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from ..effects import Drive, Place
from ..laws import Superpotential
from ..problem import references
from ..problem.problem import Problem
from ..problem.vectors import new_vector, turn
from ..reduced import loading
from ..reduced.condensation import Condensation
from ..runtime.mpi import agree
from ..system.system import System
from ..typing import Array, Integers


@dataclass(frozen=True, kw_only=True)
class _Affine:
    """Values v = constants + λ rates + rows x.

    Attributes:
        constants: (k,).
        rates: (k,).
        rows: (k, n).
    """

    constants: Array
    rates: Array
    rows: Array

    def at(self, x: Array, factor: float) -> Array:
        return np.asarray(self.constants + factor * self.rates + self.rows @ x)


class Measures:
    """What is measured at the parts with a load or a prescribed displacement. Creation is collective.

    A part's force is the resultant of its loads, the reactions of its supports, and what contact and laws give on it.
    The reaction of a vertex where two parts meet counts for the first of them.

    Args:
        system: the system.
        condensation: its condensation.
        scaled: the names of what the factor multiplies.

    Attributes:
        parts: their names, in the order of the scene.
    """

    def __init__(self, system: System, condensation: Condensation, scaled: tuple[str, ...]) -> None:
        self._system, self._scaled = system, scaled
        self.parts = tuple(driven(system.problem))
        held, touched = _attributed(system.problem, self.parts)
        made = [self._at_part(part, held[part], touched[part], condensation) for part in self.parts]
        numbers = {dof: number for number, part in enumerate(self.parts) for dof in map(int, held[part])}
        self._held = find(system.problem, numbers, loading.make(system, scaled).prescribed)
        self._forces = _joined([force for force, _ in made], condensation.problem.size)
        self._means = _joined([mean for _, mean in made], condensation.problem.size)

    def forces(self, x: Array, factor: float, largest: tuple[float, float] | None = None) -> dict[str, Array]:
        """The resultants by part, N/m or N, (d,) each.

        Args:
            x: the condensed unknowns, (n,).
            factor: λ.
            largest: the least and the greatest factor so far, where bonds remember.
        """
        found = self._forces.at(x, factor)
        for law in self._held:
            found += law.on_supports(factor, largest, len(self.parts)).ravel()
        return self._by_part(found * self._system.problem.scales.force)

    def displacements(self, x: Array, factor: float) -> dict[str, Array]:
        """The mean displacements by part, m, (d,) each.

        Args:
            x: the condensed unknowns, (n,).
            factor: λ.
        """
        return self._by_part(self._means.at(x, factor) * self._system.problem.scales.displacement)

    def _by_part(self, values: Array) -> dict[str, Array]:
        return dict(zip(self.parts, values.reshape(-1, self._system.problem.scales.dimension), strict=True))

    def _at_part(
        self, part: str, held: Integers, touched: Integers, condensation: Condensation
    ) -> tuple[_Affine, _Affine]:
        """Force and mean displacement of a part. Collective."""
        directions = range(self._system.problem.scales.dimension)
        supports = [self._support(held, i) for i in directions]
        contact = [self._contact(touched, i) for i in directions]
        means = [self._mean(part, i) for i in directions]
        factors = [*(c for _, c in supports), *(c for _, c in contact), *means]
        columns = [np.array(v.array_r) for v in factors]
        products, rows = condensation.products(np.column_stack(columns))
        d = len(directions)
        load = self._loads(part) - self._felt(condensation, [e for e, _ in supports], [e for e, _ in contact])
        forces = products[:d] + products[d : 2 * d] + load
        for vector in (*factors, *(ones for ones, _ in (*supports, *contact))):
            vector.destroy()
        return (
            _Affine(constants=forces[:, 0], rates=forces[:, 1], rows=rows[:d] + rows[d : 2 * d]),
            _Affine(constants=products[2 * d :, 0], rates=products[2 * d :, 1], rows=rows[2 * d :]),
        )

    def _support(self, held: Integers, component: int) -> tuple[PETSc.Vec, PETSc.Vec]:
        """Ones at the held unknowns of a component, Cartesian; and what multiplies u in their elastic forces."""
        ones = self._ones(held, component)
        forces = self._system.holding.pull(ones)
        turn(forces, self._system.rotation)
        return ones, forces

    def _contact(self, touched: Integers, component: int) -> tuple[PETSc.Vec, PETSc.Vec]:
        """The same of unknowns that contact and laws act on, in the components of the unknowns."""
        ones = self._ones(touched, component)
        turn(ones, self._system.rotation)
        forces = ones.duplicate()
        self._system.jacobian.elastic_product(ones, forces)
        return ones, forces

    def _ones(self, unknowns: Integers, component: int) -> PETSc.Vec:
        ones = new_vector(self._system.problem.space)
        ones.array[unknowns[unknowns % self._system.problem.scales.dimension == component]] = 1.0
        return ones

    def _mean(self, part: str, component: int) -> PETSc.Vec:
        """What multiplies u in the mean of a displacement component over a part."""
        problem = self._system.problem
        weights, areas = new_vector(problem.space), references.lumped(problem, problem.part_facets[part])
        weights.array[component :: problem.scales.dimension] = areas / self._system.comm.allreduce(areas.sum())
        turn(weights, self._system.rotation)
        return weights

    def _loads(self, part: str) -> Array:
        """The resultant of a part's loads, constant and with the factor, (d, 2)."""
        d, found = self._system.problem.scales.dimension, np.zeros((self._system.problem.scales.dimension, 2))
        for name, force in self._system.forces.items():
            if name.rpartition(".")[0] == part:
                found[:, int(name in self._scaled)] += force.array_r.reshape(-1, d).sum(axis=0)
        return np.asarray(self._system.comm.allreduce(found))

    def _felt(self, condensation: Condensation, held: list[PETSc.Vec], touched: list[PETSc.Vec]) -> Array:
        """The loads that supports, contact and laws feel, (d, 2). Collective."""
        found = np.zeros((len(held), 2))
        for name, force in self._system.forces.items():
            found[:, int(name in self._scaled)] += [ones.dot(force) for ones in held]
        constant = condensation.load(0.0)
        rate = condensation.load(1.0)
        rate.axpy(-1.0, constant)
        found += np.array([[ones.dot(constant), ones.dot(rate)] for ones in touched])
        for vector in (constant, rate):
            vector.destroy()
        return found


def driven(problem: Problem) -> Iterator[str]:
    """The boundary parts with a load, a prescribed displacement or a moved obstacle, in the order of the scene.

    Args:
        problem: the problem.
    """
    with_load = {
        str(where)
        for where, effect, _ in problem.contributions
        if effect.place is Place.BOUNDARY and (effect.drive is Drive.LOAD or effect.prescribed())
    }
    with_load |= {bounds.surface.part for bounds in problem.bounds if bounds.move is not None}
    return (part for part in problem.part_facets if part in with_load)


def _attributed(problem: Problem, parts: tuple[str, ...]) -> tuple[dict[str, Integers], dict[str, Integers]]:
    """The scalar unknowns of this rank that count for each part: those held, and those contact and laws act on."""
    taken: set[int] = set()
    here = problem.space.dofmap.index_map.size_local * problem.scales.dimension
    held: dict[str, list[int]] = {part: [] for part in parts}
    touched: dict[str, list[int]] = {part: [] for part in parts}
    for part, dofs in problem.held:
        new = [int(dof) for dof in dofs if dof < here and int(dof) not in taken]
        held.setdefault(part, []).extend(new)
        taken.update(new)
    for surface in problem.surfaces:
        new = [int(dof) for dof in surface.dofs.ravel() if int(dof) not in taken]
        touched.setdefault(surface.part, []).extend(new)
        taken.update(new)
    return _arrays(held), _arrays(touched)


def _arrays(found: dict[str, list[int]]) -> dict[str, Integers]:
    return {part: np.array(dofs, dtype=np.int64) for part, dofs in found.items()}


def _joined(parts: list[_Affine], size: int) -> _Affine:
    if not parts:
        return _Affine(constants=np.empty(0), rates=np.empty(0), rows=np.empty((0, size)))
    return _Affine(
        constants=np.concatenate([one.constants for one in parts]),
        rates=np.concatenate([one.rates for one in parts]),
        rows=np.concatenate([one.rows for one in parts]),
    )


@dataclass(frozen=True, kw_only=True)
class HeldLaw:
    """One law at m such vertices, of all ranks.

    Attributes:
        law: j.
        parts: number of the part whose support holds the vertex, (m,).
        forces: on the support for a unit traction, (m, d).
        constants: what the law acts on, at the factor 0, (m,).
        rates: how that grows with the factor, (m,).
    """

    law: Superpotential
    parts: Integers
    forces: Array
    constants: Array
    rates: Array

    def on_supports(self, factor: float, largest: tuple[float, float] | None, count: int) -> Array:
        """The forces on the supports of all parts, (count, d).

        Args:
            factor: λ.
            largest: the least and the greatest factor so far, for bonds that remember; None for those that do not.
            count: of parts.
        """
        x = self.constants + factor * self.rates
        traction = 0.5 * (self.law.left(x) + self.law.right(x))
        if largest is not None:
            traction = self._remembered(x, traction, largest)
        found = np.zeros((count, self.forces.shape[1]))
        np.add.at(found, self.parts, self.forces * traction[:, None])
        return found

    def _remembered(self, x: Array, traction: Array, largest: tuple[float, float]) -> Array:
        """Below the greatest displacement so far: along the secant."""
        ends = np.array([self.constants + factor * self.rates for factor in largest])
        if self.law.even:
            far = np.abs(ends).max(axis=0) * np.sign(x)
        else:
            far = np.where(x > 0.0, np.maximum(ends.max(axis=0), 0.0), np.minimum(ends.min(axis=0), 0.0))
        secant = np.divide(
            0.5 * (self.law.left(far) + self.law.right(far)), far, out=np.zeros_like(far), where=far != 0
        )
        return np.where(np.abs(x) < np.abs(far), secant * x, traction)


def find(problem: Problem, parts: Mapping[int, int], prescribed: Array) -> tuple[HeldLaw, ...]:
    """The laws of a problem whose argument is prescribed. Collective.

    Args:
        problem: the problem; laws on |u_t| in space are left out.
        parts: the number of the part whose support counts, by scalar unknown of this rank.
        prescribed: displacements, constant and scaled, zero where nothing is prescribed, (local unknowns, 2).
    """
    found = []
    for term in problem.terms:
        if term.radial:
            continue
        direction, dofs = term.directions[:, 0], term.surface.dofs
        along = direction != 0.0
        held = np.isin(dofs, problem.fixed_here)
        here = np.flatnonzero(np.all(held | ~along, axis=1))
        main = dofs[here, np.argmax(np.abs(direction[here]), axis=1)]
        entries = (
            np.array([parts.get(int(dof), -1) for dof in main], dtype=np.int64),
            direction[here] * term.weights[here, None],
            np.einsum("md,mdc->mc", direction[here], prescribed[dofs[here]]) / term.stretch[here, None],
        )
        numbers, forces, arguments = (np.concatenate(agree(problem.domain.mesh.comm, e)) for e in entries)
        known = numbers >= 0
        if np.any(known):
            found.append(
                HeldLaw(
                    law=term.law,
                    parts=numbers[known],
                    forces=forces[known],
                    constants=arguments[known, 0],
                    rates=arguments[known, 1],
                )
            )
    return tuple(found)
