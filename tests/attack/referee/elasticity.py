"""P1 elements in plain numpy: Hooke's laws, stiffness, loads by Gauss quadrature."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from referee.meshes import Array, Integers, Mask, Mesh

Table = dict[str, Any]
Formula = Callable[[Any, Array], Array]
LOCKING = 0.45
"""Above this Poisson's ratio div u is averaged by vertex in plane strain and in 3D (docs/methods.md)."""


def _isotropic(e: float, nu: float, model: str) -> Array:
    if model == "plane_stress":
        return np.asarray(e / (1 - nu**2) * np.array([[1, nu, 0], [nu, 1, 0], [0, 0, (1 - nu) / 2]]))
    lam, mu = e * nu / ((1 + nu) * (1 - 2 * nu)), e / (2 * (1 + nu))
    normal, shear = (2, 1) if model == "plane_strain" else (3, 3)
    c = np.diag(np.concatenate([np.full(normal, 2 * mu), np.full(shear, mu)]))
    c[:normal, :normal] += lam
    return c


def _orthotropic(table: Table) -> Array:
    """From the compliance: plane stress is its plane part, plane strain the plane part of the full stiffness."""
    e, nu, g = table["youngs_moduli"], table["poisson_ratios"], table["shear_moduli"]
    if table["model"] == "plane_stress":
        s = np.array([[1 / e[0], -nu[0] / e[0], 0], [-nu[0] / e[0], 1 / e[1], 0], [0, 0, 1 / g[0]]])
        return np.linalg.inv(s)
    s = np.diag([1 / e[0], 1 / e[1], 1 / e[2]])
    for (i, j), ratio in zip([(0, 1), (0, 2), (1, 2)], nu, strict=True):
        s[i, j] = s[j, i] = -ratio / e[i]
    c = np.linalg.inv(s)
    if table["model"] == "plane_strain":
        full = np.zeros((3, 3))
        full[:2, :2], full[2, 2] = c[:2, :2], g[0]
        return full
    full = np.zeros((6, 6))
    full[:3, :3], full[3:, 3:] = c, np.diag([g[2], g[1], g[0]])
    return full


def hooke(table: Table) -> Array:
    """C in Voigt's order 11, 22, 12 or 11, 22, 33, 23, 13, 12."""
    kind = table.get("elasticity", "isotropic")
    if kind == "isotropic":
        return _isotropic(table["youngs_modulus"], table["poisson_ratio"], table["model"])
    return _orthotropic(table) if kind == "orthotropic" else np.array(table["matrix"], dtype=float)


def thermal_stress(table: Table) -> Array:
    """What holds an isotropic material back from 1 K."""
    alpha, e, nu = table.get("thermal_expansion", 0.0), table["youngs_modulus"], table["poisson_ratio"]
    size = 3 if table["model"] != "three_dimensional" else 6
    held = alpha * e / (1 - (1 if table["model"] == "plane_stress" else 2) * nu)
    return held * np.repeat([1.0, 0.0], [2, 1] if size == 3 else [3, 3])


def _gauss(d: int) -> tuple[Array, Array]:
    """Barycentric points (q, d + 1) and weights of the unit simplex, sum 1: collapsed Gauss points, degree 5."""
    x, w = np.polynomial.legendre.leggauss(5)
    x, w = (x + 1) / 2, w / 2
    points, weights = [], []
    for index in itertools.product(range(5), repeat=d):
        rest, weight, barycentric = 1.0, math.factorial(d), []
        for k, i in enumerate(index):
            weight *= w[i] * (1 - x[i]) ** (d - 1 - k)
            barycentric.append(rest * x[i])
            rest *= 1 - x[i]
        points.append([*barycentric, rest])
        weights.append(weight)
    return np.array(points), np.array(weights)


