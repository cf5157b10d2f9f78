# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Checks that OUT.nii shows a DICOM series where its slices lie, by pydicom and NumPy alone: linear within each slice,
and linear between neighbouring slices, which need not be even nor stacked along their normal.

check_stack.py FOLDER OUT.nii SHIFT_X SHIFT_Y SHIFT_Z BACKGROUND  (mm, LPS: the field that moved the series)

Exit status 77: a module is missing.
"""
import pathlib
import sys

try:
    import nibabel
    import numpy as np
    import pydicom
except ImportError as error:
    print(error)
    sys.exit(77)


def read_slices(folder):
    slices = []
    for path in sorted(pathlib.Path(folder).rglob("*")):
        if path.is_file() and path.name != "DIRFILE":
            slices.append(pydicom.dcmread(path))
    orientation = np.array(slices[0].ImageOrientationPatient, float)
    row, column = orientation[:3], orientation[3:]
    normal = np.cross(row, column)
    place = lambda s: np.dot(normal, np.array(s.ImagePositionPatient, float))
    slices.sort(key=place)
    hu = np.array([s.pixel_array * float(s.RescaleSlope) + float(s.RescaleIntercept) for s in slices])
    padding = getattr(slices[0], "PixelPaddingValue", None)
    return slices, row, column, normal, hu, padding


def main():
    slices, row, column, normal, hu, padding = read_slices(sys.argv[1])
    shift, background = np.array([float(v) for v in sys.argv[3:6]]), float(sys.argv[6])
    position = np.array([np.array(s.ImagePositionPatient, float) for s in slices])
    spacing = np.array(slices[0].PixelSpacing, float)
    image = nibabel.load(sys.argv[2])
    found = np.asarray(image.dataobj)
    generator = np.random.default_rng(1)
    voxel = np.stack([generator.integers(0, n, 300000) for n in found.shape], 1)
    ras = voxel @ image.affine[:3, :3].T + image.affine[:3, 3]
    point = ras * [-1, -1, 1] - shift
    # Which slices lie around the point, and where their plane's origin is in between.
    places, at = position @ normal, point @ normal
    k = np.clip(np.searchsorted(places, at, side="right") - 1, 0, len(places) - 2)
    weight = (at - places[k]) / (places[k + 1] - places[k])
    offset = point - (position[k] + (position[k + 1] - position[k]) * weight[:, None])
    x, y = offset @ row / spacing[1], offset @ column / spacing[0]
    height, width = hu.shape[1:]
    inside = (x >= 0) & (x <= width - 1) & (y >= 0) & (y <= height - 1) & (weight >= 0) & (weight <= 1)
    far = (x < -0.6) | (x > width - 0.4) | (y < -0.6) | (y > height - 0.4) | (weight < -0.6) | (weight > 1.6)
    i, j = np.clip(np.floor(x).astype(int), 0, width - 2), np.clip(np.floor(y).astype(int), 0, height - 2)
    u, v = x - i, y - j
    corner = lambda dk, dj, di: hu[k + dk, j + dj, i + di]
    plane = lambda dk: (corner(dk, 0, 0) * (1 - u) + corner(dk, 0, 1) * u) * (1 - v) + (
        corner(dk, 1, 0) * (1 - u) + corner(dk, 1, 1) * u) * v
    expected = plane(0) * (1 - weight) + plane(1) * weight
    if padding is not None:  # never mixed: another rule, not looked at here; nor which slice a place on one is above
        inside &= (weight > 1e-6) & (weight < 1 - 1e-6)
        for corner_of in [(a, b, c) for a in (0, 1) for b in (0, 1) for c in (0, 1)]:
            inside &= corner(*corner_of) != padding
    value = found[voxel[:, 0], voxel[:, 1], voxel[:, 2]].astype(float)
    error = np.abs(value - expected)[inside]
    moved = np.any(shift != 0)
    off_background = 0 if moved else np.count_nonzero(value[far] != background)
    print(f"inside {np.mean(inside):.3f} largest {error.max():.3f} beyond {np.mean(far):.3f} off {off_background}")
    tolerance = 0.6  # rounding to whole HU, and places computed in another order
    share = 0.999 if moved else 1.0  # a moved lattice is snapped to 2^-12 voxel: steep edges may be off by more
    good = np.mean(error <= tolerance) >= share and np.mean(inside) > 0.5 and off_background == 0
    sys.exit(0 if good else 1)


main()
