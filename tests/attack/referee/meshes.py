"""Meshes of the attack: blocks as docs/scene.md describes them, and bodies for mesh files, in plain numpy."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]
Integers = npt.NDArray[np.int64]
Mask = npt.NDArray[np.bool_]


@dataclass(frozen=True)
class Mesh:
    """A mesh with named sides.

    Attributes:
        points: (n, d).
        cells: (m, d + 1).
        sides: facets (k, d) by name.
        regions: region of each cell, (m,), names by number; one region if there are no names.
        names: of the regions.
    """

    points: Array
    cells: Integers
    sides: dict[str, Integers]
    regions: Integers
    names: tuple[str, ...] = ()

    @property
    def dimension(self) -> int:
        """2 or 3."""
        return self.points.shape[1]

    @property
    def size(self) -> float:
        """The longest edge of its box."""
        return float(np.ptp(self.points, axis=0).max())


def boundary(cells: Integers) -> Integers:
    """The facets that belong to one cell only, (k, d)."""
    d = cells.shape[1] - 1
    facets = np.concatenate([np.delete(cells, i, axis=1) for i in range(d + 1)])
    _, index, count = np.unique(np.sort(facets, axis=1), axis=0, return_index=True, return_counts=True)
    return np.asarray(facets[index[count == 1]])


def block(size: list[float], cells: list[int]) -> Mesh:
    """[0, size] in cells, each cut along the paths from its lowest to its highest corner."""
    d = len(size)
    axes = [np.linspace(0.0, s, n + 1) for s, n in zip(size, cells, strict=True)]
    points = np.stack([g.ravel(order="F") for g in np.meshgrid(*axes, indexing="ij")], axis=1)
    steps = np.cumprod([1, *(n + 1 for n in cells[:-1])])
    corners = [sum(i * s for i, s in zip(c, steps, strict=True)) for c in itertools.product(*map(range, cells))]
    paths = [np.cumsum([0, *p]) for p in itertools.permutations(steps)]
    simplices = np.array([c + p for c in corners for p in paths], dtype=np.int64)
    facets = boundary(simplices)
    middle = points[facets].mean(axis=1)
    sides = {}
    for axis, (low, high) in _SIDES[d].items():
        sides[low] = facets[np.abs(middle[:, axis]) < 1e-9 * size[axis]]
        sides[high] = facets[np.abs(middle[:, axis] - size[axis]) < 1e-9 * size[axis]]
    return Mesh(points, simplices, sides, np.zeros(len(simplices), np.int64))


_SIDES = {
    2: {0: ("left", "right"), 1: ("bottom", "top")},
    3: {0: ("left", "right"), 1: ("front", "back"), 2: ("bottom", "top")},
}


def moved(mesh: Mesh, points: Array, name: str) -> Mesh:
    """The mesh with other points, its sides and its region named after the body."""
    sides = {f"{name}_{side}": facets for side, facets in mesh.sides.items()}
    return Mesh(points, mesh.cells, sides, mesh.regions, (name,))


def joined(bodies: list[Mesh]) -> Mesh:
    """Several bodies in one mesh; they share no vertex."""
    offsets = np.cumsum([0, *(len(b.points) for b in bodies)])
    return Mesh(
        np.concatenate([b.points for b in bodies]),
        np.concatenate([b.cells + o for b, o in zip(bodies, offsets, strict=False)]),
        {side: f + o for b, o in zip(bodies, offsets, strict=False) for side, f in b.sides.items()},
        np.concatenate([np.full(len(b.cells), i) for i, b in enumerate(bodies)]),
        tuple(n for b in bodies for n in b.names),
    )


def write_msh(mesh: Mesh, path: Path) -> None:
    """The mesh as a file of gmsh's format 2.2, every side and region a physical group."""
    d = mesh.dimension
    groups = [(d - 1, name) for name in mesh.sides] + [(d, name) for name in mesh.names]
    lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames", str(len(groups))]
    lines += [f'{dim} {number} "{name}"' for number, (dim, name) in enumerate(groups, 1)]
    lines += ["$EndPhysicalNames", "$Nodes", str(len(mesh.points))]
    full = np.column_stack([mesh.points, np.zeros((len(mesh.points), 3 - d))])
    lines += [f"{i} " + " ".join(repr(float(c)) for c in p) for i, p in enumerate(full, 1)]
    kinds = {1: 1, 2: 2, 3: 4}
    elements = [(kinds[d - 1], n, f) for n, s in enumerate(mesh.sides, 1) for f in mesh.sides[s]]
    first = len(mesh.sides) + 1
    elements += [(kinds[d], first + int(r), c) for r, c in zip(mesh.regions, mesh.cells, strict=True)]
    lines += ["$EndNodes", "$Elements", str(len(elements))]
    lines += [
        f"{i} {kind} 2 {group} {group} " + " ".join(str(int(v) + 1) for v in vertices)
        for i, (kind, group, vertices) in enumerate(elements, 1)
    ]
    path.write_text("\n".join([*lines, "$EndElements", ""]), encoding="utf-8")
