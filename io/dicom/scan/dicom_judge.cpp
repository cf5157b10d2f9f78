// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcuid.h>

#include <algorithm>
#include <cmath>

#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom/pixels/dicom_samples.h"
#include "io/dicom/scan/dicom_enhanced.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom_text.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

// The most rows or columns of a slice. CT has 512 to 4096 voxels an axis; the limit bounds what a compressed file may
// unfold to before memory is allocated for it.
constexpr int kLargestAxis = 16384;
constexpr std::uint64_t kLargestExpansion = 1000, kSmallFile = 1 << 20;

std::string where(const DicomFileHeader& header) { return ", " + shown(header); }

std::string missing_or_bad(const std::string& attribute, const DicomFileHeader& header, const std::string& expected) {
  return attribute + " is missing or malformed" + where(header) + "; expected " + expected +
         ", correct the file or leave it out";
}

bool is_localizer(const DicomFileHeader& header) {
  return std::any_of(header.image_type.begin(), header.image_type.end(),
                     [](const std::string& value) { return value == "LOCALIZER"; });
}

std::string encoding_problem(const DicomFileHeader& header) {
  const PixelFormat& pixels = header.pixels;
  if (!header.pixel_bytes && !header.private_compression.empty()) {
    return "pixels in the private compression " + known_code(header.private_compression, {"PMSCT_RLE1", "PMSCT_RGB1"}) +
           " of the attribute (07A1,1011) cannot be decoded" + where(header) +
           "; expected Pixel Data (7FE0,0010), export the series again without it";
  }
  if (!header.pixel_bytes) return "Pixel Data (7FE0,0010) is missing" + where(header) + "; export the file again";
  const auto coding = pixel_coding(header.transfer_syntax_uid);
  const bool is_compiled = coding != PixelCoding::jpeg_2000 || decodes_jpeg_2000();
  if (!coding || !is_compiled) {
    return "transfer syntax " + uid_with_name(header.transfer_syntax_uid) + " cannot be decoded" +
           (is_compiled ? "" : " by this build, which has no OpenJPEG") + where(header) +
           "; decompress the series first, for example with gdcmconv --raw";
  }
  const std::uint64_t needed = slice_bytes(pixels);
  const bool compressed = coding != PixelCoding::native || header.encoding == EXS_DeflatedLittleEndianExplicit;
  if (!compressed && *header.pixel_bytes < needed) {
    return "Pixel Data is truncated" + where(header) + ": expected " + std::to_string(needed) + " bytes, found " +
           std::to_string(*header.pixel_bytes) + "; copy the file again";
  }
  const std::uint64_t frames = header.frame ? static_cast<std::uint64_t>(pixels.frames) : 1;
  if (compressed && frames * needed > kLargestExpansion * header.file_bytes + kSmallFile) {
    return "Rows x Columns " + size_text(pixels) + (frames > 1 ? " of " + std::to_string(frames) + " frames" : "") +
           " cannot come from a file of " + std::to_string(header.file_bytes) + " bytes" + where(header) +
           "; copy the file again";
  }
  return {};
}

std::string layout_problem(const DicomFileHeader& header) {
  const PixelFormat& pixels = header.pixels;
  const auto found = [&](const std::string& what, const std::string& expected, const std::string& value) {
    return what + ", expected " + expected + ", found " + value + where(header) + "; convert the file first";
  };
  if (pixels.rows < 1 || pixels.columns < 1 || pixels.rows > kLargestAxis || pixels.columns > kLargestAxis) {
    return found("Rows x Columns", "1 to " + std::to_string(kLargestAxis), size_text(pixels));
  }
  if (pixels.samples != 1) return found("Samples per Pixel (0028,0002)", "1", std::to_string(pixels.samples));
  if (!pixels.photometric.empty() && !pixels.photometric.starts_with("MONOCHROME")) {
    return found(
        "Photometric Interpretation (0028,0004)", "MONOCHROME2",
        known_code(pixels.photometric, {"PALETTE COLOR", "RGB", "HSV", "ARGB", "CMYK", "YBR_FULL", "YBR_FULL_422",
                                        "YBR_PARTIAL_422", "YBR_PARTIAL_420", "YBR_ICT", "YBR_RCT", "XYB"}));
  }
  if (!header.frame && pixels.frames != 1 && pixels.frames != 0) {
    return found("Number of Frames (0028,0008)", "1", pixels.frames < 0 ? "no number" : std::to_string(pixels.frames));
  }
  if (pixels.bits_allocated != 8 && pixels.bits_allocated != 16) {
    return found("Bits Allocated (0028,0100)", "8 or 16", std::to_string(pixels.bits_allocated));
  }
  const std::string problem = stored_bits_problem(pixels.bits_allocated, pixels.bits_stored, pixels.high_bit);
  if (!problem.empty()) return problem + where(header) + "; convert the file first";
  if (pixels.sign_word != 0 && pixels.sign_word != 1) {
    return found("Pixel Representation (0028,0103)", "0 or 1",
                 pixels.sign_word ? std::to_string(*pixels.sign_word) : "none");
  }
  return {};
}

