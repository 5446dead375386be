"""Paths in space on which all bonds break, so that contact alone holds the body and it may still rock."""

from __future__ import annotations

import numpy as np
import pytest
from dolfinx import mesh
from mpi4py import MPI

import hvi_fenicsx as hvi

FADING = hvi.laws.Graph(points=[[0, 0], [0, 3739.0], [1.697e-4, 0]])
HOLLOW = {"shape": "cylinder", "center": [0.0, 0.0, 0.998], "axis": [0.0, 1.0, 0.0], "radius": 2.0, "hollow": True}


def keel() -> hvi.Body:
    """A box whose floor has an edge below, along y."""
    box = mesh.create_box(MPI.COMM_SELF, [[-0.45, 0.0, -1.0], [0.45, 0.8, 0.0]], [2, 1, 1])
    sides = {"floor": -1.0, "load": 0.0}
    found = [mesh.locate_entities_boundary(box, 2, lambda x, z=z: np.isclose(x[2], z)) for z in sides.values()]
    facets, tags = np.concatenate(found), np.repeat(np.array([1, 2], dtype=np.int32), [len(f) for f in found])
    order = np.argsort(facets)
    x = box.geometry.x
    x[:, 2] += np.where(np.isclose(x[:, 2], -1.0), 0.15 * (x[:, 0] / 0.45) ** 2, 0.0)
    marked = mesh.meshtags(box, 2, facets[order], tags[order])
    return hvi.Body(box, facets=marked, names={"floor": 1, "load": 2})


def rocking(*more: hvi.Friction) -> hvi.Model:
    """It falls into a hollow cylinder, in which its edge alone touches."""
    material = hvi.Isotropic(youngs_modulus=7e6, poisson_ratio=0.45)
    floor = hvi.Contact("floor", obstacle=HOLLOW)
    return hvi.Model(keel(), [material, hvi.Traction("load", [0.0, 0.0, -6e3]), floor, *more])


@pytest.mark.long
def test_a_body_whose_friction_has_faded_rests_as_one_without_friction() -> None:
    """Statics: the same energy; without memory, less what the broken bonds have lost."""
    rubbing, without = hvi.Friction("floor", FADING), hvi.solve(rocking())
    paths = [hvi.follow(rocking(rubbing), memory=memory) for memory in (True, False)]
    assert [(path.end, path.uncertified) for path in paths] == [("reached", 0)] * 2
    broken, whole = (path.rows[-1] for path in paths)
    assert broken.energy == pytest.approx(without.energy, rel=1e-9)
    assert whole.energy - broken.dissipated == pytest.approx(without.energy, rel=1e-9)
