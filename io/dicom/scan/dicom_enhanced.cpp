// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_enhanced.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcsequen.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/scan/dicom_functional_groups.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_text.h"

namespace tetwarp {
namespace {

/// The most frames that a file may have. A moving organ in full resolution has some thousand; each takes some kilobytes
/// when a series is listed.
constexpr long kMostFrames = 100'000;
/// The most attributes of a file, and of all its slices together, for each slice has a copy of what the file says of
/// all. Some hundred attributes are common.
constexpr std::size_t kMostAttributes = 5'000, kMostCopies = 30'000'000;

/// Whether an attribute is no part of a slice: it is about the file as a whole or about other objects, or the
/// functional groups say it of each slice.
bool is_of_file(const DcmTagKey& tag) {
  static const std::set<DcmTagKey> tags = {
      DCM_NumberOfFrames,
      DCM_SharedFunctionalGroupsSequence,
      DCM_PerFrameFunctionalGroupsSequence,
      DCM_DimensionOrganizationSequence,
      DCM_DimensionIndexSequence,
      DCM_DimensionOrganizationType,
      DCM_ConcatenationUID,
      DCM_SOPInstanceUIDOfConcatenationSource,
      DCM_InConcatenationNumber,
      DCM_InConcatenationTotalNumber,
      DCM_ConcatenationFrameOffsetNumber,
      DCM_PixelPresentation,
      DCM_VolumetricProperties,
      DCM_VolumeBasedCalculationTechnique,
      DCM_ContentQualification,
      DCM_MultienergyCTAcquisition,
      DCM_AcquisitionContextSequence,
      DCM_ReferencedRawDataSequence,
      DCM_ReferencedSeriesSequence,
      DCM_ReferencedImageSequence,
      DCM_ReferencedInstanceSequence,
      DCM_ReferencedImageEvidenceSequence,
      DCM_SourceImageSequence,
      DCM_SourceImageEvidenceSequence,
      DCM_StudiesContainingOtherReferencedInstancesSequence,
      DCM_ConversionSourceAttributesSequence,
  };
  constexpr Uint16 kLastGroup = 0x0040;  // the last group of classic CT; what private groups mean is not known
  return tag.getGroup() > kLastGroup || tag.getGroup() % 2 != 0 || tags.contains(tag);
}

/// Whether an attribute describes the words of Pixel Data, which all frames share (PS3.3 C.7.6.3).
bool is_of_pixels(const DcmTagKey& tag) {
  constexpr Uint16 kEnd = 0x0120;  // Pixel Padding Value
  return tag.getGroup() == 0x0028 && tag.getElement() < kEnd && tag != DCM_PixelSpacing;
}

void copy(const DcmObject& element, DcmItem& to) {
  std::unique_ptr<DcmElement> clone(dynamic_cast<DcmElement*>(element.clone()));
  if (to.insert(clone.get(), OFTrue).good()) clone.release();
}

/// Copies the value of an attribute to another one, as a whole number where the standard requires one.
void rename(DcmItem& from, const DcmTagKey& old_tag, DcmItem& to, const DcmTagKey& tag) {
  std::string value = text_of(from, old_tag);
  if (value.empty()) return;
  if (DcmTag(tag).getEVR() == EVR_IS) {
    const auto exact = decimal(value);
    if (!exact || std::abs(*exact) > 2e9) return;
    value = std::to_string(std::llround(*exact));
  }
  put(to, tag, value);
}

long long_of(DcmItem& item, const DcmTagKey& tag, long otherwise) {
  const auto value = decimal(text_of(item, tag));
  return value && std::abs(*value) <= 2e9 ? static_cast<long>(*value) : otherwise;
}

/// How many attributes an item has, those of items within it included.
std::size_t count_attributes(DcmItem& item) {
  std::size_t count = 0;
  DcmStack stack;
  while (item.nextObject(stack, OFTrue).good()) ++count;
  return count;
}

DcmItem* first_item(DcmItem& item, const DcmTagKey& sequence) {
  DcmItem* found = nullptr;
  return item.findAndGetSequenceItem(sequence, found, 0).good() ? found : nullptr;
}

/// All items of a sequence. DCMTK searches from the first item on whenever one is fetched by its number, so they are
/// fetched once.
std::vector<DcmItem*> items_of(DcmItem& item, const DcmTagKey& tag) {
  DcmSequenceOfItems* sequence = nullptr;
  std::vector<DcmItem*> items;
  if (item.findAndGetSequence(tag, sequence).bad()) return items;
  for (DcmObject* one = sequence->nextInContainer(nullptr); one; one = sequence->nextInContainer(one))
    items.push_back(dynamic_cast<DcmItem*>(one));
  std::erase(items, nullptr);
  return items;
}

}  // namespace

bool is_enhanced_ct(const std::string& sop_class_uid) {
  return sop_class_uid == UID_EnhancedCTImageStorage || sop_class_uid == UID_LegacyConvertedEnhancedCTImageStorage;
}

EnhancedFrames::EnhancedFrames(DcmDataset& data) : data_(data) {
  list_frames(data);
  if (!problem_.empty()) return;
  for (DcmObject* element = data.nextInContainer(nullptr); element; element = data.nextInContainer(element)) {
    const DcmTagKey tag = element->getTag().getXTag();
    if (is_of_file(tag)) continue;
    top_level_.insert(tag);
    copy(*element, common_);
  }
  for (DcmItem* dimension : items_of(data, DCM_DimensionIndexSequence)) {
    DcmTagKey pointer;
    DcmElement* element = nullptr;
    if (dimension->findAndGetElement(DCM_DimensionIndexPointer, element).good()) element->getTagVal(pointer);
    is_place_.push_back(pointer == DCM_InStackPositionNumber || pointer == DCM_ImagePositionPatient);
  }
  constexpr long kMostNumbers = 2'000'000'000;
  const long offset = long_of(data, DCM_ConcatenationFrameOffsetNumber, 0);
  first_number_ = offset > 0 && offset < kMostNumbers - kMostFrames ? offset + 1 : 1;
  if (DcmItem* shared = first_item(data, DCM_SharedFunctionalGroupsSequence))
    take_groups(*shared, DCM_UnassignedSharedConvertedAttributesSequence, common_);
  const std::size_t count = count_attributes(common_);
  if (count <= kMostAttributes && count * frames_.size() <= kMostCopies) return;
  problem_ = "too many attributes of all frames, expected at most " +
             std::to_string(std::min(kMostAttributes, kMostCopies / frames_.size())) + ", found " +
             std::to_string(count);
  frames_.clear();
}

void EnhancedFrames::list_frames(DcmDataset& data) {
  const std::string number = text_of(data, DCM_NumberOfFrames);
  const long expected = long_of(data, DCM_NumberOfFrames, 0);
  if (expected < 1 || expected > kMostFrames) {
    problem_ = "Number of Frames (0028,0008), expected 1 to " + std::to_string(kMostFrames) + ", found " +
               (number.empty() ? "none" : stated_number(number));
    return;
  }
  frames_ = items_of(data, DCM_PerFrameFunctionalGroupsSequence);
  if (std::ssize(frames_) == expected) return;
  problem_ = "Per-Frame Functional Groups Sequence (5200,9230), expected " + std::to_string(expected) +
             " items, as many as Number of Frames (0028,0008), found " + std::to_string(frames_.size());
  frames_.clear();
}

std::unique_ptr<DcmDataset> EnhancedFrames::slice(int frame) const {
  auto slice = std::make_unique<DcmDataset>(common_);
  DcmItem& groups = *frames_.at(static_cast<std::size_t>(frame));
  take_groups(groups, DCM_UnassignedPerFrameConvertedAttributesSequence, *slice);
  put_contrast(groups, *slice);
  put_dimensions(*slice);
  put(*slice, DCM_InstanceNumber, std::to_string(first_number_ + frame));
  return slice;
}

void EnhancedFrames::take_groups(DcmItem& groups, const DcmTagKey& unassigned, DcmItem& slice) const {
  for (const FunctionalGroup& group : functional_groups()) {
    DcmItem* macro = first_item(groups, group.sequence);
    for (std::size_t n = 0; macro && n < group.attributes.size(); ++n) {
      DcmElement* element = nullptr;
      if (macro->findAndGetElement(group.attributes[n], element).good()) copy(*element, slice);
    }
    for (std::size_t n = 0; macro && n < group.renamed.size(); ++n)
      rename(*macro, group.renamed[n].from, slice, group.renamed[n].to);
    if (macro && group.sequence == DCM_FrameContentSequence && macro->tagExists(DCM_FrameAcquisitionDateTime)) {
      drop(slice, DCM_AcquisitionDate);  // this date and time are those of the first frame
      drop(slice, DCM_AcquisitionTime);
    }
  }
  if (DcmItem* attributes = first_item(groups, unassigned)) take_unassigned(*attributes, slice);
}

void EnhancedFrames::take_unassigned(DcmItem& attributes, DcmItem& slice) const {
  if (attributes.card() > kMostAttributes) return;  // no converter makes so many
  for (DcmObject* one = attributes.nextInContainer(nullptr); one; one = attributes.nextInContainer(one)) {
    const DcmTagKey tag = one->getTag().getXTag();
    if (!is_of_file(tag) && !is_of_pixels(tag) && !top_level_.contains(tag)) copy(*one, slice);
  }
}

/// Puts Contrast/Bolus Agent, in words: the agents that had been given when the frame was taken (PS3.3 C.7.6.4b).
void EnhancedFrames::put_contrast(DcmItem& groups, DcmItem& slice) const {
  std::vector<DcmItem*> usages = items_of(groups, DCM_ContrastBolusUsageSequence);
  DcmItem* shared = first_item(data_, DCM_SharedFunctionalGroupsSequence);
  if (usages.empty() && shared) usages = items_of(*shared, DCM_ContrastBolusUsageSequence);
  if (slice.tagExists(DCM_ContrastBolusAgent)) return;
  std::set<std::string> absent;
  for (DcmItem* usage : usages) {
    if (text_of(*usage, DCM_ContrastBolusAgentAdministered) == "NO")
      absent.insert(text_of(*usage, DCM_ContrastBolusAgentNumber));
  }
  std::string given;
  for (DcmItem* agent : items_of(data_, DCM_ContrastBolusAgentSequence)) {
    if (absent.contains(text_of(*agent, DCM_ContrastBolusAgentNumber))) continue;
    const std::string meaning = text_of(*agent, DCM_CodeMeaning);
    given += (given.empty() ? "" : ", ") + (meaning.empty() ? "unnamed" : meaning);
  }
  constexpr std::size_t kLongest = 64;
  if (given.size() > kLongest) given = "several";
  drop(slice, DCM_ContrastBolusAgentSequence);
  if (!given.empty()) put(slice, DCM_ContrastBolusAgent, given);
}

void EnhancedFrames::put_dimensions(DcmItem& slice) const {
  std::string kept;
  for (std::size_t n = 0; n < is_place_.size() && n < 16; ++n) {
    Uint32 index = 0;
    if (!is_place_[n] && slice.findAndGetUint32(DCM_DimensionIndexValues, index, n).good())
      kept += (kept.empty() ? "" : "\\") + std::to_string(index);
  }
  drop(slice, DCM_DimensionIndexValues);
  if (!kept.empty()) put(slice, DCM_DimensionIndexValues, kept);
}

}  // namespace tetwarp
