// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom_structures.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <tuple>

#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/objects/dicom_along_put.h"
#include "io/dicom/objects/dicom_structures_header.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/dicom_text.h"

namespace tetwarp {

namespace {

constexpr double kFarthest = 1e5;  // mm from the origin: no patient is as large

/// One file, parsed.
class StructureFile {
 public:
  explicit StructureFile(const std::filesystem::path& path) : path_(path) {
    prepare_dcmtk();
    std::error_code failed;
    bytes_ = std::filesystem::file_size(path, failed);
    if (failed) refuse("cannot be read: " + failed.message());
    const OFCondition read = parse_dicom(format_, path, DCM_UndefinedTagKey).result;
    if (read.bad()) refuse(std::string("cannot be read as DICOM: ") + read.text());
    if (text(data(), DCM_SOPClassUID) != UID_RTStructureSetStorage) refuse("is no RT Structure Set");
  }

  StructureSet read() {
    auto header = std::make_shared<StructureSetHeader>();
    StructureSet set;
    std::map<int, std::size_t> places;  // of the structures, by ROI Number
    for (DcmItem* roi : items(data(), DCM_StructureSetROISequence)) {
      Structure& structure = set.structures.emplace_back();
      structure.number = whole_number(*roi, DCM_ROINumber);
      structure.frame_of_reference_uid = text(*roi, DCM_ReferencedFrameOfReferenceUID);
      if (!places.emplace(structure.number, places.size()).second) refuse(name(structure.number) + " is there twice");
      header->roi.emplace_back(new DcmItem(*roi));
    }
    if (set.structures.empty()) refuse("has no item in " + tag_name(DCM_StructureSetROISequence));
    header->contour.resize(set.structures.size());
    for (DcmItem* item : items(data(), DCM_ROIContourSequence)) {
      const int number = whole_number(*item, DCM_ReferencedROINumber);
      const auto place = places.find(number);
      if (place == places.end()) refuse("has contours of " + name(number) + ", which it does not define");
      if (header->contour[place->second]) refuse("has contours of " + name(number) + " at two places");
      Structure& structure = set.structures[place->second];
      structure.contours = contours(*item, number);
      structure.repeated = drop_repeated(structure.contours);
      drop(*item, DCM_ContourSequence);
      header->contour[place->second].reset(new DcmItem(*item));
    }
    for (DcmItem* item : items(data(), DCM_RTROIObservationsSequence))
      header->observations.emplace_back(new DcmItem(*item));
    for (const DcmTagKey& tag : {DCM_StructureSetROISequence, DCM_ROIContourSequence, DCM_RTROIObservationsSequence})
      drop(data(), tag);
    header->data.reset(new DcmDataset(data()));
    set.header = header;
    return set;
  }

 private:
  DcmDataset& data() { return *format_.getDataset(); }
  [[noreturn]] void refuse(const std::string& what) const {
    throw InputError(shown(path_) + " " + what + "; give an RT Structure Set as it was exported");
  }
  static std::string name(int number) { return "ROI " + std::to_string(number); }

  std::string text(DcmItem& item, const DcmTagKey& tag) const {
    if (!is_at_most(item, tag, bytes_)) refuse("is damaged: a length goes beyond its end, " + tag_name(tag));
    return text_of(item, tag);
  }

  int whole_number(DcmItem& item, const DcmTagKey& tag) const {
    const std::optional<double> value = decimal(text(item, tag));
    if (!value || std::abs(*value) > INT32_MAX || *value != std::floor(*value))
      refuse("has no whole number where one must be, " + tag_name(tag));
    return static_cast<int>(*value);
  }

  std::vector<DcmItem*> items(DcmItem& item, const DcmTagKey& tag) const {
    std::vector<DcmItem*> result;
    if (!item.tagExists(tag)) return result;
    DcmSequenceOfItems* sequence = nullptr;
    if (item.findAndGetSequence(tag, sequence).bad()) refuse("is damaged: no sequence, " + tag_name(tag));
    for (DcmObject* one = nullptr; (one = sequence->nextInContainer(one)) != nullptr;)
      result.push_back(dynamic_cast<DcmItem*>(one));
    return result;
  }

