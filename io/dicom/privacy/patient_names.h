// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: which texts of a header name the patient.
#include <memory>
#include <string>
#include <string_view>
#include <vector>

class DcmItem;

namespace tetwarp {

/// Finds texts that name the patient, so that they can be left out of what is shown. In doubt, a text counts as one
/// that does.
///
/// A text names the patient when it holds, in any spelling (comparable_text.h), a word of Patient's Name, of Other
/// Patient Names, of the birth names or of the Responsible Person, in any of the groups of a name (alphabetic,
/// ideographic, phonetic); or Patient ID or one of Other Patient IDs, with or without the zeros with which it begins;
/// or the birth date, in numbers or with an English name of the month. Case, marks, and what stands between letters do
/// not matter. Where in the text a word is looked for depends on its length:
/// - three letters or more, four characters or more with digits, any word of another script: anywhere in the text;
/// - fewer characters with digits: unless a digit beside them makes another number of them;
/// - two letters: where a word begins or ends;
/// - one letter, of an ID alone: as a word.
class PatientNames {
 public:
  explicit PatientNames(DcmItem& data);
  /// Whether a text names the patient. @param text  as the data set has it, in its Specific Character Set
  bool are_in(std::string_view text) const;

 private:
  struct Secrets;
  std::shared_ptr<const Secrets> secrets_;
  std::string character_set_;
};

}  // namespace tetwarp
