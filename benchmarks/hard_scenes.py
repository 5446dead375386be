"""From a case of the table to a scene, its mesh, and the displacement whose pieces of the laws to begin on."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
from covering import Case
from mpi4py import MPI
from petsc4py import PETSc

from hvi_fenicsx import Model, read_tables, workflow
from hvi_fenicsx.mesh import domain

Array = npt.NDArray[np.float64]
Plain = dict[str, Any]
UNITS = {"m": (1.0, 1.0), "mm": (1e3, 1e-6), "um": (1e6, 1e-6)}
"""What a metre and a N/m² are in each system."""
RESIDUAL = {
    "quadratic_linear": 0.5,
    "sawtooth": 0.25,
    "exponential": 0.5,
    "tresca": 1.0,
    "graph": 0.3,
    "one_sided": 0.4,
    "literal": 0.5,
    "softening": 0.2,
}
"""What is left of each law's traction after its drops, over its peak."""
TILT, WALL_TILT = 1.4, 2.0
"""The tilted press is Q (1 - tilt x/W): a free block stands as long as tilt < 1.5, one at a wall while it is < 2."""
_IN_SPACE = 0.6
"""A body in space has the cells along a plate's side to this power, so that about as many in all."""
_MOVED = 0.2
_RATIO = 1000.0


@dataclass(frozen=True)
class Frame:
    """The numbers of a case that its tables are made of, in the case's units."""

    case: Case
    width: float
    height: float
    press: float
    modulus: float
    slip: float

    @classmethod
    def of(cls, case: Case, data: Mapping[str, Any]) -> Frame:
        metre, pascal = UNITS[case["units"]]
        length, stretch = data["length"] * metre, case["stretch"]
        width, height = length * min(1.0, stretch), length / max(1.0, stretch)
        press, modulus = data["press"] * pascal, case["modulus"] * pascal
        return cls(case, width, height, press, modulus, case["delta"] * press * length / modulus)

    @property
    def in_space(self) -> bool:
        return self.case["body"] in ("block", "stack_3d")

    @property
    def is_stack(self) -> bool:
        """Whether the body stands on another one."""
        return self.case["body"] in ("stack", "stack_3d")

    @property
    def peak(self) -> float:
        return self.case["strength"] * self.press

    @property
    def residual(self) -> float:
        return self.peak * RESIDUAL.get(self.case["law"], 0.0)

    @property
    def distance(self) -> float:
        """From the limit, relative; positive on the side where the body is held."""
        return self.case["margin"] * (1.0 if self.case["side"] == "under" else -1.0)


def scene(case: Case, data: Mapping[str, Any], method: str) -> Model:
    """The scene of a case."""
    f = Frame.of(case, data)
    model, nu = case["material"].split()
    material = {"model": "three_dimensional" if f.in_space else model, "youngs_modulus": f.modulus}
    return read_tables(
        {
            "title": f"hard case {case.key}",
            "domain": _domain(f),
            "material": material | {"poisson_ratio": float(nu)},
            **_parts(f),
            "solver": _solver(case, method, data["tolerance"]) | {"degree": case["degree"]},
        }
    )


def _domain(f: Frame) -> Plain:
    """One body, or two of which the lower one's mesh is coarser, so that no nodes of theirs meet but the corners'."""
    cells, depth = f.case["cells"], [f.width] * f.in_space
    size = [f.width, *depth, f.height]
    number = round(cells**_IN_SPACE) if f.in_space else cells
    shape = {"shape": "box" if f.in_space else "rectangle", "size": size}
    body = shape | {"cells": [number] * len(size)}
    if not f.is_stack:
        return body
    lower = shape | {"cells": [max(1, number - 1)] * len(size), "origin": [0.0] * (len(size) - 1) + [-f.height]}
    return {"lower": lower, "upper": body}


def _parts(f: Frame) -> Plain:
    """The tables of the boundary and, of two bodies, of what is between them."""
    case, own = f.case, "upper." if f.is_stack else ""
    flat = [0.0] * (1 + f.in_space)  # the components beside the one that is given
    boundary: Plain = {
        "pull": {"on": f"{own}right", "traction": [_pull(f), *flat]},
        "press": {"on": f"{own}top", "traction": [*flat, _press(f)]},
    }
    if case["support"] == "wall":
        boundary["wall"] = {"on": f"{own}left", "displacement": [0.0, *["free"] * len(flat)]}
    floor = {"contact": {"gap": 0.0}, **_law(f), **_adhesion(f)}
    if not f.is_stack:
        return {"boundary": boundary | {"floor": {"on": "bottom", **floor}}}
    boundary["base"] = {"on": "lower.bottom", "displacement": [0.0, *flat]}
    return {"boundary": boundary, "interface": {"floor": {"between": ["upper.bottom", "lower.top"], **floor}}}


def _solver(case: Case, method: str, tolerance: float) -> Plain:
    smoothed = {"smoothing": case["smoothing"], "epsilon": case["epsilon"]} if case["smoothing"] != "exact" else {}
    return {"method": method, "linear_solver": case["linear"], "tolerance": tolerance, **smoothed}


def _press(f: Frame) -> Any:
    """At a wall its resultant is the margin; on a free block it is always there."""
    wall, tilted = f.case["support"] == "wall", f.case["lift"] == "tilted"
    if not tilted:
        return -f.press * (f.distance if wall else 1.0)
    tilt = WALL_TILT * (1.0 - f.distance) if wall else TILT
    return f"{-f.press!r}*(1 - {tilt!r}*x/{f.width!r})"


