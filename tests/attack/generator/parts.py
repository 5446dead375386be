"""Random boundary parts, body forces and solver tables."""

from __future__ import annotations

from typing import Any

from generator.draws import Draw, round_to
from generator.law_draws import law

Table = dict[str, Any]


def load(g: Draw, at: str) -> list[Any]:
    """A traction on a side, mostly towards the body's inside at the top and outwards at the sides."""
    size = round_to(g.stress * g.log(-1, 0.7))
    down, along = g.d - 1, 0
    found: list[Any] = [0.0] * g.d
    if at == "top":
        shape = g.pick("even", "tilted", "square", p=[0.6, 0.3, 0.1])
        a = round_to(g.rng.uniform(-1.9, 1.9), 3) / g.length
        found[down] = {"even": -size, "tilted": f"-{size}*(1+{a}*x)", "square": f"-{size}*(1-{abs(a)}*x*x)"}[shape]
        if g.some(0.3):
            found[along] = round_to(g.signed(-2, 0) * g.stress)
    else:
        found[along] = round_to(g.pick(1.0, 1.0, -1.0) * size)
        if g.some(0.2):
            found[down] = round_to(g.signed(-2, 0) * g.stress)
    if g.d == 3 and g.some(0.3):
        found[1] = round_to(g.signed(-2, 0) * g.stress)
    return found


def _gap(g: Draw) -> Table:
    """Contact of a side: with gaps of many forms, or bilateral."""
    form = g.pick("zero", "even", "wavy", "curved", "bilateral", "equal", p=[0.5, 0.13, 0.12, 0.1, 0.1, 0.05])
    size, k = round_to(g.u0 * g.log(-1.5, 0.5), 4), round_to(3.0 / g.length, 4)
    if form == "bilateral":
        return {"lower": round_to(-g.u0 * g.log(-2, 0)), "upper": size}
    if form == "equal":
        value = 0.0 if g.some(0.5) else size
        return {"lower": value, "upper": value}
    return {
        "gap": {"zero": 0.0, "even": size, "wavy": f"{size}*(1+sin({k}*x))", "curved": f"{size}*({k}*x-1.5)**2"}[form]
    }


def laws(g: Draw, part: Table, chance: float) -> None:
    if g.some(chance):
        part["friction"] = law(g, "slip vector" if g.d == 3 else "friction")
    if g.some(0.3):
        key = g.pick("adhesion", "support")
        part[key] = law(g, key)


def floor(g: Draw, on: Any = "bottom", *, flat: bool = True) -> Table:
    part: Table = {"on": on}
    if g.some(0.88):
        part["contact"] = _obstacle(g) if not flat or g.some(0.12) else _gap(g)
    laws(g, part, 0.75)
    if len(part) == 1:
        part["contact"] = {"gap": 0.0}
    return part


def _obstacle(g: Draw) -> Table:
    """A flat obstacle, often nearly parallel to an axis."""
    slope = g.pick(0.0, g.signed(-6.5, -3.5), g.signed(-3, -0.5), p=[0.3, 0.5, 0.2])
    normal = g.vector(slope, 1.0) if g.d == 2 else [slope, 0.0, 1.0]
    point = g.vector(g.pick(0.0, g.length))
    return {"obstacle": {"point": point, "normal": normal}}


def _side(g: Draw, at: str) -> Table | None:
    """What stands at a side that is not the floor."""
    role = g.pick(
        "none", "load", "guide", "clamp", "moved", "contact", "law", p=[0.2, 0.37, 0.16, 0.05, 0.07, 0.1, 0.05]
    )
    part: Table = {"on": at}
    axis = {"left": 0, "right": 0, "front": 1, "back": 1}.get(at, g.d - 1)
    if role == "load":
        part["traction"] = load(g, at)
    elif role in ("guide", "moved"):
        value: Any = 0.0 if role == "guide" else round_to(g.signed(-1, 0.5) * g.u0)
        if role == "moved" and g.some(0.4):
            value = f"{value}*(1+sin({round_to(9 / g.length)}*{'x' if axis else 'y'}))"
        part["displacement"] = [value if i == axis else "free" for i in range(g.d)]
    elif role == "clamp":
        part["displacement"] = [0.0] * g.d
    elif role == "contact":
        part["contact"] = _gap(g)
        laws(g, part, 0.4)
    elif role == "law":
        laws(g, part, 1.0)
    return part if role != "none" and len(part) > 1 else None


