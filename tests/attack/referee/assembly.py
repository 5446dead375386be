"""An assembly of a scene that shares nothing with the package: loads, bounds and laws by the vertex rule."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from referee.elasticity import Elements, hooke, thermal_stress
from referee.laws import Law, law_of
from referee.meshes import Array, Integers, Mesh

Table = dict[str, Any]
FLAT = 1e-8
"""Angle between the normals of a flat part, at most."""


def formula(source: float | str, points: Array) -> Array:
    """A number or a formula in x, y, z at points (n, d)."""
    if not isinstance(source, str):
        return np.full(len(points), float(source))
    names = {n: getattr(np, n) for n in ("sin", "cos", "exp", "sqrt", "abs")}
    places = dict(zip("xyz", points.T, strict=False))
    value = eval(source, {"__builtins__": {}}, names | places | {"pi": math.pi, "min": np.minimum, "max": np.maximum})
    return np.broadcast_to(np.asarray(value, dtype=float), len(points)).copy()


@dataclass(frozen=True)
class Bound:
    """lower ≤ u·n ≤ upper at one vertex."""

    vertex: int
    normal: Array
    lower: float
    upper: float


@dataclass(frozen=True)
class LawPoint:
    """One law at one vertex: the displacement along ``directions`` (k, d), its length if k = 2."""

    vertex: int
    directions: Array
    weight: float
    law: Law

    @property
    def radial(self) -> bool:
        """Whether the law acts on a length."""
        return len(self.directions) > 1

    def slip(self, u: Array) -> Array:
        """The components along the directions, (k,)."""
        return np.asarray(self.directions @ u[self.vertex])


@dataclass(frozen=True)
class Problem:
    """A scene, assembled, SI.

    Attributes:
        mesh: its mesh.
        matrix: stiffness, (n d, n d).
        load: mechanical loads, (n d,).
        strain_load: of thermal strains.
        fixed: prescribed unknowns.
        values: what they are.
        bounds: at vertices.
        laws: at vertices.
        labels: body of each vertex.
        stress: size of what drives each body, N/m².
        modulus: the largest.
        tolerance: what the scene asked for.
    """

    mesh: Mesh
    matrix: sp.csr_matrix
    load: Array
    strain_load: Array
    fixed: Integers
    values: Array
    bounds: list[Bound]
    laws: list[LawPoint]
    labels: Integers
    stress: Array
    modulus: float
    tolerance: float

    @property
    def d(self) -> int:
        """The dimension."""
        return self.mesh.dimension

    @property
    def force(self) -> Array:
        """The whole right-hand side."""
        return self.load + self.strain_load

    @cached_property
    def free(self) -> Integers:
        """The unknowns that nothing prescribes."""
        return np.setdiff1d(np.arange(len(self.load)), self.fixed)

    @property
    def bodies(self) -> int:
        """How many there are."""
        return int(self.labels.max()) + 1

    def energy(self, u: Array) -> float:
        """½ u·Au - b·u + Σ w j, J/m or J."""
        flat = u.ravel()
        laws = sum(p.weight * float(p.law.value(np.array([self.argument(p, u)]))[0]) for p in self.laws)
        return float(flat @ (self.matrix @ flat) / 2 - self.force @ flat) + laws

    @staticmethod
    def argument(point: LawPoint, u: Array) -> float:
        """What the law's j acts on."""
        slip = point.slip(u)
        return float(np.linalg.norm(slip)) if point.radial else float(slip[0])


def facet_vectors(mesh: Mesh, facets: Integers) -> Array:
    """Outward normals times areas, (k, d)."""
    p = mesh.points[facets]
    if mesh.dimension == 2:
        t = p[:, 1] - p[:, 0]
        n = np.column_stack([t[:, 1], -t[:, 0]])
    else:
        n = np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]) / 2
    owner = {tuple(sorted(f)): i for i, f in enumerate(map(tuple, facets.tolist()))}
    inner = np.zeros_like(n)
    for cell in mesh.cells.tolist():
        for i, opposite in enumerate(cell):
            key = tuple(sorted(cell[:i] + cell[i + 1 :]))
            if key in owner:
                inner[owner[key]] = mesh.points[opposite] - p[owner[key]].mean(axis=0)
    outward = np.where(np.sum(n * inner, axis=1, keepdims=True) > 0, -n, n)
    return np.asarray(outward)


