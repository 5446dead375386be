"""Warnings before a scene is solved: numbers that are not plausible, mostly for their units. Nothing is refused.

A number that is off by a factor of 1e3 or 1e6 gives a well-posed scene and a certified answer to another question. The
limits (:class:`.PlausibilityThresholds`) are therefore wide: a scene that means what it says stays within them.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from petsc4py import PETSc

from ..mesh import facets, nodes
from ..mesh.curved import CurvedMesh
from ..problem import thresholds as composition
from ..problem.contact_normals import largest_turn
from ..problem.law_term import LawTerm
from ..problem.problem import Problem
from ..rigid import Solvability, kernel
from ..runtime.mpi import largest, total
from ..system import existence
from . import scene_keys
from .thresholds import DEFAULT, PLAUSIBILITY, PlausibilityThresholds


def before_solving(
    problem: Problem, forces: Mapping[str, PETSc.Vec], thresholds: PlausibilityThresholds = PLAUSIBILITY
) -> tuple[str, ...]:
    """What there is to warn of before anything is solved, in sentences. Collective; the same on all ranks.

    Args:
        problem: as composed.
        forces: its load vectors by name, nondimensional.
        thresholds: what is plausible.
    """
    return (
        *problem.implausible,
        *_scales(problem, thresholds),
        *_uneven_parts(problem, thresholds),
        *_polygons(problem, thresholds),
        *_straightened(problem),
        *_weak_laws(problem, forces, thresholds),
    )


def of_existence(found: Solvability, thresholds: PlausibilityThresholds = PLAUSIBILITY) -> tuple[str, ...]:
    """What there is to warn of in the factor of the load that is borne, in sentences. Local; the same on all ranks.

    Args:
        found: whether a solution can exist.
        thresholds: what is plausible.
    """
    peak, far = found.lambda_peak, thresholds.far_peak
    if not (0.0 < peak < 1.0 / far or far < peak < np.inf):
        return ()
    than = "far more" if peak > 1.0 else "far less"
    return (
        f"the load may be multiplied by {peak:.1e} at most before no solution exists: the laws can carry {than} than "
        "it; are loads and the laws' tractions in N/m²?",
    )


def _scales(problem: Problem, thresholds: PlausibilityThresholds) -> Iterator[str]:
    scales, strain = problem.scales, problem.scales.stress / problem.scales.modulus
    if not thresholds.softest <= scales.modulus <= thresholds.stiffest:
        yield f"the largest Young's modulus is {scales.modulus:.3g} N/m²; is it in N/m²? (steel has 2.1e11)"
    if strain > thresholds.largest_strain:
        yield (
            f"the load (or prescribed displacement, or thermal strain) is {strain:.3g} of Young's modulus, where small "
            "strains are assumed; are loads and modulus in N/m², displacements in m?"
        )


def _uneven_parts(problem: Problem, thresholds: PlausibilityThresholds) -> Iterator[str]:
    """Contact parts that seem to be meant flat, in a mesh with few digits in its coordinates."""
    comm = problem.domain.mesh.comm
    for surface in (bounds.surface for bounds in problem.bounds):
        turn = largest_turn(comm, surface)
        if composition.DEFAULT.flat < turn < composition.DEFAULT.uneven:
            yield (
                f"{scene_keys.of_bounds(problem, surface.part)}: the part is nearly flat, its normals turn by up to "
                f"{turn:.1e} rad; this unevenness is part of the problem. If it is rounding of the mesh's coordinates, "
                "state the flat part: contact = { obstacle = { point = [...], normal = [...] } }"
            )


def _polygons(problem: Problem, thresholds: PlausibilityThresholds) -> Iterator[str]:
    """Contact parts of degree 2 whose facets seem to be those of a curve that the program does not know. Collective."""
    domain, comm = problem.domain, problem.domain.mesh.comm
    if nodes.degree(problem.space) == 1:
        return
    known = np.concatenate([np.empty(0, np.int32), *(domain.sides[name] for name in domain.curves)])
    for surface in (bounds.surface for bounds in problem.bounds):
        turns = facets.turns(domain.mesh, np.setdiff1d(surface.facets, known).astype(np.int32))
        bent = turns[(turns > thresholds.straight) & (turns < thresholds.corner)]
        if total(comm, len(bent)) > thresholds.mostly_bent * total(comm, len(turns)):
            most = np.degrees(largest(comm, float(np.max(bent, initial=0.0))))
            yield (
                f"{scene_keys.of_bounds(problem, surface.part)}: nearly all facets turn from one to the next, by up to "
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


def _weak_laws(problem: Problem, forces: Mapping[str, PETSc.Vec], thresholds: PlausibilityThresholds) -> Iterator[str]:
    comm = problem.domain.mesh.comm
    load = total(comm, sum(float(np.abs(force.array_r).sum()) for force in forces.values()))
    for term in problem.terms:
        peak = max(term.exact.peak.minus, term.exact.peak.plus)
        most = peak * total(comm, float(term.weights.sum()))
        if most < thresholds.negligible * load and not _holds(problem, forces, term, DEFAULT.near):
            unit = "N" if problem.scales.dimension == 3 else "N/m"
            yield (
                f"{scene_keys.of_law(problem, term)}: the law can carry {most * problem.scales.force:.3g} {unit} at "
                f"most, {most / load:.1e} of the load, and no rigid motion needs it: it cannot matter; are its "
                "tractions in N/m²?"
            )


def _holds(problem: Problem, forces: Mapping[str, PETSc.Vec], term: LawTerm, rounding: float) -> bool:
    """Whether a rigid motion that the supports leave works against the law. Collective."""
    comm, surface, work = problem.domain.mesh.comm, term.surface, 0.0
    for body, rigid in zip(problem.bodies, existence.rigid_problems(problem, forces), strict=True):
        basis = kernel(comm, body, rigid.fixed)
        mine = existence.inside(problem, body, surface.blocks)
        fields = problem.motions_at(surface.blocks[mine], body)
        along = np.einsum("mkd,mnd,nj->mkj", term.directions[mine], fields, basis)
        work = max(work, float(np.max(np.abs(along), initial=0.0)))
    return largest(comm, work) > rounding
