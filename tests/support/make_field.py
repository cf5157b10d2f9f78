"""Writes a displacement field as other tools do, with their libraries (nibabel, NumPy) and not with ours.

    make_field.py KIND FIELD.mha OUTPUT

FIELD.mha: three floats a voxel, uncompressed, LPS mm. KIND: 1006, 1007 (NIfTI intents), nreg-P (NiftyReg, intent_p1 P:
0 positions, else displacements), or npy:TYPE:ORDER:LAYOUT[:reversed] (such as npy:<f4:zyx:C; reversed: components z
first). Exit status 77: a library is missing.
"""

import sys

try:
    import numpy as np
    if not sys.argv[1].startswith("npy:"):
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


def write_npy(kind, lps, path):
    _, dtype, order, layout, *rest = kind.split(":")
    array = lps if order == "xyz" else lps.transpose(2, 1, 0, 3)
    if rest:
        array = array[..., ::-1]
    np.save(path, np.array(array, dtype=dtype, order=layout))


kind, source, output = sys.argv[1:]
vectors, matrix = read_mha(source)
if kind.startswith("npy:"):
    write_npy(kind, vectors, output)
else:
    write_nifti(kind, vectors, matrix, output)
