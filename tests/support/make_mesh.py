# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Has Gmsh write a mesh of the box from (0, 0, 0) to (10, 20, 30) whose vertex (10, 0, 30) is moved by (3, 5, 7).

    python3 make_mesh.py KIND BINARY VERSION FILE

KIND: tetrahedra, quadratic, wedges, hexahedra, mixed (a hexahedron below two wedges and six pyramids), or with ":deformed"
behind it the same mesh without vectors, the vertex moved. BINARY: 0 or 1. VERSION: 2.2, 4.0 or 4.1.
Exits with 77 where the module gmsh is missing.
"""
import sys

try:
    import gmsh
except ImportError:
    sys.exit(77)

MOVED = (10.0, 0.0, 30.0)


def make_box(kind):
    geo = gmsh.model.geo
    line = geo.extrude([(0, geo.addPoint(0, 0, 0))], 10, 0, 0, [2], recombine=True)[1]
    face = geo.extrude([line], 0, 20, 0, [2], recombine=kind == "hexahedra")[1]
    structured = kind in ("hexahedra", "wedges")
    geo.extrude([face], 0, 0, 30, [2] if structured else [], recombine=structured)
    geo.synchronize()
    gmsh.option.setNumber("Mesh.MeshSizeMin", 8)
    gmsh.option.setNumber("Mesh.MeshSizeMax", 8)
    gmsh.model.mesh.generate(3)
    if kind == "quadratic":
        gmsh.model.mesh.setOrder(2)


def make_mixed():
    """Vertices by hand, with tags that are neither in order nor without gaps."""
    mesh = gmsh.model.mesh
    corners = [(x, y, z) for z in (0, 10, 20, 30) for y in (0, 20) for x in (0, 10)] + [(5, 10, 25)]
    tags = [100 - 3 * n for n in range(len(corners))]
    gmsh.model.addDiscreteEntity(3, 1)
    mesh.addNodes(3, 1, tags, [value for corner in corners for value in corner])

    def ring(level):
        return [tags[4 * level + n] for n in (0, 1, 3, 2)]

    low, middle, high, top = (ring(level) for level in range(4))
    mesh.addElementsByType(1, 5, [11], low + middle)
    mesh.addElementsByType(1, 6, [7, 5], [middle[n] for n in (0, 1, 2)] + [high[n] for n in (0, 1, 2)] +
                           [middle[n] for n in (0, 2, 3)] + [high[n] for n in (0, 2, 3)])
    pyramids = [high, top[::-1]] + [[high[(n + 1) % 4], high[n], top[n], top[(n + 1) % 4]] for n in range(4)]
    mesh.addElementsByType(1, 7, [21, 22, 23, 24, 25, 26], [tag for base in pyramids for tag in base + [tags[16]]])


def main(kind, binary, version, path):
    kind, _, deformed = kind.partition(":")
    gmsh.initialize()
    gmsh.option.setNumber("General.Terminal", 0)
    gmsh.model.add("box")
    if kind == "mixed":
        make_mixed()
    else:
        make_box(kind)
    tags, values, _ = gmsh.model.mesh.getNodes()
    moved = next(n for n in range(len(tags)) if tuple(values[3 * n:3 * n + 3]) == MOVED)
    gmsh.option.setNumber("Mesh.MshFileVersion", float(version))
    gmsh.option.setNumber("Mesh.Binary", int(binary))
    gmsh.option.setNumber("Mesh.SaveAll", 1)
    if deformed:
        gmsh.model.mesh.setNode(tags[moved], [13.0, 5.0, 37.0], [])
    gmsh.write(path)
    if not deformed:
        vectors = [[3, 5, 7] if n == moved else [0, 0, 0] for n in range(len(tags))]
        gmsh.option.setNumber("PostProcessing.SaveMesh", 0)
        for step in (0, 1):
            shift = gmsh.view.add("shift")
            gmsh.view.addModelData(shift, step, "box", "NodeData", tags, [[1, 2, 3]] * len(tags))
            gmsh.view.write(shift, path, append=True)
        view = gmsh.view.add("U")
        gmsh.view.addModelData(view, 0, "box", "NodeData", tags, vectors)
        gmsh.view.write(view, path, append=True)
        pressure = gmsh.view.add("pressure")
        gmsh.view.addModelData(pressure, 0, "box", "NodeData", tags, [[1]] * len(tags))
        gmsh.view.write(pressure, path, append=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
