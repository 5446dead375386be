"""The compliance of half-spaces against closed forms."""

from __future__ import annotations

import numpy as np
import pytest

from hvi_fenicsx.estimate.data_errors import surface_compliance

FACET = np.array([[[0.0, 0.0, 0.0], [2.0, 0.0, 0.0]]])
TRIANGLE = np.array([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]])


def isotropic(d: int, lame: float, shear: float) -> np.ndarray:
    """C_ijkl below one facet."""
    e = np.eye(d)
    return (
        lame * np.einsum("ij,kl->ijkl", e, e)
        + shear * (np.einsum("ik,jl->ijkl", e, e) + np.einsum("il,jk->ijkl", e, e))
    )[None]


def test_an_isotropic_half_plane_gives_way_by_two_over_e() -> None:
    lame, shear = 1.7, 0.6
    e = 4 * shear * (lame + shear) / (lame + 2 * shear)
    assert surface_compliance(isotropic(2, lame, shear), FACET) == pytest.approx(2 / e, rel=1e-12)


def test_a_half_space_in_the_mean_of_all_waves() -> None:
    lame, shear = 1.7, 0.6
    inside = (lame + 2 * shear) / (2 * shear * (lame + shear))
    expected = [(inside + 1 / shear) / 2, (inside + 1 / shear) / 2, inside]
    assert surface_compliance(isotropic(3, lame, shear), TRIANGLE)[0] == pytest.approx(expected, rel=1e-12)


def test_an_orthotropic_half_plane() -> None:
    """Dongye and Ting: Explicit expressions of Barnett-Lothe tensors, Q. Appl. Math. 47 (1989)."""
    c11, c22, c12, c66 = 5.0, 1.3, 0.4, 0.7
    c = np.zeros((1, 2, 2, 2, 2))
    c[0, 0, 0, 0, 0], c[0, 1, 1, 1, 1], c[0, 0, 0, 1, 1], c[0, 1, 1, 0, 0] = c11, c22, c12, c12
    for i, j in ((0, 1), (1, 0)):
        c[0, i, j, 0, 1] = c[0, i, j, 1, 0] = c66
    mean = np.sqrt(c11 * c22)
    along = (c12 + mean) * np.sqrt(c66 * (mean - c12) / (c22 * (c12 + 2 * c66 + mean)))
    assert surface_compliance(c, FACET)[0] == pytest.approx([1 / along, 1 / (along * np.sqrt(c22 / c11))], rel=1e-12)