/// Why HU cannot be computed; empty if they can. Without slope and intercept they are not known: 0 and -1024 are both
/// common intercepts, so neither is assumed. Where a table (Modality LUT) stands beside them, which PS3.3 C.11.1
/// forbids, it is not known which to take.
std::string rescale_problem(const DicomFileHeader& header) {
  const PixelFormat& pixels = header.pixels;
  if (pixels.has_modality_lut) {
    return "a Modality LUT Sequence (0028,3000)" + where(header) +
           "; expected Rescale Slope and Intercept alone, export the series again without it";
  }
  if (!pixels.slope || *pixels.slope == 0) {
    return missing_or_bad("Rescale Slope (0028,1053)", header, "a number other than 0");
  }
  if (!pixels.intercept) return missing_or_bad("Rescale Intercept (0028,1052)", header, "a number");
  return {};
}

/// The name of a UID, of transfer syntaxes in words; empty if it has none.
std::string name_of(const std::string& uid) {
  const DcmXfer syntax(uid.c_str());
  if (syntax.getXfer() != EXS_Unknown) return syntax.getXferName();
  if (const char* name = dcmFindNameOfUID(uid.c_str())) return name;
  return uid == kLabelMapStorage ? "LabelMapSegmentationStorage" : name_of_newer_syntax(uid);
}

}  // namespace

std::string uid_with_name(const std::string& uid) {
  const std::string found = name_of(uid);
  return found.empty() ? shown(uid) : found + " (" + shown(uid) + ")";
}

std::string kind_name(const std::string& sop_class_uid) {
  struct Word {
    const char *start, *word;  ///< what DCMTK's name of the class begins with, and the words that stand for it
  };
  static constexpr Word kWords[] = {
      {"SecondaryCapture", "a picture, of a screen for example"},
      {"Multiframe", "pictures, of a screen for example"},
      {"MRImage", "an MR image"},
      {"EnhancedMR", "MR images"},
      {"PositronEmission", "a PET image"},
      {"EnhancedPET", "PET images"},
      {"NuclearMedicine", "a nuclear medicine image"},
      {"Ultrasound", "an ultrasound image"},
      {"ComputedRadiography", "an X-ray image"},
      {"DigitalXRay", "an X-ray image"},
      {"DigitalMammography", "an X-ray image"},
      {"XRay", "an X-ray image"},
      {"RTDose", "a radiotherapy dose"},
      {"RTStructureSet", "contours of radiotherapy"},
      {"RTPlan", "a radiotherapy plan"},
      {"RTIonPlan", "a radiotherapy plan"},
      {"RTImage", "an image of radiotherapy"},
      {"Segmentation", "a segmentation"},
      {"LabelMapSegmentation", "a segmentation"},
      {"SpatialRegistration", "a registration"},
      {"DeformableSpatialRegistration", "a deformation"},
      {"GrayscaleSoftcopyPresentation", "display settings"},
      {"ColorSoftcopyPresentation", "display settings"},
      {"KeyObjectSelection", "a list of chosen images"},
      {"BasicTextSR", "a report"},
      {"EnhancedSR", "a report"},
      {"ComprehensiveSR", "a report"},
      {"XRayRadiationDoseSR", "a report of X-ray dose"},
      {"EncapsulatedPDF", "a PDF document"},
      {"RawData", "raw data of a scanner"},
  };
  const std::string name = name_of(sop_class_uid);
  const auto found = std::find_if(std::begin(kWords), std::end(kWords),
                                  [&](const Word& word) { return name.starts_with(word.start); });
  const std::string exact = uid_with_name(sop_class_uid);
  return found == std::end(kWords) ? exact : std::string(found->word) + ", " + exact;
}

std::string other_kind(const DicomFileHeader& header) {
  const std::string& kind = header.sop_class_uid;
  const bool is_ct = kind == UID_CTImageStorage || is_enhanced_ct(kind);
  if (!kind.empty() && !is_ct) return kind_name(kind) + ", expected CT Image Storage";
  if (is_localizer(header)) return "a localizer (scout) by its Image Type, not a slice";
  const bool placed = header.position && header.orientation && header.spacing;
  if (kind.empty() && !(header.modality == "CT" && placed)) {
    return "no SOP Class UID (0008,0016), and not Modality CT with a position in space either";
  }
  return {};
}

