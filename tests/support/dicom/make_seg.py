# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""Writes a DICOM segmentation of a CT series with pydicom: a segment for each threshold, of all voxels above it.

make_seg.py SERIES SEG.dcm DUMP HU [HU ...]    DUMP receives the masks: uint8, segment by segment, slices by rising
    position, i fastest. Spacing Between Slices is left out.

Exit status 77: a module is missing.
"""
import pathlib
import sys

try:
    import numpy as np
    import pydicom
    from pydicom.dataset import Dataset, FileDataset, FileMetaDataset
except ImportError as error:
    print(error)
    sys.exit(77)

SEGMENTATION = "1.2.840.10008.5.1.4.1.1.66.4"
PATIENT_AND_STUDY = ["PatientName", "PatientID", "PatientBirthDate", "PatientSex", "StudyDate", "StudyTime",
                     "StudyInstanceUID", "StudyID", "AccessionNumber", "ReferringPhysicianName", "FrameOfReferenceUID"]


def item(**attributes):
    made = Dataset()
    for keyword, value in attributes.items():
        setattr(made, keyword, value)
    return made


def code(value, scheme, meaning):
    return [item(CodeValue=value, CodingSchemeDesignator=scheme, CodeMeaning=meaning)]


def read_series(folder):
    files = [pydicom.dcmread(path) for path in sorted(pathlib.Path(folder).iterdir()) if path.is_file()]
    cosines = np.array(files[0].ImageOrientationPatient, float)
    normal = np.cross(cosines[:3], cosines[3:])
    files.sort(key=lambda f: np.dot(normal, np.array(f.ImagePositionPatient, float)))
    hu = np.array([f.pixel_array * float(f.RescaleSlope) + float(f.RescaleIntercept) for f in files])
    return files, hu


def main():
    folder, path, dump, thresholds = sys.argv[1], sys.argv[2], sys.argv[3], [float(t) for t in sys.argv[4:]]
    slices, hu = read_series(folder)
    masks = np.array([hu > threshold for threshold in thresholds])
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = SEGMENTATION, "1.2.3.4.5"
    meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    seg = FileDataset(path, {}, file_meta=meta, preamble=b"\0" * 128)
    seg.is_little_endian, seg.is_implicit_VR = True, False
    for keyword in PATIENT_AND_STUDY:
        setattr(seg, keyword, slices[0].get(keyword, ""))
    seg.update(item(
        SOPClassUID=SEGMENTATION, SOPInstanceUID="1.2.3.4.5", SeriesInstanceUID="1.2.3.4.6", Modality="SEG",
        SeriesNumber=9, InstanceNumber=1, ContentDate="20200101", ContentTime="000000", Manufacturer="Maker",
        ManufacturerModelName="Model", DeviceSerialNumber="1", SoftwareVersions="1", PositionReferenceIndicator="",
        ImageType=["DERIVED", "PRIMARY"], ContentLabel="THRESHOLDS", ContentDescription="", ContentCreatorName="",
        LossyImageCompression="00", Rows=hu.shape[1], Columns=hu.shape[2], SamplesPerPixel=1, BitsAllocated=1,
        PhotometricInterpretation="MONOCHROME2", BitsStored=1, HighBit=0, PixelRepresentation=0,
        SegmentationType="BINARY"))
    seg.SegmentSequence = [
        item(SegmentNumber=n + 1, SegmentLabel=f"above {threshold}", SegmentAlgorithmType="AUTOMATIC",
             SegmentAlgorithmName="threshold",
             SegmentedPropertyCategoryCodeSequence=code("85756007", "SCT", "Tissue"),
             SegmentedPropertyTypeCodeSequence=code("85756007", "SCT", "Tissue"))
        for n, threshold in enumerate(thresholds)]
    seg.DimensionOrganizationSequence = [item(DimensionOrganizationUID="1.2.3.4.7")]
    seg.DimensionIndexSequence = [
        item(DimensionOrganizationUID="1.2.3.4.7", DimensionIndexPointer=pointer, FunctionalGroupPointer=group)
        for pointer, group in [(0x0062000B, 0x0062000A), (0x00200032, 0x00209113)]]
    seg.SharedFunctionalGroupsSequence = [item(
        PixelMeasuresSequence=[item(PixelSpacing=slices[0].PixelSpacing, SliceThickness=slices[0].SliceThickness)],
        PlaneOrientationSequence=[item(ImageOrientationPatient=slices[0].ImageOrientationPatient)])]
    shown = [(n, k) for n in range(len(thresholds)) for k in range(len(slices)) if masks[n, k].any()]
    seg.PerFrameFunctionalGroupsSequence = [
        item(FrameContentSequence=[item(DimensionIndexValues=[n + 1, k + 1])],
             PlanePositionSequence=[item(ImagePositionPatient=slices[k].ImagePositionPatient)],
             SegmentIdentificationSequence=[item(ReferencedSegmentNumber=n + 1)]) for n, k in shown]
    seg.NumberOfFrames = len(shown)
    bits = np.packbits(np.array([masks[n, k] for n, k in shown]).ravel(), bitorder="little").tobytes()
    seg.PixelData = bits + b"\0" * (len(bits) % 2)
    seg.save_as(path, write_like_original=False)
    masks.astype(np.uint8).tofile(dump)


main()
