"""The laws of all vertices in arrays, against the graphs of single vertices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from condensed import bonds, chain, graph, problem

from hvi_fenicsx.laws import Exponential, Superpotential
from hvi_fenicsx.laws.smoothing import create
from hvi_fenicsx.paths.vertex_laws import law_rows, vertex_laws

SAWTOOTH = graph([(0, 0), (1, 1), (1, 0.4), (2, 0.9), (2, 0.1)])
ONE_SIDED = graph([(0, 0.2), (1, 1), (1, 0.4)], one_sided=True)
LAWS = [SAWTOOTH, ONE_SIDED, Exponential(1.0, 0.2, 0.5), create("chks", SAWTOOTH, epsilon=1e-3)]


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
@pytest.mark.parametrize("remembers", [False, True])
def test_tractions_are_those_of_each_vertex(law: Superpotential, remembers: bool) -> None:
    """At random and at breaks, from both sides, in either sense of the unknown, with any memory."""
    generator, n = np.random.default_rng(1), 6
    group = bonds(law, np.arange(n), np.ones(n))
    group = replace(group, signs=np.where(np.arange(n) % 2, -1.0, 1.0)[:, None] * np.ones((n, 1)))
    given = problem(chain(n, 1.0), np.ones(n), group)
    remember = {0} if remembers else set()
    (rows,), vertices = law_rows(given, remember), vertex_laws(given, remember)
    for _ in range(20):
        ends = np.stack([-generator.choice([0.0, 1.0, 1.5], n), generator.choice([0.0, 0.7, 2.0], n)], axis=1)
        memory = np.hstack([ends, ends * generator.uniform(0.1, 0.5, (n, 2))]) * remembers
        for one, vertex in zip(memory, vertices, strict=True):
            vertex.restore(one)
        x = generator.choice([-2.0, -1.0, 0.0, 1.0, 2.0, *generator.uniform(-3.0, 3.0, 5)], n)
        for side in ("left", "right"):
            wanted = [vertex.traction(x[k : k + 1], side)[0] for k, vertex in enumerate(vertices)]
            assert rows.traction(x, side, memory) == pytest.approx(wanted, rel=1e-12, abs=1e-14)
