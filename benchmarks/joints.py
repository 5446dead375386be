"""Whether meshes of two bodies that do not match cost an order of convergence.

    ./hvi exec python3 benchmarks/joints.py [--levels 2] [--degree 2]

A block is glued to another one and bent; the error in the energy norm against a mesh four times finer than the finest
one listed, for meshes that match and for meshes that do not.
"""

from __future__ import annotations

import argparse

from effectivity import lines, rows

from hvi_fenicsx import Model, read_tables


def blocks(lower: list[int], upper: list[int]) -> Model:
    """A block glued to another one, pressed askew and pushed."""
    return read_tables(
        {
            "domain": {
                "lower": {"shape": "rectangle", "size": [1.0, 0.5], "cells": lower},
                "upper": {"shape": "rectangle", "size": [1.0, 0.4], "cells": upper, "origin": [0.0, 0.5]},
            },
            "material": {"model": "plane_stress", "youngs_modulus": 2.15e11, "poisson_ratio": 0.29},
            "boundary": {
                "base": {"on": "lower.bottom", "displacement": [0.0, 0.0]},
                "press": {"on": "upper.top", "traction": [0.0, "-1e6*(1.9 - 1.8*x)"]},
                "push": {"on": "upper.left", "traction": [6e5, 0.0]},
            },
            "interface": {"seam": {"between": ["upper.bottom", "lower.top"], "tied": True}},
        }
    )


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--levels", type=int, default=2)
    parser.add_argument("--degree", type=int, default=1, choices=(1, 2))
    options = parser.parse_args()
    print("| meshes | unknowns | true / % | estimated / % | of it smoothing / % | index | order |")
    print("|---|---|---|---|---|---|---|", flush=True)
    for name, upper in (("match", [8, 4]), ("do not match", [7, 4]), ("do not match, coarser above", [5, 3])):
        scene = blocks([8, 4], upper).with_solver(degree=options.degree)
        print("\n".join(lines(name, rows(scene, options.levels))), flush=True)


if __name__ == "__main__":
    main()
