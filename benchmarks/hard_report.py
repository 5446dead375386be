"""The document of a hard-case matrix, docs/hard-cases.md of the first, from the results alone."""

from __future__ import annotations

import re
import statistics
from collections import Counter
from collections.abc import Iterable, Sequence
from pathlib import Path

from covering import Case, Table
from hard_results import SOLVED, Record, Results

QUICK = 10.0
"""Seconds of processor time within which all methods are compared."""
_BRANCH = "`branch` was run on the unsmoothed laws only, because it is made for them.\n"
_PATHS = """ A path is solved if all its rows are certified and its end
is not against what is proved: it reaches a load at which the body is held, and ends before one that moves it away."""
COMMAND = "./hvi exec python3 benchmarks/hard_cases.py"


def write(name: str, table: Table, listed: Sequence[Case], records: Iterable[Record], folder: Path) -> None:
    """Both files, called as the table is."""
    results, page = Results(table, listed, records), name.replace("_", "-")
    parts = [
        _head(name, table, listed),
        _counts(results),
        _iterations(results),
        _without(results),
        *(_open(results, m) for m in results.methods),
    ]
    (folder / f"{page}.md").write_text("\n\n".join(parts) + "\n", encoding="utf-8")


def _without(results: Results) -> str:
    """The search of cases in which no method found an equilibrium."""
    ended = {r["key"] for of in results.of.values() for r in of.values() if r["outcome"] == "no_equilibrium"}
    decided = {key: number for key, number in results.enumerated.items() if number is not None}
    confirmed = sum(not number for number in decided.values())
    rows = [[f"`{k}`", *_size(results.cases[k]), str(n)] for k, n in decided.items()]
    words = f"""## Cases without an equilibrium

In {len(ended - results.found)} metastable or borderline cases no method found an equilibrium."""
    if not rows:
        return words
    words += f""" Is there none?
`hvi equilibria` searches all of them where the floor is short: here in {len(results.enumerated)} cases.
In {len(decided)} of them it ended with a proof within a minute. {confirmed} of these have no equilibrium."""
    return f"{words}\n\n{_markdown(['case', 'law', 'cells', 'equilibria there are'], rows)}"


def _size(case: Case) -> list[str]:
    return [case["law"], str(case["cells"])]


def _head(name: str, table: Table, listed: Sequence[Case]) -> str:
    return f"""# {table.data["title"]}

{_about(name, table, listed)} The list of cases follows from the axes
(`{COMMAND} list --table {name}`): it has

- every value of an axis, in an otherwise plain case;
- every pair of values of two axes;
- every combination of values of these axes: {"; ".join(", ".join(t) for t in table.data["groups"])};
- a few combinations of many extreme values.

The commands are

    {COMMAND} run --table {name}       # hours for all methods; `--method auto` is minutes; resumes where it stopped
    {COMMAND} report --table {name}    # writes this document

A case counts as solved in three situations: its displacement is certified within
{table.data["tolerance"]:g}; or it is proved that no solution exists (state *escapes*); or its state is metastable or
borderline, and no method found an equilibrium.{_PATHS if "question" in table.axes else ""} The time of one case and
method is processor time."""


def _about(name: str, table: Table, listed: Sequence[Case]) -> str:
    later = " (the `later` values before anything was run with them)" if "later" in table.data else ""
    return f"""This page reports {len(listed)} difficult problems. Only the certificate decides whether a problem is
solved. {table.data["about"]} `benchmarks/{name}.toml` has the axes and their values. They were committed before
anything was run{later}."""


