# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""The CT series, the masks and the program that all checks of objects share. Arrays are [k, j, i], points LPS mm."""

import copy
import importlib.metadata
import itertools
import shutil
import subprocess

import nibabel
import numpy as np
import pydicom

FIELD = ("elastic:amplitude=6,spacing=30,seed=7",)
TO_RAS = np.diag([-1.0, -1, 1, 1])


class Wrong(Exception):
    """A result that is not what it must be."""


class Missing(Exception):
    """A program or package that is not installed."""


def expect(true, what):
    if not true:
        raise Wrong(what)


def need(package, module=None):
    """Imports a package of PyPI, or says that it is not there. @return the module, and "name version" of the package"""
    try:
        return importlib.import_module(module or package), importlib.metadata.version(package)
    except ImportError as error:
        raise Missing(f"{package} is not installed ({error})") from None


def tool(name):
    path = shutil.which(name)
    if not path:
        raise Missing(f"{name} is not installed")
    return path


def run(*command):
    """Runs another program. @return what it printed"""
    done = subprocess.run(
        [str(word) for word in command], capture_output=True, text=True, errors="replace", timeout=300
    )
    expect(done.returncode == 0, f"{command[0]} ended with {done.returncode}: {(done.stderr or done.stdout)[-300:]}")
    return done.stdout


def affine_of(slices):
    """From [i, j, k] to LPS."""
    first, last = (np.array(s.ImagePositionPatient, float) for s in (slices[0], slices[-1]))
    row, column = np.reshape([float(v) for v in slices[0].ImageOrientationPatient], (2, 3))
    between_rows, between_columns = (float(v) for v in slices[0].PixelSpacing)
    affine = np.eye(4)
    affine[:3, 0], affine[:3, 1] = row * between_columns, column * between_rows
    affine[:3, 2], affine[:3, 3] = (last - first) / (len(slices) - 1), first
    return affine


def moved(affine, points):
    """Points by a 4 x 4 matrix."""
    return np.asarray(points, float) @ affine[:3, :3].T + affine[:3, 3]


def read_series(folder):
    slices = [pydicom.dcmread(path) for path in folder.glob("*.dcm")]
    return sorted(slices, key=lambda s: float(s.ImagePositionPatient[2]))


def values_of(slices):
    return np.array([s.pixel_array * float(s.RescaleSlope) + float(s.RescaleIntercept) for s in slices])


def at_points(values, affine, points):
    """A volume at points, linearly, NaN where not all eight neighbours are there."""
    index = moved(np.linalg.inv(affine), points)[..., ::-1]
    low = np.floor(index + 1e-9).astype(int)
    inside = ((low >= 0) & (low + 1 < values.shape)).all(-1)
    low, part = np.where(inside[..., None], low, 0), index - low
    result = np.zeros(index.shape[:-1])
    for corner in itertools.product((0, 1), repeat=3):
        at = low + corner
        result += np.where(corner, part, 1 - part).prod(-1) * values[at[..., 0], at[..., 1], at[..., 2]]
    return np.where(inside, result, np.nan)


