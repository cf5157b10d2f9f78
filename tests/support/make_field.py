# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes a displacement field as other tools do, with their libraries (nibabel, NumPy, pydicom) and not with ours.

    make_field.py KIND FIELD.mha OUTPUT

FIELD.mha: three floats a voxel, uncompressed, LPS mm. KIND is one of

    1006, 1007                      NIfTI intents
    nreg-P                          NiftyReg, intent_p1 P: 0 positions, else displacements
    npy:TYPE:ORDER:LAYOUT[:reversed]    such as npy:<f4:zyx:C; reversed: components z first
    dsr:ENCODING[:matrices]         a DICOM Deformable Spatial Registration; ENCODING is explicit, implicit, big or
                                    deflated; matrices: maps before and after the grid that leave the field what it is
    spline:CASE                     a cubic B-spline control point grid of NiftyReg over the field's grid; CASE is random,
                                    or corner: one control point moved by (3, 5, 7) mm

Beside a spline OUTPUT.nii lie the positions that it gives: OUTPUT-index.nii on the field's grid, by the ratio of spacings,
as reg_spline_getDeformationField computes them without composition, and OUTPUT-world.nii on a turned grid that reaches
beyond the control points, by millimetres, as it does with composition. Exit status 77: a library is missing.
"""

import sys

try:
    import numpy as np
    if sys.argv[1].startswith("dsr:"):
        import pydicom
        from pydicom.dataset import Dataset, FileMetaDataset
        from pydicom.sequence import Sequence
    elif not sys.argv[1].startswith("npy:"):
        import nibabel
except ImportError as error:
    print(error)
    sys.exit(77)


def read_mha(path):
    """Vectors by (i, j, k, component), and the 4 x 4 matrix from index to LPS mm."""
    with open(path, "rb") as file:
        fields = {}
        while "ElementDataFile" not in fields:
            name, value = file.readline().decode().split("=", 1)
            fields[name.strip()] = value.split()
        values = np.frombuffer(file.read(), "<f4")
    size = [int(n) for n in fields["DimSize"]]
    affine = np.eye(4)
    axes = np.array(fields["TransformMatrix"], float).reshape(3, 3)  # a row an axis
    affine[:3, :3] = (axes * np.array(fields["ElementSpacing"], float)[:, None]).T
    affine[:3, 3] = np.array(fields["Offset"], float)
    return values.reshape(size[2], size[1], size[0], 3).transpose(2, 1, 0, 3), affine


def write_nifti(kind, lps, affine, path):
    to_ras = np.diag([-1.0, -1.0, 1.0, 1.0])
    ras_affine = to_ras @ affine
    vectors = lps.astype(float)
    if kind != "1007":
        vectors = vectors @ to_ras[:3, :3]
    if kind == "nreg-0":
        index = np.stack(np.meshgrid(*[np.arange(n) for n in lps.shape[:3]], indexing="ij"), -1)
        vectors = vectors + index @ ras_affine[:3, :3].T + ras_affine[:3, 3]
    image = nibabel.Nifti1Image(vectors[:, :, :, None, :].astype("<f4"), ras_affine)
    header = image.header
    header.set_xyzt_units("mm")
    image.set_sform(ras_affine, 1)
    image.set_qform(ras_affine, 1)
    if kind == "1006":
        header["intent_code"] = 1006
    else:
        header["intent_code"] = 1007
    if kind.startswith("nreg-"):
        header["intent_name"] = b"NREG_TRANS"
        header["intent_p1"] = float(kind[5:])
    nibabel.save(image, path)


def basis(t):
    """Weights of the uniform cubic B-spline."""
    return [(1 - t)**3 / 6, (3 * t**3 - 6 * t**2 + 4) / 6, (-3 * t**3 + 3 * t**2 + 3 * t + 1) / 6, t**3 / 6]


def blend(points, affine, u):
    """Positions at grid indices u; beyond the grid its outermost control points go on."""
    last = np.array(points.shape[:3]) - 1
    base = np.floor(u).astype(int)
    weights = [basis(u[:, axis] - base[:, axis]) for axis in range(3)]
    total = np.zeros_like(u)
    for a in range(4):
        for b in range(4):
            for c in range(4):
                at = base - 1 + np.array([a, b, c])
                there = np.clip(at, 0, last)
                value = points[tuple(there.T)] + (at - there) @ affine[:3, :3].T
                total += (weights[0][a] * weights[1][b] * weights[2][c])[:, None] * value
    return total


def write_niftyreg(vectors, affine, kind, path):
    image = nibabel.Nifti1Image(vectors[:, :, :, None, :], affine)
    image.header.set_xyzt_units("mm")
    image.set_sform(affine, 1)
    image.set_qform(affine, 1)
    image.header["intent_code"] = 1007
    image.header["intent_name"] = b"NREG_TRANS"
    image.header["intent_p1"] = float(kind)
    nibabel.save(image, path)


def write_spline(kind, size, affine, path):
    """Control points as reg_createControlPointGrid puts them: from one before the image, ceil(extent / spacing) + 3."""
    size = np.array(size)
    ras = np.diag([-1.0, -1.0, 1.0, 1.0]) @ affine
    spacing = np.linalg.norm(ras[:3, :3], axis=0)
    ratio = np.array([1.5, 2.2, 1.7])  # voxels from one control point to the next
    grid = np.eye(4)
    grid[:3, :3] = ras[:3, :3] * ratio
    grid[:3, 3] = ras[:3, 3] - grid[:3, :3].sum(axis=1)
    count = np.ceil(size / ratio).astype(int) + 3
    index = np.stack(np.meshgrid(*[np.arange(n) for n in count], indexing="ij"), -1)
    moved = np.zeros(tuple(count) + (3,))
    if kind == "spline:corner":
        moved[-3, 1, -3] = [-3, -5, 7]  # RAS
    else:
        moved = np.random.default_rng(7).uniform(-2, 2, moved.shape) * spacing.min()
    points = (index @ grid[:3, :3].T + grid[:3, 3] + moved).astype("<f4")
    write_niftyreg(points, grid, 2, path)
    points = points.astype(float)
    voxels = np.stack(np.meshgrid(*[np.arange(n) for n in size], indexing="ij"), -1).reshape(-1, 3)
    by_index = blend(points, grid, 1 + voxels / ratio).reshape(*size, 3)
    write_niftyreg(by_index, ras, 0, path.replace(".nii", "-index.nii"))
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1]])
    other = np.eye(4)
    other[:3, :3] = turn * (size * spacing).max() / 4
    middle = ras[:3, :3] @ ((size - 1) / 2) + ras[:3, 3]
    other_size = np.array([7, 6, 5])
    other[:3, 3] = middle - other[:3, :3] @ ((other_size - 1) / 2)
    voxels = np.stack(np.meshgrid(*[np.arange(n) for n in other_size], indexing="ij"), -1).reshape(-1, 3)
    mm = voxels @ other[:3, :3].T + other[:3, 3]
    by_mm = blend(points, grid, (mm - grid[:3, 3]) @ np.linalg.inv(grid[:3, :3]).T).reshape(*other_size, 3)
    write_niftyreg(by_mm, other, 0, path.replace(".nii", "-world.nii"))


def write_npy(kind, lps, path):
    _, dtype, order, layout, *rest = kind.split(":")
    array = lps if order == "xyz" else lps.transpose(2, 1, 0, 3)
    if rest:
        array = array[..., ::-1]
    np.save(path, np.array(array, dtype=dtype, order=layout))


def decimals(values):
    """Decimal strings of at most 16 characters."""
    return ["%.10g" % value for value in values]


def matrix_sequence(matrix, kind):
    item = Dataset()
    item.FrameOfReferenceTransformationMatrixType = kind
    item.FrameOfReferenceTransformationMatrix = decimals(matrix.ravel())
    return Sequence([item])


def affine_maps():
    """Maps before and after the grid, with the digits that are written: none is the inverse of the other."""
    c, s = np.cos(0.2), np.sin(0.2)
    pre = np.array([[c, -s, 0, 12.5], [s, c, 0, -7.25], [0, 0, 1, 30], [0, 0, 0, 1]])
    post = np.array([[1.25, 0.1, 0, 4], [0, 0.9, -0.3, 5], [0.2, 0, 1.1, -60], [0, 0, 0, 1]])
    return [np.array(decimals(matrix.ravel()), float).reshape(4, 4) for matrix in (pre, post)]


def write_dsr(kind, lps, affine, path):
    _, encoding, *rest = kind.split(":")
    uids = {
        "explicit": pydicom.uid.ExplicitVRLittleEndian,
        "implicit": pydicom.uid.ImplicitVRLittleEndian,
        "big": pydicom.uid.ExplicitVRBigEndian,
        "deflated": pydicom.uid.DeflatedExplicitVRLittleEndian,
    }
    spacing = np.linalg.norm(affine[:3, :3], axis=0)
    cosines = affine[:3, :3] / spacing
    grid, item, data = Dataset(), Dataset(), Dataset()
    offsets = lps.astype(float)
    item.SourceFrameOfReferenceUID = "1.2.3.4"
    if rest:
        pre, post = affine_maps()
        index = np.stack(np.meshgrid(*[np.arange(n) for n in lps.shape[:3]], indexing="ij"), -1)
        point = index @ affine[:3, :3].T + affine[:3, 3]
        before = point @ pre[:3, :3].T + pre[:3, 3]
        offsets = (point + offsets - post[:3, 3]) @ np.linalg.inv(post[:3, :3]).T - before
        item.PreDeformationMatrixRegistrationSequence = matrix_sequence(pre, "RIGID")
        item.PostDeformationMatrixRegistrationSequence = matrix_sequence(post, "AFFINE")
    grid.ImagePositionPatient = decimals(affine[:3, 3])
    grid.ImageOrientationPatient = decimals(cosines[:, :2].T.ravel())
    grid.GridDimensions = list(lps.shape[:3])
    grid.GridResolution = list(spacing)
    order = ">f4" if encoding == "big" else "<f4"
    grid.VectorGridData = offsets.transpose(2, 1, 0, 3).astype(order).tobytes()
    item.DeformableRegistrationGridSequence = Sequence([grid])
    data.SOPClassUID = "1.2.840.10008.5.1.4.1.1.66.3"
    data.SOPInstanceUID = "1.2.3.5"
    data.Modality = "REG"
    data.FrameOfReferenceUID = "1.2.3.6"
    data.DeformableRegistrationSequence = Sequence([item])
    data.file_meta = FileMetaDataset()
    data.file_meta.MediaStorageSOPClassUID = data.SOPClassUID
    data.file_meta.MediaStorageSOPInstanceUID = data.SOPInstanceUID
    data.file_meta.TransferSyntaxUID = uids[encoding]
    data.is_little_endian = encoding != "big"
    data.is_implicit_VR = encoding == "implicit"
    data.save_as(path, write_like_original=False)


kind, source, output = sys.argv[1:]
vectors, matrix = read_mha(source)
if kind.startswith("npy:"):
    write_npy(kind, vectors, output)
elif kind.startswith("spline:"):
    write_spline(kind, vectors.shape[:3], matrix, output)
elif kind.startswith("dsr:"):
    write_dsr(kind, vectors, matrix, output)
else:
    write_nifti(kind, vectors, matrix, output)
