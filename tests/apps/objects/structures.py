# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""RT Structure Sets of plastimatch, rt-utils and pydicomrt, and odd ones made with pydicom."""

import contextlib
import io
import json

import nibabel
import numpy as np
import pydicom
from pydicom.dataset import Dataset

from world import TO_RAS, expect, need, run, tool, voxels_that_differ

LEAST_DICE = 0.97
LEAST_DICE_ROUNDED = 0.95  # by readers that round points of contours to whole pixels
LEAST_DICE_SMALL, SMALL = 0.92, 1500  # of ROIs of fewer voxels
NUMBERS = ("ROINumber", "ROIName", "ROIDescription", "ROIGenerationDescription")


def masks_of(world):
    ring = world.tube((-10, 0), 40, 36) & ~world.tube((-10, 0), 22)
    return {
        "ball": world.ball((10, 5, 0), 28),
        "ring": ring,
        "pair": world.ball((-40, -40, 8), 18) | world.ball((42, 40, -8), 18),
        "shell": world.ball((0, 0, 0), 34) & ~world.ball((5, 0, 0), 20),
        "box": world.box((20, -30, 0), (25, 20, 20)),
        "small": world.ball((50, -20, 15), 9),
    }


def deformed(world, mask):
    """A mask through the same field, linearly, and half of it."""
    return world.deform_mask(mask * 200, "linear")[0] > 100


def dice(a, b):
    return 2 * int((a & b).sum()) / max(1, int(a.sum()) + int(b.sum()))


def compared(world, found, masks, least_dice=LEAST_DICE):
    """@param found  masks that a reader made of the moved contours, by name. @return what was found, in words"""
    least, change = 1.0, 0.0
    for name, mask in masks.items():
        expect(name in found, f"no ROI {name}")
        wanted = deformed(world, mask)
        value = dice(found[name], wanted)
        small = wanted.sum() < SMALL
        expect(
            value > (LEAST_DICE_SMALL if small else least_dice),
            f"{name}: Dice {value:.4f}, {found[name].sum()} and {wanted.sum()} voxels",
        )
        least = min(least, value)
        if not small:
            change = max(change, abs(int(found[name].sum()) / int(wanted.sum()) - 1))
    return f"Dice {least:.3f} or more, volumes within {100 * change:.1f} %"


def check_references(out, source, slices):
    """What pydicom finds: contours lie on the slices that they name, ROIs and observations are the source's."""
    found, old = pydicom.dcmread(out), pydicom.dcmread(source)
    by_uid = {s.SOPInstanceUID: s for s in slices}
    (frame,) = found.ReferencedFrameOfReferenceSequence
    images = frame.RTReferencedStudySequence[0].RTReferencedSeriesSequence[0].ContourImageSequence
    expect({image.ReferencedSOPInstanceUID for image in images} == set(by_uid), "slices of the referenced series")
    for mine, its in zip(found.StructureSetROISequence, old.StructureSetROISequence, strict=True):
        expect(all(mine.get(key) == its.get(key) for key in NUMBERS), f"ROI {its.ROINumber}")
    for mine, its in zip(
        found.get("RTROIObservationsSequence", []), old.get("RTROIObservationsSequence", []), strict=True
    ):
        expect(
            (mine.ReferencedROINumber, mine.get("RTROIInterpretedType"))
            == (its.ReferencedROINumber, its.get("RTROIInterpretedType")),
            "observations",
        )
    colours = {roi.ReferencedROINumber: roi.get("ROIDisplayColor") for roi in old.ROIContourSequence}
    for roi in found.ROIContourSequence:
        expect(roi.get("ROIDisplayColor") == colours[roi.ReferencedROINumber], "ROI Display Color")
        for contour in roi.get("ContourSequence", []):
            z = np.array(contour.ContourData, float)[2::3]
            if contour.ContourGeometricType == "CLOSED_PLANAR":
                named = by_uid[contour.ContourImageSequence[0].ReferencedSOPInstanceUID]
                expect(np.abs(z - float(named.ImagePositionPatient[2])).max() < 0.0105, "a contour off its slice")


# --- plastimatch


def plastimatch_version():
    return run(tool("plastimatch"), "--version").split()[-1]


