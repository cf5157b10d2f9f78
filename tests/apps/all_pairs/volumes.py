# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Volumes as the checks see them, and files of them: written here byte by byte or by nibabel, read by nibabel, by
pydicom, or from raw NRRD and MHA. Nothing of Tetwarp is asked.

A volume is an array by (i, j, k) or (i, j, k, component), and the 4 x 4 matrix from index to LPS mm; of an uneven stack
the third axis is in mean distances of slices, and `slices` says where they lie.
"""
import gzip
import pathlib

import nibabel
import numpy as np
import pydicom

TYPES = {"i8": "int8", "u8": "uint8", "i16": "short", "u16": "ushort", "i32": "int", "u32": "uint", "f32": "float",
         "f64": "double"}
NUMPY = {"i8": "<i1", "u8": "<u1", "i16": "<i2", "u16": "<u2", "i32": "<i4", "u32": "<u4", "f32": "<f4", "f64": "<f8"}
MET = {"i8": "MET_CHAR", "u8": "MET_UCHAR", "i16": "MET_SHORT", "u16": "MET_USHORT", "i32": "MET_INT",
       "u32": "MET_UINT", "f32": "MET_FLOAT", "f64": "MET_DOUBLE"}
TO_RAS = np.diag([-1.0, -1.0, 1.0, 1.0])


class Volume:
    def __init__(self, values, affine, slices=None):
        self.values, self.affine, self.slices = values, np.array(affine, float), slices

    @property
    def size(self):
        return np.array(self.values.shape[:3])


def affine_of(spacing, origin, direction=None):
    affine = np.eye(4)
    affine[:3, :3] = (np.eye(3) if direction is None else np.array(direction)) * np.array(spacing, float)
    affine[:3, 3] = origin
    return affine


def number(value):
    return repr(float(value))


def raw(values):
    """i fastest, components of a voxel side by side."""
    if values.ndim == 4:
        return np.ascontiguousarray(values.transpose(2, 1, 0, 3)).tobytes()
    return np.ascontiguousarray(values.transpose(2, 1, 0)).tobytes()


def shaped(data, kind, size, components):
    values = np.frombuffer(data, np.dtype(kind))
    shape = [size[2], size[1], size[0]] + ([components] if components > 1 else [])
    values = values.reshape(shape)
    return values.transpose(2, 1, 0, 3) if components > 1 else values.transpose(2, 1, 0)


def kind_of(values):
    return next(name for name, code in NUMPY.items() if np.dtype(code) == values.dtype)


def write_nrrd(path, volume, compressed=False, extra=()):
    values, columns = volume.values, volume.affine[:3, :3].T
    vectors = values.ndim == 4
    sizes = ([values.shape[3]] if vectors else []) + list(values.shape[:3])
    axes = (["none"] if vectors else []) + ["(" + ",".join(number(x) for x in column) + ")" for column in columns]
    lines = ["NRRD0005", f"type: {TYPES[kind_of(values)]}", f"dimension: {len(sizes)}",
             "space: left-posterior-superior", "sizes: " + " ".join(map(str, sizes)),
             "space directions: " + " ".join(axes),
             "kinds: " + " ".join((["vector"] if vectors else []) + ["domain"] * 3), "endian: little",
             "encoding: " + ("gzip" if compressed else "raw"),
             "space origin: (" + ",".join(number(x) for x in volume.affine[:3, 3]) + ")", *extra]
    data = raw(values)
    pathlib.Path(path).write_bytes("\n".join(lines).encode() + b"\n\n" + (gzip.compress(data) if compressed else data))


def write_mha(path, volume, spacing_text=None, extra=()):
    values = volume.values
    spacing = np.linalg.norm(volume.affine[:3, :3], axis=0)
    direction = volume.affine[:3, :3] / spacing
    lines = ["ObjectType = Image", "NDims = 3", "BinaryData = True", "BinaryDataByteOrderMSB = False",
             "CompressedData = False", "TransformMatrix = " + " ".join(number(x) for x in direction.T.ravel()),
             "Offset = " + " ".join(number(x) for x in volume.affine[:3, 3]),
             "ElementSpacing = " + (spacing_text or " ".join(number(x) for x in spacing)),
             "DimSize = " + " ".join(map(str, values.shape[:3])), *extra]
    if values.ndim == 4:
        lines.append(f"ElementNumberOfChannels = {values.shape[3]}")
    lines += [f"ElementType = {MET[kind_of(values)]}", "ElementDataFile = LOCAL"]
    pathlib.Path(path).write_bytes("\n".join(lines).encode() + b"\n" + raw(values))


def write_nifti(path, volume):
    values = volume.values
    if values.ndim == 4:
        values = values[:, :, :, None, :]
    ras = TO_RAS @ volume.affine
    image = nibabel.Nifti1Image(values, ras)
    image.set_sform(ras, 1)
    image.set_qform(ras, 1)
    image.header.set_xyzt_units("mm")
    nibabel.save(image, str(path))


def read_nrrd(path):
    header, data = pathlib.Path(path).read_bytes().split(b"\n\n", 1)
    fields = dict(line.split(": ", 1) for line in header.decode().split("\n")[1:]
                  if ": " in line and not line.startswith("#"))
    if fields["encoding"] in ("gzip", "gz"):
        data = gzip.decompress(data)
    named = {name: NUMPY[code] for code, name in TYPES.items()}
    named |= {"signed char": "<i1", "unsigned char": "<u1", "unsigned short": "<u2", "unsigned int": "<u4",
              "int16": "<i2", "uint16": "<u2", "int32": "<i4", "uint32": "<u4"}
    sizes = [int(n) for n in fields["sizes"].split()]
    components = sizes.pop(0) if len(sizes) == 4 else 1
    vectors = [v for v in fields["space directions"].split() if v != "none"]
    affine = np.eye(4)
    for axis, text in enumerate(vectors):
        affine[:3, axis] = [float(x) for x in text.strip("()").split(",")]
    affine[:3, 3] = [float(x) for x in fields["space origin"].strip("()").split(",")]
    assert fields["space"] == "left-posterior-superior", fields["space"]
    return Volume(shaped(data, named[fields["type"]], sizes, components), affine)


def read_mha(path):
    with open(path, "rb") as file:
        fields = {}
        while "ElementDataFile" not in fields:
            name, value = file.readline().decode().split("=", 1)
            fields[name.strip()] = value.strip()
        data = file.read()
    if fields.get("CompressedData") == "True":
        import zlib
        data = zlib.decompress(data)
    kind = next(NUMPY[code] for code, name in MET.items() if name == fields["ElementType"])
    axes = np.array(fields["TransformMatrix"].split(), float).reshape(3, 3)
    affine = affine_of(np.array(fields["ElementSpacing"].split(), float), np.array(fields["Offset"].split(), float),
                       axes.T)
    components = int(fields.get("ElementNumberOfChannels", 1))
    return Volume(shaped(data, kind, [int(n) for n in fields["DimSize"].split()], components), affine)


def read_nifti(path):
    image = nibabel.load(str(path))
    values = np.asarray(image.dataobj)
    if values.ndim == 5:
        values = values[:, :, :, 0, :]
    return Volume(values, TO_RAS @ image.affine)


def read_series(folder):
    """A classic series of straight, even slices, in HU."""
    files = [pydicom.dcmread(path) for path in sorted(pathlib.Path(folder).iterdir())]
    cosines = np.array(files[0].ImageOrientationPatient, float)
    normal = np.cross(cosines[:3], cosines[3:])
    files.sort(key=lambda file: np.dot(normal, np.array(file.ImagePositionPatient, float)))
    first, last = (np.array(file.ImagePositionPatient, float) for file in (files[0], files[-1]))
    affine = np.eye(4)
    affine[:3, 0] = cosines[:3] * float(files[0].PixelSpacing[1])
    affine[:3, 1] = cosines[3:] * float(files[0].PixelSpacing[0])
    affine[:3, 2] = (last - first) / (len(files) - 1)
    affine[:3, 3] = first
    slices = [file.pixel_array * int(file.RescaleSlope) + int(file.RescaleIntercept) for file in files]
    return Volume(np.array(slices).transpose(2, 1, 0).astype("<i2"), affine)


def read(path):
    path = pathlib.Path(path)
    if path.is_dir():
        return read_series(path)
    if path.name.endswith(".nrrd"):
        return read_nrrd(path)
    return read_mha(path) if path.name.endswith(".mha") else read_nifti(path)


def read_mesh(path):
    """A legacy binary .vtk of tetrahedra. @return  rest, displacement, corners"""
    data = pathlib.Path(path).read_bytes()

    def block(start, kind):
        line_end = data.index(b"\n", data.index(start))
        words = data[data.index(start):line_end].split()
        return words, line_end + 1

    words, at = block(b"POINTS ", None)
    count = int(words[1])
    kind = {b"double": ">f8", b"float": ">f4"}[words[2]]
    rest = np.frombuffer(data, kind, 3 * count, at).reshape(-1, 3).astype(float)
    words, at = block(b"CELLS ", None)
    cells = int(words[1])
    corners = np.frombuffer(data, ">i4", 5 * cells, at).reshape(-1, 5)[:, 1:].astype(np.int64)
    words, at = block(b"VECTORS ", None)
    moved = np.frombuffer(data, {b"double": ">f8", b"float": ">f4"}[words[2]], 3 * count, at).reshape(-1, 3)
    return rest, moved.astype(float), corners
