"""A Newton step with elastic forces by cell, where the rounding of the matrix keeps a solution from its certificate.

A product with the matrix rounds each row on its own. In a slender body that is bent far the errors of the rows have a
net force, which is left on Γc where neither contact nor a law carries it. Forces of cells are in balance whatever the
displacement.
"""

from __future__ import annotations

from dolfinx import fem

from ..certify.certificate import Certificate, Examination
from ..certify.thresholds import DEFAULT, CertificateThresholds
from ..system.levels import Levels
from ..system.system import System
from . import dual_norm
from .dual_norm import DualNorm


def may_help(found: Certificate, thresholds: CertificateThresholds = DEFAULT) -> bool:
    """Whether a certificate is missed by no more than rounding may be.

    Args:
        found: the certificate.
        thresholds: what is no rounding.
    """
    names = ("equilibrium", "net_force", "penetration", "tension", "complementarity", "inclusion")
    return not found.passed and max(getattr(found, name) for name in names) <= thresholds.largest_rounding


def corrected(
    system: System,
    levels: Levels,
    u: fem.Function,
    examination: Examination,
    thresholds: CertificateThresholds = DEFAULT,
) -> fem.Function:
    """The displacement after the step, with contact and sticking kept as they are. Collective.

    Args:
        system: what was solved.
        levels: its coarser levels; none where there is no mesh hierarchy.
        u: its solution, nondimensional, ghosts updated.
        examination: of the same u.
        thresholds: how accurately the step is solved for.
    """
    inverse = DualNorm(system, levels, u)
    force = dual_norm.algebraic(system.problem, examination, thresholds.near)
    step, _ = inverse.solve(force, thresholds.correction)
    inverse.destroy()
    found = fem.Function(u.function_space, name=u.name)
    found.x.array[:] = u.x.array - step.x.array
    return found
