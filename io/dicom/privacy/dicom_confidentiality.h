// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: table E.1-1 of PS3.15, which says what becomes of an attribute when a data set is de-identified.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctagkey.h>

#include <array>
#include <set>
#include <string_view>

#include "io/deidentification.h"

namespace tetwarp {

/// What becomes of one attribute.
enum class Confidentiality : std::uint8_t {
  keep,         ///< K; of a sequence: its items are looked at
  remove,       ///< X
  empty,        ///< Z
  dummy,        ///< D: a value that says nothing
  replace_uid,  ///< U; of a sequence: in its items
  shift_date,   ///< C of Modified Dates
};

/// What the IOD of a data set asks of an attribute (PS3.5 7.4), as far as that is known.
enum class AttributeType : std::uint8_t {
  unknown,       ///< what is valid for every type is chosen
  may_be_empty,  ///< type 2
  optional,      ///< type 3
};

/// A row of the table.
struct ConfidentialityRow {
  std::string_view tag;  ///< eight hexadecimal digits; X stands for any; GGGGEEEE: private ones
  std::string_view name;
  std::string_view basic;                    ///< X, Z, D, U, X/Z, X/D, Z/D, X/Z/D or X/Z/U*
  std::array<std::string_view, 10> options;  ///< K, C or empty
};

/// The row of an attribute; none if the table has none.
const ConfidentialityRow* confidentiality_row(const DcmTagKey& tag);

/// Of several codes the one that an attribute of this type needs (PS3.15 table E.1-1a).
Confidentiality resolved(std::string_view basic, AttributeType type);

/// What a row means under these options. Where options disagree, the one that tells less is followed.
Confidentiality action_of(const ConfidentialityRow& row, const std::set<ConfidentialityOption>& options,
                          AttributeType type);

}  // namespace tetwarp
