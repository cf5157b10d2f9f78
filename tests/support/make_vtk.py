# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes datasets with VTK, as finite element programs and ParaView do.

    make_vtk.py KIND ENCODING OUTPUT GEOMETRY

KIND: StructuredGrid, ImageData, RectilinearGrid: a corner moved by (3, 5, 7), at the end of i, the begin of j and the end
of k; UnstructuredGrid: one cell of each kind that has a volume, 10 apart along x, quadratic ones too, and a triangle; the
last point of the first cell moves by (3, 5, 7). GEOMETRY: size, spacing, origin and direction (row by row), 18 numbers with
commas; a mesh does not look at it. ENCODING: ascii, binary, raw, base64; for XML also zlib, lz4 (appended, raw), inline-zlib,
big (big endian, raw), wide (64 bit lengths); for legacy files ascii-4, binary-4 (version 4.2). Further words behind a colon: two
(a second array of vectors), none (no vectors), off (one point elsewhere), extent (that begins at (-2, 3, 5)), double, polyhedron,
few (the first and the last two cells alone). Exit status 77: a library is missing.
"""

import sys
from types import SimpleNamespace

try:
    import vtkmodules.vtkCommonCore
    import vtkmodules.vtkCommonDataModel
    import vtkmodules.vtkIOLegacy
    import vtkmodules.vtkIOXML
except ImportError as error:
    print(error)
    sys.exit(77)

vtk = SimpleNamespace()  # import vtk takes in ten times as much
for module in (vtkmodules.vtkCommonCore, vtkmodules.vtkCommonDataModel, vtkmodules.vtkIOLegacy, vtkmodules.vtkIOXML):
    vars(vtk).update(vars(module))

kind, encoding, output, geometry = sys.argv[1:]
encoding, *words = encoding.split(":")
numbers = [float(n) for n in geometry.split(",")]
size = [int(n) for n in numbers[:3]]
spacing, origin, rows = numbers[3:6], numbers[6:9], [numbers[9 + 3 * r:12 + 3 * r] for r in range(3)]
begin = [-2, 3, 5] if "extent" in words else [0, 0, 0]
extent = [n for a in range(3) for n in (begin[a], begin[a] + size[a] - 1)]


def vectors(name, count, moved, value):
    array = vtk.vtkDoubleArray() if "double" in words else vtk.vtkFloatArray()
    array.SetName(name)
    array.SetNumberOfComponents(3)
    array.SetNumberOfTuples(count)
    for n in range(count):
        array.SetTuple3(n, *(value if n == moved else (0, 0, 0)))
    return array


def add_data(dataset, moved):
    count = dataset.GetNumberOfPoints()
    scalars = vtk.vtkIntArray()
    scalars.SetName("label of points")
    for n in range(count):
        scalars.InsertNextValue(n)
    data = dataset.GetPointData()
    data.SetScalars(scalars)
    if "none" not in words:
        name = "displacement" if "two" in words else "how far"
        data.SetVectors(vectors(name, count, moved, (3, 5, 7)))
    if "two" in words:
        data.AddArray(vectors("velocity", count, moved, (30, 50, 70)))
    cells = vtk.vtkFloatArray()
    cells.SetName("stress")
    cells.SetNumberOfComponents(6)
    cells.SetNumberOfTuples(dataset.GetNumberOfCells())
    for c in range(6):
        cells.FillComponent(c, c)
    dataset.GetCellData().AddArray(cells)


def new_points():
    points = vtk.vtkPoints()
    if "double" in words:
        points.SetDataTypeToDouble()
    return points


def make_grid():
    dataset = getattr(vtk, "vtk" + kind)()
    dataset.SetExtent(extent)
    if kind == "ImageData":
        # At index (0, 0, 0), which lies outside where the extent begins elsewhere.
        shifted = [origin[r] - sum(rows[r][a] * spacing[a] * begin[a] for a in range(3)) for r in range(3)]
        dataset.SetSpacing(spacing)
        dataset.SetOrigin(shifted)
        dataset.SetDirectionMatrix([n for row in rows for n in row])
    elif kind == "RectilinearGrid":
        for a, axis in enumerate("XYZ"):
            along = vtk.vtkDoubleArray()
            for n in range(size[a]):
                along.InsertNextValue(origin[a] + spacing[a] * n + (0.3 if "off" in words and n == 1 else 0))
            getattr(dataset, "Set" + axis + "Coordinates")(along)
    else:
        points = new_points()
        for k in range(size[2]):
            for j in range(size[1]):
                for i in range(size[0]):
                    step = [i * spacing[0], j * spacing[1], k * spacing[2]]
                    point = [origin[r] + sum(rows[r][a] * step[a] for a in range(3)) for r in range(3)]
                    if "off" in words and (i, j, k) == (1, 2, 0):
                        point[1] += 0.3
                    points.InsertNextPoint(point)
        dataset.SetPoints(points)
    add_data(dataset, size[0] - 1 + size[0] * size[1] * (size[2] - 1))
    return dataset


TETRAHEDRON = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
PYRAMID = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0.5, 0.5, 1)]
WEDGE = [(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1)]
HEXAHEDRON = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
VOXEL = [HEXAHEDRON[n] for n in (0, 1, 3, 2, 4, 5, 7, 6)]
CELLS = [(10, TETRAHEDRON, 4), (11, VOXEL, 8), (12, HEXAHEDRON, 8), (13, WEDGE, 6), (14, PYRAMID, 5),
         (24, TETRAHEDRON, 10), (25, HEXAHEDRON, 20), (26, WEDGE, 15), (27, PYRAMID, 13), (29, HEXAHEDRON, 27),
         (5, TETRAHEDRON, 3)]


def make_mesh():
    dataset = vtk.vtkUnstructuredGrid()
    points = new_points()
    for number, (cell_type, corners, count) in enumerate(CELLS[:1] + CELLS[-2:] if "few" in words else CELLS):
        ids = vtk.vtkIdList()
        for n in range(count):
            x, y, z = corners[n] if n < len(corners) else (0.5, 0.5, 0.5)
            ids.InsertNextId(points.InsertNextPoint(10 * number + x, y, z))
        dataset.InsertNextCell(cell_type, ids)
    if "polyhedron" in words:
        faces = vtk.vtkIdList()
        for n in [4, 3, 0, 2, 1, 3, 0, 1, 3, 3, 1, 2, 3, 3, 2, 0, 3]:
            faces.InsertNextId(n)
        dataset.InsertNextCell(vtk.VTK_POLYHEDRON, faces)
    dataset.SetPoints(points)
    add_data(dataset, 3)
    return dataset


def write(dataset):
    if output.endswith(".vtk"):
        legacy_kind = "StructuredPoints" if kind == "ImageData" else kind
        writer = getattr(vtk, "vtk" + legacy_kind + "Writer")()
        if encoding.startswith("ascii"):
            writer.SetFileTypeToASCII()
        else:
            writer.SetFileTypeToBinary()
        writer.SetFileVersion(42 if encoding.endswith("-4") else 51)
    else:
        writer = getattr(vtk, "vtkXML" + kind + "Writer")()
        writer.SetCompressorTypeToNone()
        if encoding == "ascii":
            writer.SetDataModeToAscii()
        elif encoding in ("binary", "inline-zlib"):
            writer.SetDataModeToBinary()
        else:
            writer.SetDataModeToAppended()
            writer.SetEncodeAppendedData(encoding == "base64")
        if encoding in ("zlib", "inline-zlib"):
            writer.SetCompressorTypeToZLib()
        if encoding == "lz4":
            writer.SetCompressorTypeToLZ4()
        if encoding in ("zlib", "inline-zlib", "lz4"):
            writer.SetBlockSize(512)
        if encoding == "big":
            writer.SetByteOrderToBigEndian()
        if encoding == "wide":
            writer.SetHeaderTypeToUInt64()
    writer.SetFileName(output)
    writer.SetInputData(dataset)
    return writer.Write()


sys.exit(0 if write(make_mesh() if kind == "UnstructuredGrid" else make_grid()) else 1)