  std::vector<Contour> contours(DcmItem& roi, int number) const {
    std::vector<Contour> result;
    for (DcmItem* item : items(roi, DCM_ContourSequence)) {
      const std::string where = " in contour " + std::to_string(result.size() + 1) + " of " + name(number);
      result.push_back(contour(*item, where));
    }
    return result;
  }

  /// Drops closed contours that are there twice: as a region and a hole of it they would leave nothing.
  /// @return how many were dropped
  static std::size_t drop_repeated(std::vector<Contour>& contours) {
    const auto less = [](const std::vector<glm::dvec3>& a, const std::vector<glm::dvec3>& b) {
      return std::lexicographical_compare(
          a.begin(), a.end(), b.begin(), b.end(),
          [](const glm::dvec3& p, const glm::dvec3& q) { return std::tie(p.x, p.y, p.z) < std::tie(q.x, q.y, q.z); });
    };
    std::set<std::vector<glm::dvec3>, decltype(less)> seen(less);
    return std::erase_if(contours, [&](const Contour& contour) {
      return contour.kind == ContourKind::closed && !seen.insert(contour.points).second;
    });
  }

  Contour contour(DcmItem& item, const std::string& where) const {
    Contour contour;
    const std::string kind = text(item, DCM_ContourGeometricType);
    const auto known = std::find_if(kContourKinds.begin(), kContourKinds.end(),
                                    [&](const auto& entry) { return kind == entry.second; });
    if (known == kContourKinds.end())
      refuse("has " + tag_name(DCM_ContourGeometricType) + " that is " + known_code(kind, {}) + where);
    contour.kind = known->first;
    const std::vector<double> values = decimals(text(item, DCM_ContourData), where);
    if (values.size() % 3 != 0)
      refuse("has " + plural(values.size(), "number") + " in " + tag_name(DCM_ContourData) + ", not three a point," +
             where);
    for (std::size_t n = 0; n < values.size(); n += 3)
      contour.points.emplace_back(values[n], values[n + 1], values[n + 2]);
    const std::string count = text(item, DCM_NumberOfContourPoints);
    if (!count.empty() && decimal(count) != static_cast<double>(contour.points.size())) {
      refuse("says " + stated_number(count) + " in " + tag_name(DCM_NumberOfContourPoints) + " and has " +
             plural(contour.points.size(), "point") + where);
    }
    const std::string offset = text(item, DCM_RETIRED_ContourOffsetVector);
    if (offset.find_first_not_of("+-0.eE\\ ") != std::string::npos)
      refuse("has " + tag_name(DCM_RETIRED_ContourOffsetVector) + ", which is retired," + where);
    return contour;
  }

  std::vector<double> decimals(const std::string& text, const std::string& where) const {
    std::vector<double> values;
    for (std::size_t begin = 0; begin < text.size();) {
      const std::size_t end = std::min(text.find('\\', begin), text.size());
      std::string_view word(text.data() + begin, end - begin);
      while (word.starts_with(' ')) word.remove_prefix(1);
      while (word.ends_with(' ')) word.remove_suffix(1);
      const std::optional<double> value = decimal(word);
      if (!value || std::abs(*value) > kFarthest) refuse("has " + stated_number(word) + " for a place in mm" + where);
      values.push_back(*value);
      begin = end + 1;
    }
    if (text.ends_with('\\')) refuse("has an empty number" + where);
    return values;
  }

  std::filesystem::path path_;
  std::uint64_t bytes_ = 0;
  DcmFileFormat format_;
};

}  // namespace

bool is_dicom_structure_set(const std::filesystem::path& path) {
  return sop_class_of(path) == UID_RTStructureSetStorage;
}

StructureSet read_structure_set(const std::filesystem::path& path) { return StructureFile(path).read(); }

}  // namespace tetwarp
