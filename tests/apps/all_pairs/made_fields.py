# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Fields of all kinds round the middle of the made-up volumes, written here as other programs write them."""
import json
import pathlib

import numpy as np

from volumes import Volume, affine_of, write_mha, write_nrrd

MIDDLE = np.array([1.0, -2.0, 3.0])  # LPS mm, of every input
HALF = 27.0  # mm: what reaches so far from the middle reaches over every input, however it is turned

# The corners of the five tetrahedra of a cell, a corner is x + 2 y + 4 z; cells of either parity.
FIVE = [[(1, 2, 4, 7), (0, 1, 2, 4), (3, 2, 1, 7), (5, 4, 7, 1), (6, 7, 4, 2)],
        [(0, 3, 5, 6), (1, 0, 3, 5), (2, 3, 0, 6), (4, 5, 6, 0), (7, 6, 5, 3)]]


def rotation(x, y, z):
    a, b, c = np.radians([x, y, z])
    turn_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    turn_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    turn_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return turn_z @ turn_y @ turn_x


def grid_affine(size, spacing, direction=None, middle=MIDDLE):
    affine = affine_of(spacing, [0, 0, 0], direction)
    affine[:3, 3] = middle - affine[:3, :3] @ ((np.array(size) - 1) / 2)
    return affine


def smooth(points, amplitude):
    x, y, z = (points - MIDDLE).T / 9.0
    return amplitude * np.stack([np.sin(y + 0.3) * np.cos(z), np.cos(x) * np.sin(z - 0.4), np.sin(x + y)], -1)


def points_of(size, affine):
    index = np.stack(np.meshgrid(*[np.arange(n) for n in size], indexing="ij"), -1)
    return index @ affine[:3, :3].T + affine[:3, 3]


def lattice(amplitude, seed, noise, size=(10, 10, 10), spacing=(6.0, 6.25, 6.5), turned=True):
    affine = grid_affine(size, spacing, rotation(3, -4, 5) if turned else None)
    points = points_of(size, affine)
    moved = smooth(points.reshape(-1, 3), amplitude).reshape(points.shape)
    moved = moved + np.random.default_rng(seed).uniform(-noise, noise, points.shape)
    return Volume(moved.astype("<f4"), affine)


