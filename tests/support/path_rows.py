"""Rows of load paths of which only factor and event matter."""

from __future__ import annotations

import numpy as np

from hvi_fenicsx.paths.load_path import PathRow


def path_row(factor: float, event: str = "kink") -> PathRow:
    """A row with nothing else in it.

    Args:
        factor: of the load.
        event: what happens there.
    """
    return PathRow(
        factor=factor,
        event=event,
        part=None,
        point=None,
        energy=0.0,
        work=0.0,
        dissipated=0.0,
        released=0.0,
        unstable=0,
        forces={"pull": np.zeros(2)},
        displacements={"pull": np.zeros(2)},
        certified=True,
    )
