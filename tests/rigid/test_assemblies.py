"""Bodies that nothing fixes, several of them: one linear programme with an unknown for each slip says the same."""

import numpy as np
import pytest
from mpi4py import MPI
from numpy.typing import NDArray
from scipy.optimize import linprog

from hvi_fenicsx.rigid import (
    Directional,
    JoinedBodies,
    Resistance,
    RigidBody,
    RigidProblem,
    analyse,
    rigid_fields,
    works,
)

Array = NDArray[np.float64]


def heap(seed: int, count: int) -> RigidProblem:
    """Blocks one upon the other on flat or rough sides, pressed together, some of them pushed by random forces."""
    rng = np.random.default_rng(seed)
    bodies = tuple(RigidBody(2, np.array([0.0, float(i), 0.0]), name=f"b{i}") for i in range(count))
    joined = JoinedBodies(bodies)
    contact, parts, load = [], [], rng.normal(size=joined.motions) * rng.choice([0.0, 0.02, 0.2])
    for i in range(1, count):
        m = int(rng.integers(2, 5))
        points = np.column_stack([np.linspace(-0.5, 0.5, m), np.full(m, i - 0.5), np.zeros(m)])
        normals = np.tile([0.0, -1.0], (m, 1)) + rng.choice([0.0, 0.3]) * rng.normal(size=(m, 2))
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        relative = np.zeros((m, joined.motions, 2))
        relative[:, joined.own(i)], relative[:, joined.own(i - 1)] = (
            sign * rigid_fields(points, bodies[j]) for sign, j in ((1.0, i), (-1.0, i - 1))
        )
        contact.append(works(normals, relative))
        load += rng.uniform(0.0, 1.0, m) @ contact[-1]
        growth = float(rng.choice([0.0, 0.2, 0.5]))
        tangents = np.column_stack([-normals[:, 1], normals[:, 0]])[:, None]
        law = Directional(growth, growth)
        weights = rng.uniform(0.1, 0.3, m)
        parts.append(Resistance(fields=relative, weights=weights, directions=tangents, growth=law, peak=law))
    return RigidProblem(body=joined, loads={"g": load}, contact=tuple(contact), resistances=tuple(parts))


def programme(problem: RigidProblem) -> tuple[float, float]:
    """The least of growth less work over |y| <= 1, and the largest factor of the load that the growth bears."""
    slips = np.vstack([part.slips[:, 0] * part.weights[:, None] for part in problem.resistances])
    growth = np.concatenate([np.full(len(part.weights), part.growth.plus) for part in problem.resistances])
    (m, n), cone, work = slips.shape, np.vstack(problem.contact), problem.loads["g"]
    rows = np.block([[cone, np.zeros((len(cone), m))], [slips, -np.eye(m)], [-slips, -np.eye(m)]])
    below, heights = np.zeros(len(rows)), [(0.0, None)] * m
    least = linprog(np.r_[-work, growth], rows, below, bounds=[(-1.0, 1.0)] * n + heights)
    unit = np.r_[work, np.zeros(m)][None]
    factor = linprog(np.r_[np.zeros(n), growth], rows, below, unit, [1.0], [(None, None)] * n + heights)
    return float(least.fun), float(factor.fun) if factor.status == 0 else np.inf


@pytest.mark.parametrize(
    ("seed", "count"),
    [
        (0, 2),
        (1, 3),
        (2, 8),
        (3, 8),
        (4, 12),
        *(pytest.param(s, 8, marks=pytest.mark.long) for s in range(5, 40)),
        pytest.param(40, 60, marks=pytest.mark.long),
    ],
)
def test_the_verdict_on_free_bodies_is_that_of_one_programme(seed: int, count: int) -> None:
    problem = heap(seed, count)
    found, (least, factor) = analyse(MPI.COMM_SELF, problem), programme(problem)
    assert found.margin is not None
    assert min(found.margin, 0.0) == pytest.approx(least, abs=1e-7)
    assert (found.state in ("held", "borderline")) == (least > -1e-7)
    assert found.lambda_held == pytest.approx(factor, rel=1e-6, abs=1e-7)
