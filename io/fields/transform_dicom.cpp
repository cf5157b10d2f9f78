// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/fields/transform_dicom.h"

#include "deform/errors.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/fields/shared/registration_item.h"
#include "io/images/image_reader.h"

namespace tetwarp {
namespace {

/// One registered frame of reference.
struct Registered {
  std::string frame_of_reference;
  AffineMap map;
  std::string type;  ///< RIGID, RIGID_SCALE or AFFINE
};

bool is_identity(const Registered& one) { return one.map.linear == glm::dmat3(1) && one.map.offset == glm::dvec3(0); }

/// The only matrix of an item of the Registration Sequence (C.20.2.1.1). @throws InputError for none, or several
Registered read_item(DcmItem& item, const std::string& file) {
  Registered one{text_of(item, DCM_FrameOfReferenceUID), {}, {}};
  DcmItem* const registration = only_item(item, DCM_MatrixRegistrationSequence, file);
  require(registration != nullptr, "no " + tag_name(DCM_MatrixRegistrationSequence) + ", " + file);
  DcmItem* const matrix = only_item(*registration, DCM_MatrixSequence, file);
  require(matrix != nullptr, "no " + tag_name(DCM_MatrixSequence) + ", " + file);
  one.map = matrix_of(*matrix, DCM_MatrixSequence, file);
  one.type = text_of(*matrix, DCM_FrameOfReferenceTransformationMatrixType);
  return one;
}

/// @throws InputError for a file that is damaged, or holds no matrix
std::vector<Registered> read_items(const std::filesystem::path& path) {
  require_readable_file(path);
  prepare_dcmtk();
  const std::string file = path.string();
  DcmFileFormat format;
  const OFCondition read = parse_dicom(format, path, DCM_UndefinedTagKey).result;
  require(read.good(), std::string("cannot be read as DICOM (") + read.text() + "), " + file + "; is it whole?");
  DcmSequenceOfItems* sequence = nullptr;
  format.getDataset()->findAndGetSequence(DCM_RegistrationSequence, sequence);
  require(sequence != nullptr && sequence->card() > 0,
          "no " + tag_name(DCM_RegistrationSequence) + ", " + file + "; is the file whole?");
  std::vector<Registered> items;
  for (unsigned long n = 0; n < sequence->card(); ++n) items.push_back(read_item(*sequence->getItem(n), file));
  return items;
}

std::string list_of(const std::vector<Registered>& items) {
  std::string lines;
  for (std::size_t n = 0; n < items.size(); ++n) {
    lines += "\n  " + std::to_string(n + 1) + "  from frame of reference " + items[n].frame_of_reference + "  " +
             (is_identity(items[n]) ? "identity" : items[n].type);
  }
  return lines;
}

/// The item to take: the one that is named, else the only one that moves anything, else the only one.
/// @throws InputError for several
const Registered& choose(const std::vector<Registered>& items, std::size_t wanted, const std::string& file) {
  if (wanted > 0) {
    require(wanted <= items.size(),
            "no item " + std::to_string(wanted) + ", " + file + "; choose one of" + list_of(items));
    return items[wanted - 1];
  }
  const auto moves = [](const Registered& one) { return !is_identity(one); };
  const auto moving = std::ranges::count_if(items, moves);
  require(moving == 1 || items.size() == 1, std::to_string(moving) + " of " + std::to_string(items.size()) +
                                                " matrices are no identity, " + file +
                                                "; choose one with item=N: " + file + ":item=1" + list_of(items));
  return moving == 1 ? *std::ranges::find_if(items, moves) : items.front();
}

bool recognizes(const std::filesystem::path&, std::string_view first_bytes) { return is_marked_dicom(first_bytes); }

bool holds_transform(const std::filesystem::path& path) { return is_of_class(path, UID_SpatialRegistrationStorage); }

TransformFile read(const FieldSource& source, const std::stop_token&) {
  const std::vector<Registered> items = read_items(source.path);
  const Registered& one = choose(items, registration_item(source), source.path.string());
  TransformFile result = affine_transform(one.map);
  result.tool = "DICOM";
  result.classes = {"Spatial Registration" + (one.type.empty() ? "" : ", " + one.type)};
  result.direction = Direction::forward;
  return result;
}

}  // namespace

const TransformFormat kTransformFormat_dicom = {recognizes, holds_transform, check_registration_options, read, nullptr};

}  // namespace tetwarp
