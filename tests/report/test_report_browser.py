"""``report.html`` in a real browser: nothing is cut off on a telephone or a desk, every picture is there, no request.

Runs wherever there is a Chromium, with or without dolfinx around it: the results come from ``./hvi run``.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest
from browser import CHROMIUM, Browser, browser

ROOT = Path(__file__).parents[2]
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium here; CI has one (.ci/run)"),
]
PUSH = "boundary.push.traction=[{}, 0]"
LONG_TITLE = 'title="' + "Averyveryverylongwordwithoutanyplacetobreakit" * 4 + '"'
RUNS = {
    "certified": (0, "demos/strong_law.toml", "domain.cells=[16, 16]"),
    "smoothed": (0, "demos/wall_left.toml", LONG_TITLE),
    "space": (0, "demos/anchor_3d.toml", "solver.tolerance=1e-8"),
    "mesh_file": (0, "demos/thermal_bar.toml", "solver.tolerance=1e-8"),
    "escapes": (3, "demos/pushed_block.toml", PUSH.format("1.1e6")),
    "none_found": (4, "demos/pushed_block.toml", PUSH.format("0.99e6")),
}
"""Exit code, scene and a change of it."""
CUT_OFF = """
[...document.querySelectorAll('body, body *')].filter(e => {
  const box = e.getBoundingClientRect();
  return e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0 && getComputedStyle(e).display !== 'inline'
      || box.right > document.documentElement.clientWidth + 1 || box.left < -1;
}).map(e => e.outerHTML.slice(0, 120))
"""
IMAGES = "Promise.all([...document.images].map(i => i.decode().then(() => i.naturalWidth, () => 0)))"
SMALL = """
[...document.querySelectorAll('body *')].filter(e => e.innerText && parseFloat(getComputedStyle(e).fontSize) < 11)
.map(e => e.outerHTML.slice(0, 120))
"""


@pytest.fixture(scope="module")
def chromium() -> Iterator[Browser]:
    with browser() as found:
        yield found


@pytest.fixture(scope="module", params=RUNS)
def report(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    code, scene, change = RUNS[request.param]
    wanted = os.environ.get("HVI_REPORTS")  # to look at them afterwards
    folder = (Path(wanted) if wanted else tmp_path_factory.mktemp("reports")) / request.param
    command = [str(ROOT / "hvi"), "run", str(ROOT / scene), "--set", change, "--out", str(folder), "--force"]
    run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=300, cwd=ROOT)
    assert run.returncode == code, run.stderr
    return folder / "report.html"


def kept(report: Path, name: str) -> Path:
    """Where a picture of the page goes: beside the result."""
    return report.parent.with_name(f"{report.parent.name}_{name}")


@pytest.mark.parametrize("width", [390, 1280])
def test_it_renders_whole_and_alone(chromium: Browser, report: Path, width: int) -> None:
    chromium.open(report, width)
    assert chromium.evaluate("innerWidth") == width
    assert chromium.evaluate("document.documentElement.scrollWidth - document.documentElement.clientWidth") == 0
    assert chromium.evaluate(CUT_OFF) == []
    assert chromium.evaluate(SMALL) == []
    sizes = chromium.evaluate(IMAGES)
    assert len(sizes) == len(list(report.parent.glob("*.png"))) > 0
    assert min(sizes) >= 1000
    kept(report, f"{width}.png").write_bytes(chromium.picture())
    asked = [m["params"]["request"]["url"] for m in chromium.heard if m.get("method") == "Network.requestWillBeSent"]
    assert [url for url in asked if not url.startswith("data:")] == [report.as_uri()]
    assert [m for m in chromium.heard if m.get("method") in ("Log.entryAdded", "Runtime.exceptionThrown")] == []


def test_it_prints_on_few_pages(chromium: Browser, report: Path) -> None:
    chromium.open(report, 1280)
    printed = chromium.printed()
    kept(report, "print.pdf").write_bytes(printed)
    assert printed.startswith(b"%PDF-")
    assert 2 <= len(re.findall(rb"/Type\s*/Page\b", printed)) <= 8
