"""Runs the program on a scene file and hands back plain arrays: the only module of the attack that imports it."""

from __future__ import annotations

import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from referee.meshes import Array


@dataclass(frozen=True)
class Answer:
    """What the program says.

    Attributes:
        code: exit code.
        text: reason, or the message of an error.
        state: of existence.
        factors: λ_held and λ_peak.
        paper: whether it says that the paper's conditions hold.
        certificate: its entries.
        energy: J/m or J.
        points: vertices, (n, d).
        u: displacement, m, (n, d).
        seconds: processor time that it took.
        margin: of existence.
    """

    code: int
    text: str
    state: str = ""
    factors: tuple[float, float] = (np.inf, np.inf)
    paper: bool = False
    certificate: dict[str, Any] | None = None
    energy: float = np.nan
    points: Array | None = None
    u: Array | None = None
    seconds: float = 0.0
    margin: float | None = None


def run(scene_file: Path, limit: float = 60.0) -> Answer:
    """Solve a scene file in this process, with at most so many seconds of processor time for the solve."""
    from hvi_fenicsx import read_scene
    from hvi_fenicsx.errors import InputError, Interrupted
    from hvi_fenicsx.workflow import finish, prepare

    began = time.process_time()
    try:
        prepared = prepare(read_scene(scene_file))
        late = time.process_time() + limit
        solution = finish(prepared, interrupted=lambda: time.process_time() > late)
    except InputError as error:
        return Answer(2, str(error), seconds=time.process_time() - began)
    except Interrupted as error:
        return Answer(130, str(error), seconds=time.process_time() - began)
    except Exception as error:
        return Answer(1, f"{type(error).__name__}: {error}", seconds=time.process_time() - began)
    problem, verdict = solution.problem, solution.solvability
    space, d = problem.space, problem.scales.dimension
    found, seen = solution.solve_result, solution.examination
    points = space.tabulate_dof_coordinates()[:, :d]
    return Answer(
        code=int(solution.exit_code),
        text=solution.reason,
        state=str(verdict.state),
        factors=(verdict.lambda_held, verdict.lambda_peak),
        paper=bool(verdict.paper.satisfied),
        certificate=asdict(seen.certificate) if seen else None,
        energy=seen.energy * problem.scales.energy if seen else np.nan,
        points=points.copy(),
        u=found.u.x.array.reshape(-1, d)[: len(points)] * problem.scales.displacement if found else None,
        seconds=time.process_time() - began,
        margin=verdict.margin,
    )