class World:
    """One CT series, masks on its voxels, and the program that deforms them."""

    def __init__(self, program, folder, size, spacing):
        self.program, self.folder = program, folder
        self.ct = folder / "ct"
        folder.mkdir(parents=True)
        self.must("phantom", "-o", f"{self.ct}/", "--size", size, "--spacing", spacing)
        self.slices = read_series(self.ct)
        self.affine = affine_of(self.slices)
        self.shape = (len(self.slices), self.slices[0].Rows, self.slices[0].Columns)
        k, j, i = np.indices(self.shape)
        self.points = moved(self.affine, np.stack([i, j, k], -1))
        self.derived = folder / "derived"

    def names(self):
        return [s.SOPInstanceUID for s in self.slices]

    def call(self, *arguments):
        command = [self.program, *(str(word) for word in arguments), "--quiet"]
        return subprocess.run(command, capture_output=True, text=True, timeout=300)

    def must(self, *arguments):
        done = self.call(*arguments)
        expect(done.returncode == 0, f"status {done.returncode}: {done.stderr.strip()}")

    def ball(self, centre, radius):
        return ((self.points - centre) ** 2).sum(-1) < radius**2

    def tube(self, centre, radius, half_length=1e9):
        x, y, z = np.moveaxis(self.points, -1, 0)
        return ((x - centre[0]) ** 2 + (y - centre[1]) ** 2 < radius**2) & (abs(z) < half_length)

    def box(self, centre, half):
        return (abs(self.points - centre) < half).all(-1)

    def deform_with(self, path, options="", field=FIELD, more=()):
        """Sends an object along. @return the finished process, and the object that it should have written"""
        out = self.folder / "out.dcm"
        shutil.rmtree(self.derived, ignore_errors=True)
        for old in (out, self.folder / "derived.json"):
            old.unlink(missing_ok=True)
        fields = [word for one in field for word in ("-f", one)]
        done = self.call(
            "deform", self.ct, *fields, "-o", f"{self.derived}/", "--with", f"{path}={out}{options}", *more
        )
        return done, out

    def moved_object(self, *arguments, **named):
        done, out = self.deform_with(*arguments, **named)
        expect(done.returncode == 0, f"refused: {done.stderr.strip()}")
        return out, read_series(self.derived)

    def deform_mask(self, mask, how, own=False, affine=None, field=FIELD):
        """The same volume as NIfTI through the same field. It has an empty slice more on either side, for a slice that
        an object does not have is empty. @return values [k, j, i] and their affine"""
        affine = self.affine if affine is None else affine
        beyond = 0 if own else 1
        padded = np.pad(mask, ((beyond, beyond), (0, 0), (0, 0))).astype(np.uint8)
        shifted = affine.copy()
        shifted[:3, 3] -= beyond * affine[:3, 2]
        source, out = self.folder / "mask.nii", self.folder / "moved_mask.nii"
        image = nibabel.Nifti1Image(padded.transpose(2, 1, 0), TO_RAS @ shifted)
        image.header.set_xyzt_units("mm")
        nibabel.save(image, source)
        fields = [word for one in field for word in ("-f", one)]
        self.must(
            "deform",
            self.ct,
            *fields,
            "-o",
            self.folder / "moved.nii",
            "--overwrite",
            "--with",
            f"{source}={out}:{how}:background=0{':own' if own else ''}",
        )
        result = nibabel.load(out)
        return np.asarray(result.dataobj).transpose(2, 1, 0), TO_RAS @ result.affine

    def other_series(self, folder):
        """The same slices as another series in a frame of reference of its own."""
        folder.mkdir()
        frame, series = pydicom.uid.generate_uid(), pydicom.uid.generate_uid()
        for n, one in enumerate(self.slices):
            one = copy.deepcopy(one)
            one.FrameOfReferenceUID, one.SeriesInstanceUID = frame, series
            one.SOPInstanceUID = one.file_meta.MediaStorageSOPInstanceUID = pydicom.uid.generate_uid()
            one.save_as(folder / f"{n}.dcm")
        return read_series(folder)


def voxels_that_differ(found, found_affine, expected, affine):
    """How many voxels two volumes [k, j, i] differ in. The grid of `found` may be a part of that of `expected`, in any
    orientation; what it shows beyond counts."""
    shown = np.argwhere(found != 0)
    place = moved(np.linalg.inv(affine), moved(found_affine, shown[:, ::-1]))[:, ::-1]
    nearest = np.rint(place).astype(int)
    if len(place):
        expect(np.abs(place - nearest).max() < 1e-3, "voxels are not those of the grid")
    inside = ((nearest >= 0) & (nearest < expected.shape)).all(-1)
    there = np.zeros(expected.shape, expected.dtype)
    there[tuple(nearest[inside].T)] = found[tuple(shown[inside].T)]
    return int((there != expected).sum() + (~inside).sum())
