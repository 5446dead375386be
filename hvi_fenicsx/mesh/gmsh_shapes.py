"""Plane shapes meshed by gmsh on rank 0: L, disk, half-disk, notched strip. SI."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ..errors import InputError
from ..runtime.mpi import on_root
from ..typing import Array
from . import gmsh_model

if TYPE_CHECKING:
    from ..scene import Disk, HalfDisk, LShape, NotchedStrip

    Plane: TypeAlias = LShape | Disk | HalfDisk | NotchedStrip

Point = tuple[float, float]
_BODY = "body"


@dataclass(frozen=True, slots=True)
class Outline:
    """A closed boundary, counterclockwise.

    Attributes:
        points: corners, m. sides: (name, centre) of the edge from each corner to the next; a centre makes it an arc.
        sizes: edge length of the cells at each corner, m.
    """

    points: Sequence[Point]
    sides: Sequence[tuple[str, Point | None]]
    sizes: Sequence[float]


@dataclass(frozen=True, slots=True)
class Arc:
    """A circle that a side lies on: centre and radius, m."""

    centre: Point
    radius: float

    def nearest(self, x: Array) -> Array:
        """The points of the circle nearest to x, shape (n, 2)."""
        away = x - np.asarray(self.centre)
        return np.asarray(self.centre + self.radius * away / np.linalg.norm(away, axis=1, keepdims=True))


def build(comm: MPI.Comm, shape: Plane) -> tuple[dmesh.Mesh, Mapping[str, npt.NDArray[Any]]]:
    """Mesh and local facets by side. Rank 0 meshes. Collective.

    Raises:
        InputError: on all ranks alike, when gmsh cannot mesh the shape.
    """
    with gmsh_model.session(comm) as gmsh:
        names = on_root(comm, lambda: _meshed(gmsh, outline(shape), shape.mesh_size))
        mesh, sides, _ = gmsh_model.distribute(comm, gmsh, 2, names)
    return mesh, sides


def outline(shape: Plane) -> Outline:
    """The boundary of a shape."""
    if shape.shape == "l_shape":
        return _l_shape(shape)
    if shape.shape == "notched_strip":
        return _notched_strip(shape)
    return _round(shape, whole=shape.shape == "disk")


def curves(shape: Plane) -> dict[str, Arc]:
    """The curved sides of a shape."""
    boundary = outline(shape)
    starts = zip(boundary.points, boundary.sides, strict=True)
    return {name: Arc(c, float(np.hypot(p[0] - c[0], p[1] - c[1]))) for p, (name, c) in starts if c is not None}


def _l_shape(shape: LShape) -> Outline:
    (w, h), (a, b) = shape.size, shape.cut
    points = [(0.0, 0.0), (w, 0.0), (w, h - b), (w - a, h - b), (w - a, h), (0.0, h)]
    return _polygon(points, ["bottom", "right", "inner_top", "inner_right", "top", "left"], shape.mesh_size)


def _notched_strip(shape: NotchedStrip) -> Outline:
    (w, h), (a, b) = shape.size, shape.notch
    notch = [((w + a) / 2, h), (w / 2, h - b), ((w - a) / 2, h)]
    points = [(0.0, 0.0), (w, 0.0), (w, h), *notch, (0.0, h)]
    return _polygon(points, ["bottom", "right", "top", "notch", "notch", "top", "left"], shape.mesh_size)


def _polygon(points: Sequence[Point], names: Sequence[str], size: float) -> Outline:
    return Outline(points, [(name, None) for name in names], [size] * len(points))


def _round(shape: Disk | HalfDisk, *, whole: bool) -> Outline:
    r, coarse = shape.radius, shape.mesh_size
    centre, fine = (0.0, r), shape.mesh_size_below or coarse
    lower = "lower_arc" if whole else "arc"
    points, sides = [(-r, r), (0.0, 0.0), (r, r)], [(lower, centre), (lower, centre)]
    if whole:
        arcs = [*sides, ("upper_arc", centre), ("upper_arc", centre)]
        return Outline([*points, (0.0, 2 * r)], arcs, [coarse, fine, coarse, coarse])
    return Outline(points, [*sides, ("top", None)], [coarse, fine, coarse])


def _meshed(gmsh: Any, boundary: Outline, size: float) -> dict[int, dict[str, int]]:
    """Mesh the outline in gmsh; its physical groups by dimension and name. Rank 0 only."""
    geo = gmsh.model.geo
    corners = [geo.addPoint(x, y, 0.0, h) for (x, y), h in zip(boundary.points, boundary.sizes, strict=True)]
    centres = {c: geo.addPoint(*c, 0.0, size) for _, c in boundary.sides if c is not None}
    edges: dict[str, list[int]] = {}
    for i, (name, centre) in enumerate(boundary.sides):
        ends = corners[i], corners[(i + 1) % len(corners)]
        edge = geo.addLine(*ends) if centre is None else geo.addCircleArc(ends[0], centres[centre], ends[1])
        edges.setdefault(name, []).append(edge)
    loop = geo.addCurveLoop([edge for found in edges.values() for edge in found], reorient=True)
    surface = geo.addPlaneSurface([loop])
    geo.synchronize()
    groups = {name: gmsh.model.addPhysicalGroup(1, found, name=name) for name, found in edges.items()}
    body = gmsh.model.addPhysicalGroup(2, [surface], name=_BODY)
    _generate(gmsh)
    return {1: groups, 2: {_BODY: body}}


def _generate(gmsh: Any) -> None:
    # Along an edge and inward the size is interpolated between the corners, so a fine corner stays local.
    gmsh.option.setNumber("Mesh.MeshSizeExtendFromBoundary", 1)
    try:
        gmsh.model.mesh.generate(2)
    except Exception as error:
        # gmsh raises bare Exceptions, whatever went wrong
        raise InputError(f"domain: gmsh cannot mesh the shape: {error}; change mesh_size") from None