def tangents(n: Array) -> Array:
    """The tangents that the contract of contact.csv states, (d - 1, d)."""
    if len(n) == 2:
        t = np.array([-n[1], n[0]])
        return np.asarray(t * np.sign(t[np.argmax(np.abs(t))]))[None, :]
    axis = np.array([0.0, 1.0, 0.0]) if abs(n[0]) > math.sqrt(0.5) else np.array([1.0, 0.0, 0.0])
    t1 = axis - (axis @ n) * n
    t1 /= np.linalg.norm(t1)
    return np.stack([t1, np.cross(n, t1)])


@dataclass(frozen=True)
class _Surface:
    """The vertices of a part with contact or laws: normals as they are, those that laws take, lumped areas."""

    table: Table
    vertices: Integers
    normals: Array
    turned: Array
    weights: Array

    @property
    def obstacle(self) -> Table | None:
        """The flat obstacle that states the normal."""
        found: Table | None = self.table.get("contact", {}).get("obstacle")
        return found

    @property
    def flat(self) -> bool:
        """Whether all its normals are one: its mesh is flat, or an obstacle states it."""
        mean = self.weights @ self.normals
        return bool(np.linalg.norm(self.normals - mean / np.linalg.norm(mean), axis=1).max() <= FLAT)


def _surface(mesh: Mesh, facets: Integers, table: Table) -> _Surface:
    vectors, vertices = facet_vectors(mesh, facets), np.unique(facets)
    normal, weight = np.zeros_like(mesh.points), np.zeros(len(mesh.points))
    for i in range(facets.shape[1]):
        np.add.at(normal, facets[:, i], vectors)
        np.add.at(weight, facets[:, i], np.linalg.norm(vectors, axis=1) / facets.shape[1])
    n = normal[vertices] / np.linalg.norm(normal[vertices], axis=1)[:, None]
    found = _Surface(table, vertices, n, n.copy(), weight[vertices])
    if found.obstacle:
        away = np.array(found.obstacle["normal"]) / np.linalg.norm(found.obstacle["normal"])
        n[:], found.turned[:] = -away, -away
    return found


def _turn(surfaces: list[_Surface], fixed: Integers, d: int) -> None:
    """Where directions meet at a vertex, uneven parts are turned towards what flat ones have (docs/methods.md)."""
    places: dict[int, list[tuple[_Surface, int]]] = {}
    for s in sorted(surfaces, key=lambda s: not s.flat):
        for i, v in enumerate(s.vertices):
            places.setdefault(int(v), []).append((s, i))
    for v, found in places.items():
        rows = [np.eye(d)[i] for i in range(d) if v * d + i in fixed]
        for s, i in found:
            n = s.normals[i]
            for row in rows:
                along = float(row @ n)
                n = np.sign(along) * row if abs(along) > 0.9 else n - along * row
            s.turned[i] = n / np.linalg.norm(n) if np.linalg.norm(n) > 0.5 else s.normals[i]
            rows.append(s.turned[i])


def _bounds(mesh: Mesh, s: _Surface, fixed: Integers) -> list[Bound]:
    contact, points, n = s.table.get("contact"), mesh.points[s.vertices], s.normals
    if not contact:
        return []
    lower, upper = np.full(len(n), -np.inf), np.full(len(n), np.inf)
    if s.obstacle:
        upper = (np.array(s.obstacle["point"]) - points) @ n[0]
    elif "gap" in contact:
        upper = formula(contact["gap"], points)
    else:
        lower, upper = -formula(contact["upper"], points), -formula(contact["lower"], points)
    d = mesh.dimension
    held = np.isin(s.vertices[:, None] * d + np.arange(d), fixed)
    along = np.sum(n * s.turned, axis=1, keepdims=True) * s.turned
    seen = np.where(held, n, along)  # contact acts along the turned normal, and stays exact in prescribed components
    size = np.linalg.norm(seen, axis=1)
    return [Bound(int(v), seen[i] / size[i], lower[i] / size[i], upper[i] / size[i]) for i, v in enumerate(s.vertices)]


