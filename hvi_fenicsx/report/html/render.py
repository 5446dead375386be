"""``report.html`` beside a result: one file that a colleague reads without the program, made from the folder alone."""

from __future__ import annotations

import functools
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...runtime import manifest, writing
from ..reader import read

if TYPE_CHECKING:
    import jinja2

NAME = "report.html"


def write(folder: Path) -> Path:
    """Write ``report.html`` into a result folder, from its files; for rank 0 alone.

    Raises:
        ResultError: no result is there, or its files are damaged.
        NotWrittenError: the page cannot be written.
    """
    from .content import content

    return page_of("run.html.j2", content(read(folder)), folder)


def page_of(template: str, values: dict[str, Any], folder: Path) -> Path:
    """Write the page of a result folder, and list it among the folder's files.

    Args:
        template: its name.
        values: what it shows, by name.
        folder: of the result.

    Returns:
        The file.

    Raises:
        NotWrittenError: it cannot be written.
    """
    page = render(template, values, folder / NAME)
    manifest.add(folder, [NAME])
    return page


def render(template: str, values: dict[str, Any], path: Path) -> Path:
    """Write a template of this package with its values, whole or not at all.

    Args:
        template: its name.
        values: what it shows, by name.
        path: the file.

    Returns:
        The file.

    Raises:
        NotWrittenError: it cannot be written.
    """
    writing.text(path, _environment().get_template(template).render(values))
    return path


@functools.cache
def _environment() -> jinja2.Environment:
    """The templates, each compiled once."""
    import jinja2  # a tenth of a second, for the report alone

    loader = jinja2.FileSystemLoader(Path(__file__).parent)
    return jinja2.Environment(
        loader=loader, autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )


__all__ = ["NAME", "page_of", "render", "write"]
