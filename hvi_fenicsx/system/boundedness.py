"""Does a convex step of the branch iteration have a minimiser? Its energy along rigid motions decides, body by body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from ..laws import Superpotential
from ..laws.convex_parts import Directional
from ..problem.law_term import LawTerm
from ..problem.problem import Problem
from ..problem.thresholds import DEFAULT
from ..rigid import AnyBody, Resistance, RigidProblem, fields_at, gives_way
from ..typing import Array
from . import existence


def is_unbounded(
    problem: Problem,
    forces: Mapping[str, PETSc.Vec],
    laws: Sequence[Superpotential],
    xi: Sequence[Array],
) -> bool:
    """Whether the convex energy with H - ξ in the place of each law j = H - G has no minimiser. Collective.

    It has none where the load does more work than ∫ H^∞(y) - ξ·y along a rigid motion y that contact admits: the body
    slides away, its remaining bonds do not hold it. Work that is equal within rounding is no proof of that.

    Args:
        problem: the problem.
        forces: its load vectors by name.
        laws: what is solved, by term.
        xi: ξ at the vertices, by term, (m,) each.
    """
    comm = problem.domain.mesh.comm
    growths = [_growth(law) for law in laws]
    terms = list(zip(problem.terms, growths, xi, strict=True))
    majorants = (_majorant(problem, forces, body, terms) for body in problem.bodies)
    return any(gives_way(comm, one) for one in majorants)


def _majorant(
    problem: Problem,
    forces: Mapping[str, PETSc.Vec],
    body: AnyBody,
    terms: Sequence[tuple[LawTerm, Directional, Array]],
) -> RigidProblem:
    """The existence question of one body with H - ξ in the place of its laws, given as (term, H^∞, ξ). Collective."""
    whole = existence.rigid_problem(problem, existence.loads_of_rigid_motions(problem, forces), body)
    here = [one for one in terms if existence.acts_on(problem, body, one[0])]
    mine = [xi[existence.inside(problem, body, term.surface.blocks)] for term, _, xi in here]
    parts = list(zip(whole.resistances, here, mine, strict=True))
    works = sum((_work(body, part, term, xi) for part, (term, _, _), xi in parts), np.zeros(body.motions))
    return replace(
        whole,
        loads={**whole.loads, "ξ": problem.domain.mesh.comm.allreduce(works)},
        resistances=tuple(_majorised(part, term, growth, xi) for part, (term, growth, _), xi in parts),
    )


def _growth(law: Superpotential) -> Directional:
    """H^∞: the limits of H' on both sides."""
    ends = np.array([-1.0, 1.0]) * DEFAULT.largest_scale
    with np.errstate(over="ignore"):
        here, beyond = (law.convex.right(x) * np.sign(ends) for x in (ends, 2.0 * ends))
    minus, plus = np.where(beyond > here, np.inf, here)
    return Directional(float(minus), float(plus))


def _majorised(part: Resistance, term: LawTerm, growth: Directional, xi: Array) -> Resistance:
    """The resistance of H - ξ at infinity; for a law of |u_t|, ξ reduces the weights of the vertices.

    A vertex whose law falls below zero pushes the body on. It counts as no resistance: the functional stays convex, and
    a body that slides away in spite of it does so all the more.
    """
    if not term.radial or not np.isfinite(growth.plus) or growth.plus == 0.0:
        return replace(part, growth=growth, peak=growth)
    return replace(part, weights=part.weights * np.maximum(1.0 - xi / growth.plus, 0.0), growth=growth, peak=growth)


def _work(body: AnyBody, part: Resistance, term: LawTerm, xi: Array) -> Array:
    """∫ ξ·y over this rank's vertices for the rigid basis, (3|6,); 0 for a law of |u_t|."""
    if term.radial:
        return np.zeros(body.motions)
    fields = fields_at(part.points, body)
    return np.asarray(np.einsum("m,md,mnd->n", part.weights * xi, part.directions[:, 0, :], fields))
