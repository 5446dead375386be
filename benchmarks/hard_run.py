"""One case with one method: solved, certified, recorded. Imports dolfinx, so only workers import it."""

from __future__ import annotations

import gc
import inspect
import time
import traceback
from collections.abc import Callable, Mapping
from dataclasses import asdict
from typing import Any

import hard_scenes
import petsc_methods  # noqa: F401  (tao and ssls are known then)
from covering import Case
from dolfinx import fem
from mpi4py import MPI
from petsc4py import PETSc

from hvi_fenicsx.certify.certificate import Examination
from hvi_fenicsx.errors import HviError
from hvi_fenicsx.load_paths.following import PathRun
from hvi_fenicsx.model import PathTable
from hvi_fenicsx.solvers import SolveContext, SolveResult, method, quadratic
from hvi_fenicsx.workflow import Preparation, finish
from hvi_fenicsx.workflow.solving import examine

COMM = MPI.COMM_WORLD
UNDECIDED = ("metastable", "borderline")
Record = dict[str, Any]


def methods() -> list[str]:
    """All methods there are, and PETSc's own, which the plugin adds."""
    return list(method.available())


def attempt(case: Case, data: Mapping[str, Any], method: str, limit: float) -> Record:
    """The outcome of a case: certified, escapes, no_equilibrium, or failed. Collective."""
    begin, used = time.monotonic(), time.process_time()
    try:
        record = _attempt(case, data, method, lambda: _late(used, limit))
    except Exception as error:
        # After an unforeseen error of one rank the others would wait: only errors of all ranks are recorded.
        if COMM.size > 1 and not isinstance(error, HviError):
            traceback.print_exc()
            COMM.Abort(1)
        record = {"outcome": "failed", "reason": f"{type(error).__name__}: {error}"}
    gc.collect()
    PETSc.garbage_cleanup(COMM)
    return {**record, "seconds": time.monotonic() - begin, "cpu": time.process_time() - used}


def _late(begin: float, limit: float) -> bool:
    """By processor time: what else the machine does must not decide whether a case is solved."""
    return bool(COMM.allreduce(time.process_time() - begin > limit, op=MPI.LOR))


def _attempt(case: Case, data: Mapping[str, Any], method: str, late: Callable[[], bool]) -> Record:
    prepared = hard_scenes.prepare(case, data, method, COMM)
    known = prepared.solvability
    about = {"state": known.state, "margin": known.margin, "dofs": prepared.system.dofs}
    answer = _followed if case["question"] == "path" else _equilibrium
    return about | answer(case, data, prepared, late)


def _followed(case: Case, data: Mapping[str, Any], prepared: Preparation, late: Callable[[], bool]) -> Record:
    """The path to the whole load: each row certified, and its end as existence says, where that is decided."""
    state = prepared.solvability.state
    path = PathRun(prepared, PathTable()).follow(interrupted=late)
    wanted = {"held": ("reached",), "escapes": ("escapes",)}.get(state, ("reached", "escapes"))
    about = {"rows": len(path.rows), "end": path.end, "uncertified": path.uncertified}
    if path.end not in wanted:
        return {**about, "outcome": "failed", "reason": "time limit" if path.end == "interrupted" else path.reason}
    outcome = "failed" if path.uncertified else "certified"
    return {**about, "outcome": outcome, "reason": f"{path.uncertified} rows are not certified" * (outcome == "failed")}


def _equilibrium(case: Case, data: Mapping[str, Any], prepared: Preparation, late: Callable[[], bool]) -> Record:
    """The equilibrium at the whole load."""
    known = prepared.solvability
    if known.state == "escapes":
        return {"outcome": "escapes", "reason": "no solution exists"}
    found, proof = _judged(case, data, prepared, late)
    outcome = "certified" if proof.certificate.passed else _unsolved(known.state, found)
    return {
        "outcome": outcome,
        "reason": "time limit" if found.interrupted else found.reason,
        "newton": found.counts.newton,
        "linear": found.counts.linear,
        "branch": found.counts.branch,
        "claimed": found.converged,
        "energy": proof.energy,
        "certificate": asdict(proof.certificate),
    }


def _judged(
    case: Case, data: Mapping[str, Any], prepared: Preparation, late: Callable[[], bool]
) -> tuple[SolveResult, Examination]:
    """A result and its certificate: as of ``hvi run``, but where a method or its start is looked at by itself."""
    if prepared.options.method == "auto" and case["start"] == "default":
        solution = finish(prepared, interrupted=late, estimating=False)
        assert solution.solve_result is not None
        assert solution.examination is not None
        return solution.solve_result, solution.examination
    found = _solved(case, data, prepared, late)
    return found, examine(prepared, prepared.problem, found.u)


def _unsolved(state: str, found: SolveResult) -> str:
    """What has neither a proof of existence nor of the opposite may end without.

    A raised energy may not, nor no time, nor a solution that the method claims and the certificate refuses.
    """
    broken = found.interrupted or found.converged or "raised the energy" in found.reason
    return "no_equilibrium" if state in UNDECIDED and not broken else "failed"


def _solved(case: Case, data: Mapping[str, Any], prepared: Preparation, late: Callable[[], bool]) -> SolveResult:
    """The method's result; the case's start is for the methods that begin on pieces of the laws."""
    context = SolveContext.create(prepared.task(interrupted=late), prepared.system)
    method = quadratic.choose(prepared.options, prepared.system)(context)
    begin = hard_scenes.branches(case, prepared, data)
    takes = "branches" in inspect.signature(method.solve).parameters
    try:
        return method.solve(branches=begin) if takes else method.solve()  # type: ignore[call-arg]
    except HviError as error:
        u = fem.Function(prepared.problem.space)
        return SolveResult(u=u, method=method.label, converged=False, reason=str(error))
