"""Force and mean displacement of each driven part, as functions of the condensed unknowns and the factor.

Both are affine in them, so that no state needs the displacement of the whole body.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from petsc4py import PETSc

from ..effects import Drive, Place
from ..laws import VertexLaws
from ..problem import references
from ..problem.problem import Problem
from ..problem.vectors import new_vector, turn
from ..reduced import loading
from ..reduced.condensation import Condensation
from ..runtime.mpi import agree
from ..system.system import System
from ..typing import Array, Entities, Integers


class Measures:
    """What is measured at the parts with a load or a prescribed displacement. Creation is collective.

    A part's force is the resultant of its loads, the reactions of its supports, and what contact and laws give on it.
    The reaction of a vertex where two parts meet counts for the first of them.

    Args:
        system: the system.
        condensation: its condensation.
        scaled: the names of what the factor multiplies.
        remember: whether bonds do.

    Attributes:
        parts: their names, in the order of the scene.
    """

    def __init__(
        self, system: System, condensation: Condensation, scaled: tuple[str, ...], *, remember: bool = False
    ) -> None:
        self._system, self._scaled, self._scales = system, scaled, system.problem.scales
        self.parts = tuple(driven(system.problem))
        held, touched = _attributed(system.problem, self.parts)
        columns, loads = list[Array](), list[Array]()
        for part in self.parts:
            for i in range(self._scales.dimension):
                column, load = self._force(part, held[part], touched[part], i, condensation)
                columns += [column, self._mean(part, i)]
                loads += [load, np.zeros(2)]
        constants: Array = np.zeros((0, 2))
        rows: Array = np.zeros((0, condensation.problem.size))
        if columns:
            constants, rows = condensation.products(np.column_stack(columns))
            constants = constants + np.array(loads)
        # each in one piece, since each row of the path is multiplied
        self._affine = [(constants[i::2], np.ascontiguousarray(rows[i::2])) for i in range(2)]
        numbers = {dof: number for number, part in enumerate(self.parts) for dof in map(int, held[part])}
        prescribed = loading.loading_of(system, scaled).prescribed
        self._held = find(system.problem, numbers, prescribed, remember=remember)

    def forces(self, x: Array, factor: float, reached: tuple[float, float] = (0.0, 0.0)) -> dict[str, Array]:
        """The resultants by part, N/m or N, (d,) each.

        Args:
            x: the condensed unknowns, (n,).
            factor: λ.
            reached: the least and the greatest factor so far.
        """
        found = self._values(0, x, factor)
        for law in self._held:
            np.add.at(found, law.parts, law.on_supports(factor, reached))
        return dict(zip(self.parts, found * self._scales.force, strict=True))

    def displacements(self, x: Array, factor: float) -> dict[str, Array]:
        """The mean displacements by part, m, (d,) each.

        Args:
            x: the condensed unknowns, (n,).
            factor: λ.
        """
        return dict(zip(self.parts, self._values(1, x, factor) * self._scales.displacement, strict=True))

    def _values(self, first: int, x: Array, factor: float) -> Array:
        """The forces (0) or means (1) of all parts, (parts, d)."""
        constants, rows = self._affine[first]
        found = constants @ np.array([1.0, factor]) + rows @ x
        return found.reshape(-1, self._scales.dimension)

    def _force(
        self, part: str, held: Integers, touched: Integers, component: int, condensation: Condensation
    ) -> tuple[Array, Array]:
        """What multiplies u in a component of a part's force, and that of its loads alone, (2,). Collective.

        Its unknowns are those that supports hold, Cartesian, and those that contact and laws act on.
        """
        system = self._system
        ones, along = self._ones(held, component), self._ones(touched, component)
        turn(along, system.rotation)
        elastic, inner = system.holding.pull(ones), along.duplicate()
        turn(elastic, system.rotation)
        system.jacobian.elastic_product(along, inner)
        elastic.axpy(1.0, inner)
        constant, whole = condensation.load(0.0), condensation.load(1.0)
        felt = along.dot(constant)
        load = self._loads(part, component) - np.array([felt, along.dot(whole) - felt])
        for name, force in system.forces.items():
            load[int(name in self._scaled)] -= ones.dot(force)
        column = np.array(elastic.array_r)
        for vector in (ones, along, elastic, inner, constant, whole):
            vector.destroy()
        return column, load

    def _ones(self, unknowns: Integers, component: int) -> PETSc.Vec:
        ones = new_vector(self._system.problem.space)
        ones.array[unknowns[unknowns % self._scales.dimension == component]] = 1.0
        return ones

    def _mean(self, part: str, component: int) -> Array:
        """What multiplies u in the mean of a displacement component over a part. Collective."""
        problem = self._system.problem
        weights, areas = new_vector(problem.space), references.lumped(problem, problem.part_facets[part])
        weights.array[component :: self._scales.dimension] = areas / self._system.comm.allreduce(areas.sum())
        weights.array[:] = problem.combined(weights.array_r)
        turn(weights, self._system.rotation)
        found = np.array(weights.array_r)
        weights.destroy()
        return found

    def _loads(self, part: str, component: int) -> Array:
        """A component of the resultant of a part's loads, constant and with the factor, (2,). Collective."""
        found = np.zeros(2)
        for name, force in self._system.forces.items():
            if name.rpartition(".")[0] == part:
                found[int(name in self._scaled)] += force.array_r[component :: self._scales.dimension].sum()
        return self._system.comm.allreduce(found)


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
    free = np.ones(problem.space.dofmap.index_map.size_local * problem.dimension, dtype=np.bool_)

    def taken(found: Iterable[tuple[str, Entities | Integers]]) -> dict[str, Integers]:
        """The unknowns of each part that none before it has."""
        own: dict[str, list[int]] = {part: [] for part in parts}
        for part, dofs in found:
            here = dofs[dofs < len(free)]
            own.setdefault(part, []).extend(map(int, here[free[here]]))
            free[here] = False
        return {part: np.array(dofs, dtype=np.int64) for part, dofs in own.items()}

    held = taken((one.part, one.dofs) for one in problem.prescribed)
    return held, taken((surface.part, surface.dofs.ravel()) for surface in problem.surfaces)


