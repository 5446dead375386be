"""Files for ParaView by VTK's own writer: each rank writes its cells, binary and compressed; rank 0 an index."""

from __future__ import annotations

import errno
import sys
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np
import numpy.typing as npt
from mpi4py import MPI

from ..runtime import writing
from ..runtime.log import logger
from ..runtime.mpi import agree, on_root
from ..typing import Array, Integers

_LOG = logger("results")
_CELLS = {2: 3, 3: 5, 4: 10}
"""VTK's numbers of line, triangle and tetrahedron, by their vertices."""
_BLOCK = 1 << 18
"""Bytes that are compressed at a time; in VTK's own blocks, an eighth of these, it takes a quarter longer."""


@dataclass(frozen=True, kw_only=True)
class Grid:
    """The part of a mesh that a rank writes, n vertices and c cells, with its fields; all ranks have the same fields.

    Attributes:
        points: m, (n, 3).
        cells: by their vertices, (c, k).
        at_points: fields by name, (n,) or (n, k).
        in_cells: fields by name, (c,) or (c, k).
        units: of fields by name; those without one are numbers.
    """

    points: Array
    cells: Integers
    at_points: Mapping[str, npt.NDArray[Any]]
    in_cells: Mapping[str, npt.NDArray[Any]]
    units: Mapping[str, str]


Entry = tuple[float, int, str, Grid]
"""Its time, its number among the blocks of that time, the ending of its name, and this rank's part."""


def write(path: Path, comm: MPI.Comm, entries: Iterable[Entry]) -> None:
    """Write NAME.pvd, and for each entry NAME-ENDING.pvtu with NAME-ENDING_RANK.vtu of each rank. Collective.

    Without VTK nothing is written, and a warning says so.

    Args:
        path: the first of them.
        comm: the ranks.
        entries: times rise.

    Raises:
        NotWrittenError: a file cannot be written, on all ranks alike.
    """
    if not all(agree(comm, find_spec("vtkmodules") is not None)):
        _LOG.warning("%s is not written: VTK is missing; install python3-vtk9 (Debian) or vtk (pip, conda)", path.name)
        return
    listed = []
    for time, block, ending, grid in entries:
        file = path.with_name(f"{path.stem}{ending}.pvtu")
        _write_parallel(file, comm, grid)
        listed.append((time, block, file.name))
    on_root(comm, lambda: _write_collection(path, listed))


def _write_parallel(path: Path, comm: MPI.Comm, grid: Grid) -> None:
    """Write a grid: its pieces, and the file that names them. Collective."""
    pieces = [path.with_name(f"{path.stem}_{rank}.vtu") for rank in range(comm.size)]
    faults = agree(comm, _write_piece(pieces[comm.rank], grid))
    for piece, fault in zip(pieces, faults, strict=True):
        if fault is not None:
            raise writing.not_written(piece, fault)
    on_root(comm, lambda: _write_pieces(path, grid, pieces))


def _write_piece(path: Path, grid: Grid) -> int | None:
    """Write a piece; where VTK could not, why, as in ``errno``."""
    from vtkmodules.vtkCommonMisc import vtkErrorCode
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridWriter  # a tenth of a second

    writer = vtkXMLUnstructuredGridWriter()
    for source in (writer, writer.GetExecutive()):
        source.AddObserver("ErrorEvent", lambda *_: None)  # told by what it returns, in our words
    writer.SetFileName(str(path))
    writer.SetDataModeToAppended()
    writer.EncodeAppendedDataOff()
    writer.SetCompressorTypeToLZ4()
    writer.SetBlockSize(_BLOCK)
    writer.SetInputData(_vtk_grid(grid))
    written, code = writer.Write(), writer.GetErrorCode()
    if written and code == 0:
        return None
    of_system = {vtkErrorCode.OutOfDiskSpaceError: errno.ENOSPC}
    return code if 0 < code < vtkErrorCode.FirstVTKErrorCode else of_system.get(code, errno.EIO)


def _vtk_grid(grid: Grid) -> Any:
    from vtkmodules.numpy_interface.dataset_adapter import WrapDataObject
    from vtkmodules.vtkCommonCore import vtkDataArray
    from vtkmodules.vtkCommonDataModel import vtkUnstructuredGrid

    count, corners = grid.cells.shape
    made = WrapDataObject(vtkUnstructuredGrid())
    made.SetPoints(np.ascontiguousarray(grid.points))
    kinds, counted = np.full(count, _CELLS[corners], dtype=np.ubyte), np.insert(grid.cells, 0, corners, axis=1)
    made.SetCells(kinds, np.arange(count) * (corners + 1), counted.astype(np.int64).ravel())
    for fields, data in ((grid.at_points, made.PointData), (grid.in_cells, made.CellData)):
        for name, values in fields.items():
            data.append(np.ascontiguousarray(values), name)
            data.VTKObject.GetArray(name).GetInformation().Set(vtkDataArray.UNITS_LABEL(), grid.units.get(name, "1"))
    return made.VTKObject


def _write_pieces(path: Path, grid: Grid, pieces: list[Path]) -> None:
    """The file that names the pieces. Rank 0 only."""
    parallel = Xml.Element(
        "VTKFile", type="PUnstructuredGrid", version="1.0", byte_order=f"{sys.byteorder.title()}Endian"
    )
    whole = Xml.SubElement(parallel, "PUnstructuredGrid", GhostLevel="0")
    for place, fields in (("PPointData", grid.at_points), ("PCellData", grid.in_cells)):
        Xml.SubElement(whole, place).extend(_declared(fields, grid.units))
    Xml.SubElement(whole, "PPoints").extend(_declared({"Points": grid.points}, {"Points": "m"}))
    for piece in pieces:
        Xml.SubElement(whole, "Piece", Source=piece.name)
    _write_xml(path, parallel)


def _write_collection(path: Path, entries: Iterable[tuple[float, int, str]]) -> None:
    """The file that ParaView opens: the files by their times and blocks. Rank 0 only."""
    root = Xml.Element("VTKFile", type="Collection", version="0.1")
    collection = Xml.SubElement(root, "Collection")
    for time, block, name in entries:
        Xml.SubElement(collection, "DataSet", timestep=f"{time:g}", part=str(block), file=name)
    _write_xml(path, root)


def _write_xml(path: Path, root: Xml.Element) -> None:
    Xml.indent(root)
    with writing.told(path):
        Xml.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _declared(fields: Mapping[str, npt.NDArray[Any]], units: Mapping[str, str]) -> Iterator[Xml.Element]:
    for name, values in fields.items():
        components = values.shape[1] if values.ndim > 1 else 1
        kind = values.dtype.name.title()
        declared = Xml.Element("PDataArray", type=kind, Name=name, NumberOfComponents=str(components))
        Xml.SubElement(declared, "InformationKey", name="UNITS_LABEL", location="vtkDataArray").text = units.get(
            name, "1"
        )
        yield declared
