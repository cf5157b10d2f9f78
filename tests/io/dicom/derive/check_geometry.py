# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Checks that other readers see the voxels of a volume where and as they are.

    check_geometry.py READER[,READER...] PATH EXPECTED

READER: pydicom or dcm2niix of a folder of a DICOM series (or of links to its files), nibabel of a NIfTI file.
EXPECTED: a NIfTI file, read by nibabel, or a JSON of size, spacing, origin, direction (columns, one after the other), LPS
mm, and voxels, the name of a file of int16, i fastest. Every corner must agree within 1e-4 mm (1e-3 of a NIfTI file), and
every voxel be equal, in whichever order the reader has them. Exit status 0: so it is, 1: it is not, 77: a reader is
missing.
"""

import json
import pathlib
import shutil
import subprocess
import sys
import tempfile


def skip(reason):
    print(reason)
    sys.exit(77)


try:
    import numpy as np
except ImportError:
    skip("python3-numpy is not installed")


def read_nifti(path):
    """LPS affine of continuous index, and voxels, i first."""
    try:
        import nibabel
    except ImportError:
        skip("python3-nibabel is not installed")
    image = nibabel.load(path)
    return np.diag([-1, -1, 1, 1]) @ image.affine, np.asarray(image.dataobj)


def read_pydicom(folder):
    try:
        import pydicom
    except ImportError:
        skip("python3-pydicom is not installed")
    slices = [pydicom.dcmread(path) for path in sorted(folder.iterdir())]
    row, column = np.reshape([float(v) for v in slices[0].ImageOrientationPatient], (2, 3))
    normal = np.cross(row, column)
    slices.sort(key=lambda s: float(np.dot(normal, [float(v) for v in s.ImagePositionPatient])))
    first, last = ([float(v) for v in s.ImagePositionPatient] for s in (slices[0], slices[-1]))
    affine = np.eye(4)
    affine[:3, 0] = row * float(slices[0].PixelSpacing[1])
    affine[:3, 1] = column * float(slices[0].PixelSpacing[0])
    affine[:3, 2] = np.subtract(last, first) / max(len(slices) - 1, 1)
    affine[:3, 3] = first
    try:
        slices[0].pixel_array
    except (NotImplementedError, RuntimeError) as error:  # compressed, and no decoder is there
        skip(f"pydicom: {error}; install python3-gdcm")
    hu = [s.pixel_array.astype(np.int32) * int(s.RescaleSlope) + int(s.RescaleIntercept) for s in slices]
    return affine, np.stack(hu).transpose(2, 1, 0)


def read_dcm2niix(folder):
    if not shutil.which("dcm2niix"):
        skip("dcm2niix is not installed")
    with tempfile.TemporaryDirectory() as output:
        command = ["dcm2niix", "-z", "n", "-f", "out", "-o", output, str(folder)]
        log = subprocess.run(command, capture_output=True, text=True, errors="replace").stdout
        files = list(pathlib.Path(output).glob("*.nii"))
        if len(files) != 1:
            sys.exit(f"dcm2niix made {len(files)} volumes of {folder}:\n{log}")
        affine, voxels = read_nifti(files[0])
        return affine, np.array(voxels)  # the file goes


def read_expected(path):
    if path.suffix != ".json":
        return (*read_nifti(path), 1e-3)
    expected = json.loads(path.read_text())
    affine = np.eye(4)
    affine[:3, :3] = np.reshape(expected["direction"], (3, 3)).T * expected["spacing"]
    affine[:3, 3] = expected["origin"]
    voxels = np.fromfile(expected["voxels"], "<i2").reshape(expected["size"], order="F")
    return affine, voxels, 1e-4


def corners(affine, size):
    """LPS mm of the eight corner voxel centres, k fastest."""
    ends = np.stack(np.meshgrid(*[(0, n - 1) for n in size], indexing="ij"), -1).reshape(8, 3)
    return ends @ affine[:3, :3].T + affine[:3, 3]


def turned(affine, voxels, like):
    """Voxels in the order of another affine: axes are exchanged and flipped, nothing else changes."""
    steps = np.linalg.inv(like[:3, :3]) @ affine[:3, :3]
    axis_of = np.abs(steps).argmax(axis=1)
    if sorted(axis_of) != [0, 1, 2]:
        sys.exit(f"axes lie askew:\n{affine}\n{like}")
    order = affine.copy()
    order[:3, :3] = affine[:3, axis_of]
    voxels = voxels.transpose(axis_of)
    for axis in range(3):
        if steps[axis, axis_of[axis]] < 0:
            order[:3, 3] += order[:3, axis] * (voxels.shape[axis] - 1)
            order[:3, axis] *= -1
            voxels = np.flip(voxels, axis)
    return order, voxels


def compare(reader, found, expected):
    affine, voxels = turned(*found, expected[0])
    wanted_affine, wanted, tolerance_mm = expected
    if voxels.shape != wanted.shape:
        sys.exit(f"{reader}: size {list(voxels.shape)}, expected {list(wanted.shape)}")
    error = np.linalg.norm(corners(affine, voxels.shape) - corners(wanted_affine, wanted.shape), axis=1).max()
    print(f"{reader}: corners agree within {error:.2e} mm")
    if not error <= tolerance_mm:
        sys.exit(f"{reader}: a corner is {error} mm away, more than {tolerance_mm}\n{affine}\n{wanted_affine}")
    if not np.array_equal(voxels, wanted):
        off = np.abs(voxels - wanted.astype(float))
        sys.exit(f"{reader}: {np.count_nonzero(off)} of {off.size} voxels differ, by up to {off.max()}")
    print(f"{reader}: voxels agree")


def main():
    readers, path, expected_path = sys.argv[1:]
    expected = read_expected(pathlib.Path(expected_path))
    read = {"pydicom": read_pydicom, "dcm2niix": read_dcm2niix, "nibabel": read_nifti}
    for reader in readers.split(","):
        compare(reader, read[reader](pathlib.Path(path)), expected)


main()
