# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Opens a dose or segmentation that went along with a derived CT series, with pydicom, and checks what it refers to.

check_along.py SERIES OBJECT SOURCE DUMP    SERIES: folder of the derived series; SOURCE: what the object was made of
    DUMP receives the values on the grid of the series: of a dose float64 doses, of a segmentation uint8 values of each
    segment, in the order of its Segment Sequence; slices by rising position, i fastest.
    With DUMP "-" the object is on a grid of its own, and nothing is dumped.

Exit status 77: a module is missing.
"""
import pathlib
import shutil
import subprocess
import sys
import tempfile

try:
    import numpy as np
    import pydicom
except ImportError as error:
    print(error)
    sys.exit(77)

problems = []


def expect(condition, text):
    if not condition:
        problems.append(text)


def position(item):
    return np.array(item.ImagePositionPatient, float)


def read_series(folder):
    slices = [pydicom.dcmread(path) for path in sorted(pathlib.Path(folder).iterdir())]
    orientation = np.array(slices[0].ImageOrientationPatient, float)
    normal = np.cross(orientation[:3], orientation[3:])
    return sorted(slices, key=lambda s: np.dot(normal, position(s)))


def references(dataset):
    """Every (SOP Class UID, SOP Instance UID) that is referred to, with the path of sequences to it."""
    found = []

    def walk(item, path):
        if "ReferencedSOPInstanceUID" in item:
            found.append((item.ReferencedSOPClassUID, item.ReferencedSOPInstanceUID, path))
        for element in item:
            if element.VR == "SQ":
                for child in element.value:
                    walk(child, path + [element.keyword])

    walk(dataset, [])
    return found


def check_common(found, source, slices):
    first = slices[0]
    for keyword in ["FrameOfReferenceUID", "StudyInstanceUID", "PatientName", "PatientID"]:
        expect(found.get(keyword) == first.get(keyword), f"{keyword} is not that of the series")
    for keyword in ["SOPInstanceUID", "SeriesInstanceUID"]:
        expect(found.get(keyword) not in ("", None, source.get(keyword), first.get(keyword)), f"{keyword} is not new")
    expect(found.file_meta.MediaStorageSOPInstanceUID == found.SOPInstanceUID, "the meta header names another instance")
    expect(found.ContributingEquipmentSequence[-1].Manufacturer == "Tetwarp", "no Contributing Equipment")
    expect("DerivationDescription" in found, "no Derivation Description")
    private = []
    found.walk(lambda dataset, element: private.append(element.tag) if element.tag.is_private else None)
    expect(not private, f"private attributes {private}")
    known = {s.SOPInstanceUID: s.SOPClassUID for s in slices}
    to_slices = 0
    for sop_class, instance, path in references(found):
        if "ReferencedRTPlanSequence" in path or path == ["SourceImageSequence"]:
            continue  # the plan by which the source was made, or the source itself
        expect(known.get(instance) == sop_class, f"{path} names {instance}, which is no slice of the series")
        to_slices += instance in known
    expect(to_slices >= len(slices), "not every slice is referred to")
    for child in found.get("SourceImageSequence", []):
        expect(child.ReferencedSOPInstanceUID == source.SOPInstanceUID, "Source Image is not the source")


def on_grid(found, slices):
    """Whether position, spacing and size are those of the series."""
    a, b = np.array(found.ImagePositionPatient, float), position(slices[0])
    return np.abs(a - b).max() < 1e-5 and (found.Rows, found.Columns) == (slices[0].Rows, slices[0].Columns)


def check_dose(found, source, slices, dump):
    for keyword in ["DoseUnits", "DoseType", "DoseSummationType", "TissueHeterogeneityCorrection",
                    "ReferencedRTPlanSequence"]:
        expect(found.get(keyword) == source.get(keyword), f"{keyword} is not that of the source")
    for keyword in ["DVHSequence", "ReferencedStructureSetSequence", "NormalizationPoint"]:
        expect(keyword not in found, f"{keyword} is still there")
    expect(found.get("SpatialTransformOfDose") == "NON_RIGID" or "identity" in found.DerivationDescription,
           "Spatial Transform of Dose")
    offsets = np.array(found.GridFrameOffsetVector, float)
    expect(found.FrameIncrementPointer == 0x3004000C and offsets[0] == 0, "frames")
    expect(len(offsets) == found.NumberOfFrames, "Grid Frame Offset Vector")
    dose = found.pixel_array * float(found.DoseGridScaling)
    if dump == "-":
        return
    expect(on_grid(found, slices) and len(offsets) == len(slices), "not on the grid of the series")
    places = [np.linalg.norm(position(s) - position(slices[0])) for s in slices]
    expect(np.abs(np.array(places) - offsets).max() < 1e-4, "frames are not where the slices are")
    dose.astype("<f8").tofile(dump)


def without_private(sequence):
    items = [pydicom.Dataset(item) for item in sequence]
    for item in items:
        item.remove_private_tags()
    return items


def check_segmentation(found, source, slices, dump):
    expect(without_private(found.SegmentSequence) == without_private(source.SegmentSequence), "Segment Sequence")
    for keyword in ["SegmentationType", "ContentLabel", "ContentCreatorName", "MaximumFractionalValue", "ContentDate"]:
        expect(found.get(keyword) == source.get(keyword), f"{keyword} is not that of the source")
    reference = found.ReferencedSeriesSequence
    expect(len(reference) == 1 and reference[0].SeriesInstanceUID == slices[0].SeriesInstanceUID, "Referenced Series")
    listed = {item.ReferencedSOPInstanceUID for item in reference[0].ReferencedInstanceSequence}
    by_uid = {s.SOPInstanceUID: n for n, s in enumerate(slices)}
    numbers = [item.SegmentNumber for item in found.SegmentSequence]
    frames = found.PerFrameFunctionalGroupsSequence
    expect(found.NumberOfFrames == len(frames), "Number of Frames")
    indices = [tuple(f.FrameContentSequence[0].DimensionIndexValues) for f in frames]
    expect(len(set(indices)) == len(indices), "frames with the same Dimension Index Values")
    dimensions = [item.DimensionIndexPointer for item in found.DimensionIndexSequence]
    expect(dimensions == [0x0062000B, 0x00200032], "dimensions")
    uid = found.DimensionOrganizationSequence[0].DimensionOrganizationUID
    expect(all(item.DimensionOrganizationUID == uid for item in found.DimensionIndexSequence), "Dimension Organization")
    pixels = np.reshape(found.pixel_array, (len(frames), found.Rows, found.Columns))
    volume = np.zeros((len(numbers), len(slices), found.Rows, found.Columns), np.uint8)
    for frame, (groups, image) in enumerate(zip(frames, pixels)):
        if dump == "-":
            expect("DerivationImageSequence" not in groups, "a frame off the slices names one")
            continue
        named = groups.DerivationImageSequence[0].SourceImageSequence[0].ReferencedSOPInstanceUID
        expect(named in listed, "a frame names a slice that Referenced Series does not list")
        k = by_uid[named]
        off = np.abs(position(groups.PlanePositionSequence[0]) - position(slices[k])).max()
        expect(off < 1e-5, f"frame {frame + 1} is {off} mm off the slice that it names")
        number = groups.SegmentIdentificationSequence[0].ReferencedSegmentNumber
        volume[numbers.index(number), k] = image
    if dump == "-":
        return
    shared = found.SharedFunctionalGroupsSequence[0]
    expect(np.abs(np.array(shared.PixelMeasuresSequence[0].PixelSpacing, float)
                  - np.array(slices[0].PixelSpacing, float)).max() < 1e-6, "Pixel Spacing")
    overlap = np.count_nonzero((volume != 0).sum(axis=0) > 1) > 0
    if found.SegmentationType == "BINARY":
        expect(found.SegmentsOverlap == ("YES" if overlap else "NO"), "Segments Overlap")
    volume.tofile(dump)


def errors_of(dataset):
    """What dciodvfy finds wrong. It cannot take pixels of 32 bits: of such a dose the words are halved first."""
    with tempfile.TemporaryDirectory() as folder:
        if dataset.BitsAllocated == 32:
            dataset = pydicom.Dataset(dataset)
            dataset.BitsAllocated = dataset.BitsStored = 16
            dataset.HighBit = 15
            dataset.PixelData = dataset.PixelData[:len(dataset.PixelData) // 2]
        path = pathlib.Path(folder) / "object.dcm"
        meta = pydicom.dataset.FileMetaDataset()
        meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
        dataset = pydicom.dataset.FileDataset(str(path), dataset, preamble=b"\0" * 128, file_meta=meta)
        dataset.is_little_endian, dataset.is_implicit_VR = True, False
        dataset.save_as(path, write_like_original=False)
        run = subprocess.run(["dciodvfy", str(path)], capture_output=True, text=True, errors="replace")
    expect(run.returncode >= 0, "dciodvfy did not finish")
    return {line for line in (run.stdout + run.stderr).splitlines() if line.startswith("Error")}


def main():
    folder, path, source_path, dump = sys.argv[1:5]
    slices, found, source = read_series(folder), pydicom.dcmread(path), pydicom.dcmread(source_path)
    check_common(found, source, slices)
    check = check_dose if found.Modality == "RTDOSE" else check_segmentation
    check(found, source, slices, dump)
    if shutil.which("dciodvfy"):
        more = errors_of(found) - (errors_of(source) if found.Modality == "RTDOSE" else set())
        expect(not more, f"dciodvfy: {more}")
    print("\n".join(problems))
    sys.exit(1 if problems else 0)


main()
