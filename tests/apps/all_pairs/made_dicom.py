# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

"""DICOM files of a made-up patient, by pydicom: CT series of all forms that are read, and what goes along with them."""
import pathlib

import numpy as np
import pydicom
from pydicom.dataset import Dataset, FileDataset, FileMetaDataset

CT, ENHANCED, DOSE = "1.2.840.10008.5.1.4.1.1.2", "1.2.840.10008.5.1.4.1.1.2.1", "1.2.840.10008.5.1.4.1.1.481.2"
STRUCTURES, SEGMENTATION = "1.2.840.10008.5.1.4.1.1.481.3", "1.2.840.10008.5.1.4.1.1.66.4"
STUDY, FRAME = "1.2.826.0.1.3680043.10.77.1", "1.2.826.0.1.3680043.10.77.2"
SERIES = "1.2.826.0.1.3680043.10.77.3"
# Words that may be found in derived DICOM files only, and nowhere if these are de-identified.
PATIENT = {"PatientName": "ZWOELFER^AENNEMARIE", "PatientID": "QX7781", "PatientBirthDate": "19440229"}
FOLDER = "folder-of-kappelmann"  # part of a path, which no output of a de-identified case may contain


def item(**attributes):
    made = Dataset()
    for keyword, value in attributes.items():
        setattr(made, keyword, value)
    return made


def save(path, data, sop_class):
    meta = FileMetaDataset()
    meta.MediaStorageSOPClassUID, meta.MediaStorageSOPInstanceUID = sop_class, data.SOPInstanceUID
    meta.TransferSyntaxUID = pydicom.uid.ExplicitVRLittleEndian
    made = FileDataset(str(path), {}, file_meta=meta, preamble=b"\0" * 128)
    made.update(data)
    made.is_little_endian, made.is_implicit_VR = True, False
    made.SOPClassUID = sop_class
    made.save_as(str(path), write_like_original=False)


def text(numbers):
    return [format(float(x), ".10g") for x in numbers]


def common(series, modality):
    return item(StudyInstanceUID=STUDY, SeriesInstanceUID=f"{SERIES}.{series}", FrameOfReferenceUID=FRAME,
                Modality=modality, SeriesNumber=series, StudyDate="20200102", StudyTime="101112", StudyID="1",
                AccessionNumber="", ReferringPhysicianName="", PatientSex="F", Manufacturer="Maker",
                PositionReferenceIndicator="", **PATIENT)


def slices(volume, series, padding=None, uneven=None, lean=0.0):
    """Classic slices. `uneven`: places in slice distances; `lean`: mm along the columns for each mm across."""
    columns = volume.affine[:3, :3]
    spacing = np.linalg.norm(columns, axis=0)
    row, column = columns[:, 0] / spacing[0], columns[:, 1] / spacing[1]
    made = []
    for k in range(volume.size[2]):
        place = k if uneven is None else uneven[k]
        across = columns[:, 2] * place
        position = volume.affine[:3, 3] + across + column * lean * spacing[2] * place
        data = common(series, "CT")
        data.update(item(
            SOPInstanceUID=f"{SERIES}.{series}.{k + 1}", ImageType=["ORIGINAL", "PRIMARY", "AXIAL"],
            InstanceNumber=k + 1, ImagePositionPatient=text(position), ImageOrientationPatient=text([*row, *column]),
            PixelSpacing=text([spacing[1], spacing[0]]), SliceThickness="2.5", RescaleSlope="1",
            RescaleIntercept="-1024", RescaleType="HU", PhotometricInterpretation="MONOCHROME2", SamplesPerPixel=1,
            Rows=int(volume.size[1]), Columns=int(volume.size[0]), BitsAllocated=16, BitsStored=16, HighBit=15,
            PixelRepresentation=1, KVP="120", AcquisitionNumber=1))
        if padding is not None:
            data.add_new(0x00280120, "SS", padding + 1024)
        data.PixelData = (volume.values[:, :, k].T.astype("<i2") + 1024).tobytes()
        made.append(data)
    return made


def write_series(folder, made):
    pathlib.Path(folder).mkdir(parents=True)
    for n, data in enumerate(made):
        save(pathlib.Path(folder) / f"s{n:03d}.dcm", data, CT)


def write_enhanced(path, made):
    data = Dataset()
    data.update(made[0])
    for keyword in ["ImagePositionPatient", "ImageOrientationPatient", "PixelSpacing", "SliceThickness", "RescaleSlope",
                    "RescaleIntercept", "RescaleType", "KVP", "AcquisitionNumber"]:
        del data[keyword]
    data.update(item(SOPInstanceUID=made[0].SeriesInstanceUID + ".900", NumberOfFrames=len(made),
                     ImageType=["ORIGINAL", "PRIMARY", "VOLUME", "NONE"], ContentDate="20200104", ContentTime="101112",
                     AcquisitionDateTime="20200104101112"))
    data.SharedFunctionalGroupsSequence = [item(
        PlaneOrientationSequence=[item(ImageOrientationPatient=made[0].ImageOrientationPatient)],
        PixelMeasuresSequence=[item(PixelSpacing=made[0].PixelSpacing, SliceThickness="2.5")],
        CTXRayDetailsSequence=[item(KVP="120")])]
    data.PerFrameFunctionalGroupsSequence = [item(
        PlanePositionSequence=[item(ImagePositionPatient=one.ImagePositionPatient)],
        PixelValueTransformationSequence=[item(RescaleSlope="1", RescaleIntercept="-1024", RescaleType="HU")],
        FrameContentSequence=[item(StackID="1", InStackPositionNumber=k + 1)]) for k, one in enumerate(made)]
    data.PixelData = b"".join(one.PixelData for one in made)
    save(path, data, ENHANCED)


