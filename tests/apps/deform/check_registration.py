# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Checks a Deformable Spatial Registration object of ours as pydicom reads it.

    check_registration.py OBJECT SOURCE_FOLDER DERIVED_FOLDER|- INVERSE.mha

INVERSE.mha: the vectors that the object should hold, LPS mm, not compressed, so that they end the file. Frames of reference, series and
instances that the object names must be those of the folders, each instance once; its grid must be the voxel centres of
the derived series (of the source, where nothing is derived). Exit status 0: all is so, 1: it is not, 77: a reader is
missing.
"""

import pathlib
import sys

try:
    import numpy as np
    import pydicom
except ImportError as error:
    print(error.name, "is not installed")
    sys.exit(77)


def slices_of(folder):
    slices = [pydicom.dcmread(path, stop_before_pixels=True) for path in sorted(pathlib.Path(folder).iterdir())]
    row, column = np.reshape([float(v) for v in slices[0].ImageOrientationPatient], (2, 3))
    normal = np.cross(row, column)
    return sorted(slices, key=lambda s: float(np.dot(normal, [float(v) for v in s.ImagePositionPatient])))


def images(sequence):
    return [(item.ReferencedSOPClassUID, item.ReferencedSOPInstanceUID) for item in sequence]


def expected_images(slices):
    return [(s.SOPClassUID, s.SOPInstanceUID) for s in slices]


def check(what, found, expected):
    if found != expected:
        print(f"{what}: {found}, expected {expected}")
        sys.exit(1)


def check_grid(grid, slices):
    first, last = slices[0], slices[-1]
    check("Grid Dimensions", list(grid.GridDimensions), [first.Columns, first.Rows, len(slices)])
    row, column = np.reshape([float(v) for v in grid.ImageOrientationPatient], (2, 3))
    end = np.array([float(v) for v in grid.ImagePositionPatient]) + np.cross(row, column) * grid.GridResolution[2] * (
        len(slices) - 1
    )
    beyond = {
        "first corner": np.subtract(grid.ImagePositionPatient, first.ImagePositionPatient),
        "last slice": np.subtract(end, last.ImagePositionPatient),
        "axes": np.subtract(grid.ImageOrientationPatient, first.ImageOrientationPatient),
        "pixels": np.subtract(grid.GridResolution[:2], [first.PixelSpacing[1], first.PixelSpacing[0]]),
    }
    for what, difference in beyond.items():
        check(what + " within 1e-4 mm", bool(np.abs(difference.astype(float)).max() <= 1e-4), True)


def main(path, source_folder, derived_folder, inverse):
    found = pydicom.dcmread(path)
    source = slices_of(source_folder)
    derived = [] if derived_folder == "-" else slices_of(derived_folder)
    check("SOP Class", found.SOPClassUID.name, "Deformable Spatial Registration Storage")
    check("Study", found.StudyInstanceUID, source[0].StudyInstanceUID)
    if derived:
        check("Frame of Reference", found.FrameOfReferenceUID, derived[0].FrameOfReferenceUID)
    items = list(found.DeformableRegistrationSequence)
    check("items", len(items), 2 if derived else 1)
    check("source frame", items[-1].SourceFrameOfReferenceUID, source[0].FrameOfReferenceUID)
    check("source images", images(items[-1].ReferencedImageSequence), expected_images(source))
    if derived:
        check("derived images", images(items[0].ReferencedImageSequence), expected_images(derived))
    named = {s.SeriesInstanceUID: images(s.ReferencedInstanceSequence) for s in found.ReferencedSeriesSequence}
    check("series", named, {s[0].SeriesInstanceUID: expected_images(s) for s in (source, derived) if s})
    (grid,) = items[-1].DeformableRegistrationGridSequence
    check_grid(grid, derived or source)
    check("bytes", len(grid.VectorGridData), 12 * int(np.prod(np.array(grid.GridDimensions, dtype=int))))
    check("vectors are those of the inverse", pathlib.Path(inverse).read_bytes().endswith(grid.VectorGridData), True)
    vectors = np.frombuffer(grid.VectorGridData, "<f4").reshape(-1, 3)
    print(f"{len(vectors)} vectors, {int(np.isnan(vectors).all(-1).sum())} undefined")


main(*sys.argv[1:])
