// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/pixels/dicom_plain_pixels.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcelem.h>
#include <dcmtk/dcmdata/dcxfer.h>

#include <string>

#include "deform/errors.h"
#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_text.h"

namespace tetwarp {

DcmElement& plain_pixels(DcmDataset& data, const std::filesystem::path& path, std::size_t expected, const char* kind) {
  const std::string file = shown(path), syntax = DcmXfer(data.getOriginalXfer()).getXferID();
  require(pixel_coding(syntax) == PixelCoding::native, file + " has compressed pixels, " + uid_with_name(syntax) +
                                                           "; " + kind + " must have plain ones: decompress it");
  DcmElement* element = nullptr;
  require(data.findAndGetElement(DCM_PixelData, element).good() && element, file + " has no Pixel Data (7FE0,0010)");
  const std::size_t found = element->getLengthField(), even = expected + expected % 2;
  require(found == even, file + " has " + std::to_string(found) + " bytes of Pixel Data (7FE0,0010), expected " +
                             std::to_string(even) + (found < even ? ": it is cut short" : ""));
  return *element;
}

}  // namespace tetwarp
