"""What goes wrong while a finished result is read, drawn or written as a page."""

from __future__ import annotations

from ..errors import HviError


class ResultError(HviError):
    """A folder holds no finished result, or its files are damaged."""


class PictureError(HviError):
    """A picture could not be drawn; those that could are in the folder."""


class PageError(HviError):
    """A page could not be written; the rest of the folder is as it was."""
