"""Where a path jumps to: the same whatever rounding and order, and where a motion in time comes to rest."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from condensed import bonds, problem
from test_exact_paths import path, random_chain, random_law, random_problem

import hvi_fenicsx as hvi
from hvi_fenicsx.paths.contact_points import ContactPoints
from hvi_fenicsx.paths.state import Event, PathState
from hvi_fenicsx.reduced.condensed_problem import CondensedProblem
from hvi_fenicsx.reduced.condensed_stiffness import DenseStiffness

Array = npt.NDArray[np.float64]
Table = dict[str, Any]
FEW = [*range(3), *(pytest.param(seed, marks=pytest.mark.long) for seed in range(3, 40))]


def same_but_for_rounding(given: CondensedProblem) -> Iterator[CondensedProblem]:
    """Changed by 1e-13, and with unknowns in reverse order."""
    n = given.size
    noise = 1.0 + 1e-13 * np.random.default_rng(1).uniform(-1, 1, (n, n))
    yield replace(given, elastic=DenseStiffness(given.stiffness * (noise + noise.T) / 2))
    back = np.arange(n)[::-1]
    yield replace(
        given,
        elastic=DenseStiffness(given.stiffness[np.ix_(back, back)]),
        **{key: getattr(given, key)[back] for key in ("force", "force_rate", "lower", "upper", "points")},
        applied=given.applied[:, back],
        bonds=tuple(replace(b, unknowns=n - 1 - b.unknowns) for b in given.bonds),
    )


@pytest.mark.parametrize("make", [random_problem, random_chain])
@pytest.mark.parametrize("seed", FEW)
def test_jumps_release_the_same_whatever_rounding_and_order(seed: int, make: object) -> None:
    assert callable(make)
    given = make(seed)
    found = []
    for one in (given, *same_but_for_rounding(given)):
        follower, states = path(one, programme=(5.0,), remember=range(len(given.bonds)))
        jumps = [state for state in states if state.event is Event.JUMP]
        found.append((follower.end, [s.factor for s in jumps], [s.released for s in jumps]))
    for end, factors, released in found[1:]:
        assert end is found[0][0]
        assert factors == pytest.approx(found[0][1], rel=1e-6)
        assert released == pytest.approx(found[0][2], rel=1e-6, abs=1e-6 * max(found[0][2], default=1.0))


@pytest.mark.parametrize("seed", range(8))
def test_what_a_bond_may_yet_bear_is_what_its_graph_has_once_it_has_been_there(seed: int) -> None:
    """Noted in the middle of each segment: exact on its own side, a bound on the other."""
    law = random_law(np.random.default_rng(seed))
    points = ContactPoints(problem(1.0, 1.0, bonds(law, 0)), [0])
    for number, segment in enumerate(points.chain(0)):
        coordinate = 0.5 * (max(segment.low, -2.0) + min(segment.high, 2.0))
        x, force = segment.displacement(coordinate), segment.force + (segment.rise or segment.slope) * coordinate
        been = ContactPoints(problem(1.0, 1.0, bonds(law, 0)), [0])
        been.remember(0, x, force)
        points.enter(0, number)
        least, greatest = min(points.least[0], force), max(points.greatest[0], force)
        ends = [(s, end) for s in been.chain(0) for end in np.clip((s.low, s.high), -9, 9)]
        forces = [s.force + (s.rise or s.slope) * end for s, end in ends]
        assert least <= min(forces) + 1e-12
        assert greatest >= max(forces) - 1e-12
        assert x < 0.0 or greatest == pytest.approx(max(forces), abs=1e-12)
        assert x > 0.0 or least == pytest.approx(min(forces), abs=1e-12)


def rest(given: CondensedProblem, state: PathState) -> Array:
    """Where x' = f - S x - r ends, in short steps from a state, pushed off at first; drops take 3e-4 of a law's length.

    Bonds go back to zero along secants from the farthest places so far, of even laws on both sides.
    """
    S, bonds, x = given.stiffness, given.bonds, state.x.copy()
    at = np.concatenate([b.unknowns[:, 0] for b in bonds])
    weights = np.concatenate([b.weights for b in bonds])
    memory = np.array(state.memory)
    far = [max(4 * np.abs(x).max(), 10 * np.abs(b.law.breaks).max()) for b in bonds]
    places = [np.linspace(-length, length, 200_001) for length in far]
    tables, steepest = [], 0.0
    for b, p in zip(bonds, places, strict=True):
        k = max(int(3e-4 * np.abs(b.law.breaks).max() / (p[1] - p[0])), 1)
        g = b.law.graph
        assert g is not None
        mean = 0.5 * (g.traction(p, "left") + g.traction(p, "right"))
        tables.append(np.convolve(np.pad(mean, k, mode="edge"), np.ones(2 * k + 1) / (2 * k + 1), "valid"))
        steepest += float(np.max(b.weights)) * np.abs(np.diff(tables[-1])).max() / (p[1] - p[0])
    even = np.repeat([np.allclose(t, -t[::-1]) for t in tables], [len(b.weights) for b in bonds])
    step, load = 1.0 / (np.linalg.eigvalsh(S)[-1] + steepest), given.load(state.factor)
    ends = np.cumsum([len(b.weights) for b in bonds])[:-1]
    for force in (load + 1e-5 * np.linalg.norm(load) / np.linalg.norm(given.force_rate) * given.force_rate, load):
        moved = np.inf
        while moved > 1e-8 * step * np.linalg.norm(load):
            a = x[at]
            parts = zip(np.split(a, ends), bonds, places, tables, strict=True)
            r = np.concatenate([b.signs[:, 0] * np.interp(b.signs[:, 0] * c, p, t) for c, b, p, t in parts])
            for side, other, beyond in ((1, 0, a > memory[:, 1]), (0, 1, a < memory[:, 0])):
                memory[beyond, side], memory[beyond, side + 2] = a[beyond], r[beyond]
                memory[beyond & even, other], memory[beyond & even, other + 2] = -a[beyond & even], -r[beyond & even]
            side = (a > 0).astype(int)
            end, there = memory[range(len(a)), side], memory[range(len(a)), side + 2]
            r = np.where(end != 0.0, there / np.where(end != 0.0, end, 1.0) * a, r)
            total = force - S @ x - np.bincount(at, weights * r, len(x))
            after = np.clip(x + step * total, given.lower, given.upper)
            moved, x = float(np.linalg.norm(after - x)), after
    return x


@pytest.mark.long
@pytest.mark.parametrize("seed", range(3))
def test_a_jump_ends_where_a_motion_in_time_comes_to_rest(seed: int) -> None:
    given = random_problem(seed)
    _, states = path(given, programme=(5.0,), remember=range(len(given.bonds)))
    for before, after in pairwise(states):
        if after.event is Event.JUMP:
            off = np.linalg.norm(rest(given, before) - after.x)
            assert off <= 0.02 * np.linalg.norm(after.x - before.x)


def block(
    size: list[float], cells: list[int], material: Table, loads: dict[str, list[float]], floor: Table
) -> hvi.Model:
    """A block beside a wall, pulled at its side and its top."""
    boundary = {
        "floor": {"on": "bottom"} | floor,
        "wall": {"on": "left", "displacement": [0.0, "free"]},
        **{f"pull_{side}": {"on": side, "traction": traction} for side, traction in loads.items()},
    }
    domain = {"shape": "rectangle", "size": size, "cells": cells}
    return hvi.read_tables({"domain": domain, "material": material, "boundary": boundary})


def test_a_block_comes_off_where_neither_its_curve_nor_a_motion_leads_on() -> None:
    """A motion in time from the limit point at 1.863 rests; the exact path bears 3.65744."""
    law = {"law": "graph", "points": [[0, 0], [8.3e-4, 1.3e7], [4.2e-3, 0]], "beta": 1.34}
    material = {"model": "plane_stress", "youngs_modulus": 1.4e9, "poisson_ratio": 0.26}
    loads = {"right": [-6.8e6, -7.1e5], "top": [-3.1e6, 2.26e6]}
    path = hvi.follow(block([1.25, 0.85], [1, 1], material, loads, {"cohesion": law}), to=4.0)
    assert path.end == "escapes"
    assert path.peak_factor == pytest.approx(3.65744, rel=1e-5)
    assert [path.rows[number].way for number in path.jumps] == ["along the curve"]


@pytest.mark.parametrize("change", [0.0, 1e-13, -1e-13])
def test_the_last_digit_of_a_modulus_changes_no_jump(change: float) -> None:
    """A motion in time leads from the first one to where 4.744181 J/m are released; held back it was 4.057 or that."""
    points = [
        [0.0, 1398468.643793451],
        [9.601123111590404e-4, 2796937.287586902],
        [9.601123111590404e-4, 2079338.4762063774],
    ]
    friction = {"law": "quadratic_linear", "gamma1": 3472941.9286524192, "gamma2": 1736470.9643262096}
    floor = {"friction": friction | {"delta": 5.501064082157771e-05}}
    floor["support"] = {"law": "graph", "points": points, "one_sided": True}
    modulus = 13489177321.220903 * (1.0 + change)
    material = {"model": "plane_strain", "youngs_modulus": modulus, "poisson_ratio": 0.19864443089343775}
    loads = {"right": [5407401.495279686, 234641.2434057474], "top": [882906.7810241914, -3084282.3408781984]}
    path = hvi.follow(block([1.9049314530516217, 1.83703685557934], [4, 1], material, loads, floor), to=0.6)
    assert [path.rows[number].released for number in path.jumps] == pytest.approx([4.744181143, 18.543304873], rel=1e-8)
