// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <filesystem>
#include <functional>
#include <stdexcept>
#include <string>

/// Writes a copy of a DICOM file with its data set changed, in the transfer syntax of the file.
inline void edit_copy(const std::filesystem::path& from, const std::filesystem::path& to,
                      const std::function<void(DcmDataset&)>& edit) {
  DcmFileFormat format;
  OFCondition result = format.loadFile(from.c_str());
  if (result.good()) result = format.loadAllDataIntoMemory();
  if (result.bad()) throw std::runtime_error(from.string() + ": " + result.text());
  edit(*format.getDataset());
  std::filesystem::create_directories(to.parent_path());
  result = format.saveFile(to.c_str(), format.getDataset()->getOriginalXfer());
  if (result.bad()) throw std::runtime_error(to.string() + ": " + result.text());
}

inline std::string text_value(DcmDataset& data, const DcmTagKey& tag) {
  OFString value;
  data.findAndGetOFStringArray(tag, value);
  return value.c_str();
}

/// Gives the object a SOP Instance UID of its own: the old one and a suffix.
inline void rename_instance(DcmDataset& data, const std::string& suffix) {
  const std::string uid = text_value(data, DCM_SOPInstanceUID).substr(0, 60 - suffix.size()) + "." + suffix;
  data.putAndInsertString(DCM_SOPInstanceUID, uid.c_str());
}
