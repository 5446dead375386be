"""Which bilinear forms depend on strains alone, as a material's does: found from the form itself."""

from __future__ import annotations

from typing import Any

import numpy as np
import ufl
from dolfinx import fem

from ..mesh import nodes
from ..rigid import RigidBody, rigid_fields
from ..runtime import forms
from ..typing import Array
from .spaces import coefficients_of
from .vectors import nodal_values

ROUNDING = 1e-10
"""Forces of a rigid motion that are less than this part of those of a stretch are rounding."""


def feels_no_rigid_motion(form: Any, space: fem.FunctionSpace) -> bool:
    """Whether a bilinear form is zero for every rigid motion. Collective.

    Args:
        form: a(u, v) in UFL.
        space: of its arguments.
    """
    points, d = coefficients_of(space, nodes.points(space)), space.mesh.geometry.dim
    field = fem.Function(space)
    compiled = forms.compiled(ufl.action(form, field))

    def force(values: Array) -> float:
        field.x.array[:] = values.ravel()
        return float(np.sqrt(space.mesh.comm.allreduce(float(np.sum(nodal_values(compiled) ** 2)))))

    motions = rigid_fields(points, RigidBody(dimension=d, centre=np.zeros(3)))
    sizes = [force(motions[:, k]) for k in range(motions.shape[1])]
    return max(sizes) <= ROUNDING * force(points[:, :d])
