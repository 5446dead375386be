"""What is frozen of a result: the numbers and words that users read, in few lines, from the files of its folder."""

from __future__ import annotations

import csv
import itertools
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

Record = dict[str, Any]
ROWS = 24
"""Of a path so many rows are kept, evenly spread; of the others their number and their events."""
TRACTIONS = ("sigma_n", "friction_t1", "friction_t2")
LENGTHS = ("u_n", "u_t1", "u_t2", "gap")
COLUMNS = {"tractions": TRACTIONS, "displacements": LENGTHS, "states": ("contact", "branch_t", "branch_n")}


def record(command: str, code: int, output: str, folder: Path) -> Record:
    """What is frozen of a command that has ended.

    Args:
        command: run, check, path or equilibria.
        code: its exit code.
        output: what it printed.
        folder: its result.
    """
    if command == "check":
        return {"code": code} | (_checked(json.loads(output)) if output.startswith("{") else {})
    if not (folder / "summary.json").exists():
        return {"code": code}
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    return {"code": code} | {"run": _state, "path": _path, "equilibria": _equilibria}[command](summary, folder)


def _checked(report: Record) -> Record:
    known = report["solvability"]
    effects = [[e["effect"], e["where"], e["bounds"], e["unknowns"]] for e in report["effects"]]
    return {"dofs": report["dofs"], **_existence(known), "load_factors": report["load_factors"], "effects": effects}


def _existence(known: Record) -> Record:
    return {key: known[key] for key in ("state", "margin", "lambda_held", "lambda_peak", "direction", "kernel", "free")}


def _state(summary: Record, folder: Path) -> Record:
    certificate, estimate = summary["certificate"] or {}, summary["estimate"] or {}
    return {
        "dofs": summary["dofs"],
        "solvability": _existence(summary["solvability"]),
        "energy": summary["energy"],
        "contact": {k: (summary["contact"] or {}).get(k) for k in ("vertices", "active", "resultant")},
        "max_gap": (summary["contact"] or {}).get("max_gap"),
        "resultants": _together(summary["resultants"] or {}),
        "mode_mixity": summary["mode_mixity"],
        "certificate": {key: certificate.get(key) for key in ("passed", "second_order")},
        "estimate": {key: estimate.get(key) for key in ("relative", "total", "energy_norm")},
        "columns": _columns(folder / "contact.csv") if (folder / "contact.csv").exists() else {},
    }


def _together(values: dict[str, Any]) -> Record:
    """Of a table by parts: one list, so that small entries are judged by the large ones."""
    return {"of": list(values), "are": list(values.values())}


def _columns(file: Path) -> Record:
    """Sums over the vertices of each part, plain and weighted by their place in the table: any change shows."""
    with file.open(encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    found: Record = {}
    for part, members in itertools.groupby(rows, key=lambda row: row["part"]):
        table = list(members)
        place = np.linspace(-1.0, 1.0, len(table))
        found[part] = {"vertices": len(table)}
        for kind, names in COLUMNS.items():
            values = np.array([[float(row[n] or 0) for n in names] for row in table])
            sums = [values.sum(axis=0), place @ values, np.abs(values).max(axis=0)]
            found[part][kind] = rounded(sums)
    return found


def _path(summary: Record, folder: Path) -> Record:
    path = summary["path"]
    with (folder / "path.csv").open(encoding="utf-8") as text:
        rows = [row for row in csv.DictReader(text) if row["event"] != "step"]
    shown = [rows[i] for i in np.unique(np.linspace(0, len(rows) - 1, ROWS).round().astype(int))] if rows else []
    forces = [name for name in rows[0] if name.rpartition(".")[2] in ("fx", "fy", "fz")] if rows else []
    moved = [name for name in rows[0] if name.rpartition(".")[2] in ("ux", "uy", "uz")] if rows else []
    return {
        "end": path["end"],
        "events": _runs([row["event"] for row in rows]),
        "all_certified": path["uncertified"] == 0,
        "peak_factor": path["peak_factor"],
        "folds": path["folds"],
        "jumps": rounded([[jump["factor"], jump["released"]] for jump in path["jumps"]][:ROWS]),
        "factors": [row["factor"] for row in _numbers(shown, ("factor",))],
        "energies": [list(row.values()) for row in _numbers(shown, ("energy", "work", "dissipated"))]
        + [rounded([path["work"], path["dissipated"]])],
        "forces": [list(row.values()) for row in _numbers(shown, forces)],
        "displacements": [list(row.values()) for row in _numbers(shown, moved)],
        "stable": "".join(row["stable"] or "?" for row in shown),
        "columns": forces + moved,
    }


def _numbers(rows: Sequence[dict[str, str]], names: Sequence[str]) -> list[dict[str, Any]]:
    return [{name: rounded(float(row[name])) if row[name] else None for name in names} for row in rows]


def _runs(events: Sequence[str]) -> str:
    """Like "start kink*3 jump end"."""
    counted = [(name, len(list(same))) for name, same in itertools.groupby(events)]
    return " ".join(name if n == 1 else f"{name}*{n}" for name, n in counted)


def _equilibria(summary: Record, folder: Path) -> Record:
    found = summary["equilibria"]
    with (folder / "equilibria.csv").open(encoding="utf-8") as text:
        rows = list(csv.DictReader(text))
    keys = ("count", "complete", "proven", "lowest_energy")
    return {key: found[key] for key in keys} | {"points": [[float(r["energy"]), r["kind"]] for r in rows]}


def rounded(value: Any) -> Any:
    """Twelve digits, which are more than any comparison asks for."""
    if isinstance(value, (list, tuple, np.ndarray)):
        return [rounded(entry) for entry in value]
    return value if value is None or isinstance(value, (int, str)) else float(f"{float(value):.12g}")
