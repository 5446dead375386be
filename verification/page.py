"""The page of the verification: a table of what was expected and found, a picture for each curve."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Sequence
from pathlib import Path

import matplotlib as mpl
import quantities
from outcomes import Comparison, Outcome

mpl.use("Agg")
from matplotlib import pyplot as plt

COLUMNS = ("case", "quantity", "expected", "found", "difference", "tolerance", "", "expected from")
HEAD = """# Do the results of others come out?

    ./hvi exec python3 verification/verify.py

This page and its pictures are written by that command. The cases are in `verification/cases.toml`: a command, a source,
and for each number the value and the tolerance that were written down before the case first ran here. A miss stays in
the table, with its explanation. The seconds are those of a
machine of two cores on which other programs ran too.

"""


def rows(outcome: Outcome) -> Iterator[str]:
    """The lines of the table for one case."""
    title = f"[{outcome.case['title']}](#{anchor(outcome.case['title'])})"
    for comparison in outcome.comparisons():
        yield row(title, comparison)
        title = ""


def anchor(title: str) -> str:
    return re.sub(r"[^\w -]", "", title.lower()).replace(" ", "-")


def row(title: str, comparison: Comparison) -> str:
    expected, found = comparison.expected, comparison.found
    unit = f" {expected['unit']}".rstrip()
    shown = "none" if found is None else f"{found:.5g}{unit}"
    off = "" if found is None or not expected["value"] else f"{100 * (found / expected['value'] - 1):+.2f} %"
    verdict = "agrees" if comparison.agrees else f"**misses**: {expected.get('miss', 'not explained')}"
    name = expected["quantity"].replace("_", " ") + (f" {expected['key']}" if "key" in expected else "")
    allowed = f"{100 * expected['tolerance']:g} %"
    return line(title, name, f"{expected['value']:.6g}{unit}", shown, off, allowed, verdict, expected["from"])


def line(*cells: str) -> str:
    return f"| {' | '.join(cells)} |"


def section(outcome: Outcome, images: Path) -> str:
    """Source, command, remarks and the picture of one case."""
    case = outcome.case
    words = ["./hvi", *(shlex.quote(word) for word in case["command"])]
    lines = [
        f"## {case['title']}\n",
        f"Source: {case['source']}.\n",
        f"Command: `{' '.join(words)}`\n",
    ]
    if "remark" in case:
        lines.append(f"{case['remark']}\n")
    if "curve" in case and outcome.code == 0:
        draw(outcome, images / f"{case['name']}.png")
        lines.append(
            f"![{case['curve']['y_label']} over {case['curve']['x_label']}](images/verification/{case['name']}.png)\n"
        )
    lines.append(f"It took {outcome.seconds:.0f} s.\n")
    return "\n".join(lines)


def draw(outcome: Outcome, path: Path) -> None:
    """The curve of a path, and the points that were published."""
    curve = outcome.case["curve"]
    moved, force = quantities.PeakForce(part=curve["part"], axis=curve["axis"]).curve(outcome.folder)
    figure, axes = plt.subplots(figsize=(6.4, 3.8), layout="constrained")
    axes.plot(curve["x_scale"] * moved, curve["y_scale"] * force, label="hvi path", linewidth=1.5)
    published = outcome.case.get("published", [])
    if published:
        axes.plot(*zip(*published, strict=True), "o", color="tab:red", label="published")
        axes.legend(frameon=False)
    axes.set(xlabel=curve["x_label"], ylabel=curve["y_label"], title=outcome.case["title"])
    axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def write(outcomes: Sequence[Outcome], docs: Path) -> None:
    """``docs/verification.md`` and its pictures."""
    images = docs / "images" / "verification"
    images.mkdir(parents=True, exist_ok=True)
    table = "\n".join([line(*COLUMNS), line(*("---" for _ in COLUMNS)), *(text for o in outcomes for text in rows(o))])
    sections = "\n".join(section(outcome, images) for outcome in outcomes)
    (docs / "verification.md").write_text(f"{HEAD}{table}\n\n{sections}", encoding="utf-8")
