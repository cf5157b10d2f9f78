// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/codecs/dicom_codecs.h"

#include <algorithm>
#include <array>

#include "deform/errors.h"

namespace tetwarp {
namespace {

struct Syntax {
  const char* uid;
  std::optional<PixelCoding> coding;
  bool lossy = false;
  const char* newer_name = "";
};

constexpr std::array kSyntaxes = {
    Syntax{UID_LittleEndianImplicitTransferSyntax, PixelCoding::native},
    Syntax{UID_LittleEndianExplicitTransferSyntax, PixelCoding::native},
    Syntax{UID_BigEndianExplicitTransferSyntax, PixelCoding::native},
    Syntax{UID_DeflatedExplicitVRLittleEndianTransferSyntax, PixelCoding::native},
    Syntax{UID_RLELosslessTransferSyntax, PixelCoding::rle},
    Syntax{UID_JPEGProcess1TransferSyntax, PixelCoding::jpeg, true},
    Syntax{UID_JPEGProcess2_4TransferSyntax, PixelCoding::jpeg, true},
    Syntax{UID_JPEGProcess6_8TransferSyntax, PixelCoding::jpeg, true},
    Syntax{UID_JPEGProcess10_12TransferSyntax, PixelCoding::jpeg, true},
    Syntax{UID_JPEGProcess14TransferSyntax, PixelCoding::jpeg},
    Syntax{UID_JPEGProcess14SV1TransferSyntax, PixelCoding::jpeg},
    Syntax{UID_JPEGLSLosslessTransferSyntax, PixelCoding::jpeg_ls},
    Syntax{UID_JPEGLSLossyTransferSyntax, PixelCoding::jpeg_ls, true},
    Syntax{UID_JPEG2000LosslessOnlyTransferSyntax, PixelCoding::jpeg_2000},
    Syntax{UID_JPEG2000TransferSyntax, PixelCoding::jpeg_2000, true},
    Syntax{"1.2.840.10008.1.2.4.201", PixelCoding::jpeg_2000, false,
           "High-Throughput JPEG 2000 Image Compression (Lossless Only)"},
    Syntax{"1.2.840.10008.1.2.4.202", PixelCoding::jpeg_2000, false,
           "High-Throughput JPEG 2000 with RPCL Options Image Compression (Lossless Only)"},
    Syntax{"1.2.840.10008.1.2.4.203", PixelCoding::jpeg_2000, true, "High-Throughput JPEG 2000 Image Compression"},
    Syntax{"1.2.840.10008.1.2.1.98", std::nullopt, false, "Encapsulated Uncompressed Explicit VR Little Endian"},
    Syntax{"1.2.840.10008.1.2.4.110", std::nullopt, false, "JPEG XL Lossless"},
    Syntax{"1.2.840.10008.1.2.4.111", std::nullopt, true, "JPEG XL JPEG Recompression"},
    Syntax{"1.2.840.10008.1.2.4.112", std::nullopt, true, "JPEG XL"},
    Syntax{"1.2.840.10008.1.2.8.1", std::nullopt, false, "Deflated Image Frame Compression"},
};

const Syntax* find(const std::string& uid) {
  const auto found = std::find_if(kSyntaxes.begin(), kSyntaxes.end(), [&](const Syntax& s) { return uid == s.uid; });
  return found == kSyntaxes.end() ? nullptr : &*found;
}

}  // namespace

std::optional<PixelCoding> pixel_coding(const std::string& transfer_syntax_uid) {
  const Syntax* syntax = find(transfer_syntax_uid);
  return syntax ? syntax->coding : std::nullopt;
}

bool is_lossy(const std::string& transfer_syntax_uid) {
  const Syntax* syntax = find(transfer_syntax_uid);
  return syntax && syntax->lossy;
}

std::string name_of_newer_syntax(const std::string& transfer_syntax_uid) {
  const Syntax* syntax = find(transfer_syntax_uid);
  return syntax ? syntax->newer_name : "";
}

void refuse_pixels(const DicomFileHeader& header, const std::string& reason) {
  throw InputError("pixel data cannot be decoded, " + shown(header) + ": " + reason +
                   "; copy or export the file again");
}

}  // namespace tetwarp
