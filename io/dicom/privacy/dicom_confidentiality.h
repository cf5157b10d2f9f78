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
  keep,         ///< K; the items of a sequence are treated one by one
  remove,       ///< X
  empty,        ///< Z
  dummy,        ///< D: a value of the same VR that tells nothing
  replace_uid,  ///< U; in a sequence: the UIDs in its items
  shift_date,   ///< C in the column Modified Dates
};

/// The type that the IOD of a data set gives an attribute (PS3.5 7.4), as far as that is known.
enum class AttributeType : std::uint8_t {
  unknown,       ///< what is valid for every type is chosen
  may_be_empty,  ///< type 2
  optional,      ///< type 3
};

/// A row of the table.
struct ConfidentialityRow {
  std::string_view tag;  ///< eight hexadecimal digits; X stands for any digit, GGGGEEEE for private attributes
  std::string_view name;
  std::string_view basic;                    ///< code of the basic profile: X, Z, D, U, X/Z, X/D, Z/D, X/Z/D or X/Z/U*
  std::array<std::string_view, 10> options;  ///< code of each option: K, C or empty
};

/// The row of the table for an attribute; null if the table has none.
const ConfidentialityRow* confidentiality_row(const DcmTagKey& tag);

/// Chooses among the codes that a row has for several types ("X/Z/D") the one for this type (PS3.15 table E.1-1a).
Confidentiality resolved(std::string_view basic, AttributeType type);

/// What a row means under these options. Where options disagree, the one that reveals less is followed.
Confidentiality action_of(const ConfidentialityRow& row, const std::set<ConfidentialityOption>& options,
                          AttributeType type);

}  // namespace tetwarp
