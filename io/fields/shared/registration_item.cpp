// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/shared/registration_item.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/fields/transform_matrix.h"

namespace tetwarp {

bool is_marked_dicom(std::string_view first_bytes) {
  constexpr std::size_t kMarkOffset = 128;
  return first_bytes.substr(std::min(kMarkOffset, first_bytes.size())).starts_with("DICM");
}

bool is_of_class(const std::filesystem::path& path, const std::string& sop_class) {
  prepare_dcmtk();
  DcmFileFormat format;
  return parse_dicom(format, path, DCM_StudyDate).result.good() &&
         text_of(*format.getDataset(), DCM_SOPClassUID) == sop_class;
}

std::size_t registration_item(const FieldSource& source) {
  const auto found = source.options.find("item");
  if (found == source.options.end()) return 0;
  const std::string& text = found->second;
  const std::size_t number = number_from<std::size_t>(text).value_or(0);
  require(number >= 1, "item=" + text + ", " + source.path.string() + "; expected a whole number from 1");
  return number;
}

void check_registration_options(const FieldSource& source) {
  for (const auto& [key, value] : source.options)
    require(key == "item", "the option \"" + key + "\", " + source.path.string() + "; expected item");
  registration_item(source);
}

std::vector<double> RegistrationValues::numbers(const DcmTagKey& tag, unsigned long count) const {
  DcmElement* element = nullptr;
  require(item_.findAndGetElement(tag, element).good() && element != nullptr,
          "no " + tag_name(tag) + ", " + file_ + "; is the file whole?");
  require(element->getVM() == count, std::to_string(element->getVM()) + " values of " + tag_name(tag) + ", " + file_ +
                                         "; expected " + std::to_string(count));
  std::vector<double> values(count);
  for (unsigned long n = 0; n < count; ++n) {
    values[n] = number(tag, n);
    require(std::isfinite(values[n]), [&] {
      return "value " + std::to_string(n + 1) + " of " + tag_name(tag) + " is no finite number, " + file_ +
             "; expected one";
    });
  }
  return values;
}

/// One number of an attribute; NaN where it cannot be read. Grid Dimensions are of VR UL, which DCMTK does not give as
/// Float64.
double RegistrationValues::number(const DcmTagKey& tag, unsigned long n) const {
  double value = 0;
  if (item_.findAndGetFloat64(tag, value, n).good()) return value;
  Uint32 whole = 0;
  return item_.findAndGetUint32(tag, whole, n).good() ? whole : std::numeric_limits<double>::quiet_NaN();
}

DcmItem* only_item(DcmItem& item, const DcmTagKey& tag, const std::string& file) {
  DcmSequenceOfItems* sequence = nullptr;
  if (item.findAndGetSequence(tag, sequence).bad() || sequence == nullptr || sequence->card() == 0) return nullptr;
  require(sequence->card() == 1,
          std::to_string(sequence->card()) + " items of " + tag_name(tag) + ", " + file + "; expected one");
  return sequence->getItem(0);
}

AffineMap matrix_of(DcmItem& item, const DcmTagKey& where, const std::string& file) {
  const std::vector<double> m = RegistrationValues(item, file).numbers(DCM_FrameOfReferenceTransformationMatrix, 16);
  require(m[12] == 0 && m[13] == 0 && m[14] == 0 && m[15] == 1,
          "the last row of the matrix of " + tag_name(where) + " is not 0 0 0 1, " + file);
  return map_of_rows(std::span<const double, 16>(m));
}

AffineMap matrix_in(DcmItem& item, const DcmTagKey& sequence, const std::string& file) {
  DcmItem* only = only_item(item, sequence, file);
  return only ? matrix_of(*only, sequence, file) : AffineMap{};
}

}  // namespace tetwarp
