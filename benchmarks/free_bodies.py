"""What existence costs over the number of bodies: stacks that stand on a floor alone, and pushed over at the top.

./hvi exec python3 benchmarks/free_bodies.py
"""

from __future__ import annotations

import os
import resource
import time
from typing import Any

from common import parser, say, table

from hvi_fenicsx import prepare, read_tables


def stack(count: int, push: float) -> dict[str, Any]:
    """Blocks with contact and friction between them, and under the lowest."""
    held = {"contact": {"gap": 0.0}, "friction": {"law": "tresca", "yield_traction": 2e4}}
    blocks = {
        f"b{i}": {"shape": "rectangle", "size": [1.0, 0.5], "cells": [4, 2], "origin": [0.0, 0.5 * i]}
        for i in range(count)
    }
    seams = {f"s{i}": {"between": [f"b{i}.top", f"b{i + 1}.bottom"], **held} for i in range(count - 1)}
    sides = {
        "floor": {"on": "b0.bottom", **held},
        "top": {"on": f"b{count - 1}.top", "traction": [push, -1e5]},
    }
    material = {"model": "plane_stress", "youngs_modulus": 1e9, "poisson_ratio": 0.3}
    return {"domain": blocks, "material": material, "interface": seams, "boundary": sides}


def measured(count: int, push: float) -> list[object]:
    """Processor seconds of the verdict, the peak memory of the process, and the verdict; in a process of its own."""
    reading, writing = os.pipe()
    if not os.fork():
        start = time.process_time()
        found = prepare(read_tables(stack(count, push)))
        whole, peak = time.process_time() - start, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
        state = found.solvability.state
        os.write(writing, f"{state} {whole:.2f} {peak:.0f}".encode())
        os._exit(0)
    os.wait()
    return [count, *os.read(reading, 200).decode().split()]


def main() -> None:
    parser(__doc__).parse_args()
    rows = [measured(count, push) for push in (0.0, 1e5) for count in (2, 8, 20, 60)]
    say(table(["bodies", "state", "from scene to verdict, s of the processor", "peak memory, MB"], rows))


if __name__ == "__main__":
    main()
