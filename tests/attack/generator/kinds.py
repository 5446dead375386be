"""Random scenes of every kind that the package knows; one seed and one number give the same scene always."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from referee.meshes import Mesh, joined

from generator import parts
from generator.bodies import body_mesh
from generator.draws import Draw, new_draw, round_to
from generator.material_draws import material

Table = dict[str, Any]


@dataclass(frozen=True)
class Drawn:
    """A scene's tables, its mesh file if it has one, and what kind it is."""

    kind: str
    table: Table
    mesh: Mesh | None = None


def draw(seed: int, number: int) -> Drawn:
    """The scene of this number."""
    rng = np.random.default_rng([seed, number])
    kind = str(
        rng.choice(list(_KINDS), p=np.array([w for w, _ in _KINDS.values()]) / sum(w for w, _ in _KINDS.values()))
    )
    return _KINDS[kind][1](kind, rng)


def _finish(g: Draw, kind: str, domain: Table, boundary: Table, mesh: Mesh | None = None) -> Drawn:
    stuff = material(g)
    body = parts.body(g, stuff)
    table = {"domain": domain, "material": stuff, "boundary": boundary, "solver": parts.solver_table(g, boundary)}
    return Drawn(kind, table | ({"body": body} if body else {}), mesh)


def _rectangle(kind: str, rng: np.random.Generator) -> Drawn:
    g = new_draw(rng, 2)
    n, m = int(rng.integers(1, 8)), int(rng.integers(1, 7))
    if kind == "fine":
        n = m = int(g.pick(52, 56, 64))
    ratio = 1.0 if g.some(0.6) else g.log(-0.7, 0.7)
    domain = {"shape": "rectangle", "size": [g.length, round_to(g.length * ratio, 3)], "cells": [n, m]}
    return _finish(g, kind, domain, parts.boundary(g))


def _driven(kind: str, rng: np.random.Generator) -> Drawn:
    """Nothing but prescribed displacements and heat."""
    g = new_draw(rng, 2)
    n = int(g.pick(2, 4, 7, 52, p=[0.35, 0.3, 0.2, 0.15]))
    size, k = round_to(g.u0 * g.log(-1, 1)), round_to(9 / g.length)
    top: list[Any] = ["free", g.pick(-size, f"-{size}*(1+sin({k}*x))")]
    if g.some(0.5):
        top[0] = g.pick(0.0, size)
    boundary: Table = {"top": {"on": "top", "displacement": top}}
    if g.some(0.6):
        boundary["floor"] = parts.floor(g)
    else:
        boundary["floor"] = {"on": "bottom", "displacement": [0.0, 0.0]}
    if g.some(0.3):
        boundary["left"] = {"on": "left", "traction": [round_to(g.stress * g.signed(-6, 0)), 0.0]}
    return _finish(g, kind, {"shape": "rectangle", "size": [g.length] * 2, "cells": [n, n]}, boundary)


def _box(kind: str, rng: np.random.Generator) -> Drawn:
    g = new_draw(rng, 3)
    cells = [int(c) for c in rng.integers(1, 4, 3)]
    size = [round_to(g.length * f, 3) for f in (1.0, g.pick(1.0, 0.5, 2.0), g.pick(1.0, 0.5))]
    return _finish(g, kind, {"shape": "box", "size": size, "cells": cells}, parts.boundary(g))


def _bodies(kind: str, rng: np.random.Generator) -> Drawn:
    """One to three bodies of a mesh file, each with sides of its own."""
    g = new_draw(rng, 3 if rng.random() < 0.12 else 2)
    count = int(g.pick(1, 2, 3, p=[0.4, 0.45, 0.15]))
    boundary: Table = {}
    meshes = []
    base = g.stress
    for i in range(count):
        name = "abc"[i]
        form, mesh = body_mesh(g, name, i * 3.0 * g.length)
        meshes.append(mesh)
        g.stress = base if g.some(0.6) else round_to(base * g.log(-8, 2))
        boundary |= parts.boundary(g, f"{name}_", flat=form in ("plain", "uneven", "inner"))
    g.stress = base
    return _finish(g, kind, {"shape": "file", "file": "bodies.msh"}, boundary, joined(meshes))


_KINDS = {
    "rectangle": (0.46, _rectangle),
    "fine": (0.01, _rectangle),
    "driven": (0.09, _driven),
    "box": (0.14, _box),
    "bodies": (0.3, _bodies),
}
