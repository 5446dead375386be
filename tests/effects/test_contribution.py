"""What an effect adds is refused where it is made if it is of a wrong kind."""

from __future__ import annotations

from typing import Any

import pytest
import ufl
from dolfinx import fem, mesh
from mpi4py import MPI

from hvi_fenicsx.effects import Contribution

SPACE = fem.functionspace(mesh.create_unit_square(MPI.COMM_SELF, 1, 1), ("Lagrange", 1))
TEST = ufl.TestFunction(SPACE)


@pytest.mark.parametrize(
    ("entries", "told"),
    [
        ({"linear": (3,)}, "linear holds a int"),
        ({"linear": (TEST,)}, "linear holds a Argument"),
        ({"laws": ("coulomb",)}, "laws holds a str"),
        ({"linear": (ufl.TrialFunction(SPACE) * TEST * ufl.dx,)}, "linear holds a form of 2 arguments"),
        ({"bilinear": (TEST * ufl.dx,)}, "bilinear holds a form of 1 arguments"),
    ],
)
def test_entries_of_a_wrong_kind_are_refused(entries: dict[str, Any], told: str) -> None:
    with pytest.raises(TypeError, match=told):
        Contribution(**entries)