def write_dose(path, volume):
    """Stored values are the volume's, each 0.001 Gy. Axes are those of the patient."""
    spacing = volume.affine.diagonal()[:3]
    data = common(20, "RTDOSE")
    data.update(item(
        SOPInstanceUID=f"{SERIES}.20.1", DoseUnits="GY", DoseType="PHYSICAL", DoseSummationType="PLAN",
        NumberOfFrames=int(volume.size[2]), GridFrameOffsetVector=text(np.arange(volume.size[2]) * spacing[2]),
        FrameIncrementPointer=0x3004000C, ImagePositionPatient=text(volume.affine[:3, 3]),
        ImageOrientationPatient=["1", "0", "0", "0", "1", "0"], PixelSpacing=text([spacing[1], spacing[0]]),
        DoseGridScaling="0.001", Rows=int(volume.size[1]), Columns=int(volume.size[0]), BitsAllocated=32,
        BitsStored=32, HighBit=31, PixelRepresentation=0, SamplesPerPixel=1,
        PhotometricInterpretation="MONOCHROME2"))
    data.PixelData = volume.values.transpose(2, 1, 0).astype("<u4").tobytes()
    save(path, data, DOSE)


def write_structures(path, contours):
    """One ROI; contours are lists of points, LPS mm."""
    data = common(21, "RTSTRUCT")
    data.update(item(SOPInstanceUID=f"{SERIES}.21.1", StructureSetLabel="PLAN", StructureSetDate="20200102",
                     StructureSetTime="101112", ApprovalStatus="UNAPPROVED"))
    data.ReferencedFrameOfReferenceSequence = [item(FrameOfReferenceUID=FRAME)]
    data.StructureSetROISequence = [item(ROINumber=1, ReferencedFrameOfReferenceUID=FRAME, ROIName="organ",
                                         ROIGenerationAlgorithm="MANUAL")]
    data.ROIContourSequence = [item(ReferencedROINumber=1, ContourSequence=[
        item(ContourGeometricType="CLOSED_PLANAR", NumberOfContourPoints=len(points),
             ContourData=text(np.ravel(points))) for points in contours])]
    data.RTROIObservationsSequence = [item(ObservationNumber=1, ReferencedROINumber=1, RTROIInterpretedType="ORGAN",
                                           ROIInterpreter="")]
    save(path, data, STRUCTURES)


def code(value, meaning):
    return [item(CodeValue=value, CodingSchemeDesignator="SCT", CodeMeaning=meaning)]


def write_segmentation(path, volume):
    """A binary segment, where the volume is not 0."""
    columns = volume.affine[:3, :3]
    spacing = np.linalg.norm(columns, axis=0)
    directions = columns / spacing
    data = common(22, "SEG")
    data.update(item(
        SOPInstanceUID=f"{SERIES}.22.1", InstanceNumber=1, ContentDate="20200101", ContentTime="000000",
        ManufacturerModelName="Model", DeviceSerialNumber="1", SoftwareVersions="1", ImageType=["DERIVED", "PRIMARY"],
        ContentLabel="LABELS", ContentDescription="", ContentCreatorName="", LossyImageCompression="00",
        Rows=int(volume.size[1]), Columns=int(volume.size[0]), SamplesPerPixel=1, BitsAllocated=1, BitsStored=1,
        HighBit=0, PixelRepresentation=0, PhotometricInterpretation="MONOCHROME2", SegmentationType="BINARY",
        NumberOfFrames=int(volume.size[2])))
    data.SegmentSequence = [item(SegmentNumber=1, SegmentLabel="tissue", SegmentAlgorithmType="MANUAL",
                                 SegmentedPropertyCategoryCodeSequence=code("85756007", "Tissue"),
                                 SegmentedPropertyTypeCodeSequence=code("85756007", "Tissue"))]
    data.DimensionOrganizationSequence = [item(DimensionOrganizationUID=SERIES + ".22.9")]
    data.DimensionIndexSequence = [
        item(DimensionOrganizationUID=SERIES + ".22.9", DimensionIndexPointer=pointer, FunctionalGroupPointer=group)
        for pointer, group in [(0x0062000B, 0x0062000A), (0x00200032, 0x00209113)]]
    data.SharedFunctionalGroupsSequence = [item(
        PixelMeasuresSequence=[item(PixelSpacing=text([spacing[1], spacing[0]]), SliceThickness="2.5",
                                    SpacingBetweenSlices=text([spacing[2]])[0])],
        PlaneOrientationSequence=[item(ImageOrientationPatient=text([*directions[:, 0], *directions[:, 1]]))])]
    data.PerFrameFunctionalGroupsSequence = [item(
        FrameContentSequence=[item(DimensionIndexValues=[1, k + 1])],
        PlanePositionSequence=[item(ImagePositionPatient=text(volume.affine[:3, 3] + columns[:, 2] * k))],
        SegmentIdentificationSequence=[item(ReferencedSegmentNumber=1)]) for k in range(volume.size[2])]
    bits = np.packbits((volume.values != 0).transpose(2, 1, 0).ravel(), bitorder="little").tobytes()
    data.PixelData = bits + b"\0" * (len(bits) % 2)
    save(path, data, SEGMENTATION)