class Mesh:
    """Cells of a box, five tetrahedra each."""

    def __init__(self, count, step, amplitude, seed, rests_at_border):
        size = (count, count, count)
        points = points_of(size, grid_affine(size, (step, step, step))).reshape(-1, 3)
        number = np.arange(count**3).reshape(size)
        inner = np.zeros(size, bool)
        inner[1:-1, 1:-1, 1:-1] = True
        inner = inner.ravel()
        random = np.random.default_rng(seed)
        self.rest = points + inner[:, None] * random.uniform(-0.15 * step, 0.15 * step, points.shape)
        self.moved = np.round(smooth(points, amplitude) * (inner[:, None] if rests_at_border else 1), 4)
        self.tetrahedra = []
        for i, j, k in np.ndindex(count - 1, count - 1, count - 1):
            corner = [number[i + (c & 1), j + (c >> 1 & 1), k + (c >> 2)] for c in range(8)]
            self.tetrahedra += [[int(corner[c]) for c in four] for four in FIVE[(i + j + k) % 2]]

    def write_msh(self, path):
        lines = ["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(self.rest))]
        lines += [f"{n + 1} " + " ".join(repr(float(x)) for x in p) for n, p in enumerate(self.rest)]
        lines += ["$EndNodes", "$Elements", str(len(self.tetrahedra))]
        lines += [f"{n + 1} 4 2 1 1 " + " ".join(str(c + 1) for c in t) for n, t in enumerate(self.tetrahedra)]
        lines += ["$EndElements", "$NodeData", "1", "\"U\"", "1", "0.0", "3", "0", "3", str(len(self.rest))]
        lines += [f"{n + 1} " + " ".join(repr(float(x)) for x in u) for n, u in enumerate(self.moved)]
        pathlib.Path(path).write_text("\n".join(lines + ["$EndNodeData", ""]))

    def write_vtk(self, path, deformed=False):
        points = self.rest + self.moved if deformed else self.rest
        lines = ["# vtk DataFile Version 3.0", "mesh", "ASCII", "DATASET UNSTRUCTURED_GRID",
                 f"POINTS {len(points)} double"]
        lines += [" ".join(repr(float(x)) for x in p) for p in points]
        lines += [f"CELLS {len(self.tetrahedra)} {5 * len(self.tetrahedra)}"]
        lines += ["4 " + " ".join(map(str, t)) for t in self.tetrahedra]
        lines += [f"CELL_TYPES {len(self.tetrahedra)}"] + ["10"] * len(self.tetrahedra)
        pathlib.Path(path).write_text("\n".join(lines + [""]))


def scenario(method, opened, closed=False, push=7.0):
    """A plate through the middle, cut or not, whose two sides are pulled apart."""
    at = [float(x) for x in MIDDLE]
    sides = [{"name": name, "handle": {"at": {"mm": [at[0] + side * 4, at[1], at[2]]}, "radius_mm": 3.5},
              "by_mm": [side * push / 2, 0.5, 0.25]} for name, side in (("right", -1), ("left", 1))]
    page = {"method": method, "cell_size": 3, "body_above_hu": -2000,
            "tissues": [{"name": "all", "compression": 0.6, "stretch": 0.6, "shear": 0.6}], "hold": [{"border": True}],
            "phases": [{"name": "open", "move": sides, "frames": 1}]}
    if opened or closed:
        page["cuts"] = [{"name": "cut", "disc": {"at": {"mm": at}, "normal": [1, 0.125, 0], "radius_mm": 7}}]
    if closed:
        page["phases"].append({"name": "close", "move": sides[:1], "frames": 1, "closed_cuts": ["cut"]})
    return page


def affine_tfm(matrix, offset):
    numbers = " ".join(repr(float(x)) for x in [*np.ravel(matrix), *offset])
    middle = " ".join(repr(float(x)) for x in MIDDLE)
    return ("#Insight Transform File V1.0\n#Transform 0\nTransform: AffineTransform_double_3_3\n"
            f"Parameters: {numbers}\nFixedParameters: {middle}\n")


def write(folder):
    """All field files but those that depend on an input."""
    folder = pathlib.Path(folder)
    write_nrrd(folder / "lattice.nrrd", lattice(1.5, 1, 0.3))
    write_mha(folder / "folded.mha", lattice(3.0, 2, 5.0))
    write_mha(folder / "second.mha", lattice(1.0, 3, 0.2, size=(12, 12, 12), turned=False))
    pull = lattice(2.0, 4, 0.3, size=(13, 12, 11), spacing=(4.6, 5.1, 5.6))
    write_nrrd(folder / "pull.nrrd", pull)
    pull.values[5:7, 4:6, 5:8] = np.nan
    write_mha(folder / "gaps.mha", pull)
    whole = Mesh(5, 2 * HALF / 4, 1.5, 5, False)
    whole.write_msh(folder / "mesh.msh")
    other = Mesh(5, 2 * HALF / 4, 1.25, 6, False)
    other.write_vtk(folder / "rest.vtk")
    other.write_vtk(folder / "moved.vtk", deformed=True)
    Mesh(4, 6.0, 1.5, 7, True).write_msh(folder / "island.msh")
    near = rotation(2, -3, 4) * 1.03
    (folder / "affine.tfm").write_text(affine_tfm(near, [0.4, -0.3, 0.2]))
    pages = {"open": scenario("chainmail", True), "closed": scenario("chainmail", True, True),
             "chain": scenario("chainmail", False), "springs": scenario("mass-spring", False),
             "open-springs": scenario("mass-spring", True), "labelled": scenario("chainmail", False)}
    one = {"name": "one", "label": 1, "compression": 0.3, "stretch": 0.3, "shear": 0.3}
    pages["labelled"]["tissues"].insert(0, one)
    for name, page in pages.items():
        (folder / f"{name}.json").write_text(json.dumps(page, indent=1))
