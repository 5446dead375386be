"""``hvi check``: a scene validated, its effects, sizes, rigid motions and existence told; nothing is solved."""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from typing import Any

from .. import console
from ..errors import ExitCode
from ..problem import domain_forms
from ..runtime import log
from ..solvers import obstacle_force
from ..system import existence
from ..typing import Array, magnitude
from ..workflow import Preparation, prepare
from .session import COMM, scene_of

_CODES = {"escapes": ExitCode.NO_SOLUTION, "undecided": ExitCode.NOT_CONVERGED}
"""What the command ends with, by the state."""


def execute(options: argparse.Namespace) -> int:
    """Validate a scene and print its effects, rigid motions and existence; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    prepared = prepare(scene_of(options), COMM)
    text = _report(prepared, options.loads, as_json=options.json)
    if COMM.rank == 0:
        log.say(text)
    return _CODES.get(prepared.solvability.state, ExitCode.CERTIFIED)


def _report(prepared: Preparation, loads: Sequence[str], *, as_json: bool) -> str:
    """What ``check`` prints. Collective."""
    sizes = _sizes(prepared)
    factors = {name: prepared.load_factors(name) for name in loads}
    if as_json:
        return json.dumps(console.as_data(prepared, factors) | {"sizes": sizes}, indent=2, ensure_ascii=False)
    lines = [*console.heading(prepared, COMM.size), *_size_lines(sizes), *console.load_factors(factors)]
    return "\n".join([*lines, *console.effects(prepared), *console.history(prepared)])


def _sizes(prepared: Preparation) -> dict[str, Any]:
    """Sizes in SI, by which mistakes in units are seen: the body's extent, areas, the sum of each load. Collective.

    Raises:
        InputError: on all ranks alike: forces press several obstacles.
    """
    problem, d = prepared.problem, prepared.problem.dimension
    loads = existence.loads_of_rigid_motions(problem, prepared.system.forces)
    sums = {name: COMM.allreduce(force.array_r.reshape(-1, d).sum(axis=0)) for name, force in loads.items()}
    pressed = obstacle_force.pressed(problem)
    obstacles = {} if pressed is None else {pressed.name: pressed.force * pressed.direction}

    def shown(force: Array) -> list[float]:
        rounding = 1e-12 * magnitude(force)
        return [float(f) * problem.scales.force if abs(f) > rounding else 0.0 for f in force]

    return {
        "body": list(map(float, problem.domain.upper - problem.domain.lower)),
        "parts": {name: domain_forms.of(problem.space, facets).area for name, facets in problem.part_facets.items()},
        "loads": {name: shown(force) for name, force in sums.items()},
        "obstacle_forces": {name: shown(force) for name, force in obstacles.items()},
    }


def _size_lines(sizes: dict[str, Any]) -> Iterator[str]:
    """The sizes, a line for each kind."""
    area, force = ("m", "N/m") if len(sizes["body"]) == 2 else ("m²", "N")
    yield f"body: {' x '.join(f'{e:.4g}' for e in sizes['body'])} m"
    yield f"parts: {', '.join(f'{name} {value:.4g} {area}' for name, value in sizes['parts'].items())}"
    for what, kind in (("sum of", "loads"), ("force on the obstacle of", "obstacle_forces")):
        for name, total in sizes[kind].items():
            yield f"{what} {name}: ({', '.join(f'{component:.4g}' for component in total)}) {force}"
