"""What acts on the unknowns of Γc that are kept: loads, prescribed displacements, bounds and laws.

Loads and prescribed displacements are functions of one factor: constant ones, and λ times the rest.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
from dolfinx.fem.petsc import set_bc

from ..errors import InputError
from ..problem.law_term import LawTerm
from ..problem.vectors import new_vector, turn
from ..runtime.mpi import agree
from ..system.interior import Interior
from ..system.system import System
from ..typing import Array, Integers, Mask
from .condensed_problem import Bonds, PrescribedBonds


@dataclass(frozen=True, kw_only=True)
class Loading:
    """This rank's part of loads g + λ g' and prescribed displacements: columns for constant ones and for scaled ones.

    Attributes:
        applied: loads in the components of the unknowns, (local unknowns, 2).
        working: those without thermal strain, which does no work, (local unknowns, 2).
        prescribed: prescribed displacements, zero at other unknowns, (local unknowns, 2).
        lifted: what the unknowns that are not prescribed feel of both; else as ``prescribed``, (local unknowns, 2).
        pulled: elastic forces of the prescribed displacements alone at the prescribed unknowns, (local unknowns, 2).
    """

    applied: Array
    working: Array
    prescribed: Array
    lifted: Array
    pulled: Array


def load_names(system: System) -> tuple[str, ...]:
    """All that a factor can scale: ``part.effect`` of each load, prescribed displacement and moved obstacle."""
    moved = [bounds.move.name for bounds in system.bounds if bounds.move is not None]
    return tuple(dict.fromkeys([*system.forces, *(one.name for one in system.problem.prescribed), *moved]))


def obstacle_shift(system: System, scaled: Collection[str]) -> Array:
    """By how much the obstacles that a factor moves have moved the bounds of this rank's unknowns, (local unknowns,).

    Args:
        system: the system.
        scaled: names of what the factor scales.

    Raises:
        InputError: on all ranks alike: not in proportion; or another bound of the same unknown stands still.
    """
    shift, still = np.zeros(system.load.local_size), np.zeros(system.load.local_size, dtype=bool)
    both = False
    for bounds in system.bounds:
        dofs, sign = bounds.component()
        if bounds.move is None or bounds.move.name not in scaled:
            still[dofs] = True
            continue
        if not bounds.move.straight:
            raise InputError(
                f"{bounds.move.name}: this obstacle's gaps do not change in proportion to its displacement, so that no "
                "path can move it; give it a direction along its displacement, or leave it out of path.scaled"
            )
        by = sign * bounds.move.by
        both |= bool(np.any((shift[dofs] != 0.0) & (shift[dofs] != by)))
        shift[dofs] = by
    if any(agree(system.comm, both or bool(np.any(still & (shift != 0.0))))):
        raise InputError(
            "path: a vertex is on two parts with contact, and the path moves the obstacle of one only; leave the "
            "vertex out of one part (where)"
        )
    return shift


def loading_of(system: System, scaled: Collection[str] | None) -> Loading:
    """The loading of a system. Collective.

    Args:
        system: the system.
        scaled: names of the loads and prescribed displacements that the factor scales; None: all.

    Raises:
        InputError: on all ranks alike: a name that is none, or a constant and a scaled displacement of one unknown.
    """
    known = load_names(system)
    chosen = set(known if scaled is None else scaled)
    for name in sorted(chosen - set(known)):
        raise InputError(f"path.scaled: there is no load {name!r}; there are: {', '.join(known) or 'none'}")
    columns = [_column(system, [n for n in known if (n in chosen) == with_factor]) for with_factor in (False, True)]
    found = Loading(**{name: np.column_stack([column[name] for column in columns]) for name in columns[0]})
    _check_overlap(system, found.prescribed, chosen)
    return found


def _column(system: System, chosen: Collection[str]) -> dict[str, Array]:
    """What a loading consists of, by its name, of these loads and conditions. Collective."""
    problem, fixed = system.problem, system.problem.fixed_here
    applied, working, prescribed = (new_vector(problem.space) for _ in range(3))
    for name in system.forces.keys() & set(chosen):
        applied.axpy(1.0, system.forces[name])
        working.axpy(float(name not in problem.bulk.strains), system.forces[name])
    for vector in (applied, working):
        vector.array[:] = problem.combined(vector.array_r)
    set_bc(prescribed, [one.condition for one in problem.prescribed if one.name in chosen])
    pull = system.holding.pull(prescribed)
    for vector in (applied, working, pull):
        turn(vector, system.rotation)
    lifted, pulled = applied.array_r - pull.array_r, np.zeros(applied.local_size)
    lifted[fixed], pulled[fixed] = prescribed.array_r[fixed], pull.array_r[fixed]
    parts = {"applied": applied, "working": working, "prescribed": prescribed}
    own = {name: np.array(vector.array_r) for name, vector in parts.items()}
    for vector in (*parts.values(), pull):
        vector.destroy()
    return own | {"lifted": lifted, "pulled": pulled}


def _check_overlap(system: System, prescribed: Array, chosen: Collection[str]) -> None:
    """Refuse an unknown that is prescribed twice, scaled and not, unless it is zero. Collective."""
    known = system.problem.prescribed
    sides = [{int(dof) for one in known if (one.name in chosen) == side for dof in one.dofs} for side in (True, False)]
    both = [dof for dof in sides[0] & sides[1] if dof < len(prescribed)]
    if any(agree(system.comm, bool(np.any(prescribed[both] != 0.0)))):
        raise InputError(
            "path.scaled: two boundary parts meet and prescribe the same displacement, one scaled and the other not; "
            "scale both or none"
        )


@dataclass(frozen=True, kw_only=True)
class CondensedLaws:
    """The laws on some unknowns.

    Attributes:
        bonds: where displacements are free.
        prescribed: where they are prescribed.
    """

    bonds: tuple[Bonds, ...]
    prescribed: tuple[PrescribedBonds, ...]

    def renumbered(self, stay: Integers) -> CondensedLaws:
        """The laws on fewer unknowns.

        Args:
            stay: numbers of the unknowns that stay, ascending.
        """
        return replace(self, bonds=tuple(replace(b, unknowns=np.searchsorted(stay, b.unknowns)) for b in self.bonds))


def laws_of(system: System, interior: Interior, prescribed: Array) -> CondensedLaws:
    """The laws of a system. Collective.

    Args:
        system: the system.
        interior: which unknowns are kept.
        prescribed: prescribed displacements, constant and scaled, (local unknowns, 2).

    Raises:
        InputError: on all ranks alike: a law of a length where one component has a prescribed value that is not zero.
    """
    number = np.full(system.load.local_size, -1)
    number[interior.kept] = np.arange(interior.size)[interior.here]
    found = [_Term(system, term, number, prescribed) for term in system.terms]
    bonds = [b for term in found for b in term.bonds()]
    held = [b for term in found for b in term.prescribed_bonds()]
    return CondensedLaws(bonds=tuple(bonds), prescribed=tuple(held))


class _Term:
    """One law, its directions along the axes of the vertices' unknowns. Creation is collective."""

    def __init__(self, system: System, term: LawTerm, number: Integers, prescribed: Array) -> None:
        self._comm, self._term = system.comm, term
        dofs, along = term.surface.dofs, np.any(term.directions != 0.0, axis=1)
        self._unknowns, values = number[dofs], prescribed[dofs]
        self._free = along & (self._unknowns >= 0)
        constant = np.einsum("mkd,mdc->mkc", term.directions, values)
        self._components = np.count_nonzero(self._free, axis=1)
        self._arguments = constant[:, 0].T / term.stretch
        moved = np.any(constant != 0.0, axis=(1, 2)) & ((self._components > 0) | term.radial)
        if any(agree(system.comm, bool(np.any(moved)))):
            raise InputError(
                f"boundary.{term.surface.part}: a law acts on the length of a vector of which one component is "
                "prescribed and not zero; such a scene has no condensed form"
            )

    def bonds(self) -> list[Bonds]:
        """The vertices by the number of free components and whether one is an opening, of all ranks. Collective."""
        opens = self._term.length is not None and self._term.length.opens
        opening = opens & np.any((self._term.directions[:, 0] != 0.0) & self._free, axis=1)
        kinds = [(k, opens) for k in (1, 2, 3) for opens in (False, True)]
        return [b for k, opens in kinds for b in self._alike((self._components == k) & (opening == opens), k, opens)]

    def _alike(self, here: Mask, components: int, opens: bool) -> Sequence[Bonds]:
        """The vertices of one kind. Collective."""
        term, surface = self._term, self._term.surface
        unknowns, signs = self._felt(here, components, opens)
        parts = (
            unknowns,
            signs / term.stretch[here, None],
            (surface.weights * term.placed * term.stretch)[here],
            surface.points[here],
        )
        unknowns, signs, weights, points = (np.concatenate(agree(self._comm, p)) for p in parts)
        if not len(weights):
            return []
        if term.is_linear and not opens:  # the energy of a spring on a length is that of springs on its components
            weights, points = (np.repeat(part, components, axis=0) for part in (weights, points))
            unknowns, signs = unknowns.reshape(-1, 1), signs.reshape(-1, 1)
        mixity = term.mixity
        if mixity is not None and components == 1 and not opens:  # a slip alone has the energy of the second mode
            weights, mixity = weights * mixity.energy(np.ones_like(weights)), None
        found = Bonds(
            law=term.law,
            unknowns=unknowns,
            signs=signs,
            weights=weights,
            part=surface.part,
            direction=term.direction,
            points=points,
            opens=opens,
            mixity=mixity,
        )
        return [found]

    def _felt(self, here: Mask, components: int, opens: bool) -> tuple[Integers, Array]:
        """The unknowns, an opening first, and what they are multiplied by, (m, k) each."""
        term, free = self._term, self._free[here]
        unknowns = self._unknowns[here][free].reshape(-1, components)
        columns = np.swapaxes(term.directions[here], 1, 2)[free].reshape(-1, components, term.directions.shape[1])
        if term.length is None:
            return unknowns, columns[:, :, 0]
        signs = np.linalg.norm(columns * np.array(term.length.factors), axis=2)
        if not opens:
            return unknowns, signs
        signs = np.where(columns[:, :, 0] != 0.0, columns[:, :, 0] * term.length.factors[0], signs)
        order = np.argsort(columns[:, :, 0] == 0.0, axis=1, kind="stable")
        return np.take_along_axis(unknowns, order, axis=1), np.take_along_axis(signs, order, axis=1)

    def prescribed_bonds(self) -> Sequence[PrescribedBonds]:
        """The vertices where no component is free, and the energy is not always zero, of all ranks. Collective."""
        at_rest = float(self._term.law.value(np.zeros(1))[0])
        here = (self._components == 0) & (np.any(self._arguments != 0.0, axis=0) | (at_rest != 0.0))
        weights = np.concatenate(agree(self._comm, self._term.energy_weights[here]))
        arguments = np.concatenate(agree(self._comm, self._arguments[:, here]), axis=1)
        if not len(weights):
            return []
        return [PrescribedBonds(law=self._term.law, weights=weights, arguments=arguments)]


