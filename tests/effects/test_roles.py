"""Why: what an effect does is known to it alone; a user's own is drawn, doubted and measured like the program's."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w
from runs import process, summary
from scenes import model

from hvi_fenicsx.report import reader
from hvi_fenicsx.report.pictures import shape
from hvi_fenicsx.report.pictures.shape import touches

OWN = '''
import ufl

from hvi_fenicsx.effects import (
    BoundaryLaw, Condition, Contribution, Direction, Drive, Effect, FormulaField, NormalBounds, Place, SurfaceLoad
)
from hvi_fenicsx.effects import LawEffect
from hvi_fenicsx.formula import Formula


class Suction(Effect):
    """A pull away from the boundary."""

    key = "suction"
    place = Place.BOUNDARY
    drive = Drive.LOAD
    term = "<g, v> += ∫ p v·n ds"

    value: FormulaField

    def contribute(self, context, where):
        p = context.render(self.value) / context.number(context.stress)
        return Contribution(linear=(p * ufl.inner(context.normal, context.test) * context.facets(where),))

    def stress_scale(self, largest, sizes):
        return largest(self.value)

    def surface_load(self):
        return SurfaceLoad(pressure=Formula(f"-({self.value.source})"))

    def implausible(self, largest, sizes):
        most = largest(self.value)
        return (f"a suction of {most:g} N/m² is more than the air can do",) if most > 1e5 else ()


class Glide(Effect):
    """A wall that lets the body glide upwards."""

    key = "glide"
    place = Place.BOUNDARY
    drive = Drive.KINEMATIC
    term = "u_1 = 0"

    def contribute(self, context, where):
        return Contribution(conditions=tuple(Condition(i, Formula(0.0)) for i in self.prescribed()))

    def prescribed(self):
        return (0,)


class Bed(Effect):
    """A rigid bed under the body."""

    key = "bed"
    place = Place.BOUNDARY
    term = "K: u·n ≤ depth"
    bounds_normal = True

    depth: FormulaField

    def contribute(self, context, where):
        return Contribution(bounds=(NormalBounds(lower=Formula(f"-({self.depth.source})"), upper=None),))


class Glue(LawEffect):
    """Glue that resists slip."""

    key = "glue"
    term = "∫ j⁰(u_t; v_t - u_t) ds"
    direction = Direction.SLIP


class Spin(Effect):
    """The body turns about its centre."""

    key = "spin"
    label = "a centrifugal force"
    place = Place.BODY
    drive = Drive.LOAD
    term = "<g, v> += ∫ f·v dx"

    rate: FormulaField

    def contribute(self, context, where):
        x = ufl.SpatialCoordinate(context.test.ufl_function_space().mesh)
        pull = ufl.as_vector([context.render(self.rate), 0]) * context.number(context.length / context.stress)
        return Contribution(linear=(ufl.inner(pull, context.test) * context.cells(where),))
'''
GLUED = {"law": "exponential", "peak_traction": 1e-3, "residual_traction": 5e-4, "delta": 5e-6}


def own_scene() -> dict[str, Any]:
    """The model problem in the user's own effects; above it, far away, a ceiling."""
    table = model(8)
    table["plugins"] = ["own.py"]
    table["body"] = {"spin": {"rate": 1e3}}
    table["boundary"] = {
        "wall": {"on": "left", "glide": {}},
        "pull": {"on": "right", "suction": {"value": "2e6*(1 - y)"}},
        "press": {"on": "top", "traction": [0.0, -1e6], "bed": {"depth": 10.0}},
        "floor": {"on": "bottom", "bed": {"depth": 0.0}, "glue": GLUED},
    }
    table.pop("solver", None)
    return table


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the user's effects, a scene of them, and its result."""
    found = tmp_path_factory.mktemp("own")
    (found / "own.py").write_text(OWN, encoding="utf-8")
    (found / "own.toml").write_text(tomli_w.dumps(own_scene()), encoding="utf-8")
    done = process("run", "own.toml", "--out", "r", cwd=found)
    assert done.returncode == 0, done.stderr
    return found


def test_the_users_effects_are_drawn(folder: Path) -> None:
    found = reader.read(folder / "r")
    (held,), loaded = shape.held_sides(found), shape.loaded_sides(found)
    assert (held.side.part, held.rolling) == ("wall", True)
    assert {load.side.part for load in loaded} == {"pull", "press"}
    pull = next(load for load in loaded if load.side.part == "pull")
    y = found.body.points[pull.side.vertices, 1]
    np.testing.assert_allclose(pull.traction, np.stack([2e6 * (1 - y), 0 * y, 0 * y], axis=1), atol=1e-6)
    assert {name for name in found.arrays.sides if touches(found.roles(name))} == {"floor", "press"}
    assert found.resists("floor", "slip")
    assert not found.resists("floor", "opening")
    assert found.within == ["a centrifugal force"]
    assert {"scene.png", "contact_floor.png", "body.png"} <= {file.name for file in (folder / "r").iterdir()}
    page = (folder / "r" / "report.html").read_text(encoding="utf-8")
    assert "A wall that lets the body glide upwards." in page


def test_the_users_effects_are_doubted_where_they_stand(folder: Path) -> None:
    warnings = summary(folder / "r")["warnings"]
    assert "boundary.pull.suction: a suction of 2e+06 N/m² is more than the air can do" in warnings
    assert any(text.startswith("boundary.floor.glue: the law can carry 0.001 N/m at most") for text in warnings)
    assert any(text.startswith("boundary.press.bed: the gap is 10 m at least") for text in warnings)


def test_a_target_quantity_finds_the_users_law_and_bounds(folder: Path) -> None:
    code = """
from types import SimpleNamespace
from hvi_fenicsx import prepare, read_scene
from hvi_fenicsx.accuracy.quantities import FrictionTraction, Resultant
level = SimpleNamespace(prepared=prepare(read_scene("own.toml")))
print(Resultant().missing(level), FrictionTraction().missing(level))
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["None", "None"]


def test_a_scene_of_the_users_effects_is_checked_for_contradictions(folder: Path) -> None:
    table = own_scene()
    table["boundary"]["wall"] |= {"bed": {"depth": 0.0}, "displacement": [0.0, "free"]}
    (folder / "wrong.toml").write_text(tomli_w.dumps(table), encoding="utf-8")
    done = process("check", "wrong.toml", cwd=folder)
    told = " ".join(done.stderr.split())
    assert done.returncode == 2
    assert '"left" has u_x prescribed already, by boundary.wall.' in told
    assert "leave bed out or write" in told
