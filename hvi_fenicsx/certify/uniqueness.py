"""Is it the only equilibrium? What convexity of the energy proves, at the cost of one factorisation at most.

Where no law drops, let c bound how steeply each falls: w (j + ½ c x²) is convex, also on a length, and the energy is
convex if the stiffness A less C, the sum of c w over the laws' vertices, is positive semidefinite. By Sylvester's law
its negative pivots decide. Every equilibrium is then one of lowest energy, and two of them differ by a rigid motion
that the supports leave. There is no other one where such motions meet a component in which the energy grows to first
order in each direction (a pressed contact, a kink that is not used up), or a law that is a spring.

Where laws drop, the state itself may tell: no displacement has a lower energy if the stiffness outweighs by how much
the laws' energies are below their tangents there.

Where a force F presses an obstacle, E - F way takes the place of the energy E of the body, and contact bounds u·n by
the way: what is convex stays so, and E(v) >= E(u) + E'(u)(v - u) gives E(v) - F way_v >= E(u) - F way_u, as contact
bears F. So the lowest state is that at all positions of the obstacle. The only one is, too, where the body has no rigid
motions: contact that bears F tells the obstacle's position. With rigid motions it is told for the position found.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from dolfinx import fem
from petsc4py import PETSc

from ..laws.traction_graph import Arc
from ..problem import references
from ..problem.law_term import LawTerm
from ..rigid import Mode
from ..runtime.mpi import agree, largest, total
from ..system import existence, rigid_motions
from ..system.system import System
from ..typing import Array, Integers, magnitude
from .certificate import Examination
from .contact_state import LawState
from .second_order import growth, negative_eigenvalues, on_places
from .thresholds import DEFAULT, UNIQUENESS


def needed_falls(state: LawState) -> Array | None:
    """The least c at each vertex, infinite where there is none, (m,); None where the traction is no polyline.

    Args:
        state: of a law at a certified displacement.
    """
    graph = state.term.law.graph
    if graph is None or state.term.mixity is not None:
        return None
    low, high = state.term.law.interval(state.argument, state.near)
    traction = np.clip(state.traction, low, high)
    x = on_places(state.argument, graph.breaks, state.near)
    falls: Array = np.zeros(len(x))
    energy, rounding = graph.primitive(x), DEFAULT.near * state.scale
    for arc in (a for a in (Arc(*map(float, row)) for row in graph.table) if not state.term.radial or a.low >= 0.0):
        falls = np.maximum(falls, _needed(arc, x, energy, traction, rounding))
    falls[falls <= DEFAULT.near * magnitude(graph.slopes)] = 0.0
    falls /= state.term.stretch
    if state.term.radial:
        return np.where(state.hidden | (traction < 0.0), np.inf, falls)
    return np.where(state.hidden, 0.0, falls)


def _needed(arc: Arc, x: Array, energy: Array, traction: Array, rounding: Array) -> Array:
    """The least c for all y of a piece, (m,).

    Args:
        arc: the piece.
        x: where the parabola touches the law, (m,).
        energy: of the law there, (m,).
        traction: there, (m,).
        rounding: differences of tractions that are none, (m,).
    """
    above, steeper = arc.at(x) - energy, arc.rate(x) - traction
    inside = (x >= arc.low) & (x <= arc.high)
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = 1.0 / (arc.low - x), 1.0 / (arc.high - x)  # c(y) = -(2 a w² + 2 b w + slope), w being 1/(y - x)
        turn = np.clip(np.where(above > 0.0, -0.5 * steeper / above, ends[0]), np.minimum(*ends), np.maximum(*ends))
        tractions = [(w, above * w + steeper) for w in (*ends, turn)]
        found = [-2.0 * np.where(np.abs(t) <= rounding, 0.0, t) * w - arc.slope for w, t in tractions]
        ahead = arc.high - x > x - arc.low
        pull, near = np.where(ahead, steeper, -steeper), np.where(ahead, *np.abs(ends[::-1]))
        beside = np.where(pull < -rounding, np.inf, -2.0 * np.maximum(pull, 0.0) * near - arc.slope)
    return np.where(inside, beside, np.max(found, axis=0))


WAY_OUT = "`hvi equilibria SCENE --lowest` finds out"


@dataclass(frozen=True, kw_only=True)
class Uniqueness:
    """What is known about other equilibria.

    Attributes:
        state: ``unique``: there is no other; ``lowest``: none has a lower energy; ``unknown``.
        why: the proof, or what stands in its way.
    """

    state: Literal["unique", "lowest", "unknown"]
    why: str


def is_convex(system: System) -> bool:
    """Whether the energy is known to be convex; the laws' tangents of the system are set to 0. Collective.

    Args:
        system: the system.
    """
    return _doubt(system, _motions(system)) is None


def uniqueness(system: System, u: fem.Function, examination: Examination) -> Uniqueness:
    """What is known about equilibria beside a certified one; the laws' tangents of the system are set to 0. Collective.

    Args:
        system: the system that was solved.
        u: its solution, nondimensional, ghosts updated.
        examination: of u.
    """
    motions = _motions(system)
    doubt, pressed = _doubt(system, motions), any(b.force is not None for b in system.bounds)
    everywhere = "; at every position of the obstacle" if pressed else ""
    if doubt is not None:
        supported = _supported(system, motions, examination)
        if supported is not None:
            why = f"{supported} ({doubt}, so there may be other equilibria){everywhere}"
            return Uniqueness(state="lowest", why=why)
        searched = all(term.mixity is None for term in system.terms) and not pressed
        return Uniqueness(state="unknown", why=f"{doubt}; {WAY_OUT}" if searched else doubt)
    falling = any(term.law.steepest_fall > 0.0 for term in system.terms)
    proof = "the body is stiffer than its laws fall, so the energy is convex" if falling else "the energy is convex"
    left = _left(system, motions, u, examination)
    if not left:
        here = "; with the obstacle where it is" if pressed and motions else everywhere
        return Uniqueness(state="unique", why=f"{proof}, and no rigid motion leaves it as it is{here}")
    together = ", or by motions together with the obstacle" if pressed else ""
    return Uniqueness(state="lowest", why=f"{proof}; others of the same energy may differ by: {left}{together}")


Motions = Sequence[tuple[Mode, PETSc.Vec]]
"""Rigid motions that the supports leave, and what they are in the unknowns."""


def _motions(system: System) -> Motions:
    """The rigid motions that the supports leave. Collective."""
    modes = existence.motions(system.problem, contact_closed=False)
    fields = rigid_motions.fields(system.problem, modes)
    return [(mode, system.unknowns(field)) for mode, field in zip(modes, fields, strict=True)]


def _doubt(system: System, motions: Motions) -> str | None:
    """Why the energy is not known to be convex; None where it is. Collective."""
    falls = [_fall(term) for term in system.terms]
    for term, fall in zip(system.terms, falls, strict=True):
        if not np.isfinite(fall):
            return f"boundary.{term.surface.part}: {_steepness(term)}"
    if not any(falls):
        return None
    if not _is_tried(system):
        return (
            f"a law falls, and it was not tried whether the body is stiffer: more than {UNIQUENESS.most_on_boundary} "
            f"unknowns on Γc, or {UNIQUENESS.most_unknowns[system.problem.dimension - 2]:,} in all"
        )
    each = [fall / term.stretch for term, fall in zip(system.terms, falls, strict=True)]
    if (moved := _moved(system, motions, each)) is not None:
        return f"a law falls, and only laws and contact hold the motion {moved}"
    return None if _stiffer(system, motions, each) else "a law falls more steeply than the body is stiff"


def _supported(system: System, motions: Motions, examination: Examination) -> str | None:
    """Why no displacement has a lower energy, be the energy convex or not; None where this is not known. Collective."""
    laws = {id(law.term): law for state in examination.states for law in state.laws}
    falls = [needed_falls(laws[id(term)]) for term in system.problem.terms]
    known = [fall for fall in falls if fall is not None]
    if len(known) < len(falls) or not np.isfinite(most := largest(system.comm, _size(known))):
        return None
    if most == 0.0:
        return "no law's energy is anywhere below its tangent at this state"
    if not _is_tried(system) or _moved(system, motions, known) is not None:
        return None
    return (
        "the body is stiffer than the laws' energies fall below their tangents at this state"
        if _stiffer(system, motions, known)
        else None
    )


def _is_tried(system: System) -> bool:
    """Whether the problem is small enough for a factorisation. Collective."""
    unknowns = int(total(system.comm, float(len(system.jacobian.rows.dofs))))
    most = UNIQUENESS.most_unknowns[system.problem.dimension - 2]
    return unknowns <= UNIQUENESS.most_on_boundary and system.dofs <= most


def _moved(system: System, motions: Motions, falls: Sequence[Array]) -> str | None:
    """A rigid motion that moves a vertex whose law falls; None if there is none. Collective."""
    for mode, motion in motions:
        falling = [term.slip(motion.array_r)[fall > 0.0] for term, fall in zip(system.terms, falls, strict=True)]
        if largest(system.comm, _size(falling)) > DEFAULT.near:
            return mode.name
    return None


def _fall(term: LawTerm) -> float:
    """A bound of how steeply a law falls; inf where a law of a length has a slope at 0 that points inwards, or none."""
    if term.mixity is not None:
        return np.inf
    inwards = term.radial and bool(term.law.right(np.zeros(1))[0] < 0.0)
    return np.inf if inwards else float(term.law.steepest_fall)


def _steepness(term: LawTerm) -> str:
    """Why there is no bound of how steeply a law falls."""
    if term.mixity is not None:
        return "the energy of separation depends on the mode, and the law has no potential"
    if term.law.concave.kinks.size:
        return "the law's traction drops"
    return "how steeply the law's traction falls is not known"


def _size(values: Sequence[Array]) -> float:
    return max((magnitude(v) for v in values), default=0.0)


def _stiffer(system: System, motions: Motions, falls: Sequence[Array]) -> bool:
    """Whether A less C, a little enlarged, is positive but for the motions, which C does not feel. Collective."""
    pins: Integers = np.empty(0, np.int64)
    if motions:
        made = rigid_motions.create([motion.copy() for _, motion in motions], [mode for mode, _ in motions])
        pins = made.pins.astype(np.int64)
    enlarged = 1.0 + UNIQUENESS.enlarged
    system.jacobian.set_rates([_rate(t, -enlarged * c) for t, c in zip(system.terms, falls, strict=True)])
    with negative_eigenvalues(system) as negative:
        count = negative(pins)
    system.jacobian.clear()
    return count == 0


def _rate(term: LawTerm, slope: Array) -> Array:
    """The tangent of a law with given slopes by displacements wherever it is, (m,); (m, d, d)."""
    factors = np.ones(1) if term.length is None else np.array(term.length.factors)
    full = np.einsum("m,k,mka,mkb->mab", slope, factors**2, term.directions, term.directions)
    return term.free[:, :, None] * full * term.free[:, None, :]


def _left(system: System, motions: Motions, u: fem.Function, examination: Examination) -> str:
    """The rigid motions if some of them, together, are not shown to raise the energy; else nothing. Collective."""
    if not motions:
        return ""
    problem, certificate = system.problem, examination.certificate
    allowed = max(certificate.tolerance, certificate.rounding or 0.0)
    known = references.of(problem, examination.forces.load)
    strong = growth(known, problem.relative(u.x.array), examination.forces.reaction, allowed).strong
    springs = [term for term in system.terms if term.is_linear]
    moved = [motion.array_r for _, motion in motions]
    rows = [np.concatenate([m[strong], *(term.slip(m).ravel() for term in springs)]) for m in moved]
    gram = sum(agree(system.comm, np.array([[a @ b for a in rows] for b in rows])))
    held = np.linalg.eigvalsh(gram)[0] > DEFAULT.near  # what is tied moves by rounding alone
    return "" if held else ", ".join(mode.name for mode, _ in motions)
