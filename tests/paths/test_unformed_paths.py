"""Paths followed by factorisations of the whole body are those followed with the condensed stiffness as an array."""

from __future__ import annotations

from typing import Any

import pytest
from runs import LONG_RANKS, on_ranks
from scenes import STEEL, Table
from unformed import difference, figures, path_run, words

from hvi_fenicsx.reduced.condensed_stiffness import DenseStiffness
from hvi_fenicsx.reduced.factorised_stiffness import FactorisedStiffness

SOFT: Table = {"law": "graph", "points": [[0, 0], [2e-6, 3e6], [1.6e-5, 0]]}
TEETH: Table = {"law": "graph", "points": [[0, 0], [4e-6, 1e6], [4e-6, 6e5], [9e-6, 1e6], [9e-6, 6e5]]}
ONE_SIDED: Table = {"law": "graph", "points": [[0, 0], [4e-6, 5e6], [2e-5, 0]], "one_sided": True}
BRITTLE: Table = {"law": "graph", "points": [[0, 0], [2e-5, 1e6], [2e-5, 4e5], [6e-5, 0]], "one_sided": True}


def bar(**path: Any) -> Table:
    """A bar that is glued along its underside, and pulled."""
    material = {"model": "plane_stress", "youngs_modulus": 4.224e10, "poisson_ratio": 0.0}
    glue = {"law": "graph", "points": [[0, 0], [3.4e-5, 7.2e6], [1.6e-4, 0]]}
    return {
        "domain": {"shape": "rectangle", "size": [0.1, 0.001], "cells": [20, 1]},
        "material": material,
        "boundary": {
            "pull": {"on": "right", "traction": [2e8, 0.0]},
            "glue": {"on": "bottom", "contact": {"lower": 0.0, "upper": 0.0}, "friction": glue},
        },
        "path": path,
    }


def strip(**path: Any) -> Table:
    """A strip that is peeled off by its end, in contact ahead of the crack."""
    return {
        "domain": {"shape": "rectangle", "size": [0.15, 0.005], "cells": [16, 2]},
        "material": {"model": "plane_strain", "youngs_modulus": 7e10, "poisson_ratio": 0.3},
        "boundary": {
            "lifted": {"on": "left", "displacement": ["free", 1e-3]},
            "far": {"on": "right", "displacement": [0.0, 0.0]},
            "glue": {"on": "bottom", "contact": {"gap": 0.0}, "adhesion": ONE_SIDED},
        },
        "path": path,
    }


def square(law: Table, **path: Any) -> Table:
    """On a floor with friction, pressed and pulled."""
    return {
        "domain": {"shape": "rectangle", "size": [1.0, 1.0], "cells": [6, 6]},
        "material": dict(STEEL),
        "boundary": {
            "wall": {"on": "left", "displacement": [0.0, "free"]},
            "pull": {"on": "right", "traction": [4e6, 0.0]},
            "press": {"on": "top", "traction": [0.0, -1e6]},
            "floor": {"on": "bottom", "contact": {"gap": 0.0}, "friction": law},
        },
        "path": path,
    }


def free_block(**path: Any) -> Table:
    """Nothing but its floor holds it."""
    table = square(TEETH, **path)
    table["boundary"]["push"] = {"on": "left", "traction": [6e5, 0.0]}
    del table["boundary"]["wall"], table["boundary"]["pull"]
    return table


def anchor(**path: Any) -> Table:
    """A plate on brittle glue in space."""
    return {
        "domain": {"shape": "box", "size": [0.2, 0.2, 0.1], "cells": [2, 2, 1]},
        "material": {"model": "three_dimensional", "youngs_modulus": 2.1e11, "poisson_ratio": 0.3},
        "boundary": {
            "pull": {"on": "top", "traction": [0.0, 0.0, 6e5]},
            "side": {"on": "left", "displacement": [0.0, "free", "free"]},
            "face": {"on": "front", "displacement": ["free", 0.0, "free"]},
            "lift": {"on": "right", "traction": [0.0, 0.0, 3e5]},
            "base": {"on": "bottom", "contact": {"gap": 0.0}, "adhesion": BRITTLE},
        },
        "path": path,
    }


SCENES = {
    "peak and snap-back": bar(to=1.5, follow="exact"),
    "a bar that comes off": bar(to=1.5),
    "peeled off and let go": strip(to=[1.0, 0.2, 1.2]),
    "peeled off exactly": strip(to=1.0, follow="exact"),
    "softening, loaded again": square(SOFT, to=[0.9, 0.2, 1.5]),
    "teeth that heal": square(TEETH, to=[1.0, 0.0, 1.4], memory=False),
    "a free block": free_block(to=2.0, scaled=["push.traction"]),
    "a plate in space": anchor(to=[0.9, 0.1, 2.0]),
}


QUICK = "softening, loaded again"


@pytest.mark.parametrize("name", [pytest.param(n, marks=[] if n == QUICK else pytest.mark.long) for n in SCENES])
def test_rows_are_those_with_an_array(name: str) -> None:
    runs = [path_run(SCENES[name], formed=formed) for formed in (True, False)]
    kinds = [type(run._condensation.problem.elastic) for run in runs]
    assert kinds == [DenseStiffness, FactorisedStiffness]
    one, other = (run.follow() for run in runs)
    assert (other.end, other.reason) == (one.end, one.reason)
    assert words(other) == words(one)
    assert other.uncertified == 0
    assert len(one.rows) > 8
    assert difference(figures(one), figures(other)) < 1e-10


@pytest.mark.parametrize("ranks", LONG_RANKS[1:])
def test_all_ranks_follow_the_path_of_one(ranks: int) -> None:
    alone, together = (on_ranks(n, "tests/paths/unformed_ranks.py") for n in (1, ranks))
    assert together["equal"]
    assert (together["end"], together["words"]) == (alone["end"], alone["words"])
    assert difference(alone["figures"], together["figures"]) < 1e-9
