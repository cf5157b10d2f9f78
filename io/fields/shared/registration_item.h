// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/. What the two registration objects of DICOM have in common (PS3.3 C.20.2, C.20.3).
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "deform/geometry.h"
#include "io/field_file.h"

namespace tetwarp {

/// Whether a file begins as PS3.10 says: with the mark DICM at byte 128.
bool is_marked_dicom(std::string_view first_bytes);
/// Whether an object is of a SOP class. It does not throw for what cannot be read.
bool is_of_class(const std::filesystem::path& path, const std::string& sop_class);

/// The item that the option `item` names, from 1; 0: the option is not given. @throws InputError for what is no number
std::size_t registration_item(const FieldSource& source);
/// @throws InputError for any other option than `item`
void check_registration_options(const FieldSource& source);

/// The numbers of one item.
class RegistrationValues {
 public:
  RegistrationValues(DcmItem& item, std::string file) : item_(item), file_(std::move(file)) {}

  /// The numbers of an attribute. @throws InputError unless there are `count` of them, all finite
  std::vector<double> numbers(const DcmTagKey& tag, unsigned long count) const;
  const std::string& file() const { return file_; }

 private:
  double number(const DcmTagKey& tag, unsigned long n) const;

  DcmItem& item_;
  std::string file_;
};

/// The only item of a sequence; null: it has none. @throws InputError for several items
DcmItem* only_item(DcmItem& item, const DcmTagKey& tag, const std::string& file);

/// The Frame of Reference Transformation Matrix of an item (C.20.2.1.1, row by row).
/// @param where  the sequence that the item is of, for messages
/// @throws InputError unless it is affine
AffineMap matrix_of(DcmItem& item, const DcmTagKey& where, const std::string& file);
/// That of the only item of a sequence; the identity where there is none.
AffineMap matrix_in(DcmItem& item, const DcmTagKey& sequence, const std::string& file);

}  // namespace tetwarp