def read_by_plastimatch(world, path, folder):
    where = world.folder / "filled"
    for old in where.glob("*"):
        old.unlink()
    run(
        "plastimatch",
        "convert",
        "--input",
        path,
        "--referenced-ct",
        folder,
        "--output-prefix",
        where,
        "--prefix-format",
        "nii",
    )
    found = {}
    for one in where.glob("*.nii"):
        image = nibabel.load(one)
        values = (np.asarray(image.dataobj).squeeze().transpose(2, 1, 0) > 0).astype(np.uint8)
        full = np.zeros(world.shape, np.uint8)
        index = np.argwhere(values)
        affine = np.linalg.inv(world.affine) @ TO_RAS @ image.affine
        at = np.rint(index[:, ::-1] @ affine[:3, :3].T + affine[:3, 3]).astype(int)[:, ::-1]
        full[tuple(at.T)] = 1
        expect(
            voxels_that_differ(values, TO_RAS @ image.affine, full, world.affine) == 0, "plastimatch fills another grid"
        )
        found[one.stem] = full > 0
    return found


def made_by_plastimatch(world, masks):
    images, made = world.folder / "images", world.folder / "plastimatch"
    for folder in (images, made):
        folder.mkdir(exist_ok=True)
        for old in folder.iterdir():
            old.unlink()
    for name, mask in masks.items():
        nibabel.save(
            nibabel.Nifti1Image(mask.astype(np.uint8).transpose(2, 1, 0), TO_RAS @ world.affine), images / f"{name}.nii"
        )
    run("plastimatch", "convert", "--input-prefix", images, "--referenced-ct", world.ct, "--output-dicom", made)
    (path,) = made.glob("rtss*")
    return path


def check_plastimatch(world):
    masks = masks_of(world)
    path = made_by_plastimatch(world, masks)
    out, slices = world.moved_object(path)
    check_references(out, path, slices)
    return compared(world, read_by_plastimatch(world, out, world.derived), masks)


def plastimatch_cases():
    yield "RTSTRUCT, 6 ROIs with holes and parts", "filled by plastimatch", check_plastimatch


# --- rt-utils


class RtUtils:
    def __init__(self, world):
        self.world, (module, _) = world, need("rt-utils", "rt_utils")
        self.builder = module.RTStructBuilder
        with contextlib.redirect_stdout(io.StringIO()):
            self.set = self.builder.create_new(dicom_series_path=str(world.ct))

    def add(self, name, mask, **named):
        with contextlib.redirect_stdout(io.StringIO()):
            self.set.add_roi(
                mask=np.ascontiguousarray(mask.transpose(1, 2, 0)), name=name, approximate_contours=False, **named
            )

    def save(self):
        path = self.world.folder / "rt_utils.dcm"
        with contextlib.redirect_stdout(io.StringIO()):
            self.set.save(str(path))
        return path

    def read(self, path, names):
        with contextlib.redirect_stdout(io.StringIO()):
            found = self.builder.create_from(dicom_series_path=str(self.world.derived), rt_struct_path=str(path))
            return {name: found.get_roi_mask_by_name(name).transpose(2, 0, 1) for name in names}


def check_rt_utils(world, masks, empty=(), **named):
    made = RtUtils(world)
    for name, mask in masks.items():
        made.add(name, mask, **named)
    for name in empty:
        made.add(name, np.zeros(world.shape, bool))
    path = made.save()
    out, slices = world.moved_object(path)
    check_references(out, path, slices)
    return compared(world, made.read(out, masks), masks, LEAST_DICE_ROUNDED)


def many(world):
    """As many ROIs as TotalSegmentator makes."""
    random = np.random.default_rng(1)
    return {f"organ_{n}": world.ball(random.uniform((-50, -50, -18), (50, 50, 18)), 12 + n % 16) for n in range(117)}


def rt_utils_cases():
    proof = "filled by rt-utils"
    yield "RTSTRUCT, 6 ROIs, inner contours, one empty ROI", proof, lambda w: check_rt_utils(
        w, masks_of(w), empty=["nothing"]
    )
    yield "RTSTRUCT, 6 ROIs, holes by a pin hole", proof, lambda w: check_rt_utils(w, masks_of(w), use_pin_hole=True)
    yield "RTSTRUCT, 117 ROIs", proof, lambda w: check_rt_utils(w, many(w))


