"""``report.html``: drawn from the folder alone, self-contained, and saying what the numbers say."""

from __future__ import annotations

import base64
import json
import re
import shlex
import shutil
import tomllib
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import pytest
from runs import ROOT, hvi, summary

from hvi_fenicsx.errors import HviError
from hvi_fenicsx.report import page as pages

PUSHED = ROOT / "demos" / "pushed_block.toml"
PIXEL = base64.b64decode(
    "iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg=="
)
VOID = {"meta", "link", "img", "br"}


class Page(HTMLParser):
    """Its text, its attributes by tag, and whether its tags are closed in order."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self._open: list[str] = []
        self._text: list[str] = []
        self.feed(file.read_text(encoding="utf-8"))
        assert self._open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        self._open += [] if tag in VOID else [tag]

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self._open:
            self._text.append(data)

    @property
    def text(self) -> str:
        return " ".join(" ".join(self._text).split())

    def all(self, tag: str, attribute: str) -> list[str]:
        return [found[attribute] or "" for name, found in self.tags if name == tag and attribute in found]


def pushed(folder: Path, share: float, *words: str) -> Path:
    """A block pushed with this share of the floor's peak strength, heavy enough not to tip."""
    change = [f"boundary.push.traction=[{share}e6, 0]", "boundary.press.traction=[0, -4e6]", "domain.cells=[4, 4]"]
    sets = [w for c in change for w in ("--set", c)]
    hvi("run", PUSHED, "--out", folder, "--no-pictures", *sets, *words)
    return folder


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return pushed(tmp_path_factory.mktemp("reports") / "held", 0.4)


def test_state_and_load_factors_are_told_in_words(held: Path) -> None:
    """Statics by hand: the floor bears 0.5e6 N/m for ever and 1e6 N/m at its peak, the push is 0.4e6 N/m."""
    text = Page(held / "report.html").text
    assert "A solution exists, was found, and is certified." in text
    assert "held up to 1.25 times the given load" in text
    assert "beyond 2.5 times the given load no equilibrium can exist" in text
    assert "All passed." in text
    assert "failed" not in text


def test_every_state_has_its_headline(tmp_path: Path) -> None:
    metastable, escapes, lost = (pushed(tmp_path / str(share), share) for share in (0.6, 1.1, 0.99))
    assert [summary(f)["exit_code"] for f in (metastable, escapes, lost)] == [0, 3, 4]
    words = "An equilibrium was found and is certified; the state is metastable."
    assert words in Page(metastable / "report.html").text
    text = Page(escapes / "report.html").text
    assert "No solution exists: the load carries the body away." in text
    assert "translation along +x" in text
    assert "There was nothing to certify" in text
    text = Page(lost / "report.html").text
    assert "No certified solution: metastable, and no equilibrium found" in text
    assert f"the last state that is borne is shown, at load factor {summary(lost)['last_borne']['factor']:.6g}" in text
    assert "Under the whole load no equilibrium was found." in text
    assert "stable equilibrium" not in text


def test_nothing_comes_from_elsewhere_and_pictures_are_whole(held: Path, tmp_path: Path) -> None:
    folder = shutil.copytree(held, tmp_path / "copy")
    for name in ("contact.png", "body.png", "scene.png", "own.png"):
        (folder / name).write_bytes(PIXEL)
    page = Page(pages.write(folder))
    sources = page.all("img", "src")
    assert [base64.b64decode(s.removeprefix("data:image/png;base64,")) for s in sources] == 4 * [PIXEL]
    everything = [value or "" for _, found in page.tags for key, value in found.items() if key in ("src", "href")]
    assert all(value.startswith("data:") for value in everything)
    assert not {tag for tag, _ in page.tags} & {"script", "iframe", "object", "embed"}
    assert "url(" not in (folder / "report.html").read_text(encoding="utf-8")
    assert [path.name for path in folder.iterdir() if path.name.startswith(".")] == []


def test_the_scene_in_the_page_is_the_scene(held: Path) -> None:
    page = Page(held / "report.html")
    scene = (held / "scene.toml").read_text(encoding="utf-8")
    (download,) = page.all("a", "href")
    assert base64.b64decode(download.split(",")[1]).decode() == scene
    assert " ".join(scene.split()) in page.text
    for name in tomllib.loads(scene)["boundary"]:
        assert name in page.text
    words = [word.rpartition("/")[2] if word[0] == "/" else word for word in shlex.split(summary(held)["command"])]
    assert shlex.join(words) in page.text


def test_a_scene_cannot_write_into_the_page(held: Path, tmp_path: Path) -> None:
    folder = pushed(tmp_path / "sly", 0.4, "--set", 'title="<script>alert(1)</script> & {{ 7*7 }}"')
    page = Page(folder / "report.html")
    assert "script" not in {tag for tag, _ in page.tags}
    assert "<script>alert(1)</script> & {{ 7*7 }}" in page.text


def changed(held: Path, folder: Path, **entries: Any) -> Path:
    shutil.copytree(held, folder)
    record = {**summary(held), **entries}
    (folder / "summary.json").write_text(json.dumps(record), encoding="utf-8")
    return pages.write(folder)


def test_a_certified_solution_on_a_coarse_mesh_is_not_called_good(held: Path, tmp_path: Path) -> None:
    rough = {"relative": 0.43, "total": 43.0, "discretisation": 43.0, "energy_norm": 100.0, "coarse": True}
    page = Page(changed(held, tmp_path / "new", estimate=rough))
    assert "Certified on a coarse mesh: the estimated error is large" in page.text
    assert "A solution exists, was found, and is certified." not in page.text


@pytest.mark.parametrize("name", ["summary.json", "scene.toml"])
def test_a_damaged_folder_is_refused(held: Path, tmp_path: Path, name: str) -> None:
    folder = shutil.copytree(held, tmp_path / "copy")
    (folder / name).write_text("{ not", encoding="utf-8")
    with pytest.raises(HviError, match=re.escape(name)):
        pages.write(folder)


def test_a_study_has_its_page(tmp_path: Path) -> None:
    record = {"scene": "A & B", "sentences": ["10 % costs 2 s."], "points": [{}, {}], "ranks": 1, "version": "0"}
    text = json.dumps({**record, "quantities": {"u_t_l2": "u_t on Γc, L2"}})
    (tmp_path / "study.json").write_text(text, encoding="utf-8")
    (tmp_path / "time.png").write_bytes(PIXEL)
    page = Page(pages.write_study(tmp_path))
    assert "10 % costs 2 s." in page.text
    assert "A & B: what accuracy costs" in page.text
    assert len(page.all("img", "src")) == 1
    (tmp_path / "study.json").write_text("[", encoding="utf-8")
    with pytest.raises(HviError, match="study"):
        pages.write_study(tmp_path)
