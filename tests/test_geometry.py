"""Chains of edges: the order of a part's vertices, and the outline of a body, follow from them."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx.geometry import chains, spot


def found(pairs: list[tuple[int, int]], rank: list[int] | None = None) -> list[list[int]]:
    return [chain.tolist() for chain in chains(np.array(pairs), None if rank is None else np.array(rank))]


def test_open_chains_come_before_closed_ones() -> None:
    assert found([(5, 6), (6, 7), (7, 5), (2, 1), (1, 3)]) == [[2, 1, 3], [5, 6, 7, 5]]


def test_a_closed_chain_begins_at_the_lowest_rank() -> None:
    assert found([(0, 1), (1, 2), (2, 0)], [3, 1, 2]) == [[1, 2, 0, 1]]


def test_without_edges_there_is_no_chain() -> None:
    assert chains(np.empty((0, 2), dtype=np.int64)) == []


@pytest.mark.parametrize("seed", range(5))
def test_chains_that_touch_use_every_edge_once(seed: int) -> None:
    """Two loops and an open chain through one vertex: how they are told apart is free."""
    pairs = np.array([(0, 1), (1, 2), (2, 0), (0, 3), (3, 4), (4, 0), (5, 0), (0, 6)])
    pairs = pairs[np.random.default_rng(seed).permutation(len(pairs))]
    edges = [pair for chain in chains(pairs) for pair in zip(chain[:-1].tolist(), chain[1:].tolist(), strict=True)]
    assert sorted(edges) == sorted(map(tuple, pairs.tolist()))
    assert chains(pairs)[0][0] == 5


def test_a_point_in_a_message_has_no_rounding() -> None:
    assert spot(np.array([-0.65830001, 1.889649253085104e-14])) == "(-0.6583, 0)"
    assert spot(np.array([1e-9, 2e-9, 0.0])) == "(1e-09, 2e-09, 0)"
    assert spot(np.zeros(2)) == "(0, 0)"
