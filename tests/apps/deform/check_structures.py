# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Checks an RT Structure Set that was moved with a derived series, by other programs.

    check_structures.py references SERIES OUT.dcm SOURCE.dcm   every UID by pydicom; every contour lies in its slice
    check_structures.py masks      SERIES OUT.dcm MASK.nii ROI [MASK.nii ROI ...]       areas by NumPy, against masks
    check_structures.py plastimatch SERIES OUT.dcm MASK.nii NAME [MASK.nii NAME ...]    the same, by plastimatch
    check_structures.py dciodvfy   OUT.dcm SOURCE.dcm          no error that the source does not have

Exit status 0: it is right, 1: it is not, 77: a program or module is missing.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

ON_SLICE_MM = 0.0105
LEAST_DICE = 0.99
EDGE = 100  # value of masks on a surface, more inside


def skip(reason):
    print(reason)
    sys.exit(77)


try:
    import nibabel
    import numpy as np
    import pydicom
except ImportError as error:
    skip(error)


def expect(true, what):
    if not true:
        sys.exit(f"wrong: {what}")


def read_series(folder):
    slices = [pydicom.dcmread(path) for path in sorted(pathlib.Path(folder).iterdir())]
    return sorted(slices, key=lambda s: float(s.ImagePositionPatient[2]))


def points_of(contour):
    points = np.array([float(v) for v in contour.ContourData]).reshape(-1, 3)
    expect(len(points) == int(contour.NumberOfContourPoints), "Number of Contour Points")
    return points


def contours_of(structures):
    for roi in structures.ROIContourSequence:
        for contour in roi.get("ContourSequence", []):
            yield int(roi.ReferencedROINumber), contour


def check_sets(slices, structures, source):
    """Study, series and frame of reference, and the sequences that name them."""
    first = slices[0]
    instances = {s.SOPInstanceUID for s in slices}
    expect(len(instances) == len(slices), "SOP Instance UIDs of slices")
    expect(structures.StudyInstanceUID == first.StudyInstanceUID, "study")
    expect(structures.SeriesInstanceUID not in (first.SeriesInstanceUID, source.SeriesInstanceUID), "series is new")
    expect(structures.SOPInstanceUID != source.SOPInstanceUID, "instance is new")
    expect(structures.SOPInstanceUID == structures.file_meta.MediaStorageSOPInstanceUID, "meta header")
    expect(structures.PatientID == source.PatientID and structures.PatientName == source.PatientName, "patient")
    expect(structures.ApprovalStatus == "UNAPPROVED", "approval")
    frame, = structures.ReferencedFrameOfReferenceSequence
    study, = frame.RTReferencedStudySequence
    series, = study.RTReferencedSeriesSequence
    expect(frame.FrameOfReferenceUID == first.FrameOfReferenceUID, "frame of reference")
    expect(study.ReferencedSOPInstanceUID == first.StudyInstanceUID, "referenced study")
    expect(series.SeriesInstanceUID == first.SeriesInstanceUID, "referenced series")
    named = [image.ReferencedSOPInstanceUID for image in series.ContourImageSequence]
    expect(sorted(named) == sorted(instances), "the series' slices, each once")
    expect(structures.PredecessorStructureSetSequence[0].ReferencedSOPInstanceUID == source.SOPInstanceUID,
           "predecessor")


def check_rois(first, structures, source):
    numbers = [int(roi.ROINumber) for roi in structures.StructureSetROISequence]
    expect(numbers == [int(roi.ROINumber) for roi in source.StructureSetROISequence], "ROI numbers")
    for roi, old in zip(structures.StructureSetROISequence, source.StructureSetROISequence):
        expect(roi.ReferencedFrameOfReferenceUID == first.FrameOfReferenceUID, "frame of reference of an ROI")
        expect(roi.ROIName == old.ROIName and "ROIVolume" not in roi, "ROI name, no volume")
    for sequence in (structures.ROIContourSequence, structures.RTROIObservationsSequence):
        expect(all(int(item.ReferencedROINumber) in numbers for item in sequence), "referenced ROI")


