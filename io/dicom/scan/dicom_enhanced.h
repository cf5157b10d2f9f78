// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: multi-frame CT, whose frames share one data set.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

namespace tetwarp {

/// Whether files of this SOP Class are Enhanced CT Image Storage, or the Legacy Converted one.
bool is_enhanced_ct(const std::string& sop_class_uid);

/// The frames of an Enhanced CT object (PS3.3 A.38, C.7.6.16), each as the data set that a classic file of this slice
/// would have.
///
/// Attributes that the CT Image IOD (A.3) has too are taken from the functional groups: those of the frame, else the
/// shared ones, else from the top level of the file. Frame Type is Image Type then, Frame Acquisition Number and
/// DateTime are those of the acquisition, Frame Comments Image Comments, and Instance Number counts the frames (of all
/// instances of a concatenation). What a converter could not assign (C.7.6.16.2.25) is where it was, unless the file
/// has such an attribute at its top level. Dimensions, concatenation, offset tables and private groups are left out;
/// Stack ID, Temporal Position Index, phases, and Dimension Index Values but for those of the place stay.
class EnhancedFrames {
 public:
  /// @param data  read up to Pixel Data or wholly; is looked into as long as this lives
  explicit EnhancedFrames(DcmDataset& data);

  /// Why the frames cannot be told apart: what, expected and found; empty if they can.
  const std::string& problem() const { return problem_; }
  /// 0 with a problem.
  int count() const { return static_cast<int>(frames_.size()); }
  /// Without Pixel Data. Not for several threads at a time.
  std::unique_ptr<DcmDataset> slice(int frame) const;

 private:
  void list_frames(DcmDataset& data);
  void take_groups(DcmItem& groups, const DcmTagKey& unassigned, DcmItem& slice) const;
  void take_unassigned(DcmItem& attributes, DcmItem& slice) const;
  void put_contrast(DcmItem& groups, DcmItem& slice) const;
  void put_dimensions(DcmItem& slice) const;

  DcmDataset& data_;
  std::set<DcmTagKey> top_level_;  ///< of the file
  DcmDataset common_;              ///< of every slice, before its own groups are taken
  std::vector<DcmItem*> frames_;   ///< Per-Frame Functional Groups
  std::vector<bool> is_place_;     ///< per dimension: whether it counts positions
  long first_number_ = 1;          ///< Instance Number of the first frame
  std::string problem_;
};

}  // namespace tetwarp
