"""Does a solution exist, was one found, and how far is the load from its limit: in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from ...errors import ExitCode
from ..reader import Result
from ..units import number, percent

_STATES = {
    "held": "The load is held: along every rigid motion that supports and contact leave, the lasting (residual) "
    "resistance is larger than what the load does. A solution exists.",
    "borderline": "Borderline: load and resistance are in balance along a rigid motion, to within rounding. The "
    "slightest change of the load decides.",
    "metastable": "Metastable: along a rigid motion the load exceeds the lasting (residual) resistance, but not the "
    "largest one (the peak). The body can be in equilibrium only as long as its bonds are unbroken; a disturbance may "
    "carry it away.",
    "escapes": "No solution exists: along a rigid motion the load exceeds the largest resistance that contact and laws "
    "can give. The body is carried away.",
    "undecided": "Undecided: whether a solution exists could not be computed, as happens where sizes or loads lie so "
    "far apart that rounding hides the smaller ones. What the certificate says below holds all the same.",
}


def headline(result: Result) -> dict[str, str]:
    """The answer in one line, and whether it is good news: ``good``, ``limited`` or ``bad``."""
    code, state = result.summary.get("exit_code"), result.solvability.get("state")
    if result.certified and result.coarse:
        return {"kind": "limited", "words": f"Certified on a coarse mesh: {_rough(result)}."}
    if result.certified and state == "held":
        return {"kind": "good", "words": "A solution exists, was found, and is certified."}
    if result.certified:
        return {"kind": "limited", "words": f"An equilibrium was found and is certified; the state is {state}."}
    if not result.solved:
        return {"kind": "bad", "words": "No solution exists: the load carries the body away."}
    if code == ExitCode.INTERRUPTED:
        return {"kind": "bad", "words": "The run was interrupted: what is shown is not a solution."}
    off = " The body is carried off; `hvi path` finds the last state that is borne." if result.carried_off else ""
    return {"kind": "bad", "words": f"No certified solution: {result.summary.get('reason')}.{off}"}


def _rough(result: Result) -> str:
    """The mesh's error in words."""
    found = result.summary["estimate"]
    norm, part = found.get("energy_norm"), found.get("discretisation")
    size = f"{percent(part / norm)} of the solution" if norm and part is not None else "as large as the solution"
    return (
        f"the estimated error is {size}, so its numbers are rough; refine the mesh, or ask `hvi run` for an --accuracy"
    )


def existence(result: Result) -> Iterator[str]:
    """State, rigid motions, margin and load factors in words."""
    found = result.solvability
    yield _STATES.get(str(found.get("state")), f"State: {found.get('state')}.")
    kernel = found.get("kernel") or []
    yield (
        f"Rigid motions that the supports leave: {'; '.join(kernel)}."
        if kernel
        else "The supports leave no rigid motion: the body is held whatever the load."
    )
    if found.get("direction"):
        yield f"The critical motion: {found['direction']}."
    yield from _free(found)
    yield from _margin(found)
    if kernel:
        yield from _factors(found)
    yield from _paper(found)


def _free(found: Mapping[str, Any]) -> Iterator[str]:
    if found.get("free"):
        yield f"Nothing resists, and the load does not drive: {'; '.join(found['free'])}."


def _margin(found: Mapping[str, Any]) -> Iterator[str]:
    margin = found.get("margin")
    if margin is not None:
        sense = "is left over" if margin > 0 else "is lacking" if margin < 0 else "and load balance"
        unit = "resistance minus load along the worst motion of unit size, nondimensional"
        yield f"Margin {number(margin, 3)} ({unit}): resistance {sense}."


def _factors(found: Mapping[str, Any]) -> Iterator[str]:
    held, peak = found.get("lambda_held"), found.get("lambda_peak")
    if held is None and peak is None and found.get("state") == "held":
        yield "Load factors: however much the whole load grows, it does not carry the body away as a rigid whole."
    if held == 0 and peak == 0:
        yield "Load factors: made larger or smaller as a whole, the load carries the body away."
        return
    if found.get("never_held"):
        yield "Load factors: laws drive the body, and made larger or smaller as a whole the load does not hold it."
    if (start := found.get("held_from")) is not None and start > 0 and not found.get("never_held"):
        yield f"Laws drive the body; the load holds it from {_times(start)} the given load on."
    if held is not None:
        yield f"Load factor of safety against residual strength: the body is held up to {_times(held)} the given load."
    if peak is not None:
        yield (
            f"Load factor of peak strength: beyond {_times(peak)} the given load no equilibrium can exist. This is an "
            "upper bound: an elastic body gives way before it."
        )


def _paper(found: Mapping[str, Any]) -> Iterator[str]:
    paper = found.get("paper")
    if paper is not None and paper.get("satisfied") is not None:
        yield (
            f"The sufficient condition of Ovcharova and Gwinner (A2s) is {'' if paper.get('satisfied') else 'not '}"
            f"satisfied (constant c = {number(paper['c'], 3)})."
        )


def _times(factor: float) -> str:
    return f"{factor:.4g} times"
