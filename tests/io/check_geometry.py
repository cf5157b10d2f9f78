"""Checks that other readers see a DICOM series of ours where it is.

    check_geometry.py pydicom|dcm2niix FOLDER EXPECTED.json

EXPECTED.json: size, spacing, origin, direction (columns, one after the other), LPS mm; HU sum of all voxels; where the
brightest voxel is, if there is one. Every corner voxel centre and the brightest must agree within 1e-4 mm. Exit status 0: it does, 1: it does not, 77: the reader is missing.
"""

import itertools
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

TOLERANCE_MM = 1e-4


def skip(reason):
    print(reason)
    sys.exit(77)


try:
    import numpy as np
except ImportError:
    skip("python3-numpy is not installed")


def corners(affine, size):
    """LPS mm of the eight corner voxel centres, as a set of points: flipped axes name the same voxels."""
    ends = itertools.product(*[(0, n - 1) for n in size])
    return np.array([affine @ [*end, 1] for end in ends])[:, :3]


def expected_affine(expected):
    affine = np.eye(4)
    affine[:3, :3] = np.reshape(expected["direction"], (3, 3)).T * expected["spacing"]
    affine[:3, 3] = expected["origin"]
    return affine


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
    hu = [s.pixel_array.astype(np.int64) * int(s.RescaleSlope) + int(s.RescaleIntercept) for s in slices]
    return affine, np.stack(hu).transpose(2, 1, 0)


def read_dcm2niix(folder):
    if not shutil.which("dcm2niix"):
        skip("dcm2niix is not installed")
    try:
        import nibabel
    except ImportError:
        skip("python3-nibabel is not installed")
    with tempfile.TemporaryDirectory() as output:
        command = ["dcm2niix", "-z", "n", "-f", "out", "-o", output, str(folder)]
        log = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        files = list(pathlib.Path(output).glob("*.nii"))
        if len(files) != 1:
            sys.exit(f"dcm2niix made {len(files)} volumes of {folder}:\n{log}")
        image = nibabel.load(files[0])
        return np.diag([-1, -1, 1, 1]) @ image.affine, np.asarray(image.dataobj).astype(np.int64)


def main():
    reader, folder, expected_file = sys.argv[1:]
    expected = json.loads(pathlib.Path(expected_file).read_text())
    read = {"pydicom": read_pydicom, "dcm2niix": read_dcm2niix}[reader]
    affine, voxels = read(pathlib.Path(folder))
    size, total = voxels.shape, int(voxels.sum())
    if list(size) != expected["size"]:
        sys.exit(f"{reader}: size {list(size)}, expected {expected['size']}")
    found, wanted = corners(affine, size), corners(expected_affine(expected), expected["size"])
    error = max(np.linalg.norm(found - point, axis=1).min() for point in wanted)
    print(f"{reader}: corners agree within {error:.2e} mm")
    if not error <= TOLERANCE_MM:
        sys.exit(f"{reader}: a corner is {error} mm away, more than {TOLERANCE_MM}\n{affine}\n{expected_affine(expected)}")
    if "brightest" in expected:
        place = (affine @ [*np.unravel_index(voxels.argmax(), size), 1])[:3]
        if not np.linalg.norm(place - expected["brightest"]) <= TOLERANCE_MM:
            sys.exit(f"{reader}: the brightest voxel is at {place}, expected {expected['brightest']}")
    if total != expected["hu_sum"]:
        sys.exit(f"{reader}: the voxels add up to {total} HU, expected {expected['hu_sum']}")


main()
