"""The length of a vector of displacements that a law acts on: of a slip in space, or of opening and slip together.

With components c_i and factors b_i it is δ(c) = sqrt(Σ (b_i c_i)²); an opening counts only where it is positive. δ is
convex and positively homogeneous. Off δ = 0 the law j has ∂(j∘δ) = ∂j(δ) ∇δ; at 0 it is the traction j'(0+) times the
part of an ellipsoid Σ (f_i / b_i)² ≤ 1, of which an opening leaves the half f_0 ≥ 0.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from typing_extensions import override

from ..class_registry import enter
from ..errors import InputError
from ..typing import Array, Mask
from .registry import require_number, require_positive

_ROUNDS = 40
"""Newton steps to the boundary of an ellipsoid, at most; they end long before."""


@dataclass(frozen=True)
class Length:
    """A length of vectors with k components. Arrays of vectors have shape (m, k), arrays of lengths (m,).

    Attributes:
        factors: what the components are multiplied by, all positive, k numbers.
        opens: whether the first component is an opening, which counts only where it is positive.
    """

    factors: tuple[float, ...]
    opens: bool = False

    @classmethod
    def plain(cls, k: int) -> Length:
        """The Euclidean length of k components."""
        return cls((1.0,) * k)

    def of(self, c: Array) -> Array:
        """δ at vectors c."""
        return np.linalg.norm(self._felt(c), axis=1)

    def gradient(self, c: Array) -> Array:
        """∇δ at vectors c, (m, k); zero where δ is."""
        felt = self._felt(c)
        size = np.linalg.norm(felt, axis=1, keepdims=True)
        return np.divide(felt, size, out=np.zeros_like(felt), where=size > 0.0) * np.array(self.factors)

    def hessian(self, c: Array, first: Array, second: Array) -> Array:
        """The second derivative of a function of δ, (m, k, k); at δ = 0 the one behind, on the side of an opening.

        Args:
            c: the vectors, (m, k).
            first: derivative of the function at δ(c), (m,).
            second: its second derivative, (m,).
        """
        unit, size = self.gradient(c), self.of(c)
        along = unit[:, :, None] * unit[:, None, :]
        across = np.divide(first, size, out=np.array(second, dtype=float), where=size > 0.0)
        weights = np.where(self._counts(c), np.array(self.factors) ** 2, 0.0)
        whole = weights[:, :, None] * np.eye(len(self.factors))
        return second[:, None, None] * along + across[:, None, None] * (whole - along)

    def traction(self, c: Array, forces: Array, near: float | Array) -> Array:
        """The traction of the law, by which ∇δ makes forces per area; at δ = 0 the least that can give them, (m,).

        Args:
            c: the vectors, (m, k).
            forces: along the components, (m, k).
            near: lengths up to this are zero, one for all or (m,).
        """
        unit = self.gradient(c)
        squares = np.sum(unit**2, axis=1)
        moving = self.of(c) > near
        along = np.divide(np.sum(forces * unit, axis=1), squares, out=np.zeros_like(squares), where=moving)
        least = np.linalg.norm(self._pulled(forces) / np.array(self.factors), axis=1)
        return np.where(moving, along, least)

    def nearest(self, forces: Array, most: Array) -> tuple[Array, Array]:
        """The forces at δ = 0 that are nearest to given ones, (m, k), and their derivative by these, (m, k, k).

        Args:
            forces: along the components, (m, k).
            most: j'(0+), (m,).
        """
        axes = np.array(self.factors) * most[:, None]
        pulled = self._pulled(forces)
        shift = self._shift(pulled, axes)[:, None]
        share = np.divide(axes**2, axes**2 + shift, out=np.zeros_like(axes), where=axes > 0.0)
        found = share * pulled
        slope = np.eye(len(self.factors)) * (share * (forces == pulled))[:, :, None]
        # on the boundary found = share(t) pulled, where t keeps Σ (found / axes)² = 1
        out = np.divide(found, axes**2, out=np.zeros_like(axes), where=axes > 0.0)
        scale = np.sum(share * out**2, axis=1, keepdims=True)
        turned = share * out * (forces == pulled)
        edge = (shift > 0.0) & (scale > 0.0)
        normal = np.divide(turned, np.sqrt(scale), out=np.zeros_like(axes), where=edge)
        return found, slope - normal[:, :, None] * normal[:, None, :]

    def allowed(self, c: Array, forces: Array, ends: tuple[Array, Array], near: float | Array) -> Array:
        """The forces per area nearest to given ones that a law of δ allows, (m, k).

        Args:
            c: the vectors, (m, k).
            forces: along the components, (m, k).
            ends: Clarke's subdifferential of the law at δ(c), (m,) each.
            near: lengths up to this are zero, one for all or (m,).
        """
        sizes = np.clip(self.traction(c, forces, near), *ends)
        at_rest, _ = self.nearest(np.where(self.counts_at_zero(c, near), forces, 0.0), np.maximum(ends[1], 0.0))
        return np.where((self.of(c) > near)[:, None], sizes[:, None] * self.gradient(c), at_rest)

    def slip_share(self, c: Array, near: Array) -> Array:
        """The share of all components but the first in δ², (m,); NaN where δ is zero.

        Args:
            c: the vectors, (m, k).
            near: lengths up to this are zero, one for all or (m,).
        """
        felt, size = self._felt(c), self.of(c)
        slip = np.linalg.norm(felt[:, 1:], axis=1)
        share = np.divide(slip, size, out=np.full_like(size, np.nan), where=size > near)
        return share**2

    def counts_at_zero(self, c: Array, near: float | Array) -> Mask:
        """Which components count to first order at δ = 0, (m, k): not an opening that is negative.

        Args:
            c: the vectors, (m, k).
            near: distances up to this are zero, one for all or (m,).
        """
        counts = np.ones(c.shape, dtype=bool)
        if self.opens:
            counts[:, 0] = c[:, 0] >= -near
        return counts

    def two_sided(self) -> Mask:
        """Which components count in both directions, (k,)."""
        counts = np.ones(len(self.factors), dtype=bool)
        counts[0] = not self.opens
        return counts

    def _felt(self, c: Array) -> Array:
        return np.where(self._counts(c), c, 0.0) * np.array(self.factors)

    def _counts(self, c: Array) -> Mask:
        return self.counts_at_zero(c, 0.0)

    def _pulled(self, forces: Array) -> Array:
        """Forces without those that press where there is an opening, with which they do no work."""
        return np.where(self._counts(forces), forces, 0.0)

    def _shift(self, forces: Array, axes: Array) -> Array:
        """The multiplier t ≥ 0 with Σ (axes f / (axes² + t))² = 1; 0 inside of the ellipsoid, (m,)."""
        shift = np.zeros(len(forces))
        flat = np.all(axes <= 0.0, axis=1)
        for _ in range(_ROUNDS):
            below = np.where(flat[:, None], 1.0, axes**2 + shift[:, None])
            ends = axes * forces / below
            size = np.sqrt(np.sum(ends**2, axis=1))
            beyond = size > 1.0
            slope = np.sum(ends**2 / below, axis=1)
            step = np.divide((size - 1.0) * size**2, slope, out=np.zeros_like(size), where=beyond)
            shift = shift + step
            if not np.any(step > 1e-15 * shift):
                break
        return shift


_REGISTRY: dict[str, type] = {}


@dataclass(frozen=True)
class Mixity(ABC):
    """A criterion of mixed-mode separation. A subclass with a `name` is registered under it.

    Attributes:
        energy_ratio: the energy of slip alone over that of opening alone.
        exponent: of the criterion, at least 1.

    Raises:
        InputError: these are not such numbers.
    """

    name: ClassVar[str]
    energy_ratio: float
    exponent: float

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        enter(_REGISTRY, cls, cls.name, "mixity")

    def __post_init__(self) -> None:
        require_positive(self._title, energy_ratio=self.energy_ratio)
        require_number(self._title, exponent=self.exponent)
        if self.exponent < 1.0:
            raise InputError(f"{self._title}: exponent = {self.exponent!r} must be at least 1")

    @property
    def _title(self) -> str:
        """How messages name it."""
        return f"mixity {self.name!r}"

    @abstractmethod
    def energy(self, share: Array) -> Array:
        """The energy of separation over that of opening alone, monotone in the share, (m,).

        Args:
            share: of the slip in the work, 0 to 1, (m,).
        """

    @abstractmethod
    def slope(self, share: Array) -> Array:
        """The derivative of the energy by the share, (m,).

        Args:
            share: of the slip in the work, 0 to 1, (m,).
        """


class BenzeggaghKenane(Mixity):
    """G = G_I + (G_II - G_I) B^exponent (Benzeggagh and Kenane 1996)."""

    name = "benzeggagh_kenane"

    @override
    def energy(self, share: Array) -> Array:
        return 1.0 + (self.energy_ratio - 1.0) * share**self.exponent

    @override
    def slope(self, share: Array) -> Array:
        return (self.energy_ratio - 1.0) * self.exponent * share ** (self.exponent - 1.0)


class PowerLaw(Mixity):
    """(G (1 - B)/G_I)^exponent + (G B/G_II)^exponent = 1 (Wu and Reuter 1965)."""

    name = "power_law"

    @override
    def energy(self, share: Array) -> Array:
        return self._parts(share) ** (-1.0 / self.exponent)

    @override
    def slope(self, share: Array) -> Array:
        power = self.exponent - 1.0
        change = (1.0 - share) ** power - (share / self.energy_ratio) ** power / self.energy_ratio
        return change * self._parts(share) ** (-1.0 / self.exponent - 1.0)

    def _parts(self, share: Array) -> Array:
        return (1.0 - share) ** self.exponent + (share / self.energy_ratio) ** self.exponent


def mixities() -> dict[str, type[Mixity]]:
    """All criteria by name, sorted by it."""
    return dict(sorted(_REGISTRY.items()))
