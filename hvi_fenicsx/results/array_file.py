"""Arrays as a NumPy archive: rank 0 writes the rows of each rank as they come, and holds no more than a block of them.

Open MPI's parallel files do not tell that a disk is full, and a zip file is written from its beginning to its end.
"""

from __future__ import annotations

import itertools
import zipfile
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from ..runtime import writing
from ..runtime.mpi import on_root

_BLOCK = 1 << 22
"""Bytes that travel at a time."""
Rows = npt.NDArray[Any]


def write(comm: MPI.Comm, path: Path, arrays: Mapping[str, Rows]) -> None:
    """Write the archive, whole or not at all, as ``numpy.savez`` does. Collective.

    Args:
        comm: the ranks.
        path: the file.
        arrays: by their names, the same on all ranks: of each array this rank's rows, which follow those of the rank
            before it. A number without rows is that of rank 0.

    Raises:
        NotWrittenError: on all ranks alike: it cannot be written.
    """
    lengths = comm.gather([_length(values) for values in arrays.values()])
    blocks = iter(()) if lengths is None else _blocks(comm, arrays, lengths)
    if lengths is None:
        for values in arrays.values():
            for block in _cut(values) if values.ndim else ():
                comm.Send(block, dest=0)
    on_root(comm, lambda: _save(path, arrays, lengths or [], blocks))


def _length(values: Rows) -> int:
    return len(values) if values.ndim else 0


def _cut(values: Rows) -> Iterator[npt.NDArray[np.uint8]]:
    """The bytes of an array, block by block; none of an empty one."""
    raw = np.ascontiguousarray(values).reshape(-1).view(np.uint8)
    return (raw[start : start + _BLOCK] for start in range(0, len(raw), _BLOCK))


def _blocks(
    comm: MPI.Comm, arrays: Mapping[str, Rows], lengths: Sequence[Sequence[int]]
) -> Iterator[tuple[str, npt.NDArray[np.uint8]]]:
    """The name and the bytes of each array, at least once, in the order of the file. Rank 0 only."""
    room = np.empty(_BLOCK, dtype=np.uint8)
    for number, (name, values) in enumerate(arrays.items()):
        yield name, room[:0]
        for block in _cut(values):
            yield name, block
        row = int(np.prod(values.shape[1:])) * values.itemsize
        for source in range(1, comm.size):
            for left in range(lengths[source][number] * row, 0, -_BLOCK):
                block = room[: min(left, _BLOCK)]
                comm.Recv(block, source=source)
                yield name, block


def _save(
    path: Path,
    arrays: Mapping[str, Rows],
    lengths: Sequence[Sequence[int]],
    blocks: Iterator[tuple[str, npt.NDArray[np.uint8]]],
) -> None:
    """Write the blocks. Rank 0 only; in any case all that the others send is received."""
    rows = dict(zip(arrays, map(sum, zip(*lengths, strict=True)), strict=True))
    try:
        with writing.whole(path) as aside, zipfile.ZipFile(aside, "w") as archive:
            for name, own in itertools.groupby(blocks, lambda block: block[0]):
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    values = arrays[name]
                    shape = (rows[name], *values.shape[1:]) if values.ndim else ()
                    head = {"descr": values.dtype.str, "fortran_order": False, "shape": shape}
                    np.lib.format.write_array_header_1_0(member, head)
                    for _, block in own:
                        member.write(block.data)
    finally:
        for _ in blocks:
            pass
