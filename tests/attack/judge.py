"""The verdict on one scene: agrees, contradicts, missed or undecided, with one line that says why."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from program import Answer
from referee import programmes
from referee.assembly import Problem, assemble
from referee.coordinates import Floor
from referee.equilibria import find
from referee.meshes import Array, Mesh, block
from referee.minimality import examine, sampled_descent
from referee.solution import EPS, Check

AGREES, CONTRADICTS, MISSED, UNDECIDED = "agrees", "contradicts", "missed", "undecided"
Table = dict[str, Any]
SHARP, LOST = 1e-7, 1e-3
"""Where rounding moves tractions by less than the first a point can be judged; from the second on it says nothing."""
REFUSALS = (
    "orthogonal or equal",
    "that differ",
    "would have to be",
    "violates the contact bound",
    "solves the law without smoothing",
)
"""What is said of scenes that are drawn at random and mean nothing; every other scene is to be answered."""
SMALLEST_FACTOR = 1e-3
"""A load factor below this is not compared: beside the rest of the load its work is within our tie."""

WEDGE = 1e4
"""Where contact must carry so many times the load, displacements are its square times those of the load: no number of
double precision tells whether a solution was missed."""


@dataclass(frozen=True)
class Verdict:
    """What the referee says of one answer."""

    word: str
    why: str


def mesh_of(scene: Table, drawn: Mesh | None) -> Mesh:
    """The mesh of a scene, our own."""
    return block(scene["domain"]["size"], scene["domain"]["cells"]) if drawn is None else drawn


def displacement(mesh: Mesh, answer: Answer) -> Array | None:
    """The program's displacement in the order of our vertices; None if the vertices differ."""
    assert answer.points is not None
    assert answer.u is not None
    if len(mesh.points) != len(answer.points):
        return None
    scale = mesh.size
    keys = [np.lexsort(np.round(p / scale, 9).T) for p in (mesh.points, answer.points)]
    if np.abs(mesh.points[keys[0]] - answer.points[keys[1]]).max() > 1e-9 * scale:
        from scipy.spatial import cKDTree

        distance, index = cKDTree(answer.points).query(mesh.points)
        return answer.u[index] if distance.max() < 1e-9 * scale and len(set(index)) == len(index) else None
    u = np.empty_like(answer.u)
    u[keys[0]] = answer.u[keys[1]]
    return u


def judge(scene: Table, drawn: Mesh | None, answer: Answer, seed: int = 0) -> Verdict:
    """Compare an answer with what the referee finds."""
    if answer.code == 2:
        asked = any(words in answer.text for words in REFUSALS)
        return Verdict(UNDECIDED if asked else CONTRADICTS, f"refused: {answer.text[:160]}")
    if answer.code == 130:
        return Verdict(UNDECIDED, "took too long")
    if answer.code == 1:
        return Verdict(CONTRADICTS, f"broke down: {answer.text[:200]}")
    mesh = mesh_of(scene, drawn)
    problem = assemble(scene, mesh)
    if not problem.stress.any() and not Check(problem, np.zeros_like(mesh.points)).wrongs():
        word = AGREES if answer.code == 0 else CONTRADICTS
        return Verdict(word, "nothing drives, so u = 0 is a solution")
    truth = programmes.verdict(problem)
    if answer.state == "undecided" and truth.state != "unclear":
        return Verdict(MISSED, f"whether a solution exists was left undecided, in truth {truth.state}")
    wrong, missed = _existence(problem, truth, answer), list[str]()
    if answer.code == 0:
        more, note = _solution(problem, answer, seed)
        wrong += more
    elif answer.code == 4:
        missed, note = _unsolved(problem, truth, answer, seed, scene["solver"].get("method", "auto"))
    else:
        note = "no solution exists"
    if wrong or missed:
        return Verdict(CONTRADICTS if wrong else MISSED, "; ".join(wrong + missed))
    sure = truth.state != "unclear" or answer.code == 0
    return Verdict(UNDECIDED if note.startswith("?") or not sure else AGREES, f"{truth.state}: {note}")


def _existence(problem: Problem, truth: programmes.Verdict, answer: Answer) -> list[str]:
    """State, load factors, and the paper's conditions."""
    found = []
    tie = "" if answer.margin is None else f", margin {answer.margin:.1e}"
    allowed = {"unclear": ("held", "borderline", "metastable", "escapes", "undecided")}
    tied = answer.state == "borderline" and np.nanmin(np.abs([truth.growth, truth.peak])) < truth.equal
    if answer.state not in allowed.get(truth.state, (truth.state,)) and not tied:
        found.append(f"state {answer.state}{tie}, in truth {truth.state} ({truth.growth:.2e}, {truth.peak:.2e})")
    sure = truth.state in ("held", "metastable") and abs(truth.growth) > max(programmes.TIE, truth.equal)
    if answer.margin is not None and sure and (answer.margin > 0) != (truth.growth > 0):
        found.append(f"margin {answer.margin:.2e}, in truth {truth.growth:.2e}")
    if answer.paper and truth.state in ("metastable", "escapes"):
        found.append(f"paper's condition satisfied, but {truth.state}")
    held, peak = answer.factors
    if np.isfinite(held) and held > SMALLEST_FACTOR:
        inside = programmes.verdict(problem, held * (1 - 1e-4))
        if inside.state in ("metastable", "escapes"):
            found.append(f"held up to {held:.4g} times the load, but {inside.state} just below")
        outside = programmes.verdict(problem, held * (1 + 1e-4))
        if outside.state == "held":
            found.append(f"held up to {held:.4g} times the load, but held beyond")
    if np.isfinite(peak) and peak > SMALLEST_FACTOR and not _may_escape(problem, peak * (1 + 1e-3)):
        found.append(f"peak at {peak:.4g} times the load, but no escape beyond")
    return found


