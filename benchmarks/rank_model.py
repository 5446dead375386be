"""The model of docs/scaling.md: the time of one iteration of conjugate gradients with multigrid, by ranks.

    ./hvi exec python3 benchmarks/rank_model.py [UNKNOWNS] [--weak]

With --weak UNKNOWNS are those of each rank.
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from math import log2

from hvi_fenicsx.system.fewer_ranks import joined_ranks
from hvi_fenicsx.system.thresholds import DEFAULT

PRODUCT, LATENCY, NUMBER = 9e-9, 2e-6, 1e-9
"""Seconds of a product with the matrix per unknown, of a message, and of a number sent."""
COARSEST, COARSEST_SOLVE = 2_178, 5e-5
"""Unknowns of the coarsest level, and seconds of its triangular solves."""
WORK, NEIGHBOURS, GROWTH = 8.25, 6, 4
"""Products that a level costs in time, ranks around a rank, growth of unknowns from level to level in the plane."""


def levels(unknowns: float, ranks: int) -> list[tuple[float, int]]:
    """Unknowns and ranks of each level, finest first."""
    sizes = [unknowns]
    while sizes[-1] > 2 * COARSEST:
        sizes.append(sizes[-1] / GROWTH)
    joined = [1, *(joined_ranks(int(size), ranks, DEFAULT.rank_unknowns) for size in sizes[1:-1]), ranks]
    return [(size, -(-ranks // n)) for size, n in zip(sizes, joined, strict=True)]


def parts(unknowns: float, ranks: int) -> tuple[float, float, float, float]:
    """Seconds of computing, of exchanges on levels, of transfers to fewer ranks, of reductions."""
    found = levels(unknowns, ranks)
    computing = COARSEST_SOLVE + sum(WORK * PRODUCT * size / count for size, count in found[:-1])
    side = [NEIGHBOURS * LATENCY + NUMBER * 4 * (size / count) ** 0.5 for size, count in found[:-1] if count > 1]
    exchanges, gathered = 4 * sum(side) + (side[0] if side else 0.0), 0.0
    for (_, count), (size, fewer) in pairwise(found):
        if fewer < count:
            gathered += 2 * (LATENCY * (count / fewer) + NUMBER * size / fewer)
    return computing, exchanges, gathered, 4 * LATENCY * log2(ranks)


def main() -> None:
    """Print the table."""
    made = argparse.ArgumentParser(description=__doc__)
    made.add_argument("unknowns", nargs="?", type=float, default=2e6)
    made.add_argument("--weak", action="store_true")
    options = made.parse_args()
    print("| p | m | computing / ms | exchanges / ms | to fewer ranks / ms | reductions / ms | efficiency |")
    print("|---|---|---|---|---|---|---|")
    for ranks in (1, 10, 100, 1_000, 10_000):
        unknowns = options.unknowns * (ranks if options.weak else 1)
        times = parts(unknowns, ranks)
        alone = sum(parts(options.unknowns, 1)) / (1 if options.weak else ranks)
        cells = [
            f"{ranks:,}",
            f"{unknowns / ranks:,.0f}",
            *(f"{1e3 * t:.3g}" for t in times),
            f"{alone / sum(times):.2f}",
        ]
        print("| " + " | ".join(cells) + " |")


if __name__ == "__main__":
    main()