@dataclass(frozen=True)
class Carriers:
    """The vertices' unknowns, the same on all ranks.

    Attributes:
        lower: bounds, (n,).
        upper: bounds, (n,).
        shift: by how much obstacles that the factor moves have moved the bounds, which are those without, (n,).
        points: vertices, m, (n, 3).
        parts: the part whose contact bounds the unknown; empty where none does, (n,).
        carrying: numbers of those that carry a bound or a law.
    """

    lower: Array
    upper: Array
    shift: Array
    points: Array
    parts: npt.NDArray[np.object_]
    carrying: Integers

    def of(self, chosen: Integers) -> Carriers:
        """Those of some unknowns, among which are all that carry.

        Args:
            chosen: their numbers, ascending, (m,).
        """
        lower, upper, shift = (each[chosen] for each in (self.lower, self.upper, self.shift))
        carrying = np.searchsorted(chosen, self.carrying)
        return Carriers(lower, upper, shift, self.points[chosen], self.parts[chosen], carrying)


def carriers_of(system: System, interior: Interior, laws: CondensedLaws, moved: Array) -> Carriers:
    """What the kept unknowns carry. Collective.

    Args:
        system: the system.
        interior: which unknowns are kept.
        laws: on them.
        moved: by how much obstacles that the factor moves have moved the bounds, (local unknowns,).

    Raises:
        InputError: on all ranks alike: a law acts along a displacement along which an obstacle is moved.
    """
    lower, upper, shift = (interior.gathered(v) for v in (system.lower.array_r, system.upper.array_r, moved))
    bounded = np.isfinite(lower) | np.isfinite(upper)
    with_law = [b.unknowns.ravel() for b in laws.bonds]
    d = system.problem.dimension
    named = np.full(system.load.local_size, "", dtype=object)
    for bounds in system.bounds:
        named[bounds.component()[0]] = bounds.surface.part
    for bonds in laws.bonds:
        if np.any(shift[bonds.unknowns] != 0.0):  # laws act on the body's own displacement
            raise InputError(
                f"boundary.{bonds.part}: the path moves an obstacle along the displacement that this "
                "law acts on; leave the vertices that both parts share out of one of them (where)"
            )
    return Carriers(
        lower=lower - shift,
        upper=upper - shift,
        shift=shift,
        points=np.concatenate(agree(system.comm, system.problem.points[interior.kept // d])),
        parts=np.where(bounded, interior.gathered(named), ""),
        carrying=np.unique(np.concatenate([np.flatnonzero(bounded), *with_law])),
    )