def _may_escape(problem: Problem, factor: float) -> bool:
    """Whether some body escapes, or may by a tie, be the others held or metastable."""
    states = [programmes.Body(problem, label, factor).verdict().state for label in range(problem.bodies)]
    return not {"escapes", "unclear"}.isdisjoint(states)


def _solution(problem: Problem, answer: Answer, seed: int) -> tuple[list[str], str]:
    """A certified solution: inequality, energy, second order."""
    u = displacement(problem.mesh, answer)
    if u is None:
        return [], "? vertices differ"
    check = Check(problem, u)
    found = check.wrongs()
    if found:
        return ["certified, but " + "; ".join(found)], ""
    found += _energy(problem, u, answer)
    assert answer.certificate is not None
    said = answer.certificate["second_order"]
    floor = Floor(problem)
    if said == "undecided":
        return found, "solution right, second order left open"
    seen = examine(check, floor)
    if seen.minimiser is False and said == "local minimiser":
        found.append(f"called a local minimiser, but {seen.why}")
    elif seen.minimiser is True and said == "not a minimiser":
        found.append(f"called no minimiser, but {seen.why}")
    elif said == "local minimiser" and seen.why not in ("not looked at", "the inside is not held"):
        lowest = sampled_descent(check, floor, np.random.default_rng(seed))
        if lowest < -1e-4:
            found.append(f"called a local minimiser, but sampling descends by {lowest:.1e}")
    return found, f"solution right, {said}"


def _energy(problem: Problem, u: Array, answer: Answer) -> list[str]:
    ours, flat = problem.energy(u), u.ravel()
    size = float(np.abs(flat) @ (abs(problem.matrix) @ np.abs(flat)) + np.abs(problem.force) @ np.abs(flat))
    elastic = float(flat @ (problem.matrix @ flat))
    off = abs(ours - answer.energy)
    if off > 1e-6 * (abs(ours) + elastic) + 1e-13 * size:
        return [f"energy {answer.energy:.9g}, ours {ours:.9g}"]
    return []


def _unsolved(
    problem: Problem, truth: programmes.Verdict, answer: Answer, seed: int, method: str
) -> tuple[list[str], str]:
    """Exit code 4: is there a solution? It says that none was found, so nothing false is said where one exists."""
    if method not in ("auto", "branch"):
        return [], f"? not solved by {method}, which is there for comparison"
    u = displacement(problem.mesh, answer)
    check = None if u is None else Check(problem, u, SHARP)
    if check and blurred(check):
        return [], f"? rounding moves the tractions by {check.blur:.0e}"
    if check and check.blur <= SHARP and not check.wrongs():
        return [f"{truth.state}, exit 4, but its own point is a solution ({answer.text[:100]}{_failed(answer)})"], ""
    far = _far(problem)
    if far > 1e-6:
        return [], f"? over the distance to its supports rounding moves the tractions by {far:.0e}"
    wedge = max(programmes.Body(problem, label).amplification() for label in range(problem.bodies))
    if wedge > WEDGE:
        return [], f"? contact must carry {wedge:.0e} times the load"
    if truth.state == "held":
        why = "C = {0}" if np.isinf(truth.growth) else f"margin {truth.growth:.2e}"
        return [f"held ({why}), so a solution exists, and none was found: {answer.text[:100]}{_failed(answer)}"], ""
    seen = find(problem, np.random.default_rng(seed))
    if seen is not None:
        return [f"{truth.state}, exit 4, and there is a solution: {seen} ({answer.text[:100]}{_failed(answer)})"], ""
    return [], "? no solution found by either"


def blurred(check: Check) -> bool:
    """Whether a point is a solution up to what rounding alone does: 50 eps (|A| |u| + |b|) at each vertex.

    Twice this bound is allowed: the program's forces have it, and ours.
    """
    return SHARP < check.blur < LOST and not Check(check.problem, check.u, 2.0 * check.blur).wrongs()


def _far(problem: Problem) -> float:
    """What the rounding of a displacement as large as the gaps makes of the tractions of some body."""
    worst = 0.0
    for b in problem.bounds:
        label = problem.labels[b.vertex]
        gaps = [abs(end) for end in (b.lower, b.upper) if np.isfinite(end)]
        if gaps and problem.stress[label] > 0:
            lost = EPS * problem.modulus * max(gaps) / problem.mesh.size
            worst = max(worst, 50.0 * lost / problem.stress[label])
    return float(worst)


def _failed(answer: Answer) -> str:
    """The certificate's entries above its tolerance."""
    entries = answer.certificate or {}
    limit = float(entries.get("tolerance", 1e-8))
    names = ("equilibrium", "penetration", "tension", "complementarity", "inclusion")
    return "".join(f", {n} {entries[n]:.1e}" for n in names if n in entries and not entries[n] <= limit)
