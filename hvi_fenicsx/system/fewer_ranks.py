"""Coarse levels of multigrid on fewer ranks than their mesh: with few unknowns each, ranks would only send messages.

Neighbouring ranks give their rows to the first of them. Row numbers stay as they are. A rank without rows neither sends
nor receives, so no communicator of its own is needed. What reaches the coarsest level, on one rank, has come through
the levels above it as through a tree.
"""

from __future__ import annotations

from petsc4py import PETSc


def joined_ranks(unknowns: int, ranks: int, least: int) -> int:
    """How many neighbouring ranks give their rows to the first of them, so that each that is left has enough.

    Args:
        unknowns: of the level.
        ranks: all.
        least: unknowns of a rank, on average.
    """
    left = min(ranks, max(1, unknowns // least))
    return -(-ranks // left)


class PlacedMatrix:
    """A square matrix whose rows are on some of its ranks. Creation is collective.

    Args:
        source: the matrix on all ranks.
        joined: how many neighbouring ranks give their rows to the first of them.

    Attributes:
        rows: the global numbers of the rows on this rank.
        matrix: the matrix as it is placed; the source itself where no rank gives rows away.
    """

    def __init__(self, source: PETSc.Mat, joined: int) -> None:
        self._source, self._moved = source, joined > 1
        self.rows = _rows(source, joined)
        self.matrix = source.createSubMatrix(self.rows, self.rows) if self._moved else source
        self._state = source.stateGet()

    def update(self) -> None:
        """Take over the values of the source, where they have changed. Collective."""
        if self._moved and self._source.stateGet() != self._state:
            self._source.createSubMatrix(self.rows, self.rows, self.matrix)
            self._state = self._source.stateGet()

    def prolongation(self, matrix: PETSc.Mat, finer: PlacedMatrix) -> PETSc.Mat:
        """A prolongation from this level, its rows where those of the finer level are. Collective.

        Args:
            matrix: the prolongation on all ranks.
            finer: the matrix of the finer level.
        """
        return matrix.createSubMatrix(finer.rows, self.rows) if self._moved or finer._moved else matrix

    def free(self) -> None:
        """Free the PETSc objects; the source stays. Collective."""
        self.rows.destroy()
        if self._moved:
            self.matrix.destroy()


def _rows(matrix: PETSc.Mat, joined: int) -> PETSc.IS:
    ranges, rank = matrix.getOwnershipRanges(), matrix.comm.rank
    end = min(rank + joined, matrix.comm.size) if rank % joined == 0 else rank
    return PETSc.IS().createStride(int(ranges[end] - ranges[rank]), int(ranges[rank]), 1, comm=matrix.comm)