def check_references(folder, out, old):
    slices, structures, source = read_series(folder), pydicom.dcmread(out), pydicom.dcmread(old)
    check_sets(slices, structures, source)
    check_rois(slices[0], structures, source)
    by_uid = {s.SOPInstanceUID: s for s in slices}
    count = 0
    for number, contour in contours_of(structures):
        if "ContourImageSequence" not in contour:
            expect(contour.ContourGeometricType in ("POINT", "OPEN_NONPLANAR"), f"ROI {number} names no image")
            continue
        image, = contour.ContourImageSequence
        expect(image.ReferencedSOPInstanceUID in by_uid, f"image of a contour of ROI {number}")
        s = by_uid[image.ReferencedSOPInstanceUID]
        expect(image.ReferencedSOPClassUID == s.SOPClassUID, "class of an image")
        row, column = np.array(s.ImageOrientationPatient, float).reshape(2, 3)
        away = (points_of(contour) - np.array(s.ImagePositionPatient, float)) @ np.cross(row, column)
        expect(np.abs(away).max() <= ON_SLICE_MM, f"ROI {number}: {np.abs(away).max()} mm from its slice")
        count += 1
    print(f"{count} contours lie in their slices")


def inside(polygon, x, y):
    """Whether points are inside contours, by the parity of edges that a ray along x crosses."""
    result = np.zeros(np.broadcast(x, y).shape, bool)
    for (ax, ay), (bx, by) in zip(polygon, np.roll(polygon, -1, axis=0)):
        if ay != by:
            result ^= ((ay > y) != (by > y)) & (ax + (y - ay) / (by - ay) * (bx - ax) > x)
    return result


def rasterised(slices, structures, number):
    first = slices[0]
    spacing = [float(v) for v in first.PixelSpacing]
    x = float(first.ImagePositionPatient[0]) + spacing[1] * np.arange(first.Columns)[None, :]
    y = float(first.ImagePositionPatient[1]) + spacing[0] * np.arange(first.Rows)[:, None]
    index = {s.SOPInstanceUID: k for k, s in enumerate(slices)}
    mask = np.zeros((len(slices), first.Rows, first.Columns), bool)
    for roi, contour in contours_of(structures):
        if roi == number:
            uid = contour.ContourImageSequence[0].ReferencedSOPInstanceUID
            mask[index[uid]] ^= inside(points_of(contour)[:, :2], x, y)
    return mask


def mask_of(path):
    """Values as z, y, x in LPS."""
    image = nibabel.as_closest_canonical(nibabel.load(path))
    return np.asarray(image.dataobj).squeeze().transpose(2, 1, 0)[:, ::-1, ::-1]


def check_dice(found, mask, what):
    dice = 2 * (found & mask).sum() / (found.sum() + mask.sum())
    print(f"{what}: Dice {dice:.4f}, {found.sum()} and {mask.sum()} voxels")
    expect(dice > LEAST_DICE, what)


def check_masks(folder, out, *pairs):
    slices, structures = read_series(folder), pydicom.dcmread(out)
    for mask, number in zip(pairs[::2], pairs[1::2]):
        check_dice(rasterised(slices, structures, int(number)), mask_of(mask) > EDGE, f"ROI {number}")


def check_plastimatch(folder, out, *pairs):
    if not shutil.which("plastimatch"):
        skip("plastimatch is not installed")
    with tempfile.TemporaryDirectory() as masks:
        command = ["plastimatch", "convert", "--input", out, "--referenced-ct", folder, "--output-prefix", masks,
                   "--prefix-format", "nii"]
        log = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        for mask, name in zip(pairs[::2], pairs[1::2]):
            found = pathlib.Path(masks) / f"{name}.nii"
            expect(found.exists(), f"no {name}.nii by plastimatch:\n{log}")
            check_dice(mask_of(found) > 0, mask_of(mask) > EDGE, name)


def errors_of(path):
    run = subprocess.run(["dciodvfy", path], capture_output=True, text=True)
    return {line for line in (run.stdout + run.stderr).splitlines() if line.startswith("Error")}


def check_dciodvfy(out, old):
    if not shutil.which("dciodvfy"):
        skip("dciodvfy (dicom3tools) is not installed")
    more = errors_of(out) - errors_of(old)
    expect(not more, "\n".join(sorted(more)))


if __name__ == "__main__":
    {"references": check_references, "masks": check_masks, "plastimatch": check_plastimatch,
     "dciodvfy": check_dciodvfy}[sys.argv[1]](*sys.argv[2:])
