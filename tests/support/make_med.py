#!/usr/bin/env python3
# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes MED files by MEDCoupling (PyPI: medcoupling), that is by the library MED itself: make_med.py FOLDER.

linear.med, MED 4.2: a node of no cell, two tetrahedra, pyramids, wedges and hexahedra each, a triangle, all in mm.
Fields:
  RESU____DEPL   displacements at steps 1 and 3, f (z, x, y) with f = 0 and 1/4
  RESU____SIGM   six components, no vector
  RESU____VITE   three components, DZ DX DY: (1, 2, 3)
  FULL           at all nodes but the first, in m: at step 7, iteration 0 zero, iteration 2 (z, x, y) / 1024
  PART           at the nodes 2, 5 and 10 alone
  BEAM           six components, DRX DRY DRZ DX DY DZ, without step
quadratic.med, MED 3.0: a tetrahedron, pyramid, wedge and hexahedron of second order, whose nodes have the numbers 10, 20,
  ..., and displacements (z, x, y) as float, without step.
small.med, MED 3.0: a tetrahedron, and the vectors (0, 1, 2), (3, 4, 5), ... at its nodes, from the last to the first.
It prints the volumes of the cells by MEDCoupling, which also says that none is oriented wrongly.
"""

import sys

import medcoupling as mc
import numpy as np

KINDS = {  # corners at unit size, in the order of MED, whose first face looks outwards
    mc.NORM_TETRA4: [(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1)],
    mc.NORM_PYRA5: [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0), (0, 0, 1)],
    mc.NORM_PENTA6: [(0, 0, 0), (0, 1, 0), (1, 0, 0), (0, 0, 1), (0, 1, 1), (1, 0, 1)],
    mc.NORM_HEXA8: [(0, 0, 0), (0, 1, 0), (1, 1, 0), (1, 0, 0), (0, 0, 1), (0, 1, 1), (1, 1, 1), (1, 0, 1)],
}
CURVED = [mc.NORM_TETRA10, mc.NORM_PYRA13, mc.NORM_PENTA15, mc.NORM_HEXA20]
EDGES = {  # of the nodes between corners, in the order of MED
    mc.NORM_TETRA4: [(0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3)],
    mc.NORM_PYRA5: [(0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4)],
    mc.NORM_PENTA6: [(0, 1), (1, 2), (2, 0), (3, 4), (4, 5), (5, 3), (0, 3), (1, 4), (2, 5)],
    mc.NORM_HEXA8: [
        *[(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4)],
        *[(0, 4), (1, 5), (2, 6), (3, 7)],
    ],
}


def make_mesh(name, each, curved):
    """`each` cells of each kind, side by side along x, those of a kind of the sizes 1 and 2."""
    points, cells = [] if curved else [(9.0, 9.0, 9.0)], []
    for kind, corners in KINDS.items():
        for n in range(each):
            places = (1 + n) * np.array(corners, float) + (3 * len(cells), 0, 0)
            if curved:
                places = np.concatenate([places, [(places[a] + places[b]) / 2 for a, b in EDGES[kind]]])
            cells.append((CURVED[list(KINDS).index(kind)] if curved else kind, len(points), len(places)))
            points.extend(places)
    mesh = mc.MEDCouplingUMesh(name, 3)
    mesh.setCoords(mc.DataArrayDouble(np.array(points)))
    mesh.allocateCells(len(cells))
    for kind, first, count in cells:
        mesh.insertNextCell(kind, count, list(range(first, first + count)))
    mesh.checkConsistency()
    print(name, mesh.getMeasureField(False).getArray().getValues())
    linear = mesh.deepCopy()
    linear.convertQuadraticCellsToLinear()
    assert linear.findAndCorrectBadOriented3DCells().empty()
    return mesh, np.array(points)


def field_of(mesh, name, values, components, step, iteration=-1):
    single = values.dtype == np.float32
    field = (mc.MEDCouplingFieldFloat if single else mc.MEDCouplingFieldDouble)(mc.ON_NODES, mc.ONE_TIME)
    array = (mc.DataArrayFloat if single else mc.DataArrayDouble)(np.ascontiguousarray(values))
    array.setInfoOnComponents(components)
    field.setName(name)
    field.setMesh(mesh)
    field.setTime(0.5 * step, step, iteration)
    field.setArray(array)
    return field


def put(fields, *steps):
    """Adds a field of some steps: an entry is a field, or (field, mesh file, profile)."""
    single = isinstance(steps[0], mc.MEDCouplingFieldFloat)
    series = (mc.MEDFileFloatFieldMultiTS if single else mc.MEDFileFieldMultiTS)()
    for step in steps:
        if isinstance(step, tuple):
            one = mc.MEDFileField1TS()
            one.setFieldProfile(step[0], step[1], 0, step[2])
            series.pushBackTimeStep(one)
        else:
            series.appendFieldNoProfileSBT(step)
    fields.pushField(series)


def in_file(mesh, *others):
    file = mc.MEDFileUMesh()
    file[0] = mesh
    for level, other in enumerate(others, 1):
        file[-level] = other
    file.setUnivNameWrStatus(False)  # else the file says who wrote it, and when
    return file


def write(mesh_file, fields, path, version):
    meshes, data = mc.MEDFileMeshes(), mc.MEDFileData()
    meshes.pushMesh(mesh_file)
    data.setMeshes(meshes)
    data.setFields(fields)
    getattr(data, version)(path, 2)


def make_linear(path):
    mesh, points = make_mesh("liver", 2, False)
    mesh.getCoords().setInfoOnComponents(["X [mm]", "Y [mm]", "Z [mm]"])
    skin = mc.MEDCouplingUMesh("liver", 2)
    skin.setCoords(mesh.getCoords())
    skin.allocateCells(1)
    skin.insertNextCell(mc.NORM_TRI3, 3, [1, 2, 3])
    file, fields, axes = in_file(mesh, skin), mc.MEDFileFields(), ["DX", "DY", "DZ"]
    moved, count = points[:, [2, 0, 1]], len(points)
    put(fields, *[field_of(mesh, "RESU____DEPL", f * moved, axes, step, step) for step, f in ((1, 0), (3, 0.25))])
    put(fields, field_of(mesh, "RESU____SIGM", np.ones((count, 6)), ["SIXX", "SIYY", "SIZZ", "SIXY", "SIXZ", "SIYZ"], 3))
    put(fields, field_of(mesh, "RESU____VITE", np.tile([3.0, 1.0, 2.0], (count, 1)), ["DZ", "DX", "DY"], 3))
    metres = ["DX [m]", "DY [m]", "DZ [m]"]
    full, some = mc.DataArrayInt(list(range(1, count))), mc.DataArrayInt([1, 4, 9])
    full.setName("full")
    some.setName("some")
    parts = ((0 * moved[1:], 0), (moved[1:] / 1024, 2))
    put(fields, *[(field_of(None, "FULL", part, metres, 7, i), file, full) for part, i in parts])
    put(fields, (field_of(None, "PART", np.ones((3, 3)), metres, 7), file, some))
    names = ["DRX", "DRY", "DRZ", *axes]
    put(fields, field_of(mesh, "BEAM", np.hstack([0 * moved, moved]), names, -1))
    write(file, fields, path, "write")


def make_quadratic(path):
    mesh, points = make_mesh("quadratic", 1, True)
    file, fields = in_file(mesh), mc.MEDFileFields()
    file.setRenumFieldArr(1, mc.DataArrayInt(list(range(10, 10 * len(points) + 10, 10))))
    put(fields, field_of(mesh, "U", points[:, [2, 0, 1]], ["x", "y", "z"], -1))
    write(file, fields, path, "write30")


def make_small(path):
    mesh = mc.MEDCouplingUMesh("m", 3)
    mesh.setCoords(mc.DataArrayDouble(np.array(KINDS[mc.NORM_TETRA4], float)))
    mesh.allocateCells(1)
    mesh.insertNextCell(mc.NORM_TETRA4, 4, [0, 1, 2, 3])
    fields, part = mc.MEDFileFields(), mc.DataArrayInt([3, 2, 1, 0])
    part.setName("p")
    file = in_file(mesh)
    put(fields, (field_of(None, "RESU____DEPL", np.arange(12.0).reshape(4, 3), ["DX", "DY", "DZ"], 3), file, part))
    write(file, fields, path, "write30")


def main():
    make_small(sys.argv[1] + "/small.med")
    make_linear(sys.argv[1] + "/linear.med")
    make_quadratic(sys.argv[1] + "/quadratic.med")


if __name__ == "__main__":
    main()
