"""Every command of the documents runs, in the order in which a reader would type them, and ends as it is said to."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from documents import DOCUMENTS, ROOT, Block, blocks, commands

LEFT_OUT = re.compile(r"^(\./hvi (test\b|exec python3 (benchmarks|tests|verification)/)|git show |pip |docker |time )")
"""The tests themselves, what takes minutes to hours on a quiet machine, the history, and what changes the machine."""
READER = ("hvi", "demos", "benchmarks", "docs", "hvi_fenicsx")
"""What a command may name, relative to the root of the repository."""


def names(documents: list[Path]) -> list[str]:
    return [str(document.relative_to(ROOT)) for document in documents]


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder that looks like the root of the repository to a reader, and where results may go."""
    for name in READER[1:]:
        (tmp_path / name).symlink_to(ROOT / name)
    launcher = tmp_path / "hvi"
    launcher.write_text(f'#!/bin/sh\nexec "{ROOT}/hvi" "$@"\n')
    launcher.chmod(0o755)
    return tmp_path


def run(command: list[str], place: Path) -> subprocess.CompletedProcess[str]:
    settings = {**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": f"{ROOT}:{os.environ.get('PYTHONPATH', '')}"}
    return subprocess.run(command, cwd=place, capture_output=True, text=True, check=False, timeout=600, env=settings)


def run_shell(block: Block, place: Path) -> None:
    if block.key == "syntax":
        return
    for command in commands(block):
        if LEFT_OUT.match(command.text):
            continue
        done = run(["bash", "-c", command.text], place)
        assert done.returncode == command.code, f"{command.text}\n{done.stdout}\n{done.stderr}"


def make_result(block: Block, place: Path) -> None:
    if block.key == "needs" and not (place / block.value).exists():
        run([str(place / "hvi"), "run", f"demos/{Path(block.value).name}.toml", "--out", block.value], place)


def run_python(program: list[str], place: Path) -> None:
    """The page's blocks as one program, as a reader types them; the traceback shows the block that fails."""
    (place / "page.py").write_text("\n".join(program), encoding="utf-8")
    done = run([sys.executable, "page.py"], place)
    assert done.returncode == 0, done.stderr


@pytest.mark.long
@pytest.mark.parametrize("name", names([d for d in DOCUMENTS if list(blocks(d))]))
def test_every_block_does_what_it_says(name: str, place: Path) -> None:
    python: list[str] = []
    for block in blocks(ROOT / name):
        if block.key == "file":
            (place / block.value).write_text(block.text, encoding="utf-8")
            if block.language == "python":
                done = run([sys.executable, block.value], place)
                assert done.returncode == 0, f"{block.value}\n{done.stderr}"
        elif block.language == "sh":
            run_shell(block, place)
        elif block.language == "python":
            make_result(block, place)
            python.append(block.text)
    if python:
        run_python(python, place)


@pytest.mark.long
def test_the_python_page_is_one_program_for_two_ranks(place: Path) -> None:
    program = [block.text for block in blocks(ROOT / "docs/python.md") if block.language == "python"]
    (place / "page.py").write_text("\n".join(program), encoding="utf-8")
    done = run(["mpirun", "-n", "2", sys.executable, "-m", "mpi4py", "page.py"], place)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("name", names(DOCUMENTS))
def test_every_block_is_well_formed(name: str) -> None:
    for block in blocks(ROOT / name):
        if block.language == "sh":
            done = subprocess.run(["bash", "-n"], input=block.text, capture_output=True, text=True, check=False)
            assert done.returncode == 0, f"{block.text}\n{done.stderr}"
        elif block.language == "python":
            compile(block.text, name, "exec")
        elif block.language == "toml":
            tomllib.loads(block.text)


@pytest.mark.parametrize("name", names(DOCUMENTS))
def test_every_link_leads_somewhere(name: str) -> None:
    text = (ROOT / name).read_text(encoding="utf-8")
    for target in re.findall(r"\]\(([^)\s]+)\)", re.sub(r"`[^`\n]*`", "", text)):
        file, _, part = target.partition("#")
        if "://" in target:
            continue
        there = (ROOT / name).parent / file if file else ROOT / name
        assert there.exists(), f"{name}: {target}"
        if part:
            assert part in anchors(there), f"{name}: {target}; {there.name} has {anchors(there)}"


def anchors(document: Path) -> list[str]:
    """The names that GitHub gives to a document's headings."""
    headings = re.findall(r"^#+ (.*)$", document.read_text(encoding="utf-8"), re.M)
    return [re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings]