# --- pydicomrt


def check_pydicomrt(world):
    structures, _ = need("pydicomrt", "pydicomrt.rs.builder")
    maker, masks = structures.RTStructBuilder(world.slices), masks_of(world)
    for name, mask in masks.items():
        maker.add_roi(mask.astype(np.uint8), name, interpreted_type="PTV")
    path = world.folder / "pydicomrt.dcm"
    maker.build().save_as(path, enforce_file_format=True)
    out, slices = world.moved_object(path)
    check_references(out, path, slices)
    volumes, _ = need("pydicomrt", "pydicomrt.rs.rs_to_volume")
    found = volumes.rtstruct_to_masks(pydicom.dcmread(out), *volumes.calc_image_series_affine_mapping(slices))
    return compared(world, {name: one["mask_volume"] > 0 for name, one in found.items()}, masks, LEAST_DICE_ROUNDED)


def pydicomrt_cases():
    yield "RTSTRUCT, 6 ROIs of type PTV", "filled by pydicomrt", check_pydicomrt


# --- by hand


class Handmade:
    """A structure set of one box, and what is added to it."""

    def __init__(self, world):
        self.world, first = world, world.slices[0]
        meta = pydicom.dataset.FileMetaDataset()
        meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = (
            "1.2.840.10008.5.1.4.1.1.481.3",
            pydicom.uid.generate_uid(),
        )
        meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        self.set = pydicom.dataset.FileDataset("set", {}, file_meta=meta, preamble=b"\0" * 128)
        self.set.SOPClassUID, self.set.SOPInstanceUID = meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID
        self.set.Modality, self.set.SeriesInstanceUID, self.set.StructureSetLabel = (
            "RTSTRUCT",
            pydicom.uid.generate_uid(),
            "by hand",
        )
        for keyword in ("PatientName", "PatientID", "StudyInstanceUID", "FrameOfReferenceUID"):
            setattr(self.set, keyword, first.get(keyword, ""))
        self.set.StructureSetROISequence, self.set.ROIContourSequence, self.set.RTROIObservationsSequence = [], [], []
        self.add([self.square(k) for k in range(8, 22)], "EXTERNAL")

    def square(self, k, half=25, kind="CLOSED_PLANAR"):
        z = float(self.world.slices[k].ImagePositionPatient[2])
        return self.contour([(-half, -half, z), (half, -half, z), (half, half, z), (-half, half, z)], kind, k)

    def contour(self, points, kind, k=None):
        made = Dataset()
        made.ContourGeometricType, made.NumberOfContourPoints = kind, len(points)
        made.ContourData = [f"{value:.3f}" for point in points for value in point]
        if k is not None:
            image = Dataset()
            image.ReferencedSOPClassUID, image.ReferencedSOPInstanceUID = (
                self.world.slices[k].SOPClassUID,
                self.world.slices[k].SOPInstanceUID,
            )
            made.ContourImageSequence = [image]
        return made

    def add(self, contours, kind):
        number = len(self.set.StructureSetROISequence) + 1
        roi, drawn, observed = Dataset(), Dataset(), Dataset()
        roi.ROINumber, roi.ROIName, roi.ROIGenerationAlgorithm = number, f"roi {number}", "MANUAL"
        roi.ReferencedFrameOfReferenceUID = self.set.FrameOfReferenceUID
        drawn.ReferencedROINumber, drawn.ROIDisplayColor, drawn.ContourSequence = number, [255, 0, number], contours
        observed.ObservationNumber, observed.ReferencedROINumber = number, number
        observed.RTROIInterpretedType, observed.ROIInterpreter = kind, ""
        for sequence, item in (
            ("StructureSetROISequence", roi),
            ("ROIContourSequence", drawn),
            ("RTROIObservationsSequence", observed),
        ):
            self.set[sequence].value.append(item)
        return number

    def moved(self):
        """@return the moved set's contours of each ROI, and what the sidecar says of each"""
        path = self.world.folder / "hand.dcm"
        self.set.is_little_endian, self.set.is_implicit_VR = True, False
        self.set.save_as(path, write_like_original=False)
        out, slices = self.world.moved_object(path)
        check_references(out, path, slices)
        sidecar = json.loads((self.world.folder / "derived.json").read_text())["structures"][0]["rois"]
        found = pydicom.dcmread(out)
        return (
            {int(roi.ReferencedROINumber): list(roi.get("ContourSequence", [])) for roi in found.ROIContourSequence},
            {roi["number"]: roi for roi in sidecar},
        )


