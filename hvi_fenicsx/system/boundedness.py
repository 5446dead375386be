"""Does a convex step of the branch iteration have a minimiser? The rigid motions of its majorant tell, body by body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from petsc4py import PETSc

from ..laws import Superpotential
from ..laws.convex_parts import Directional
from ..problem.law_term import LawTerm
from ..problem.problem import Problem
from ..rigid import Resistance, RigidBody, RigidProblem, analyse, rigid_fields
from ..typing import Array
from . import existence

_INFINITE, _UNBOUNDED = 1e100, 1e30
"""A displacement beyond all scales, and a traction there that grows without bound."""


def slides(
    problem: Problem, forces: Mapping[str, PETSc.Vec], laws: Sequence[Superpotential], xi: Sequence[Array]
) -> bool:
    """Whether the convex energy with H - ξ in the place of each law j = H - G has no minimiser. Collective.

    That is so when the load works more than ∫ H^∞(y) - ξ·y along a rigid motion y that contact admits: a body slides
    away on what is left of its bonds. A balance within rounding is no proof of it.

    Args:
        problem, forces: as for :func:`.existence.solvability`. laws: what is solved, by term. xi: ξ by term, each (m,).
    """
    comm, terms = problem.domain.mesh.comm, list(zip(problem.terms, laws, xi, strict=True))
    majorants = (_majorant(problem, forces, body, terms) for body in problem.bodies)
    return any(analyse(comm, one).state in ("metastable", "escapes") for one in majorants)


def _majorant(
    problem: Problem,
    forces: Mapping[str, PETSc.Vec],
    body: RigidBody,
    terms: Sequence[tuple[LawTerm, Superpotential, Array]],
) -> RigidProblem:
    """The existence question of one body with H - ξ in the place of its laws. Collective."""
    whole = existence.of_body(problem, existence.felt(problem, forces), body)
    here = [one for one in terms if existence.touches(problem, body, one[0])]
    mine = [xi[existence.inside(problem, body, term.surface.blocks)] for term, _, xi in here]
    parts = list(zip(whole.resistances, here, mine, strict=True))
    borne = sum((_borne(body, part, term, xi) for part, (term, _, _), xi in parts), np.zeros(body.motions))
    return replace(
        whole,
        loads={**whole.loads, "ξ": problem.domain.mesh.comm.allreduce(borne)},
        resistances=tuple(_majorised(part, term, _directional(law), xi) for part, (term, law, _), xi in parts),
    )


def _directional(law: Superpotential) -> Directional:
    """H^∞: the limits of H' on both sides."""
    ends = np.array([-_INFINITE, _INFINITE])
    with np.errstate(over="ignore"):
        minus, plus = law.convex.right(ends) * np.sign(ends)
    return Directional(*(float(t) if t < _UNBOUNDED else np.inf for t in (minus, plus)))


def _majorised(part: Resistance, term: LawTerm, growth: Directional, xi: Array) -> Resistance:
    """The resistance of H - ξ at infinity; of a law of |u_t| what ξ takes off is a share of it, vertex by vertex."""
    if not term.radial or not np.isfinite(growth.plus) or growth.plus == 0.0:
        return replace(part, growth=growth, peak=growth)
    return replace(part, weights=part.weights * (1.0 - xi / growth.plus), growth=growth, peak=growth)


def _borne(body: RigidBody, part: Resistance, term: LawTerm, xi: Array) -> Array:
    """∫ ξ·y of this rank's vertices on the rigid basis (3|6,), for a law of a signed slip."""
    if term.radial:
        return np.zeros(body.motions)
    fields = rigid_fields(part.points, body)
    return np.asarray(np.einsum("m,md,mnd->n", part.weights * xi, part.directions[:, 0, :], fields))