class Elements:
    """The elements of a mesh."""

    def __init__(self, mesh: Mesh) -> None:
        self.mesh = mesh
        self.d = mesh.dimension
        corners = mesh.points[mesh.cells]
        full = np.concatenate([np.ones((*corners.shape[:2], 1)), corners], axis=2)
        self.gradients = np.linalg.inv(full)[:, 1:, :].transpose(0, 2, 1)
        self.volumes = np.abs(np.linalg.det(full)) / math.factorial(self.d)

    @cached_property
    def strains(self) -> Array:
        """B of each cell in Voigt's order, (m, 3|6, (d + 1) d)."""
        g, d = self.gradients, self.d
        b = np.zeros((len(g), 3 if d == 2 else 6, d + 1, d))
        for i in range(d):
            b[:, i, :, i] = g[:, :, i]
        for row, (i, j) in enumerate([(0, 1)] if d == 2 else [(1, 2), (0, 2), (0, 1)], d):
            b[:, row, :, i], b[:, row, :, j] = g[:, :, j], g[:, :, i]
        return b.reshape(len(g), b.shape[1], -1)

    @cached_property
    def dofs(self) -> Integers:
        """The unknowns of each cell, (m, (d + 1) d)."""
        return (self.mesh.cells[:, :, None] * self.d + np.arange(self.d)).reshape(len(self.mesh.cells), -1)

    def stiffness(self, material: Table, where: Mask) -> sp.csr_matrix:
        """Stiffness of the cells of one material."""
        b, dofs, volumes = self.strains[where], self.dofs[where], self.volumes[where]
        c, size = hooke(material), self.mesh.points.size
        nu = material.get("poisson_ratio", 0.0)
        averaged = material["model"] != "plane_stress" and nu > LOCKING
        if averaged:
            lam = material["youngs_modulus"] * nu / ((1 + nu) * (1 - 2 * nu))
            c = c - lam * np.pad(np.ones((self.d, self.d)), (0, len(c) - self.d))
        local = np.einsum("mri,rs,msj,m->mij", b, c, b, volumes)
        rows, columns = np.broadcast_arrays(dofs[:, :, None], dofs[:, None, :])
        k = sp.coo_matrix((local.ravel(), (rows.ravel(), columns.ravel())), shape=(size, size)).tocsr()
        return k + self._averaged(lam, where) if averaged else k

    def _averaged(self, lam: float, where: Mask) -> sp.csr_matrix:
        """λ Σ (Du)_i²/V_i with (Du)_i = ∫ φ_i div u, V_i = ∫ φ_i."""
        d, n = self.d, len(self.mesh.points)
        share = self.volumes[where] / (d + 1)
        divergence = self.gradients[where].reshape(len(share), -1) * share[:, None]
        cells, dofs = self.mesh.cells[where], self.dofs[where]
        values = np.broadcast_to(divergence[:, None, :], (len(share), d + 1, divergence.shape[1]))
        rows, columns = np.broadcast_arrays(cells[:, :, None], dofs[:, None, :])
        big = sp.coo_matrix((values.ravel(), (rows.ravel(), columns.ravel())), shape=(n, n * d)).tocsr()
        volume = np.zeros(n)
        np.add.at(volume, cells, share[:, None])
        inverse = np.divide(lam, volume, out=np.zeros(n), where=volume > 0)
        return sp.csr_matrix(big.T @ sp.diags(inverse) @ big)

    def strain_load(self, held: Array, temperature: float | str, where: Mask, formula: Formula) -> Array:
        """∫ ΔT held:ε(v)."""
        points, weights = _gauss(self.d)
        places = np.einsum("qv,mvd->mqd", points, self.mesh.points[self.mesh.cells[where]])
        heat = formula(temperature, places.reshape(-1, self.d)).reshape(places.shape[:2]) @ weights
        local = np.einsum("r,mri,m->mi", held, self.strains[where], heat * self.volumes[where])
        load = np.zeros(self.mesh.points.size)
        np.add.at(load, self.dofs[where], local)
        return load

    def body_load(self, force: list[Any], where: Mask, formula: Formula) -> Array:
        """∫ f·v."""
        return self._load(self.mesh.cells[where], self.volumes[where], force, formula)

    def traction_load(self, facets: Integers, traction: list[Any], formula: Formula) -> Array:
        """∫ t·v ds."""
        p = self.mesh.points[facets]
        if self.d == 2:
            areas = np.linalg.norm(p[:, 1] - p[:, 0], axis=1)
        else:
            areas = np.linalg.norm(np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), axis=1) / 2
        return self._load(facets, areas, traction, formula)

    def _load(self, simplices: Integers, sizes: Array, vector: list[Any], formula: Formula) -> Array:
        points, weights = _gauss(simplices.shape[1] - 1)
        places = np.einsum("qv,mvd->mqd", points, self.mesh.points[simplices])
        load = np.zeros_like(self.mesh.points)
        for i, component in enumerate(vector):
            values = formula(component, places.reshape(-1, self.d)).reshape(places.shape[:2])
            np.add.at(load[:, i], simplices, np.einsum("mq,q,qv,m->mv", values, weights, points, sizes))
        return load.ravel()
