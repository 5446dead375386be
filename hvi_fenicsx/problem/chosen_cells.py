"""Forms over some of the cells only, and all cells in pieces."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import ufl
from dolfinx import mesh as dmesh
from mpi4py import MPI

from ..typing import Entities
from .thresholds import DEFAULT


def pieces(mesh: dmesh.Mesh, most: int = DEFAULT.piece) -> Iterator[Entities]:
    """The cells that this rank owns in pieces, as many on all ranks. Collective.

    Args:
        mesh: the mesh.
        most: cells of a piece.
    """
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    number = mesh.comm.allreduce(max(-(-owned // most), 1), op=MPI.MAX)
    yield from np.array_split(np.arange(owned, dtype=np.int32), number)


def on_cells(form: Any, cells: Entities) -> Any:
    """A UFL form of integrals over cells, restricted to some of them.

    Args:
        form: its subdomain data are mesh tags, or none.
        cells: local numbers.
    """
    data: list[tuple[int, Entities]] = []
    restricted = []
    for number, integral in enumerate(form.integrals(), start=1):
        data.append((number, _shared(integral, cells)))
        restricted.append(integral.reconstruct(subdomain_id=number, subdomain_data=data))
    return ufl.Form(restricted)


def _shared(integral: Any, cells: Entities) -> Entities:
    """The cells among some over which an integral goes, ascending."""
    tags, ids = integral.subdomain_data(), integral.subdomain_id()
    if tags is None:
        return np.unique(cells).astype(np.int32)
    wanted = ids if isinstance(ids, tuple) else (ids,)
    return np.intersect1d(cells, np.concatenate([tags.find(i) for i in wanted])).astype(np.int32)