def _pull(f: Frame) -> Any:
    case = f.case
    if case["support"] == "wall":
        return f.press * (6.0 if case["lift"] == "pulled" else 1.0)
    if case["support"] == "tip":
        tilt = TILT if case["lift"] == "tilted" else 0.0
        moment = f.press * f.width**2 * (0.5 - tilt / 6.0)  # of the press about the lower right corner
        return 2.0 * moment / f.height**2 * (1.0 - f.distance)
    limit = f.residual if case["support"] == "residual" else f.peak
    mean = limit * f.width / f.height * (1.0 - f.distance)
    up = "z" if f.in_space else "y"
    return f"{mean!r}*(4 - 6*{up}/{f.height!r})"  # no moment about the floor


def _law(f: Frame) -> Plain:
    """The effect of the floor's law: friction, or of opening and slip together."""
    law = f.case["law"]
    return {"cohesion": _cohesion(f)[law]} if law in _cohesion(f) else {"friction": _friction(f)[law]}


def _friction(f: Frame) -> Plain:
    peak, residual, slip = f.peak, f.residual, f.slip
    drop = {"peak_traction": peak, "residual_traction": residual, "delta": slip}
    ramp = [[0.0, 0.0], [slip, peak], [slip, residual]]
    up_and_down = [[0.0, 0.0], [slip, 0.5 * peak], [slip, peak], [2 * slip, peak], [2 * slip, residual]]
    paper = {"gamma1": peak, "gamma2": residual, "delta": slip}
    return {
        "quadratic_linear": {"law": "quadratic_linear", **paper},
        "literal": {"law": "quadratic_linear_literal", **paper},
        "sawtooth": {"law": "sawtooth", "drops": 3, **drop},
        "exponential": {"law": "exponential", **drop},
        "tresca": {"law": "tresca", "yield_traction": peak, "reference_slip": slip},
        "graph": {"law": "graph", "points": up_and_down},
        "one_sided": {"law": "graph", "points": ramp, "one_sided": True},
        "softening": {"law": "graph", "points": [[0.0, 0.0], [slip, peak], [4 * slip, residual]]},
    }


def _cohesion(f: Frame) -> Plain:
    """The strength in shear is the peak: beta times that in tension, with a mixity beta times the energies' ratio."""
    law = {"law": "graph", "points": [[0.0, 0.0], [f.slip, f.peak], [4 * f.slip, 0.0]]}
    shear = {"beta": 0.5, "mixity": "benzeggagh_kenane", "energy_ratio": 2.0, "exponent": 2.0}
    return {"cohesion": law, "mixed": law | shear}


def _adhesion(f: Frame) -> Plain:
    """A bond that breaks altogether, so that the limit (the growth) is the same with and without it."""
    if f.case["adhesion"] == "off":
        return {}
    opening = f.slip / 10
    points = [[0.0, 0.0], [opening, 0.3 * f.press], [opening, 0.0]]
    return {"adhesion": {"law": "graph", "points": points}}


def prepare(case: Case, data: Mapping[str, Any], method: str, comm: MPI.Comm) -> workflow.Preparation:
    """As :func:`hvi_fenicsx.workflow.prepare`, on a mesh whose vertices are moved first. Collective."""
    made = scene(case, data, method)
    if case["distortion"] == "none":
        return workflow.prepare(made, comm)
    body = made.domain.build(comm, made.dimension)
    distort(body, case)
    return workflow.prepare(made, comm, domain=body)


def distort(body: domain.Domain, case: Case) -> None:
    """Move the mesh's vertices, the same on any number of ranks; sides stay straight and corners where they are."""
    size, n = body.upper - body.lower, case["cells"]
    x = body.mesh.geometry.x
    place = (x[:, :2] - body.lower) / size  # 0 to 1
    moved = {"random": _shaken, "graded": _graded(0), "layer": _graded(1)}[case["distortion"]](place, n)
    x[:, :2] = body.lower + moved * size


def _shaken(place: Array, n: int) -> Array:
    inside = (place > 0.5 / n) & (place < 1 - 0.5 / n)
    grid = np.rint(place * n)
    return place + np.where(inside, _MOVED / n * np.stack([_noise(grid, 1.0), _noise(grid, 2.0)], axis=1), 0.0)


def _graded(axis: int) -> Any:
    """Cells of which the last is _RATIO times the first."""

    def move(place: Array, n: int) -> Array:
        moved = place.copy()
        moved[:, axis] = np.expm1(place[:, axis] * np.log(_RATIO)) / (_RATIO - 1.0)
        return moved

    return move


def _noise(points: Array, seed: float) -> Array:
    """From -1 to 1, a function of the point alone."""
    mixed = np.sin(points @ np.array([12.9898, 78.233]) + 37.719 * seed) * 43758.5453
    return 2.0 * (mixed - np.floor(mixed)) - 1.0


def branches(case: Case, prepared: workflow.Preparation, data: Mapping[str, Any]) -> PETSc.Vec | None:
    """The displacement, in units of u0, whose pieces of the laws a method is to begin on; None for its own start."""
    if case["start"] == "default":
        return None
    space, body = prepared.problem.space, prepared.problem.domain
    slip = Frame.of(case, data).slip / prepared.problem.scales.displacement
    place = (space.tabulate_dof_coordinates()[:, :2] - body.lower) / (body.upper - body.lower)
    vector = prepared.system.load.duplicate()
    vector.array[:] = _started(case["start"], np.rint(place * 1e6), slip).ravel()[: vector.local_size]
    return vector


def _started(start: str, points: Array, slip: float) -> Array:
    field = np.zeros_like(points)
    if start == "hovering":
        field[:, 1] = slip
    elif start == "random":
        field = 5.0 * slip * np.stack([_noise(points, 3.0), np.abs(_noise(points, 4.0))], axis=1)
    elif start in ("broken", "reversed"):
        field[:, 0] = 5.0 * slip * (1.0 if start == "broken" else -1.0)
    return field
