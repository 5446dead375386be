"""One body is the limit of two: each demo of one body, with a stiff partner in the place of the rigid floor.

The partner is 1e6 times as stiff and held at its far side; its vertices lie on those of the body, but for curved sides.
What then differs is its stiffness, and what a prescribed corner carries: on an interface its neighbour has that share.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass

import numpy as np
import pytest
from runs import ROOT
from scenes import Array, Table, energy
from scipy.spatial import cKDTree

from hvi_fenicsx import Solution, read_tables, solve
from hvi_fenicsx.certify.contact_state import ContactState

DEMOS = ROOT / "demos"
OPPOSITE = {"bottom": "top", "top": "bottom", "left": "right", "right": "left"}


@dataclass(frozen=True, kw_only=True)
class Partner:
    """What stands in the floor's place.

    Attributes:
        side: of the body that lies on it.
        origin: of the partner, m.
        size: of the partner, m.
        cells: of the partner.
        traction: the largest difference of a traction, relative to the largest one.
    """

    side: str
    origin: tuple[float, ...]
    size: tuple[float, ...]
    cells: tuple[int, ...]
    traction: float = 2e-6


def below(width: float, cells: int, traction: float = 2e-6) -> Partner:
    """A block as deep as wide, below a rectangle of so many cells."""
    size, origin = (width, width), (0.0, -width)
    return Partner(side="bottom", origin=origin, size=size, cells=(cells, 4), traction=traction)


CORNER = 5e-3
"""Of the traction next to a corner at which the body is prescribed."""
PARTNERS = {
    "anchor_3d": Partner(side="bottom", origin=(0.0, 0.0, -0.2), size=(0.2, 0.2, 0.2), cells=(6, 6, 2)),
    "block_3d": Partner(side="left", origin=(-1.0, 0.0, 0.0), size=(1.0, 1.0, 1.0), cells=(2, 6, 6)),
    "glued_bar": below(0.190, 190),
    "peeling": below(0.15, 150),
    "pushed_block": below(1.0, 16),
    "slot": below(1.0, 16),
    "strong_law": below(1.0, 64, traction=CORNER),
    "thermal_bar": Partner(side="right", origin=(1.0, 0.0), size=(0.05, 0.05), cells=(4, 4)),
    "tipping_tower": below(1.0, 8),
}


def of_demo(name: str) -> Table:
    """The tables of a demo; a mesh file is named by its whole path."""
    table: Table = tomllib.loads((DEMOS / f"{name}.toml").read_text(encoding="utf-8"))
    if "file" in table["domain"]:
        table["domain"]["file"] = str(DEMOS / table["domain"]["file"])
    return table


def acts(effects: Table) -> bool:
    """Whether a boundary part has contact or a law."""
    return any(key in effects for key in ("contact", "friction", "adhesion", "support", "cohesion"))


def on_partner(table: Table, partner: Partner) -> Table:
    """The demo's body on a stiff one."""
    ((part, effects),) = [(n, e) for n, e in table["boundary"].items() if acts(e)]
    faces = OPPOSITE.get(partner.side, "top")
    dimension = len(partner.size)
    rest = {n: {**e, "on": named(e["on"])} for n, e in table["boundary"].items() if n != part}
    rest["held"] = {"on": f"partner.{OPPOSITE[faces]}", "displacement": [0.0] * dimension}
    own = {key: value for key, value in effects.items() if key not in ("on", "where")}
    sides = [f"body.{partner.side}", f"partner.{faces}"]
    block = {"shape": "rectangle" if dimension == 2 else "box", "size": list(partner.size)}
    place = {"cells": list(partner.cells), "origin": list(partner.origin)}
    return {
        **table,
        "domain": {"body": table["domain"], "partner": block | place},
        "material": materials(table["material"]),
        "boundary": rest,
        "body": region_forces(table),
        "interface": {part: {"between": sides, **own}},
    }


def named(sides: str | list[str]) -> list[str]:
    """Sides of the body, by their names among several bodies."""
    return [f"body.{side}" for side in ([sides] if isinstance(sides, str) else sides)]


def region_forces(table: Table) -> Table:
    """What acts in the body, and not in the partner."""
    return {"inside": {"region": "body", **table["body"]}} if "body" in table else {}


def materials(stated: Table) -> Table:
    """The body's own, and the partner's: 1e6 times as stiff, else alike."""
    several = all(isinstance(value, dict) for value in stated.values())
    own = stated if several else {"own": stated}
    found = {n: m | {"region": f"body.{m['region']}" if several else "body"} for n, m in own.items()}
    one = next(iter(own.values()))
    modulus = max(one.get("youngs_moduli", [one.get("youngs_modulus")]))
    stiff = {"model": one["model"], "youngs_modulus": 1e6 * modulus, "poisson_ratio": 0.3}
    return {**found, "stiff": stiff | {"region": "partner"}}


def state(found: Solution) -> ContactState:
    assert found.exit_code == 0, found.reason
    assert found.examination is not None
    (only,) = found.examination.states
    return only


def tractions(found: Solution) -> Array:
    """Size of pressure and friction by vertex, N/m², (m, 2)."""
    met = state(found)
    slip = np.linalg.norm(met.friction, axis=1) if met.resists_slip else np.zeros(len(met.pressure))
    return np.abs(np.column_stack([met.pressure, slip])) * found.problem.scales.stress


FAST = {"pushed_block", "slot", "tipping_tower"}


@pytest.mark.parametrize("name", [n if n in FAST else pytest.param(n, marks=pytest.mark.long) for n in PARTNERS])
def test_a_stiff_partner_is_the_rigid_floor(name: str) -> None:
    partner, table = PARTNERS[name], of_demo(name)
    one, two = solve(read_tables(table)), solve(read_tables(on_partner(table, partner)))
    away, same = cKDTree(state(one).surface.points).query(state(two).surface.points)
    met = away < 1e-9  # beyond the part's `where` nothing is in contact
    assert not state(two).contact[~met].any()
    wanted, found = tractions(one)[same[met]], tractions(two)[met]
    assert np.abs(found - wanted).max() <= partner.traction * wanted.max()
    assert energy(two) == pytest.approx(energy(one), rel=5e-6)
