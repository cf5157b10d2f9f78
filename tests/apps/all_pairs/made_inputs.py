# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The volumes that go through the fields, and what goes along: each as a file of its form and as a `Volume`."""
import json
import pathlib

import numpy as np

import made_dicom
from made_fields import MIDDLE, grid_affine, rotation
from volumes import NUMPY, Volume, write_mha, write_nifti, write_nrrd

SIZE, SPACING = (12, 14, 10), (2.5, 2.0, 3.0)
UNEVEN = [0, 1, 2, 3.5, 4.5, 5.25, 6.25, 7.25, 8.25, 9]  # slice distances
LEAN = 0.25
PADDING = -2000
RANGES = {"i8": (-100, 100), "u8": (0, 7), "i16": (-1000, 1500), "u16": (0, 4000), "i32": (-90000, 90000),
          "u32": (0, 4000000), "f32": (-1000, 1500), "f64": (-1000, 1500)}
# name: type, file, spacing, turned
FILES = {"nii-i8": ("i8", "a.nii", SPACING, False), "nii-u8": ("u8", "b.nii.gz", SPACING, False),
         "nii-i16": ("i16", "c.nii", (2.7, 1.9, 3.1), False), "nii-u16": ("u16", "d.nii.gz", SPACING, False),
         "nii-i32": ("i32", "e.nii", SPACING, False), "nii-u32": ("u32", "f.nii", SPACING, False),
         "nii-f32": ("f32", "g.nii.gz", SPACING, False), "nii-f64": ("f64", "h.nii", SPACING, False),
         "nii-oblique": ("i16", "i.nii", SPACING, True), "nrrd-i16": ("i16", "j.nrrd", SPACING, False),
         "nii-nan": ("f32", "n.nii", SPACING, False), "nrrd-f32": ("f32", "k.nrrd", (2.0, 2.0, 2.0), True),
         "mha-u16": ("u16", "l.mha", SPACING, False),
         "mha-f64": ("f64", "m.mha", (2.6, 2.2, 2.9), False)}
DICOM = ["dicom", "dicom-file", "dicom-oblique", "enhanced", "tilted", "uneven", "padded"]


def noise(kind, size, seed):
    low, high = RANGES[kind]
    random = np.random.default_rng(seed)
    if kind in ("f32", "f64"):
        return random.uniform(low, high, size).astype(NUMPY[kind])
    return random.integers(low, high, size).astype(NUMPY[kind])


class Inputs:
    """Makes what is asked for, once, in a folder."""

    def __init__(self, folder):
        self.folder, self.made = pathlib.Path(folder), {}

    def get(self, name):
        """@return  path as on the command line, and the volume"""
        if name not in self.made:
            self.made[name] = self.make_dicom(name) if name in DICOM else self.make_file(name)
        return self.made[name]

    def make_file(self, name):
        if name == "vectors":
            path = self.folder / "vectors.nrrd"
            values = np.random.default_rng(90).uniform(-5, 5, (*SIZE, 3)).astype("<f4")
            volume = Volume(values, grid_affine(SIZE, SPACING))
        else:
            kind, file, spacing, turned = FILES[name]
            path = self.folder / file
            direction = rotation(25, -35, 15) if turned else None
            volume = Volume(noise(kind, SIZE, len(self.made)), grid_affine(SIZE, spacing, direction))
        if name == "nii-nan":
            volume.values[np.indices(SIZE).sum(0) % 9 == 4] = np.nan
        if path.suffix == ".nrrd":
            write_nrrd(path, volume, compressed=name == "nrrd-f32")
        elif path.suffix == ".mha":
            write_mha(path, volume)
        else:
            write_nifti(path, volume)
        return str(path), volume

    def make_dicom(self, name):
        direction = rotation(20, 10, -30) if name == "dicom-oblique" else None
        volume = Volume(noise("i16", SIZE, 50 + DICOM.index(name)), grid_affine(SIZE, SPACING, direction))
        series = DICOM.index(name) + 1
        folder = self.folder / made_dicom.FOLDER / name
        if name == "tilted":
            slices = made_dicom.slices(volume, series, lean=LEAN)
            volume.affine[:3, 2] += volume.affine[:3, 1] / SPACING[1] * LEAN * SPACING[2]
        elif name == "uneven":
            slices = made_dicom.slices(volume, series, uneven=UNEVEN)
            volume.slices = np.array(UNEVEN)
        elif name == "padded":
            corner = np.indices(SIZE).sum(0)
            volume.values[(corner % 7 == 0) | (corner < 6)] = PADDING
            slices = made_dicom.slices(volume, series, padding=PADDING)
            volume.padding = PADDING
        else:
            slices = made_dicom.slices(volume, series)
        if name == "enhanced":
            folder.mkdir(parents=True, exist_ok=True)
            made_dicom.write_enhanced(folder / "e.dcm", slices)
        else:
            made_dicom.write_series(folder, slices)
        return str(folder / "s005.dcm" if name == "dicom-file" else folder), volume