def _laws(s: _Surface, solver: Table) -> list[LawPoint]:
    rows = {
        "friction": [tangents(n) for n in s.turned],
        "adhesion": list(-s.turned[:, None]),
        "support": list(s.turned[:, None]),
    }
    found = []
    for key in (k for k in rows if k in s.table):
        law = law_of(s.table[key], solver)
        found += [LawPoint(int(v), rows[key][i], s.weights[i], law) for i, v in enumerate(s.vertices)]
    return found


def _side(mesh: Mesh, on: str | list[str]) -> Integers:
    return np.concatenate([mesh.sides[name] for name in ([on] if isinstance(on, str) else on)])


def _labels(mesh: Mesh) -> Integers:
    n = len(mesh.points)
    first, rest = mesh.cells[:, :1], mesh.cells[:, 1:]
    pairs = np.stack([np.broadcast_to(first, rest.shape).ravel(), rest.ravel()])
    graph = sp.coo_matrix((np.ones(pairs.shape[1]), pairs), shape=(n, n))
    return np.asarray(sp.csgraph.connected_components(graph, directed=False)[1], dtype=np.int64)


def _named(table: Table, single: set[str]) -> list[Table]:
    """The tables of [material] or [body], whether named or not."""
    return [table] if not table or single & set(table) else list(table.values())


def assemble(scene: Table, mesh: Mesh) -> Problem:
    """A scene's tables on a mesh."""
    d, n, solver = mesh.dimension, len(mesh.points), scene.get("solver", {})
    elements, labels = Elements(mesh), _labels(mesh)
    regions = {name: mesh.regions == i for i, name in enumerate(mesh.names)}
    every = np.ones(len(mesh.cells), bool)
    matrix, strain = sp.csr_matrix((n * d, n * d)), np.zeros(n * d)
    load, stress, modulus = np.zeros(n * d), np.zeros(labels.max() + 1), 0.0
    heats = [b for b in _named(scene.get("body", {}), {"force", "temperature"}) if b]
    for material in _named(scene["material"], {"model"}):
        where = regions[material["region"]] if "region" in material else every
        matrix = matrix + elements.stiffness(material, where)
        modulus = max(modulus, float(np.abs(hooke(material)).max()))
        for body in (b for b in heats if "temperature" in b):
            inside = where & (regions[body["region"]] if "region" in body else every)
            held = thermal_stress(material)
            strain += elements.strain_load(held, body["temperature"], inside, formula)
            for label in np.unique(labels[mesh.cells[inside]]):
                size = np.abs(formula(body["temperature"], mesh.points)).max() * np.abs(held).max()
                stress[label] = max(stress[label], size)
    for body in (b for b in heats if "force" in b):
        inside = regions[body["region"]] if "region" in body else every
        load += elements.body_load(body["force"], inside, formula)
        for label in np.unique(labels[mesh.cells[inside]]):
            largest = max(np.abs(formula(f, mesh.points)).max() for f in body["force"])
            stress[label] = max(stress[label], largest * mesh.size)
    fixed: dict[int, float] = {}
    surfaces: list[_Surface] = []
    for part in scene["boundary"].values():
        facets = _side(mesh, part["on"])
        vertices = np.unique(facets)
        sizes = [0.0]
        if "traction" in part:
            load += elements.traction_load(facets, part["traction"], formula)
            sizes += [float(np.abs(formula(f, mesh.points[vertices])).max()) for f in part["traction"]]
        for i, value in enumerate(part.get("displacement", [])):
            if value != "free":
                values = formula(value, mesh.points[vertices])
                fixed |= {int(v) * d + i: float(x) for v, x in zip(vertices, values, strict=True)}
                sizes.append(modulus * float(np.ptp(values)) / mesh.size)
        if {"contact", "friction", "adhesion", "support"} & set(part):
            surfaces.append(_surface(mesh, facets, part))
        for label in np.unique(labels[vertices]):
            stress[label] = max(stress[label], *sizes)
    order = np.array(sorted(fixed), dtype=np.int64)
    values = np.array([fixed[int(i)] for i in order])
    _turn(surfaces, order, d)
    bounds = [b for s in surfaces for b in _bounds(mesh, s, order)]
    laws = [p for s in surfaces for p in _laws(s, solver)]
    tolerance = float(solver.get("tolerance", 1e-8))
    return Problem(mesh, matrix.tocsr(), load, strain, order, values, bounds, laws, labels, stress, modulus, tolerance)
