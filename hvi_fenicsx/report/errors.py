"""What goes wrong while a finished result is read, drawn or written as a page."""

from __future__ import annotations

from ..errors import HviError


class ReportError(HviError):
    """A picture or a page cannot be made; it costs no result."""


class ResultError(ReportError):
    """A folder holds no finished result, or its files are damaged."""


class PictureError(ReportError):
    """A picture could not be drawn; those that could are in the folder."""