def _counts(results: Results) -> str:
    words = [
        "method",
        "limit, s",
        "cases run",
        "no solution exists",
        "refused",
        "asked",
        "solved",
        "share of those asked",
    ]
    words += ["held: certified", "no equilibrium found", "missed", "failed"]
    quick = [f"`{m}` {_quick(results, m)}" for m in results.methods]
    return f"""## How many cases does each method solve?

{_markdown(words, (_count(results, m) for m in results.methods))}

There are {len(results.cases)} cases; what is missing under *cases run* has not been run yet. The columns mean:

- *no solution exists*: the existence analysis proves it before any method is asked; not counted under
  *asked* and *solved*;
- *refused*: `tao` and `ssls` take no law with a kink (the paper's smoothing keeps one at zero slip); `condensed` runs
  in one process only; an exact law that jumps upwards at a length is taken in the plane only;
- *asked*: the cases run, without these two;
- *held: certified*: of the cases in which the body is held, so that an equilibrium exists, those that are certified;
- *no equilibrium found*: the state is metastable or borderline, and no method or search found an equilibrium;
- *missed*: the method found no equilibrium, but another method or the search did;
- *failed*: all other cases.

{_BRANCH if "branch" in results.methods else ""}Solved within {QUICK:g} s: {", ".join(quick)}."""


def _count(results: Results, method: str) -> list[str]:
    records, taken = results.of[method].values(), results.taken(method)
    count = Counter(results.outcome(r) for r in records)
    solved, held = sum(count[k] for k in SOLVED), [r for r in taken if r.get("state") == "held"]
    certified = sum(r["outcome"] == "certified" for r in held)
    limits = sorted({r["limit"] for r in records})
    share = f"{100 * solved / max(1, len(taken)):.1f} %"
    return [
        f"`{method}`",
        ", ".join(f"{t:g}" for t in limits),
        *map(str, (len(records), count["escapes"], count["refused"], len(taken))),
        f"**{solved}**",
        share,
        f"{certified} of {len(held)}",
        *(str(count[k]) for k in ("no_equilibrium", "missed", "failed")),
    ]


def _quick(results: Results, method: str) -> int:
    return sum(results.solved(r) and r.get("cpu", 0.0) <= QUICK for r in results.taken(method))


def _iterations(results: Results) -> str:
    entries = {"newton": "Newton", "linear": "linear", "branch": "convex steps", "cpu": "processor time, s"}
    rows = []
    for method in results.methods:
        ended = [r for r in results.of[method].values() if r["outcome"] == "certified"]
        rows.append([f"`{method}`", *(_spread([r[e] for r in ended if e in r]) for e in entries)])
    text = "## How many iterations do the certified cases take? Median, maximum\n\n"
    return text + _markdown(["method", *entries.values()], rows)


def _spread(values: Sequence[float]) -> str:
    return f"{statistics.median(values):.3g}, {max(values):.3g}" if values else ""


def _open(results: Results, method: str) -> str:
    """The unsolved cases, counted by reason; for ``auto`` one by one too."""
    found, head = results.unsolved(method), f"## Cases that `{method}` does not solve, by reason"
    if not found:
        return f"{head}\n\nNone."
    reasons = Counter(_reason(r) for r in found).most_common()
    summary = f"{head}\n\n" + "\n".join(f"- {number} × {reason}" for reason, number in reasons)
    if method != "auto":
        return summary
    rows = [_row(results.cases[r["key"]], r, results) for r in found]
    listing = _markdown(["case", "what is not plain about it", "state", "outcome", "reason"], rows)
    return f"{summary}\n\n<details><summary>The list</summary>\n\n{listing}\n\n</details>"


def _reason(record: Record) -> str:
    """The reason without its figures, so that equal reasons count together."""
    return re.split(r", (?:residual|merit)|: vertices|\d+\.\d", record["reason"])[0].strip()


def _row(case: Case, record: Record, results: Results) -> list[str]:
    plain = next(iter(results.cases.values())).values
    special = ", ".join(f"{a} {v}" for a, v in case.values.items() if v != plain[a])
    return [f"`{case.key}`", special, record.get("state", ""), results.outcome(record), record["reason"]]


def _markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(cell.replace('|', '/') for cell in line)} |" for line in lines)
