"""Damaged scenes, meshes, paths, searches and words of requests, in a process of their own or on two ranks."""

from __future__ import annotations

import copy
import random
from collections.abc import Callable
from pathlib import Path

import damage
import tomli_w
from scenes import Table, model, quadratic_linear, two_blocks

from .case import OUT, SCENE, Case, table, write

STUDY = ("--axis", "epsilon=1", "--repeat", "1", "--limit", "20")
COMMANDS: dict[str, tuple[str, ...]] = {"run": (), "path": (), "equilibria": ("--limit", "3")}
BOND = {"law": "graph", "points": [[0, 0], [1e-6, 2e6], [2e-5, 0]], "one_sided": True}
_BETWEEN = ["upper.bottom", "lower.top"]
_PROGRAMMES = [1.5, [1.0, 0.2, 1.1], [-1.0, 1.0], [], [0.0], [1.0, 1.0], "1", [float("nan")], [float("inf")], [1e300]]
_PROGRAMMES += [1e-300, [[1.0]], True, {}, [0.5] * 3, 40, [1, -1, 1, -1]]
_SCALED = [[], ["push.traction"], ["push"], ["", ""], "push.traction", ["press.traction", "press.traction"], [3], ["x"]]
_PLACES = ["upper.bottom", "lower.top", "lower.bottom", "upper.top", "upper.left", "bottom", "", "upper", 3, "up.per"]
_ORIGINS = [[0.0, 0.5], [0.21, 0.4], [0.21, 0.5 + 1e-9], [5.0, 0.5], [0.0], "0", [float("nan"), 0.5], [1e300, 0.5]]
_SEAMS = [
    {"tied": True}, {"tied": "yes"}, {"contact": {"gap": "measured"}}, {"contact": {"gap": -1e-6}},
    {"contact": {"gap": "1/x"}}, {"cohesion": {**BOND, "beta": 0.0}}, {"traction": [1e6, 0.0]},
    {"cohesion": {"law": "graph", "points": [[0, 0], [0, 1]]}}, {"adhesion": {**BOND, "multiplier": "x - 0.3"}},
]  # fmt: skip
_WORDS = ["nan", "inf", "-inf", "0", "-1", "1e-300", "1e300", "x", "", "1,5", "²", "1_0", " 1 ", "0x10", "1" * 400]
_VALUES = [*_WORDS, "2", "exact,exact", "paper", "gamg", ",", "=", "0.5", "1/3", "10**9", "energy", "u_t", "enrgy"]
_AXES = ("mesh", "epsilon", "epsilon_absolute", "smoothing", "method", "tolerance", "accuracy", "msh", "")
_OPTIONS = {
    "run": ["--accuracy", "--quantity", "--np", "--petsc", "--set=solver.degree", "--set=domain.cells"],
    "path": ["--np", "--petsc", "--set=path.to", "--set=path.follow", "--set=path.memory", "--set=path.states"],
    "equilibria": ["--gap", "--limit", "--np", "--petsc", "--set=solver.tolerance", "--set=solver.degree"],
    "study": ["--repeat", "--limit", "--np", *(f"--axis={axis}" for axis in _AXES)],
}


def _pairs() -> list[Table]:
    """Two bodies with each kind of interface, in the plane and in space, and a body with a strong law."""
    touching, glued, tied = (two_blocks("rectangle", [0.6], [[3, 2], [2, 2]], "plane_strain") for _ in range(3))
    glued["interface"]["seam"] = {"between": list(_BETWEEN), "contact": {}, "cohesion": dict(BOND)}
    tied["interface"]["seam"] = {"between": list(_BETWEEN), "tied": True}
    solid = two_blocks("box", [0.6, 0.5], [[2, 1, 1], [1, 1, 1]], "three_dimensional")
    return [touching, glued, tied, solid, model(3, 6e6, friction=quadratic_linear(3e6))]


def programme(chance: random.Random, table: Table) -> None:
    table["path"] = {"to": copy.deepcopy(chance.choice(_PROGRAMMES))}
    if chance.random() < 0.5:
        table["path"]["scaled"] = copy.deepcopy(chance.choice(_SCALED))
    if chance.random() < 0.3:
        table["path"] |= chance.choice([{"states": 1}, {"contact_at": [0.5, 9.0]}, {"contact_at": "x"}, {"memry": 1}])


def ends(chance: random.Random, table: Table) -> None:
    table["interface"]["seam"]["between"][chance.randrange(2)] = chance.choice(_PLACES)


def moved(chance: random.Random, table: Table) -> None:
    table["domain"]["upper"]["origin"] = copy.deepcopy(chance.choice(_ORIGINS))


def third(chance: random.Random, table: Table) -> None:
    """A third body: somewhere else, or in another."""
    at = chance.choice([[0.0, 2.0], [0.1, 0.1], [0.21, 0.9]])
    table["domain"]["third"] = {"shape": "rectangle", "size": [0.3, 0.3], "cells": [1, 1], "origin": at}


def seams(chance: random.Random, table: Table) -> None:
    table["interface"]["seam"] |= copy.deepcopy(chance.choice(_SEAMS))


def doubled(chance: random.Random, table: Table) -> None:
    table["interface"]["again"] = copy.deepcopy(table["interface"]["seam"])


def unheld(chance: random.Random, table: Table) -> None:
    del table["boundary"][chance.choice(list(table["boundary"]))]


OWN: list[Callable[[random.Random, Table], None]] = [programme, programme, ends, moved, third, seams, doubled, unheld]


def _request(command: str, *words: str, alone: bool = False) -> Case:
    pictures = () if command == "study" else ("--no-pictures",)
    asked = [command, SCENE, "--out", OUT, *pictures, *words]
    return Case(what=" ".join(asked), words=asked, alone=alone, places=True)


def damaged_scene(chance: random.Random, folder: Path) -> Case:
    """A scene, its mesh or its file, damaged; run, now and then with an accuracy or as a study."""
    done = damage.make(chance, folder)
    command, words = chance.choice([("run", ())] * 8 + [("run", ("--accuracy", "0.3")), ("study", STUDY)])
    return _request(command, *words).told(done)


def damaged_pair(chance: random.Random, folder: Path) -> Case:
    """Two bodies, damaged: solved, followed, searched, each tenth on two ranks."""
    command = chance.choice(list(COMMANDS))
    content = copy.deepcopy(chance.choice(_pairs()))
    if command != "equilibria" and chance.random() < 0.5:
        content["path"] = {"to": 1.2, "follow": chance.choice(["stable", "exact"]), "memory": chance.random() < 0.5}
    done = damage.damaged(chance, content, [*damage.TABLES, *OWN, *OWN])
    write(folder, tomli_w.dumps(content))
    ranks = ("--np", "2") if chance.random() < 0.1 else ()
    return _request(command, *COMMANDS[command], *ranks, alone=bool(ranks)).told(done)


def odd_words(chance: random.Random, folder: Path) -> Case:
    """A sound scene, and an option with a value that does not fit; a later option wins."""
    command = chance.choice(list(_OPTIONS))
    write(folder, table())
    option = f"{chance.choice(_OPTIONS[command])}={chance.choice(_VALUES)}"
    return _request(command, *(STUDY if command == "study" else COMMANDS[command]), option)


KINDS = [*[damaged_scene] * 8, *[damaged_pair] * 4, odd_words]