def check_points(world):
    """POINT and OPEN contours go where --points go."""
    made = Handmade(world)
    places = np.array([(3, 4, -6), (-30, 0, -3), (0, 5, 3), (30, 0, 12)], float)
    point = made.add([made.contour(places[:1], "POINT")], "ISOCENTER")
    line = made.add([made.contour(places[1:], "OPEN_NONPLANAR")], "FIXATION")
    contours, _ = made.moved()
    before, after = world.folder / "points.csv", world.folder / "moved.csv"
    before.write_text("x,y,z\n" + "".join(f"{x},{y},{z}\n" for x, y, z in places))
    after.unlink(missing_ok=True)
    world.must(
        "deform",
        world.ct,
        "-f",
        "elastic:amplitude=6,spacing=30,seed=7",
        "-o",
        world.folder / "moved.nii",
        "--overwrite",
        "--points",
        f"{before}={after}",
    )
    wanted = np.array([row.split(",")[:3] for row in after.read_text().splitlines()[1:]], float)
    expect(
        contours[point][0].ContourGeometricType == "POINT"
        and contours[line][0].ContourGeometricType == "OPEN_NONPLANAR",
        "types",
    )
    found = np.array([*contours[point][0].ContourData, *contours[line][0].ContourData], float).reshape(-1, 3)
    away = max(np.abs(found - place).max(-1).min() for place in wanted)  # where lines bend they have more points
    expect(away < 1e-4, f"{away} mm from where --points goes")
    return f"within {away:.5f} mm"


def check_volumes(world, contours_of, millilitres):
    """One ROI, by the volumes of the sidecar."""
    made = Handmade(world)
    number = made.add(contours_of(made), "ORGAN")
    contours, told = made.moved()
    before, after = told[number]["volume_ml"]
    expect(abs(before - millilitres) < 0.02 * max(millilitres, 1), f"{before} mL before, expected {millilitres}")
    expect(millilitres == 0 or abs(after / millilitres - 1) < 0.06, f"{after} mL after, expected {millilitres}")
    expect((len(contours[number]) > 0) == (millilitres > 0), f"{len(contours[number])} contours")
    return f"{before:.2f} mL before, {after:.2f} mL after"


def hand_cases():
    sidecar = "volumes in the sidecar"
    slices = range(10, 20)
    yield "RTSTRUCT, POINT and OPEN_NONPLANAR", "--points", check_points
    yield "RTSTRUCT, CLOSEDPLANAR_XOR with a hole", sidecar, lambda w: check_volumes(
        w, lambda h: [h.square(k, half, "CLOSEDPLANAR_XOR") for k in slices for half in (20, 10)], 36
    )
    yield "RTSTRUCT, two groups of slices", sidecar, lambda w: check_volumes(
        w, lambda h: [h.square(k, 20) for k in (8, 9, 10, 18, 19, 20)], 28.8
    )
    yield "RTSTRUCT, a ROI on one slice", sidecar, lambda w: check_volumes(w, lambda h: [h.square(14, 20)], 4.8)
    yield "RTSTRUCT, contours of one and two points", sidecar, lambda w: check_volumes(
        w, lambda h: [h.contour([(3, 4, 1.5)][:n] + [(9, 4, 1.5)][: n - 1], "CLOSED_PLANAR") for n in (1, 2)], 0
    )
    yield "RTSTRUCT, every contour twice", sidecar, lambda w: check_volumes(
        w, lambda h: [h.square(k, 20) for k in slices for _ in (1, 2)], 48
    )


def cases():
    yield "plastimatch", plastimatch_version, plastimatch_cases
    yield "rt-utils", lambda: need("rt-utils", "rt_utils")[1], rt_utils_cases
    yield "pydicomrt", lambda: need("pydicomrt")[1], pydicomrt_cases
    yield "pydicom, by hand", lambda: need("pydicom")[1], hand_cases
