// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: removes from a data set what tells whom it shows.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <optional>
#include <string>

#include "io/deidentification.h"
#include "io/dicom/privacy/dicom_confidentiality.h"

namespace tetwarp {

/// Applies table E.1-1 of PS3.15 to whole data sets. It is stricter than the table, since no list of names is complete:
/// - What the dictionary of DCMTK does not know is removed, and so is what lies in an element of VR UN.
/// - Other free text (VR LT, ST, UT, UC, UR), persons' names (PN), application entities (AE) and bytes (OB, OW, ...)
///   are removed, and all texts of the groups 0010, 0012, 0032, 0038, 0040 and 0070: of patient, trial, order,
///   presentation.
/// - Dates and times (DA, DT, TM) that the table does not list are treated as those that it lists; UIDs that it does
///   not list are replaced unless the standard defines them.
/// What may not be missing in an item, or may not be empty, becomes empty or a dummy instead.
class Deidentifier {
 public:
  /// @param patient_id, study_uid  of the source. The number of days by which dates go back is chosen by the patient
  /// ID, and by the study UID where no patient is named
  Deidentifier(Deidentification how, const std::string& patient_id, const std::string& study_uid);

  /// The UID that replaces one of the source; the same UID if it is empty, registered in PS3.6, or UIDs are retained.
  std::string uid(const std::string& uid) const;
  /// The patient ID that replaces one of the source.
  std::string patient(const std::string& id) const;

  /// De-identifies a data set and says so in Patient Identity Removed and the attributes that belong to it (PS3.3
  /// C.7.1.1 and C.12.1).
  /// @param is_ct_image  the types of attributes of a CT image are known; for another object a value is chosen that is
  /// valid for every type
  void apply(DcmItem& dataset, bool is_ct_image) const;

  /// De-identifies an item of which no type of attribute is known. It is not marked as de-identified.
  void apply(DcmItem& item) const { apply_to(item, false); }

 private:
  std::string replacement(const std::string& uid) const;
  void apply_to(DcmItem& item, bool is_ct_image) const;
  Confidentiality action_on(DcmElement& element, AttributeType type) const;
  void carry_out(Confidentiality action, DcmItem& item, unsigned long n, AttributeType type) const;
  void put_dummies(DcmItem& item, unsigned long n) const;
  void replace_uids(DcmElement& element) const;
  bool shift(DcmElement& element) const;

  Deidentification how_;
  int days_back_;
};

/// De-identifies a data set by its own Patient ID and Study Instance UID. Without `how` nothing is done.
void deidentify(DcmItem& dataset, const std::optional<Deidentification>& how, bool is_ct_image);

}  // namespace tetwarp