std::string geometry_problem(const DicomFileHeader& header) {
  if (!header.damage.empty()) return "damaged file" + where(header) + ": " + header.damage + "; copy it again";
  if (!header.no_frames.empty()) return header.no_frames + where(header) + "; export the file again";
  if (!header.position) return missing_or_bad("Image Position (0020,0032)", header, "three numbers");
  if (!header.orientation) return missing_or_bad("Image Orientation (0020,0037)", header, "six numbers");
  if (!header.spacing || !is_spacing(header.spacing->x) || !is_spacing(header.spacing->y)) {
    return missing_or_bad("Pixel Spacing (0028,0030)", header, "two numbers from 1e-6 to 1e6 mm");
  }
  if (const std::string problem = rotation_problem(*header.orientation); !problem.empty()) {
    return "Image Orientation (0020,0037) is no rotation" + where(header) + ": " + problem +
           "; correct the file or leave it out";
  }
  return {};
}

std::string rotation_problem(std::span<const double, 6> c) {
  const double row = std::hypot(c[0], c[1], c[2]), column = std::hypot(c[3], c[4], c[5]);
  const double across = c[0] * c[3] + c[1] * c[4] + c[2] * c[5];
  // 1e-3: cosines of three digits (.707) are round-off, anything worse is no rotation.
  if (std::abs(row - 1) <= 1e-3 && std::abs(column - 1) <= 1e-3 && std::abs(across) <= 1e-3) return {};
  return "expected lengths 1, 1 and product 0, found " + number(row) + ", " + number(column) + " and " + number(across);
}

std::string pixel_problem(const DicomFileHeader& header) {
  for (const auto& check : {layout_problem, encoding_problem, rescale_problem}) {
    if (std::string problem = check(header); !problem.empty()) return problem;
  }
  return {};
}

std::string excess_problem(const DicomFileHeader& header) {
  const PixelFormat& pixels = header.pixels;
  if (pixel_coding(header.transfer_syntax_uid) != PixelCoding::native || !header.pixel_bytes) return {};
  const auto frames = static_cast<std::uint64_t>(header.frame ? pixels.frames - *header.frame : 1);
  const std::uint64_t expected = frames * slice_bytes(pixels), row = expected / frames / std::uint64_t(pixels.rows);
  if (*header.pixel_bytes < expected + row) return {};
  return "more Pixel Data than Rows x Columns " + size_text(pixels) + (frames > 1 ? " of each frame" : "") +
         where(header) + ": expected " + std::to_string(expected) + " bytes, found " +
         std::to_string(*header.pixel_bytes) + "; correct the file or leave it out";
}

std::string size_text(const PixelFormat& pixels) {
  return std::to_string(pixels.rows) + " x " + std::to_string(pixels.columns);
}

std::uint64_t slice_bytes(const PixelFormat& pixels) {
  return std::uint64_t(pixels.rows) * std::uint64_t(pixels.columns) * std::uint64_t(pixels.bits_allocated / 8);
}

int stored_value(const PixelFormat& pixels, unsigned word) {
  return static_cast<int>(StoredBits(pixels.bits_stored, pixels.high_bit, pixels.is_signed).value(word));
}

double hu_of(const PixelFormat& pixels, int stored) { return *pixels.slope * stored + *pixels.intercept; }

std::optional<StoredRange> stored_padding(const PixelFormat& pixels) {
  if (!pixels.padding_word) return std::nullopt;
  const int smallest = pixels.is_signed ? -(1 << (pixels.bits_stored - 1)) : 0;
  const int largest = smallest + (1 << pixels.bits_stored) - 1;
  const auto value = [&](int word) {
    if (!pixels.is_signed) return word;
    // The word has the stored bits alone, without the sign above them.
    if (word > largest && word < 1 << pixels.bits_stored) return word - (1 << pixels.bits_stored);
    return static_cast<int>(static_cast<std::int16_t>(word));
  };
  int low = value(*pixels.padding_word);
  int high = value(pixels.padding_limit_word.value_or(*pixels.padding_word));
  if (low > high) std::swap(low, high);
  if (high < smallest || low > largest) return std::nullopt;
  return StoredRange{low, high};
}

std::optional<PaddingRange> padding_hu(const PixelFormat& pixels) {
  const auto stored = stored_padding(pixels);
  if (!stored) return std::nullopt;
  const auto hu = [&](int value) { return std::clamp(std::nearbyint(hu_of(pixels, value)), -32768.0, 32767.0); };
  const auto [low, high] = std::minmax({hu(stored->low), hu(stored->high)});
  return PaddingRange{low, high};
}

}  // namespace tetwarp
