"""Gmsh files for the tests, made by gmsh in a process of its own: good ones, and those that must be refused."""

from __future__ import annotations

import functools
import subprocess
import sys
import tempfile
from pathlib import Path

_START = """
import sys, gmsh
path = sys.argv[1]
gmsh.initialize(["-noenv"], interruptible=False)
gmsh.option.setNumber("General.Terminal", 0)
occ, mesh = gmsh.model.occ, gmsh.model.mesh
SIDES = {"left": (0, 0, 0, 1), "right": (1, 0, 1, 1), "bottom": (0, 0, 1, 0), "top": (0, 1, 1, 1)}

def groups(names):
    near = 1e-6
    for name in names:
        a, b, c, d = SIDES[name]
        found = gmsh.model.getEntitiesInBoundingBox(a - near, b - near, -near, c + near, d + near, near, 1)
        gmsh.model.addPhysicalGroup(1, [tag for _, tag in found], name=name)

def body():
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in gmsh.model.getEntities(2)], name="body")

def square(size):
    gmsh.option.setNumber("Mesh.MeshSizeMax", size)
    occ.addRectangle(0, 0, 0, 1, 1)
    occ.synchronize()
    groups(SIDES)
    body()
"""
_END = "\ngmsh.write(path)\ngmsh.finalize()\n"
GOOD = "square(0.2)\nmesh.generate(2)"
HALVES = """
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.2)
parts = [(2, occ.addRectangle(0, 0, 0, 0.5, 1)), (2, occ.addRectangle(0.5, 0, 0, 0.5, 1))]
occ.fragment(parts[:1], parts[1:])
occ.synchronize()
groups(SIDES)
for name, at in (("soft", 0.0), ("hard", 0.5)):
    found = gmsh.model.getEntitiesInBoundingBox(at - 1e-6, -1e-6, -1e-6, at + 0.5 + 1e-6, 1 + 1e-6, 1e-6, 2)
    gmsh.model.addPhysicalGroup(2, [tag for _, tag in found], name=name)
mesh.generate(2)
"""
BAD = {
    "third order": "square(0.3)\nmesh.generate(2)\nmesh.setOrder(3)",
    "quadrilaterals": "square(0.3)\nmesh.generate(2)\nmesh.recombine()",
    "lines only": "occ.addLine(occ.addPoint(0, 0, 0), occ.addPoint(1, 0, 0))\nocc.synchronize()\n"
    'gmsh.model.addPhysicalGroup(1, [1], name="bottom")\nmesh.generate(1)',
    "a solid": 'occ.addBox(0, 0, 0, 1, 1, 1)\nocc.synchronize()\ngmsh.model.addPhysicalGroup(3, [1], name="body")\n'
    'gmsh.model.addPhysicalGroup(2, [1], name="left")\nmesh.generate(3)',
    "no groups": "occ.addRectangle(0, 0, 0, 1, 1)\nocc.synchronize()\nmesh.generate(2)",
    "not in a plane": "square(0.3)\nmesh.generate(2)\nmesh.affineTransform([1, 0, 0, 0, 0, 1, 0, 0, 0.5, 0, 1, 0])",
}
SLANTED = """
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
p = [occ.addPoint(*x, 0) for x in ((0, 0), (1, 0.4), (1, 1), (0, 1))]
lines = [occ.addLine(p[i], p[(i + 1) % 4]) for i in range(4)]
occ.addPlaneSurface([occ.addCurveLoop(lines)])
occ.synchronize()
for name, line in zip(("bottom", "right", "top", "left"), lines):
    gmsh.model.addPhysicalGroup(1, [line], name=name)
body()
mesh.generate(2)
"""


def make(path: Path, body: str) -> Path:
    """A file by gmsh; ``body`` is run in its API, with a few helpers. What was made before is written again."""
    path.write_bytes(_made(path.suffix, body))
    return path


@functools.cache
def _made(suffix: str, body: str) -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        made = Path(folder, f"made{suffix}")
        script = _START + body + _END
        subprocess.run([sys.executable, "-c", script, str(made)], check=True, capture_output=True, timeout=60)
        return made.read_bytes()


def transformed(path: Path, source: Path, matrix: list[float]) -> Path:
    """The same mesh with its points moved by a 3 x 4 affine matrix, row by row."""
    script = f"gmsh.open({str(source)!r})\nmesh.affineTransform({matrix!r})"
    return make(path, script)


