"""Bubbles and nodes in turns: what is followed from step to step is what the forms say of the whole error."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
from scenes import Table, model, quadratic_linear

from hvi_fenicsx import read_tables
from hvi_fenicsx.certify.certificate import examine
from hvi_fenicsx.estimate.bubbles import BubbleStiffness
from hvi_fenicsx.estimate.coupled_errors import Coupled
from hvi_fenicsx.estimate.dual_norm import DualNorm
from hvi_fenicsx.estimate.law_traces import LawTraces

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "benchmarks"))

from effectivity import scenes, steps


def bent_wall() -> Table:
    """Bubbles that are prescribed, others on bounds that are not zero, and a law that drops."""
    table = model(6, pull=3e6, gap="1e-6*x*(1 - x)", friction=quadratic_linear(1e6))
    table["boundary"]["wall"]["displacement"] = ["1e-6*y*(1 - y)", "free"]
    return table


def stiff_bond() -> Table:
    """A law that rises steeply beside the stiffness of the bubbles; a part of it lifts off."""
    bond = {"law": "graph", "points": [[0, 0], [1e-7, 5e6], [4e-5, 0]]}
    table = model(4, press=-2e5)
    table["boundary"]["floor"] = {"on": "bottom", "contact": {"gap": 0.0}, "cohesion": bond}
    return table


CASES = {
    "stiff bond": read_tables(stiff_bond()),
    "lift-off": scenes()["lift_off"],
    "bent wall": read_tables(bent_wall()),
    "two bodies": scenes()["single_lap"],
    "half-disk": scenes()["hertz"],
    "block in space": scenes()["block_3d"],
}


QUICK = {(name, 1) for name in CASES} | {("stiff bond", 2)}


@pytest.mark.parametrize(
    ("name", "degree"),
    [(n, p) if (n, p) in QUICK else pytest.param(n, p, marks=pytest.mark.long) for n in CASES for p in (1, 2)],
)
def test_size_and_residual_are_followed(name: str, degree: int) -> None:
    (step,) = steps(CASES[name].with_solver(degree=degree), 1)
    system, u = step.system, step.u
    problem, bulk = system.problem, system.problem.bulk
    traces = LawTraces(problem, u, examine(problem, u, 1e-8).states, exact=False)
    inverse = DualNorm(system, step.solved.levels, u)
    bubbles = traces.bubbles
    coupled = Coupled(traces, inverse, BubbleStiffness(problem, bubbles))
    rounding = 1e-8
    if degree == 2 and name == "half-disk":  # gradients in curved cells are no polynomials; each form has its own rule
        rounding = 1e-6
    for _ in range(3):
        coupled.find_bubbles()
        coupled.move_nodes()
        error = coupled.error.nodes + coupled.error.bubbles
        assert coupled.size**2 == pytest.approx(bulk.energy_by_cell(error).sum(), rel=rounding)
        coupled.tell_bubbles()
    felt = bulk.residual_in(bubbles, u, problem.linear.values())
    felt -= traces.tested(coupled.error)[0].everywhere(len(felt))
    wanted = felt - bulk.force_in(bubbles, error).values()
    assert coupled.residual == pytest.approx(wanted, abs=rounding * np.abs(felt).max())
    inverse.destroy()
