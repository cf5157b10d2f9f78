// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: the frames of multi-frame CT, which share one data set.
#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdatset.h>

#include <memory>
#include <set>
#include <string>
#include <vector>

namespace tetwarp {

/// Whether a SOP Class is Enhanced CT Image Storage, or Legacy Converted Enhanced CT Image Storage.
bool is_enhanced_ct(const std::string& sop_class_uid);

/// The frames of an Enhanced CT object (PS3.3 A.38, C.7.6.16), each as the data set that a classic file of this slice
/// would have.
///
/// Attributes that the CT Image IOD (A.3) has, too, are taken from the functional groups of the frame, else from the
/// shared ones, else from the top level of the file. Frame Type becomes Image Type, Frame Acquisition Number and Frame
/// Acquisition DateTime become those of the acquisition, Frame Comments become Image Comments, and Instance Number
/// counts the frames (of all instances of a concatenation). Attributes that a converter could not assign
/// (C.7.6.16.2.25) return to the top level, unless the file has them there already. Dimensions, concatenation, offset
/// tables and private groups are left out; Stack ID, Temporal Position Index, phases, and Dimension Index Values,
/// except those of the position, stay.
class EnhancedFrames {
 public:
  /// @param data  read up to Pixel Data or wholly; must live as long as this object, which refers to it
  explicit EnhancedFrames(DcmDataset& data);

  /// Why the frames cannot be told apart, with what was expected and found; empty if they can.
  const std::string& problem() const { return problem_; }
  /// The number of frames; 0 if there is a problem.
  int count() const { return static_cast<int>(frames_.size()); }
  /// The data set of a frame, without Pixel Data. One thread may call this at a time.
  std::unique_ptr<DcmDataset> slice(int frame) const;

 private:
  void list_frames(DcmDataset& data);
  void take_groups(DcmItem& groups, const DcmTagKey& unassigned, DcmItem& slice) const;
  void take_unassigned(DcmItem& attributes, DcmItem& slice) const;
  void put_contrast(DcmItem& groups, DcmItem& slice) const;
  void put_dimensions(DcmItem& slice) const;

  DcmDataset& data_;
  std::set<DcmTagKey> top_level_;  ///< attributes at the top level of the file
  DcmDataset common_;              ///< what every slice begins with, before its own functional groups are taken
  std::vector<DcmItem*> frames_;   ///< items of Per-Frame Functional Groups, one a frame
  std::vector<bool> is_place_;     ///< by dimension: whether it counts positions
  long first_number_ = 1;          ///< Instance Number of the first frame
  std::string problem_;
};

}  // namespace tetwarp