BLOCKS = """
gmsh.option.setNumber("Mesh.MeshSizeMax", {size})
d, named = {dimension}, {named}
for x in (0, 2):
    occ.addRectangle(x, 0, 0, 1, 1) if d == 2 else occ.addBox(x, 0, 0, 1, 1, 1)
occ.synchronize()
for x, name in ((0, "a"), (2, "b")):
    ends = {{"left": (0, x), "right": (0, x + 1), "bottom": (d - 1, 0), "top": (d - 1, 1)}}
    low, high = [x, 0, 0][:d], [x + 1, 1, 1][:d]
    for side, (axis, at) in ends.items():
        a, b = list(low), list(high)
        a[axis] = b[axis] = at
        box = [c - 1e-6 for c in (a + [0])[:3]] + [c + 1e-6 for c in (b + [0])[:3]]
        found = gmsh.model.getEntitiesInBoundingBox(*box, d - 1)
        gmsh.model.addPhysicalGroup(d - 1, [tag for _, tag in found], name=f"{{side}}_{{name}}")
    if named:
        box = [c - 1e-6 for c in (low + [0])[:3]] + [c + 1e-6 for c in (high + [0])[:3]]
        found = gmsh.model.getEntitiesInBoundingBox(*box, d)
        gmsh.model.addPhysicalGroup(d, [tag for _, tag in found], name=name)
if not named:
    gmsh.model.addPhysicalGroup(d, [tag for _, tag in gmsh.model.getEntities(d)], name="both")
mesh.generate(d)
"""
"""Two unit blocks, at x = 0 and x = 2: to be formatted with size, dimension, and whether each is a region (a, b)."""
HINGE = """
gmsh.option.setNumber("Mesh.MeshSizeMax", 0.5)
parts = [(2, occ.addRectangle(0, 0, 0, 1, 1)), (2, occ.addRectangle(1, 1, 0, 1, 1))]
occ.fragment(parts[:1], parts[1:])
occ.synchronize()
groups(["left", "bottom"])
body()
mesh.generate(2)
"""
GRADED = """
p = [occ.addPoint(*x, 0, 0.005 if x == (0, 0) else 0.1) for x in ((0, 0), (1, 0), (1, 1), (0, 1))]
occ.addPlaneSurface([occ.addCurveLoop([occ.addLine(p[i], p[(i + 1) % 4]) for i in range(4)])])
occ.synchronize()
groups(SIDES)
body()
mesh.generate(2)
"""
BORED = """
occ = gmsh.model.occ
box = occ.addBox(0, 0, 0, 1, 1, 1)
if {radius}:
    occ.cut([(3, box)], [(3, occ.addCylinder(0.5, -0.1, 0.6, 0, 1.2, 0, {radius}))])
occ.synchronize()
found = {{}}
for _, tag in gmsh.model.getEntities(2):
    ends = gmsh.model.getBoundingBox(2, tag)
    thin = [i for i in range(3) if ends[i + 3] - ends[i] < 1e-5]
    names = ("left", "front", "bottom", "right", "back", "top")
    found.setdefault(names[thin[0] + 3 * (ends[thin[0]] > 0.5)] if thin else "bore", []).append(tag)
for name, tags in found.items():
    gmsh.model.addPhysicalGroup(2, tags, name=name)
gmsh.model.addPhysicalGroup(3, [tag for _, tag in gmsh.model.getEntities(3)], name="body")
gmsh.option.setNumber("Mesh.MeshSizeMax", {size})
gmsh.option.setNumber("Mesh.MeshSizeMin", {size})
mesh.generate(3)
"""
TOUCHING = """
gmsh.option.setNumber("Mesh.MeshSizeMax", {size})
d = {dimension}
for y in (0, 1):
    occ.addRectangle(0, y, 0, 1, 1) if d == 2 else occ.addBox(0, y, 0, 1, 1, 1)
occ.synchronize()
for body, name in ((1, "lower"), (2, "upper")):
    gmsh.model.addPhysicalGroup(d, [body], name=name)
    sides = [tag for _, tag in gmsh.model.getBoundary([(d, body)], oriented=False)]
    heights = [gmsh.model.occ.getCenterOfMass(d - 1, tag)[1] for tag in sides]
    for at, side in ((0, "low"), (1, "high")):
        chosen = [tag for tag, y in zip(sides, heights) if abs(y - body + 1 - at) < 1e-6]
        gmsh.model.addPhysicalGroup(d - 1, chosen, name=f"{{name}}_{{side}}")
ends = [tag for dim, tag in gmsh.model.getEntities(d - 1)
        if abs(gmsh.model.occ.getCenterOfMass(dim, tag)[0]) < 1e-6]
gmsh.model.addPhysicalGroup(d - 1, ends, name="left")
mesh.setSize(gmsh.model.getBoundary([(d, 2)], recursive=True), 0.8 * {size})
mesh.generate(d)
"""
"""A unit block on another that it shares no point with; the meshes differ. To be formatted with size and dimension."""
