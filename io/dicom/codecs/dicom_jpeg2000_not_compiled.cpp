// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/codecs/dicom_codecs.h"

namespace tetwarp {

bool decodes_jpeg_2000() { return false; }

std::vector<std::uint16_t> decode_jpeg_2000(std::span<const std::uint8_t>, const DicomFileHeader& header) {
  refuse_pixels(header, "JPEG 2000 is not in this build of Tetwarp, which has no OpenJPEG");
}

}  // namespace tetwarp
