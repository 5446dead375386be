"""Why: what a scene does not name must cost nothing, and the simplest solver that its effects allow must be the one.

An integral that nobody needs is compiled and assembled for ever unnoticed; so is a contact solver without contact.
"""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import dolfinx
import numpy as np
import pytest
from runs import hvi, summary, write_scene
from scenes import STEEL, Table, displacement, energy, model, quadratic_linear, solved

from hvi_fenicsx import prepare, read_tables
from hvi_fenicsx.workflow import finish

SPRING = {"law": "linear_spring", "stiffness": 1e12}
LAW = quadratic_linear(1e3)


def scene(floor: Table, **tables: Any) -> Table:
    """A square pulled and pressed; ``floor``: what acts on its bottom."""
    table = model(4) | tables
    table["boundary"]["floor"] = {"on": "bottom", **floor}
    return table


def rolling(**floor: Any) -> Table:
    """Held in the normal direction of its bottom by a condition."""
    return scene({"displacement": ["free", 0.0], **floor})


SCENES: dict[str, tuple[Table, int, str, bool]] = {
    # scene; compiled integrals (the stiffness, the two tractions, and what else is named); method; bounds
    "linear": (rolling(), 3, "linear", False),
    "a force more": (rolling() | {"body": {"force": [0.0, -1e5]}}, 4, "linear", False),
    "heat more": (
        rolling() | {"body": {"temperature": 20.0}, "material": {**STEEL, "thermal_expansion": 1e-5}},
        4,
        "linear",
        False,
    ),
    # with bounds or laws: normals and lumped areas of the part
    "an elastic support": (scene({"support": SPRING}), 3 + 2, "linear", False),
    "contact": (scene({"contact": {"gap": 0.0}}), 3 + 2, "convex", True),
    "contact on springs": (scene({"contact": {"gap": 0.0}, "friction": SPRING}), 3 + 2, "convex", True),
    "friction": (rolling(friction=LAW), 3 + 2, "branch", False),
    "contact and friction": (scene({"contact": {"gap": 0.0}, "friction": LAW}), 3 + 2, "branch", True),
    "adhesion more": (
        scene({"contact": {"gap": 0.0}, "friction": LAW, "adhesion": LAW}),
        3 + 2,
        "branch",
        True,
    ),
}


@dataclass
class Compiled:
    """The forms that were compiled."""

    forms: list[Any] = field(default_factory=list)

    @property
    def integrals(self) -> int:
        """Those in the C code, of all forms."""
        return sum(f.ufcx_form.form_integral_offsets[3] for f in self.forms)


@pytest.fixture
def compiled(monkeypatch: pytest.MonkeyPatch) -> Compiled:
    found, form = Compiled(), dolfinx.fem.form

    def counted(*words: Any, **keys: Any) -> Any:
        made = form(*words, **keys)
        found.forms.append(made)
        return made

    monkeypatch.setattr(dolfinx.fem, "form", counted)
    return found


@pytest.mark.parametrize("name", SCENES)
def test_only_what_is_named_is_compiled(name: str, compiled: Compiled) -> None:
    table, integrals, _, _ = SCENES[name]
    prepare(read_tables(table))
    assert compiled.integrals == integrals


@pytest.mark.parametrize("name", SCENES)
def test_the_solver_follows_from_what_acts(name: str) -> None:
    table, _, method, bounds = SCENES[name]
    ready = prepare(read_tables(table))
    box = np.concatenate([ready.system.lower.array, ready.system.upper.array])
    assert bool(np.isfinite(box).any()) is bounds
    found = finish(ready)
    assert found.converged
    assert found.solve_result is not None
    assert found.solve_result.method == method
    assert (found.solve_result.counts.branch > 0) is (method == "branch")


@pytest.mark.parametrize("name", [n for n, case in SCENES.items() if case[2] != "branch"])
def test_the_simple_solvers_find_what_the_branch_iteration_finds(name: str) -> None:
    table = SCENES[name][0]
    one, other = solved(table), solved(table | {"solver": {"method": "branch"}})
    assert other.solve_result is not None
    assert other.solve_result.method == "branch"
    assert energy(one) == pytest.approx(energy(other), rel=1e-10)
    assert displacement(one) == pytest.approx(displacement(other), abs=1e-9 * np.abs(displacement(other)).max())


def test_check_tells_the_same_as_data(tmp_path: Path) -> None:
    file = write_scene(tmp_path / "square.toml", rolling())
    data = json.loads(hvi("check", file, "--json").stdout)
    assert data["solver"] == "one linear solve, no bounds, MUMPS"
    assert [(e["effect"], e["unknowns"], e["terms"]) for e in data["effects"]] == [
        ("isotropic", 50, "1 bilinear"),
        ("displacement", -5, "none"),
        ("traction", 0, "1 linear"),
        ("traction", 0, "1 linear"),
        ("displacement", -5, "none"),
    ]
    done = hvi("run", file, "--out", tmp_path / "out", "--no-pictures")
    assert done.returncode == 0
    assert summary(tmp_path / "out")["method"] == "linear"
    assert summary(tmp_path / "out")["effects"] == data["effects"]
