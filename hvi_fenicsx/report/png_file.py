"""A picture's file: its size, and the caption that it carries for those who show it."""

from __future__ import annotations

import struct
from collections.abc import Iterator

CAPTION = "Description"
"""The keyword of the caption among the file's texts; it is one of the PNG standard's."""
_SIGNATURE = 8


def size(raw: bytes) -> tuple[int, int]:
    """Width and height in pixels of a PNG file."""
    width, height = struct.unpack(">II", raw[16:24])
    return int(width), int(height)


def caption(raw: bytes) -> str:
    """The caption of a PNG file; empty where it has none."""
    for kind, data in _chunks(raw):
        keyword, _, rest = data.partition(b"\0")
        if kind == b"iTXt" and keyword == CAPTION.encode():
            _, _, text = rest[2:].split(b"\0", 2)  # after two flags: language, translated keyword, text
            return text.decode()
    return ""


def _chunks(raw: bytes) -> Iterator[tuple[bytes, bytes]]:
    """Kind and content of each chunk before the image itself."""
    at = _SIGNATURE
    while at + 8 <= len(raw):
        length, kind = struct.unpack(">I4s", raw[at : at + 8])
        if kind == b"IDAT":
            return
        yield kind, raw[at + 8 : at + 8 + length]
        at += length + 12


__all__ = ["CAPTION", "caption", "size"]
