"""Warnings of numbers that are not plausible, mostly for their units: of a problem, and of its solution."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import combinations

import numpy as np
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from ..effects import Direction
from ..mesh import facets, nodes
from ..mesh.curved import CurvedMesh
from ..problem import scaling as composition
from ..problem.contact_surface import largest_turn
from ..problem.law_term import LawTerm
from ..problem.problem import Problem
from ..rigid import Solvability, kernel
from ..runtime.log import percent
from ..runtime.mpi import largest, total
from ..system import existence
from ..typing import Array, together
from .certificate import Examination
from .contact_state import ContactState, LawState
from .thresholds import DEFAULT, PLAUSIBILITY


def _key(problem: Problem, part: str, direction: Direction | None = None) -> str:
    """The key of the effect that brought a part's bounds, or its law in a direction."""
    keys = (
        effect.key
        for where, effect, contribution in problem.contributions
        if where == part
        and (any(law.direction is direction for law in contribution.laws) if direction else bool(contribution.bounds))
    )
    return f"boundary.{part}.{next(keys)}"


def _most(comm: MPI.Comm, values: Array) -> float:
    """The largest of values that are not negative, on all ranks. Collective."""
    return largest(comm, float(np.max(values, initial=0.0)))


def before_solving(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> tuple[str, ...]:
    """What there is to warn of before anything is solved, in sentences. Collective; the same on all ranks.

    Args:
        problem: as composed.
        forces: its load vectors by name, nondimensional.
    """
    return (
        *problem.implausible,
        *_scales(problem),
        *_uneven_parts(problem),
        *_polygons(problem),
        *_straightened(problem),
        *_weak_laws(problem, forces),
    )


def of_existence(found: Solvability) -> tuple[str, ...]:
    """What there is to warn of in the factor of the load that is borne, in sentences. Local; the same on all ranks.

    Args:
        found: whether a solution can exist.
    """
    peak, far = found.lambda_peak, PLAUSIBILITY.negligible**-2
    if not (0.0 < peak < 1.0 / far or far < peak < np.inf):
        return ()
    than = "far more" if peak > 1.0 else "far less"
    return (
        f"the load may be multiplied by {peak:.1e} at most before no solution exists: the laws can carry {than} than "
        "it; are loads and the laws' tractions in N/m²?",
    )


def _scales(problem: Problem) -> Iterator[str]:
    scales, strain = problem.scales, problem.scales.stress / problem.scales.modulus
    if not PLAUSIBILITY.softest <= scales.modulus <= PLAUSIBILITY.stiffest:
        yield f"the largest Young's modulus is {scales.modulus:.3g} N/m²; is it in N/m²? (steel has 2.1e11)"
    if strain > PLAUSIBILITY.large:
        yield (
            f"the load (or prescribed displacement, or thermal strain) is {strain:.3g} of Young's modulus, where small "
            "strains are assumed; are loads and modulus in N/m², displacements in m?"
        )


def _uneven_parts(problem: Problem) -> Iterator[str]:
    """Contact parts that seem to be meant flat, in a mesh with few digits in its coordinates."""
    comm = problem.comm
    for surface in (bounds.surface for bounds in problem.bounds):
        turn = largest_turn(comm, surface)
        if composition.DEFAULT.same < turn < composition.DEFAULT.uneven:
            yield (
                f"{_key(problem, surface.part)}: the part is nearly flat, its normals turn by up to "
                f"{turn:.1e} rad; this unevenness is part of the problem. If it is rounding of the mesh's coordinates, "
                "state the flat part: contact = { obstacle = { point = [...], normal = [...] } }"
            )


def _polygons(problem: Problem) -> Iterator[str]:
    """Contact parts of degree 2 whose facets seem to be those of a curve that the program does not know. Collective."""
    domain, comm = problem.domain, problem.comm
    if nodes.degree(problem.space) == 1:
        return
    known = together(domain.sides[name] for name in domain.curves)
    for surface in (bounds.surface for bounds in problem.bounds):
        turns = facets.turns(domain.mesh, np.setdiff1d(surface.facets, known).astype(np.int32))
        bent = turns[(turns > PLAUSIBILITY.straight) & (turns < PLAUSIBILITY.corner)]
        if total(comm, len(bent)) > PLAUSIBILITY.mostly_bent * total(comm, len(turns)):
            most = np.degrees(_most(comm, bent))
            yield (
                f"{_key(problem, surface.part)}: nearly all facets turn from one to the next, by up to "
                f"{most:.2g}°, as those of a curved side. They are taken for a polygon, and the pressure of degree 2 "
                "shows its corners: give a mesh file of second order (gmsh: Mesh.ElementOrder = 2), or use "
                "solver.degree = 1"
            )


def _straightened(problem: Problem) -> Iterator[str]:
    """Cells of degree 2 that are straight although the curves of their sides are known."""
    domain, mesh = problem.domain, problem.space.mesh
    if nodes.degree(problem.space) == 1 or not domain.curves:
        return
    unknown = "the error of this polygon is not estimated"
    if not domain.bends:
        yield (
            f"domain: the energy has data of the straight mesh, so all cells stay straight, and {unknown}; write them "
            "as formulas of the position"
        )
    elif isinstance(mesh, CurvedMesh) and (straight := mesh.straight_cells) > 0:
        sides = ", ".join(repr(name) for name in sorted(domain.curves))
        cells = "1 cell would turn over and stays" if straight == 1 else f"{straight} cells would turn over and stay"
        yield (
            f"domain: the mesh is too coarse for its curve ({sides}): {cells} straight, and {unknown}; use smaller "
            "cells"
        )


def _weak_laws(problem: Problem, forces: Mapping[str, PETSc.Vec]) -> Iterator[str]:
    comm = problem.comm
    load = total(comm, sum(float(np.abs(force.array_r).sum()) for force in forces.values()))
    for term in problem.terms:
        peak = max(term.exact.peak.minus, term.exact.peak.plus)
        most = peak * total(comm, float(term.weights.sum()))
        if most < PLAUSIBILITY.negligible * load and not _holds(problem, forces, term, DEFAULT.near):
            unit = "N" if problem.dimension == 3 else "N/m"
            yield (
                f"{_key(problem, term.surface.part, term.direction)}: the law can carry "
                f"{most * problem.scales.force:.3g} {unit} at most, {most / load:.1e} of the load, "
                "and no rigid motion needs it: it cannot matter; are its "
                "tractions in N/m²?"
            )


def _holds(problem: Problem, forces: Mapping[str, PETSc.Vec], term: LawTerm, rounding: float) -> bool:
    """Whether a rigid motion that the supports leave works against the law. Collective."""
    comm, surface = problem.comm, term.surface
    for body, rigid in zip(problem.bodies, existence.rigid_problems(problem, forces), strict=True):
        basis = kernel(comm, body, rigid.fixed)
        mine = existence.inside(problem, body, surface.blocks)
        fields = problem.motions_at(surface.blocks[mine], body)
        along = np.einsum("mkd,mnd,nj->mkj", term.directions[mine], fields, basis)
        if _most(comm, np.abs(along)) > rounding:
            return True
    return False


def of_solution(problem: Problem, examination: Examination, u: fem.Function) -> tuple[str, ...]:
    """What there is to warn of in a solution, in sentences. Collective; the same on all ranks.

    Args:
        problem: as composed.
        examination: its state at u.
        u: the displacement, nondimensional.
    """
    warnings = [*_strain(problem, u)]
    if examination.certificate.passed:
        size = _most(problem.comm, np.abs(u.x.array))
        warnings += _dips(problem, examination, size)
        for state in examination.states:
            warnings += _distant_obstacle(problem, state, size)
            warnings += _given_way(problem, state, size)
            for law in state.laws:
                warnings += _slip_and_kink(problem, law)
                warnings += _wide_smoothing(problem, law)
    return tuple(warnings)


def _strain(problem: Problem, u: fem.Function) -> Iterator[str]:
    """By the edges: of P1, the strain along an edge is its change of length over its length."""
    d = problem.dimension
    edges, changes = (_along_edges(problem, field) for field in (problem.points[:, :d], u.x.array.reshape(-1, d)))
    strain = problem.scales.displacement * max(
        _most(problem.comm, np.abs(np.einsum("nd,nd->n", edge, change)) / np.einsum("nd,nd->n", edge, edge))
        for edge, change in zip(edges, changes, strict=True)
    )
    if strain > PLAUSIBILITY.large:
        yield f"the largest strain is {strain:.3g}, where small strains are assumed; is the modulus in N/m²?"


def _along_edges(problem: Problem, values: Array) -> Iterator[Array]:
    """The difference of vectors (nodes, d) between the ends of each edge of the cells, (cells, d)."""
    d = problem.dimension
    corners = np.take(values, problem.space.dofmap.list[:, : d + 1], axis=0)
    for a, b in combinations(range(d + 1), 2):
        yield corners[:, b] - corners[:, a]


def _dips(problem: Problem, examination: Examination, size: float) -> Iterator[str]:
    """A penetration between the nodes that is not small."""
    dip = examination.between_nodes
    if dip is not None and dip > PLAUSIBILITY.negligible * size > 0:
        yield (
            f"between the nodes of Γc, where nothing bounds it, a body goes {dip * problem.scales.displacement:.3g} m "
            f"beyond its bound, {dip / size:.1e} of the largest displacement; a finer mesh there makes it smaller"
        )


def _distant_obstacle(problem: Problem, state: ContactState, size: float) -> Iterator[str]:
    """An obstacle that nothing comes near."""
    comm = problem.comm
    if state.bounds is None:
        return
    gap = -largest(comm, -float(np.min(state.bounds.upper, initial=np.inf)))
    if np.isfinite(gap) and PLAUSIBILITY.negligible * gap > size > 0:
        metres, displacement = (value * problem.scales.displacement for value in (gap, size))
        yield (
            f"{_key(problem, state.surface.part)}: the gap is {metres:.3g} m at least and the largest "
            f"displacement {displacement:.3g} m: it is never closed; is it in m?"
        )


def _given_way(problem: Problem, state: ContactState, size: float) -> Iterator[str]:
    """Bonds that are pressed where nothing stops penetration; a foundation that pulls where the body lifts off."""
    kinds = {law.term.direction for law in state.laws if law.term.direction.normal}
    if state.bounds is not None or len(kinds) != 1:
        return
    (kind,), off = kinds, state.normal_displacement
    text = "m, and nothing stops penetration; give contact = { gap = 0.0 } too"
    if kind is Direction.PENETRATION:
        off, text = np.where(state.pressure > 0.0, -off, 0.0), "m, and is pulled back; make the law one-sided to let go"
    most = _most(problem.comm, np.maximum(off, 0.0))
    if most > PLAUSIBILITY.negligible * size:
        way = "lifts off" if kind is Direction.PENETRATION else "is pressed in"
        metres = problem.scales.displacement * most
        yield f"{_key(problem, state.surface.part, kind)}: the side {way} by up to {metres:.3g} {text}"


def _slip_and_kink(problem: Problem, law: LawState) -> Iterator[str]:
    """A law whose kinks are of another order than what the solution does to it."""
    comm, term, far = problem.comm, law.term, 1.0 / PLAUSIBILITY.negligible
    kink, reached, weights = term.exact.length_scale, np.abs(law.argument), term.weights
    if term.exact.is_linear or np.any(term.exact.kinks == 0.0):
        return
    if term.direction in (Direction.OPENING, Direction.PENETRATION):
        reached = np.where(law.argument > 0, reached, 0.0)
    most = _most(comm, reached)
    beyond = total(comm, float(weights[reached > far * kink].sum())) / total(comm, float(weights.sum()))
    metres = problem.scales.displacement * _most(comm, term.stretch)
    what = "slip" if term.direction is Direction.SLIP else term.direction.value
    sizes = f"{most * metres:.3g} m, the law's first kink {kink * metres:.3g} m"
    if DEFAULT.near < most < kink / far:
        yield (
            f"{_key(problem, term.surface.part, term.direction)}: the largest {what} is {sizes}: "
            "the law is on its first piece everywhere; are the law's displacements in m?"
        )
    elif beyond > 1.0 - PLAUSIBILITY.large:
        yield (
            f"{_key(problem, term.surface.part, term.direction)}: the {what} is up to {sizes}: "
            "the law is far beyond it nearly everywhere; are the law's displacements in m?"
        )


def _wide_smoothing(problem: Problem, law: LawState) -> Iterator[str]:
    """A smoothing so wide that the law which is solved is another one."""
    comm, term = problem.comm, law.term
    if term.law is term.exact:
        return
    peak = max(term.exact.peak.minus, term.exact.peak.plus)
    away, weights, limit = law.true_distance(), term.weights, PLAUSIBILITY.large
    share = total(comm, float(weights[away > limit * peak].sum())) / total(comm, float(weights.sum()))
    if share > PLAUSIBILITY.large:
        most, of_peak = (_most(comm, v) for v in (away * term.multiplier, away / peak))
        yield (
            f"{_key(problem, term.surface.part, term.direction)}: smoothing changes the traction by up to "
            f"{most * problem.scales.stress:.3g} N/m² ({percent(of_peak)} of the law's peak), "
            f"and by more than {100 * limit:.0f} % on "
            f"{percent(share)} of the part; is a smaller ε meant? (epsilon_absolute is in N/m)"
        )