@dataclass(frozen=True)
class HeldLaw:
    """One law at m such vertices, of all ranks.

    Attributes:
        laws: over what is prescribed.
        parts: number of the part whose support holds the vertex, (m,).
        forces: on the support for a unit traction, (m, d).
        arguments: what the law acts on is the first row plus λ times the second, (2, m).
    """

    laws: VertexLaws
    parts: Integers
    forces: Array
    arguments: Array

    def on_supports(self, factor: float, reached: tuple[float, float]) -> Array:
        """The forces on the supports of the vertices, (m, d).

        Args:
            factor: λ.
            reached: the least and the greatest factor so far.
        """
        laws = self.laws
        for end in reached if laws.memory is not None else ():
            laws = laws.remembering(*self._at(laws, end))
        return self.forces * self._at(laws, factor)[1][:, None]

    def _at(self, laws: VertexLaws, factor: float) -> tuple[Array, Array]:
        """What the laws act on at a factor, and their tractions, at a jump the mean of both limits."""
        x = self.arguments[0] + factor * self.arguments[1]
        return x, 0.5 * np.add(*laws.limits(x))


def find(problem: Problem, parts: Mapping[int, int], prescribed: Array, *, remember: bool) -> list[HeldLaw]:
    """The laws of a problem whose argument is prescribed. Collective.

    Args:
        problem: the problem; laws on |u_t| in space are left out.
        parts: the number of the part whose support counts, by scalar unknown of this rank.
        prescribed: displacements, constant and scaled, zero where nothing is prescribed, (local unknowns, 2).
        remember: whether bonds do.
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
        numbers, forces, arguments = (np.concatenate(agree(problem.comm, e)) for e in entries)
        known = numbers >= 0
        if np.any(known):
            ones = np.ones(np.count_nonzero(known))
            laws = VertexLaws(law=term.law, factors=ones, weights=ones)
            laws = laws.with_memory if remember else laws
            found.append(HeldLaw(laws, numbers[known], forces[known], arguments[known].T))
    return found
