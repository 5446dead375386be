"""``hvi check``: a scene validated, its effects, rigid motions and existence told; nothing is solved."""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence

from .. import console
from ..errors import ExitCode
from ..runtime import terminal
from ..runtime.mpi import on_root
from ..scene import read_scene
from ..workflow import Preparation, prepare
from . import sizes
from .telling import COMM

_CODES = {"escapes": ExitCode.NO_SOLUTION, "undecided": ExitCode.NOT_CONVERGED}
"""What the command ends with, by the state."""


def execute(options: argparse.Namespace) -> int:
    """Validate a scene and print its effects, rigid motions and existence; the exit code by the contract. Collective.

    Raises:
        InputError: on all ranks alike.
    """
    scene = on_root(COMM, lambda: read_scene(options.scene, options.overrides))
    prepared = prepare(scene, COMM)
    text = _report(prepared, options.loads, as_json=options.json)
    if COMM.rank == 0:
        terminal.say(text)
    return _CODES.get(prepared.solvability.state, ExitCode.CERTIFIED)


def _report(prepared: Preparation, loads: Sequence[str], *, as_json: bool) -> str:
    """What ``check`` prints. Collective."""
    measured = sizes.of(prepared)
    factors = {name: prepared.load_factors(name) for name in loads}
    if as_json:
        data = console.as_data(prepared, factors) | {"sizes": measured.as_dict()}
        return json.dumps(data, indent=2, ensure_ascii=False)
    lines = [
        *console.heading(prepared, COMM.size),
        *measured.lines(),
        *console.load_factors(factors),
        *console.effects(prepared),
        *console.history(prepared),
    ]
    return "\n".join(lines)