def boundary(g: Draw, prefix: str = "", *, flat: bool = True) -> Table:
    sides = ["left", "right", "top"] + (["front", "back"] if g.d == 3 else [])
    found: Table = {f"{prefix}floor": floor(g, f"{prefix}bottom", flat=flat)}
    if g.some(0.06):
        found[f"{prefix}floor"] = {"on": f"{prefix}bottom", "displacement": [0.0] * g.d}
    if g.some(0.5) and (flat or g.some(0.1)):  # the paper's own arrangement, of random sizes
        wall = g.pick("left", "right")
        found[f"{prefix}wall"] = {"on": prefix + wall, "displacement": g.vector(0.0)[:1] + ["free"] * (g.d - 1)}
        found[f"{prefix}pull"] = {"on": prefix + ("right" if wall == "left" else "left"), "traction": load(g, "right")}
        found[f"{prefix}press"] = {"on": f"{prefix}top", "traction": load(g, "top")}
        return found
    driven = False
    for side in sides:
        part = _side(g, side)
        if part is not None and "displacement" in part:
            moved = any(c not in (0.0, "free") for c in part["displacement"])
            part = None if driven and moved else part
            driven = driven or moved
        if part is not None and not flat and not g.some(0.1) and "traction" not in part:
            part = None  # slanted sides meet the floor at an angle that the program refuses
        if part is not None:
            found[f"{prefix}at_{side}"] = part | {"on": prefix + side}
    press = f"{prefix}at_top"
    if press not in found and g.some(0.8):
        found[press] = {"on": f"{prefix}top", "traction": load(g, "top")}
    if g.some(0.1):  # balanced, as large as may be
        size = round_to(g.stress * g.log(0, 4))
        off = 1.0 + g.pick(0.0, 1e-9, 1e-7, 1e-3)
        found[f"{prefix}at_left"] = {"on": f"{prefix}left", "traction": g.vector(size * off)}
        found[f"{prefix}at_right"] = {"on": f"{prefix}right", "traction": g.vector(-size)}
    return found


def body(g: Draw, table: Table) -> Table:
    """Force and temperature of a body, or nothing."""
    found: Table = {}
    if g.some(0.2):
        size = round_to(g.stress / g.length * g.log(-1, 0.5))
        found["force"] = [round_to(g.rng.uniform(-0.3, 0.3) * size), *[0.0] * (g.d - 2), -size]
    if g.some(0.12) and table.get("elasticity", "isotropic") == "isotropic":
        table["thermal_expansion"] = 1.2e-5
        heat = round_to(g.signed(-1, 0.5) * g.u0 / g.length / 1.2e-5)
        found["temperature"] = heat if g.some(0.6) else f"{heat}*(1+{round_to(1 / g.length)}*x)"
    return found


def solver_table(g: Draw, boundary: Table) -> Table:
    stated = [p[k] for p in boundary.values() for k in ("friction", "adhesion", "support") if k in p]
    found: Table = {}
    if stated and g.some(0.1):
        paper = all(w["law"] == "quadratic_linear" for w in stated)
        found["smoothing"] = g.pick("quadratic", "chks", "log_exp", *(["paper"] if paper else []))
        found["epsilon_absolute"] = round_to(g.stress * g.u0 * g.log(-4, -1))
    if g.some(0.06) and stated:
        found["method"] = g.pick("branch", "snes_vi", "condensed")
    if g.some(0.1) and stated and "method" not in found:
        found["start"] = g.pick("unbroken", "resting", "broken")
    if g.some(0.3):
        found["second_order"] = True
    return found