def write_along(folder):
    """Volumes and objects for --with, and the volume of --grid FILE. @return  the volumes by name"""
    folder = pathlib.Path(folder)
    size = (9, 8, 7)
    affine = grid_affine(size, (3.0, 3.0, 3.0), rotation(5, -8, 12))
    made = {"labels": Volume(noise("u8", size, 70), affine),
            "vectors": Volume(np.random.default_rng(71).uniform(-4, 4, (*size, 3)).astype("<f4"), affine),
            "other": Volume(noise("i16", size, 72), grid_affine(size, (1.25, 1.5, 1.5))),
            "dose": Volume(noise("u32", size, 73) // 100, grid_affine(size, (3.0, 2.5, 3.5))),
            "segments": Volume((noise("u8", (12, 12, 8), 74) > 3).astype("u1"),
                               grid_affine((12, 12, 8), (2.0, 2.0, 3.0))),
            "grid": Volume(np.zeros((9, 10, 8), "<i2"), grid_affine((9, 10, 8), (1.2, 1.3, 1.25), rotation(0, 0, 20)))}
    write_nifti(folder / "labels.nii.gz", made["labels"])
    write_nrrd(folder / "arrows.nrrd", made["vectors"])
    write_mha(folder / "other.mha", made["other"])
    write_mha(folder / "grid.mha", made["grid"])
    made_dicom.write_dose(folder / "dose.dcm", made["dose"])
    made_dicom.write_segmentation(folder / "seg.dcm", made["segments"])
    x, y, z = MIDDLE
    planes = z - 3.0 * np.arange(-2, 3)
    corner = [(-7, -6), (6, -7), (7, 6), (-6, 7)]
    made_dicom.write_structures(folder / "structures.dcm",
                                [[(x + a, y + b, plane) for a, b in corner] for plane in planes])
    return made


def write_points(folder):
    folder = pathlib.Path(folder)
    points = MIDDLE + np.random.default_rng(80).uniform(-15, 15, (24, 3))
    points[-1] = MIDDLE + 200
    points = np.round(points, 3)
    (folder / "points.csv").write_text(
        "name,x,y,z\n" + "".join(f"p{n}," + ",".join(repr(float(x)) for x in p) + "\n" for n, p in enumerate(points)))
    markup = {"markups": [{"type": "Fiducial", "coordinateSystem": "RAS", "controlPoints": [
        {"id": str(n), "label": f"p{n}", "position": [-p[0], -p[1], p[2]], "positionStatus": "defined"}
        for n, p in enumerate(points.tolist())]}]}
    (folder / "points.mrk.json").write_text(json.dumps(markup))
    facets = points[:21].reshape(-1, 3, 3)
    lines = ["solid made SPACE=LPS"]
    for facet in facets:
        lines += ["facet normal 0 0 0", "outer loop", *("vertex " + " ".join(map(repr, p.tolist())) for p in facet),
                  "endloop", "endfacet"]
    (folder / "points.stl").write_text("\n".join(lines + ["endsolid made", ""]))
    return points
