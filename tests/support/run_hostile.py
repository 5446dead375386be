"""Hostile cases of a seed: run_hostile.py --seed 1 --cases 300. What is at fault is printed, its folder stays."""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections import Counter
from pathlib import Path

from hostile import driver


def main() -> int:
    """Run the cases; 1 if one is at fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, metavar="NUMBER")
    parser.add_argument("--cases", type=int, default=300, metavar="COUNT")
    parser.add_argument("--step", type=int, default=1, metavar="N", help="only each Nth, to share the cases out")
    given = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="hostile-"))
    found = driver.attack(folder, given.seed, range(given.first, given.first + given.cases, given.step))
    wrong = [told for told in found if told["faults"]]
    for told in wrong:
        print(f"{told['number']} {told.get('kind')} {told['what']!r}: {told['faults']}")
    codes = Counter(told["code"] for told in found)
    print(f"seed {given.seed}: {len(found)} cases, {len(wrong)} at fault, exit codes {dict(codes)}; see {folder}")
    return bool(wrong)


if __name__ == "__main__":
    sys.exit(main())
