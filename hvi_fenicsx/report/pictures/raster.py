"""Linear values on triangles as an image: exactly, or thinned to its pixels.

matplotlib's own shading takes 3 s for half a million triangles; this takes a fraction of one, for many small triangles
as for few large ones.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from ...typing import Array, Integers, Mask

_AT_ONCE = 100_000
"""Candidate pixels handled at a time: what fits a cache is twice as fast."""
_EDGE = 1e-6
_LARGEST = 1 << 20
"""More pixels than an image has on a side."""
_SMALL = 2.25
"""Pixels: the middle of a triangle that is no wider and no higher is at most one pixel beside each that it covers."""


def thinned(points: Array, triangles: Integers, values: Array, shape: tuple[int, int]) -> Array:
    """An image of values that are linear on triangles, of which small ones count by their middles.

    A pixel has what large triangles have at its centre, as :func:`shade` finds it; else the mean of the small ones
    whose middles it has, or the pixels around it. So there is no hole, but values reach a pixel beyond small triangles.

    Args:
        points: in pixels from the image's lower left corner, (n, 2).
        triangles: by their points, (k, 3).
        values: at the corners of each triangle, (k, 3).
        shape: rows and columns of the image.

    Returns:
        An array of this shape, its first row the lowest, NaN where there is no triangle.
    """
    total, count, large = np.zeros(shape), np.zeros(shape), np.zeros(len(triangles), dtype=np.bool_)
    for start in range(0, len(triangles), _AT_ONCE):
        own = slice(start, start + _AT_ONCE)
        corners = [[column[corner] for corner in triangles[own].T] for column in points.T]
        small = _within(corners, _SMALL)
        large[own] = ~small
        _count(total, count, [_mean(column)[small] for column in corners], _mean(values[own].T)[small])
    exact = shade(points, triangles[large], values[large], shape)
    with np.errstate(invalid="ignore"):
        means = np.where(count > 0.0, total / count, _around(total) / _around(count))
    return np.where(np.isnan(exact), means, exact)


def _mean(three: Iterable[Array]) -> Array:
    return np.asarray(functools.reduce(np.add, three) / 3.0, dtype=np.float64)


def _within(corners: Iterable[Sequence[Array]], size: float) -> Mask:
    """Which triangles are at most so large along each axis, from their three corners there, (k,)."""
    spans = (functools.reduce(np.maximum, column) - functools.reduce(np.minimum, column) for column in corners)
    return functools.reduce(np.logical_and, (span <= size for span in spans))


def _count(total: Array, count: Array, places: Sequence[Array], values: Array) -> None:
    """Add values to the pixels that have their places; some places may be outside of the image."""
    column, row = (np.floor(place).astype(np.int64) for place in places)
    rows, columns = total.shape
    seen = (row >= 0) & (row < rows) & (column >= 0) & (column < columns)
    pixel = (row * columns + column)[seen]
    np.add.at(total.ravel(), pixel, values[seen])
    np.add.at(count.ravel(), pixel, 1.0)


def _around(image: Array) -> Array:
    """The sum over the nine pixels around each."""
    for _ in range(2):
        wider = image.copy()
        wider[1:] += image[:-1]
        wider[:-1] += image[1:]
        image = wider.T
    return image


def shade(points: Array, triangles: Integers, values: Array, shape: tuple[int, int]) -> Array:
    """An image of values that are linear on triangles: a pixel has the largest of those at its centre.

    Args:
        points: in pixels from the image's lower left corner, (n, 2).
        triangles: by their points, (k, 3).
        values: at the corners of each triangle, (k, 3).
        shape: rows and columns of the image.

    Returns:
        An array of this shape, its first row the lowest, NaN where there is no triangle.
    """
    image = np.full(shape, np.nan)
    columns = [points[:, axis] - 0.5 for axis in range(2)]  # pixel centres at whole numbers
    sizes = zip(columns, shape[::-1], strict=True)
    boxes = [_box([column[corner] for corner in triangles.T], pixels) for column, pixels in sizes]
    low, high = (np.column_stack(ends) for ends in zip(*boxes, strict=True))
    for chosen, box in _by_box(high - low + 1):
        corners = np.stack([column[triangles[chosen]] for column in columns], axis=2)
        _fill(image, corners, values[chosen], low[chosen], box)
    return image


def _box(corners: Sequence[Array], pixels: int) -> tuple[Integers, Integers]:
    """The first and the last pixel of each triangle along an axis, from its three corners there, (k,) each."""
    low = np.ceil(functools.reduce(np.minimum, corners) - _EDGE)
    high = np.floor(functools.reduce(np.maximum, corners) + _EDGE)
    return np.maximum(low, 0).astype(np.int64), np.minimum(high, pixels - 1).astype(np.int64)


def _by_box(sizes: Integers) -> Iterator[tuple[Integers, tuple[int, int]]]:
    """Triangles grouped by the width and height of their boxes, in portions; those that hold no pixel left out."""
    full = np.flatnonzero((sizes > 0).all(axis=1))
    width, height = (_coarser(column[full]) for column in sizes.T)
    box = width * _LARGEST + height
    for key in np.unique(box):
        group, (w, h) = full[box == key], divmod(int(key), _LARGEST)
        portion = max(1, _AT_ONCE // (w * h))
        for start in range(0, len(group), portion):
            yield group[start : start + portion], (w, h)


def _coarser(sizes: Integers) -> Integers:
    """Sizes rounded up, so that there are few groups: to 1, 2, 3, 4, 6, 8, 12, 16, ..."""
    power = np.left_shift(1, np.frexp(sizes)[1].astype(np.int64) - 1)
    half = np.maximum(power // 2, 1)
    return power + half * -((power - sizes) // half)


def _fill(image: Array, corners: Array, values: Array, low: Integers, box: tuple[int, int]) -> None:
    """Set the pixels of triangles whose boxes start at ``low`` and are of a common size."""
    x, y = (a.ravel() for a in np.meshgrid(np.arange(box[0]), np.arange(box[1])))
    columns, rows = low[:, :1] + x, low[:, 1:] + y
    second, third = (weight(columns - corners[:, :1, 0], rows - corners[:, :1, 1]) for weight in _barycentric(corners))
    inside = (second >= -_EDGE) & (third >= -_EDGE) & (second + third <= 1.0 + _EDGE)
    inside &= (columns < image.shape[1]) & (rows < image.shape[0])
    rise = values[:, 1:] - values[:, :1]
    value = values[:, :1] + second * rise[:, :1] + third * rise[:, 1:]
    np.fmax.at(image.ravel(), rows[inside] * image.shape[1] + columns[inside], value[inside])


def _barycentric(corners: Array) -> Iterator[Callable[[Array, Array], Array]]:
    """The second and third coordinate as functions of the way from the first corner; none in a flat triangle."""
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    area = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    a, b = (side / np.where(area == 0.0, np.nan, area)[:, None] for side in (a, b))
    yield lambda x, y: x * b[:, 1:] - y * b[:, :1]
    yield lambda x, y: y * a[:, :1] - x * a[:, 1:]
