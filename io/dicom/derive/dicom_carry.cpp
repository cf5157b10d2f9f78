// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/derive/dicom_carry.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcelem.h>
#include <dcmtk/dcmdata/dcsequen.h>

#include <algorithm>
#include <memory>

#include "io/dicom/derive/dicom_put.h"

namespace tetwarp {

namespace {

/// Attributes that are not carried although their group is: they would be false of the derived slice, or are set anew.
const std::set<DcmTagKey>& not_carried() {
  static const std::set<DcmTagKey> tags = {
      DCM_RETIRED_LengthToEnd,
      DCM_InstanceCreationDate,  // when another instance was made; no clock is read for this one
      DCM_InstanceCreationTime,
      DCM_InstanceCreatorUID,
      DCM_SOPClassUID,
      DCM_SOPInstanceUID,
      DCM_RelatedGeneralSOPClassUID,
      DCM_OriginalSpecializedSOPClassUID,
      DCM_SeriesDescriptionCodeSequence,
      DCM_ReferencedSeriesSequence,  // what these refer to belongs to the source's pixels
      DCM_ReferencedImageSequence,
      DCM_ReferencedInstanceSequence,
      DCM_SourceImageSequence,
      DCM_DerivationDescription,
      DCM_AlternateRepresentationSequence,
      DCM_StudiesContainingOtherReferencedInstancesSequence,
      DCM_ReferencedImageEvidenceSequence,
      DCM_SourceImageEvidenceSequence,
      DCM_FrameType,
      DCM_VolumetricProperties,
      DCM_VolumeBasedCalculationTechnique,
      DCM_RETIRED_ImagePosition,
      DCM_RETIRED_ImageOrientation,
      DCM_RETIRED_Location,
      DCM_SliceLocation,
      DCM_ConcatenationUID,
      DCM_InConcatenationNumber,
      DCM_InConcatenationTotalNumber,
      DCM_RealWorldValueMappingSequence,
  };
  return tags;
}

/// The attributes of group 0028 that are carried.
const std::set<DcmTagKey>& carried_of_0028() {
  static const std::set<DcmTagKey> tags = {
      DCM_PixelSpacing,  // put_image_plane replaces it unless it agrees with the geometry
      DCM_WindowCenter,
      DCM_WindowWidth,
      DCM_WindowCenterWidthExplanation,
      DCM_VOILUTFunction,
      DCM_QualityControlImage,
      DCM_BurnedInAnnotation,
      DCM_RecognizableVisualFeatures,
      DCM_LongitudinalTemporalInformationModified,
      DCM_LossyImageCompression,
      DCM_LossyImageCompressionRatio,
      DCM_LossyImageCompressionMethod,
  };
  return tags;
}

bool is_carried(const DcmTagKey& tag, const std::set<DcmTagKey>& varying) {
  if (tag.getElement() == 0) return false;  // a group length
  switch (tag.getGroup()) {
    case 0x0008:
    case 0x0010:
    case 0x0012:
    case 0x0018:
    case 0x0020:
    case 0x0032:
    case 0x0038:
    case 0x0040: return !not_carried().contains(tag) && !varying.contains(tag);
    case 0x0028: return carried_of_0028().contains(tag);
    default: return false;
  }
}

bool is_of_patient_or_study(const DcmTagKey& tag) {
  static const std::set<DcmTagKey> of_study = {DCM_SpecificCharacterSet,
                                               DCM_StudyDate,
                                               DCM_StudyTime,
                                               DCM_AccessionNumber,
                                               DCM_IssuerOfAccessionNumberSequence,
                                               DCM_ReferringPhysicianName,
                                               DCM_ReferringPhysicianIdentificationSequence,
                                               DCM_ConsultingPhysicianName,
                                               DCM_ConsultingPhysicianIdentificationSequence,
                                               DCM_TimezoneOffsetFromUTC,
                                               DCM_StudyDescription,
                                               DCM_ProcedureCodeSequence,
                                               DCM_PhysiciansOfRecord,
                                               DCM_PhysiciansOfRecordIdentificationSequence,
                                               DCM_NameOfPhysiciansReadingStudy,
                                               DCM_PhysiciansReadingStudyIdentificationSequence,
                                               DCM_AdmittingDiagnosesDescription,
                                               DCM_AdmittingDiagnosesCodeSequence,
                                               DCM_StudyInstanceUID,
                                               DCM_StudyID,
                                               DCM_PositionReferenceIndicator};
  const Uint16 group = tag.getGroup();
  if (tag.getElement() == 0) return false;  // a group length
  return group == 0x0010 || group == 0x0012 || group == 0x0038 || of_study.contains(tag);
}

/// Removes private attributes and group lengths from the items of a sequence, at any depth.
void clean(DcmSequenceOfItems& sequence) {
  for (unsigned long i = 0; i < sequence.card(); ++i) {
    DcmItem& item = *sequence.getItem(i);
    for (unsigned long j = item.card(); j-- > 0;) {
      DcmElement* element = item.getElement(j);
      const DcmTagKey tag = element->getTag().getXTag();
      if (tag.getGroup() % 2 != 0 || tag.getElement() == 0)
        delete item.remove(j);
      else if (auto* nested = dynamic_cast<DcmSequenceOfItems*>(element))
        clean(*nested);
    }
  }
}

/// Copies an attribute to `target`; private attributes in the items of a sequence are left out.
void copy_element(DcmItem& target, const DcmElement& element) {
  std::unique_ptr<DcmElement> copy(dynamic_cast<DcmElement*>(element.clone()));
  if (auto* sequence = dynamic_cast<DcmSequenceOfItems*>(copy.get())) clean(*sequence);
  if (target.insert(copy.get(), OFTrue).good()) copy.release();
}

template <class Wanted>
void copy_those(DcmItem& target, DcmDataset& source, const Wanted& is_wanted) {
  for (unsigned long i = 0; i < source.card(); ++i) {
    const DcmElement& element = *source.getElement(i);
    if (is_wanted(element.getTag().getXTag())) copy_element(target, element);
  }
}

}  // namespace

std::set<DcmTagKey> varying_acquisition(const std::vector<DcmDataset*>& slices, bool own) {
  std::set<DcmTagKey> of_each_slice = {DCM_KVP, DCM_SpacingBetweenSlices, DCM_ContributingEquipmentSequence};
  if (own) of_each_slice.insert(DCM_SliceThickness);
  std::set<DcmTagKey> tags, varying;
  for (DcmDataset* slice : slices) {
    for (unsigned long i = 0; i < slice->card(); ++i) {
      const DcmTagKey tag = slice->getElement(i)->getTag().getXTag();
      if (tag.getGroup() == 0x0018 && !of_each_slice.contains(tag)) tags.insert(tag);
    }
  }
  for (const DcmTagKey& tag : tags) {
    DcmElement* first = nullptr;
    slices.front()->findAndGetElement(tag, first);
    const bool constant = first && std::all_of(slices.begin(), slices.end(), [&](DcmDataset* slice) {
                            DcmElement* other = nullptr;
                            return slice->findAndGetElement(tag, other).good() && first->compare(*other) == 0;
                          });
    if (!constant) varying.insert(tag);
  }
  return varying;
}

void carry_over(DcmItem& target, DcmDataset& source, const std::set<DcmTagKey>& varying) {
  copy_those(target, source, [&](const DcmTagKey& tag) { return is_carried(tag, varying); });
}

void carry_patient_and_study(DcmItem& target, DcmDataset& source) {
  copy_those(target, source, is_of_patient_or_study);
  static const std::vector<DcmTagKey> kType2 = {DCM_StudyDate,        DCM_StudyTime,
                                                DCM_AccessionNumber,  DCM_ReferringPhysicianName,
                                                DCM_PatientName,      DCM_PatientID,
                                                DCM_PatientBirthDate, DCM_PatientSex,
                                                DCM_StudyID,          DCM_PositionReferenceIndicator};
  put_missing(target, kType2);
}

void carry_attribute(DcmItem& target, DcmItem& source, const DcmTagKey& tag) {
  DcmElement* element = nullptr;
  if (source.findAndGetElement(tag, element).good()) copy_element(target, *element);
}

void copy_over(DcmItem& target, DcmItem& source, std::span<const DcmTagKey> tags) {
  for (const DcmTagKey& tag : tags) carry_attribute(target, source, tag);
}

std::vector<DcmTagKey> type_2_attributes() {
  return {DCM_StudyDate,
          DCM_StudyTime,
          DCM_AccessionNumber,
          DCM_Manufacturer,
          DCM_ReferringPhysicianName,
          DCM_PatientName,
          DCM_PatientID,
          DCM_PatientBirthDate,
          DCM_PatientSex,
          DCM_SliceThickness,
          DCM_KVP,
          DCM_PatientPosition,
          DCM_StudyID,
          DCM_SeriesNumber,
          DCM_AcquisitionNumber,
          DCM_PositionReferenceIndicator};
}

}  // namespace tetwarp
