// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_header.h"

#include <dcmtk/dcmdata/dcdict.h>
#include <dcmtk/dcmdata/dcrledrg.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <dcmtk/dcmjpeg/djdecode.h>
#include <dcmtk/dcmjpls/djdecode.h>
#include <dcmtk/oflog/oflog.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <span>

#include "io/dicom/codecs/dicom_codecs.h"
#include "io/dicom/scan/dicom_enhanced.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/dicom/scan/dicom_traits.h"
#include "io/dicom_text.h"
#include "io/hash.h"

namespace tetwarp {
namespace {

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> values(1);
  for (const char c : text) {
    if (c == '\\')
      values.emplace_back();
    else
      values.back() += c;
  }
  for (std::string& value : values) {
    const auto first = value.find_first_not_of(' ');
    const auto last = value.find_last_not_of(' ');
    value = first == std::string::npos ? "" : value.substr(first, last - first + 1);
  }
  return values;
}

/// How many digits a number has after the point: 3 for "1.250", -1 for "5E1" (tens).
int decimals_of(const std::string& text) {
  const auto exponent_at = text.find_first_of("eE");
  const std::string mantissa = text.substr(0, exponent_at);
  const auto point = mantissa.find('.');
  const int digits = point == std::string::npos ? 0 : static_cast<int>(mantissa.size() - point - 1);
  if (exponent_at == std::string::npos) return digits;
  return digits - static_cast<int>(decimal(text.substr(exponent_at + 1)).value_or(0));
}

}  // namespace

std::optional<std::vector<double>> numbers_of(DcmItem& item, const DcmTagKey& tag, std::size_t count) {
  const std::vector<std::string> texts = split(text_of(item, tag));
  if (texts.size() != count) return std::nullopt;
  std::vector<double> values;
  for (const std::string& text : texts) {
    const auto value = decimal(text);
    if (!value) return std::nullopt;
    values.push_back(*value);
  }
  return values;
}

namespace {

std::optional<double> decimal_of(DcmItem& item, const DcmTagKey& tag) {
  const auto values = numbers_of(item, tag, 1);
  return values ? std::optional(values->front()) : std::nullopt;
}

std::optional<int> integer_of(DcmItem& item, const DcmTagKey& tag) {
  const auto value = decimal_of(item, tag);
  if (!value || std::abs(*value) > 2e9) return std::nullopt;
  return static_cast<int>(*value);
}

/// The 16 bits of an attribute of VR US or SS, also where the file gives it another VR of numbers, words or bytes.
std::optional<int> word_of(DcmItem& item, const DcmTagKey& tag) {
  DcmElement* element = nullptr;
  Uint16 word = 0;
  Sint16 signed_word = 0;
  if (!is_at_most(item, tag, kLongestValue) || item.findAndGetElement(tag, element).bad()) return std::nullopt;
  if (element->getUint16(word).good()) return word;
  if (element->getSint16(signed_word).good()) return static_cast<Uint16>(signed_word);
  Uint8* bytes = nullptr;
  if (element->getUint8Array(bytes).good() && bytes && element->getLength() >= 2) return bytes[0] | bytes[1] << 8;
  const auto value = integer_of(item, tag);
  if (value && *value >= INT16_MIN && *value <= UINT16_MAX) return static_cast<Uint16>(*value);
  return std::nullopt;
}

PixelFormat pixel_format_of(DcmItem& data) {
  PixelFormat pixels;
  pixels.rows = word_of(data, DCM_Rows).value_or(0);
  pixels.columns = word_of(data, DCM_Columns).value_or(0);
  pixels.samples = word_of(data, DCM_SamplesPerPixel).value_or(1);
  pixels.bits_allocated = word_of(data, DCM_BitsAllocated).value_or(0);
  pixels.bits_stored = word_of(data, DCM_BitsStored).value_or(pixels.bits_allocated);
  pixels.high_bit = word_of(data, DCM_HighBit).value_or(pixels.bits_stored - 1);
  pixels.sign_word = word_of(data, DCM_PixelRepresentation);
  pixels.is_signed = pixels.sign_word == 1;
  pixels.photometric = text_of(data, DCM_PhotometricInterpretation);
  if (!text_of(data, DCM_NumberOfFrames).empty()) pixels.frames = integer_of(data, DCM_NumberOfFrames).value_or(-1);
  pixels.slope = decimal_of(data, DCM_RescaleSlope);
  pixels.intercept = decimal_of(data, DCM_RescaleIntercept);
  pixels.rescale_type = text_of(data, DCM_RescaleType);
  pixels.has_modality_lut = data.tagExists(DCM_ModalityLUTSequence);
  pixels.padding_word = word_of(data, DCM_PixelPaddingValue);
  pixels.padding_limit_word = word_of(data, DCM_PixelPaddingRangeLimit);
  return pixels;
}

void read_geometry(DcmItem& data, DicomFileHeader& header) {
  if (const auto position = numbers_of(data, DCM_ImagePositionPatient, 3)) {
    header.position = glm::dvec3((*position)[0], (*position)[1], (*position)[2]);
    const std::vector<std::string> texts = split(text_of(data, DCM_ImagePositionPatient));
    std::transform(texts.begin(), texts.end(), header.position_decimals.begin(), decimals_of);
  }
  if (const auto cosines = numbers_of(data, DCM_ImageOrientationPatient, 6)) {
    header.orientation.emplace();
    std::copy(cosines->begin(), cosines->end(), header.orientation->begin());
  }
  // Pixel Spacing is the distance of rows, then of columns (PS3.3 10.7.1.3).
  if (const auto spacing = numbers_of(data, DCM_PixelSpacing, 2))
    header.spacing = glm::dvec2((*spacing)[1], (*spacing)[0]);
  header.thickness = decimal_of(data, DCM_SliceThickness);
  header.slice_spacing = decimal_of(data, DCM_SpacingBetweenSlices);
}

/// Whether a file of at least `size` bytes that starts like this may be DICOM: it has the prefix "DICM", or a data set
/// that starts without one.
bool looks_like_dicom(const std::array<char, 132>& start, std::size_t size) {
  if (size == start.size() && std::memcmp(start.data() + 128, "DICM", 4) == 0) return true;
  if (size < 8) return false;
  const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(start[i]); };
  const bool little = (byte(0) == 2 || byte(0) == 8) && byte(1) == 0 && byte(3) == 0;
  const bool big = byte(0) == 0 && (byte(1) == 2 || byte(1) == 8) && byte(2) == 0;
  return little || big;
}

/// Why an object holds no image and is left out of the scan; empty for images and for what might be one.
std::string no_image_reason(const DicomFileHeader& header) {
  const bool is_ct = header.sop_class_uid == UID_CTImageStorage || is_enhanced_ct(header.sop_class_uid);
  if (header.sop_class_uid == UID_MediaStorageDirectoryStorage)
    return "a DICOM directory (DICOMDIR): what lies in the folder counts, not what it names";
  if (is_ct || header.pixels.rows != 0) return {};
  if (!header.sop_class_uid.empty()) return kind_name(header.sop_class_uid) + ", not an image";
  if (header.damage.empty()) return "DICOM without an image";
  return header.series_uid.empty() ? "damaged, or not DICOM: " + header.damage : std::string();
}

/// Looks at the first bytes of a file: DCMTK is given only what may be DICOM, for without the prefix it would take many
/// other files for a data set.
void sniff(OpenedFile& file, DicomFileHeader& header) {
  std::array<char, 132> start{};
  const std::size_t size = file.read(0, std::as_writable_bytes(std::span(start)));
  const bool blank =
      std::all_of(start.begin(), start.begin() + std::min<std::size_t>(size, 128), [](char c) { return c == 0; });
  if (!file.problem().empty()) {
    header.skip = "cannot be read: " + file.problem();
  } else if (size == 0) {
    header.skip = "an empty file";
  } else if (!looks_like_dicom(start, size)) {
    header.skip = blank ? "cut short: nothing but zeros where DICOM begins"
                        : "not DICOM: no prefix DICM at byte 128, no data set at the start";
  }
  header.broken = !header.skip.empty() && (blank || !file.problem().empty());
}

/// Registers DCMTK's decoders until the process ends, and then frees them: DCMTK frees none of them by itself.
class Decoders {
 public:
  Decoders() {
    DcmRLEDecoderRegistration::registerCodecs();
    DJDecoderRegistration::registerCodecs();
    DJLSDecoderRegistration::registerCodecs();
  }
  ~Decoders() {
    DJLSDecoderRegistration::cleanup();
    DJDecoderRegistration::cleanup();
    DcmRLEDecoderRegistration::cleanup();
  }
  Decoders(const Decoders&) = delete;
  Decoders& operator=(const Decoders&) = delete;
};

std::filesystem::path& dictionary_of_ours() {
  static std::filesystem::path path;
  return path;
}

/// Where DCMTK found none and the user named none. What cannot be read is refused by `prepare_dcmtk`.
void load_dictionary_of_ours() {
  const std::filesystem::path& path = dictionary_of_ours();
  if (path.empty() || dcmDataDict.isDictionaryLoaded() || std::getenv("DCMDICTPATH") != nullptr) return;
  dcmDataDict.wrlock().loadDictionary(path.c_str());
  dcmDataDict.wrunlock();
}

}  // namespace

void set_dicom_dictionary(const std::filesystem::path& path) { dictionary_of_ours() = path; }

void prepare_dcmtk() {
  static std::once_flag once;
  std::call_once(once, [] {
    OFLog::configure(OFLogger::OFF_LOG_LEVEL);
    load_dictionary_of_ours();
    dcmEnableUnknownVRConversion.set(OFTrue);  // standard attributes that were written as VR UN get their own VR
    static const Decoders decoders;
  });
  if (!dcmDataDict.isDictionaryLoaded()) {
    throw Error(
        "DCMTK's data dictionary is not found, without it DICOM is neither read nor written; "
        "install DCMTK, or set DCMDICTPATH to its dicom.dic");
  }
}

bool is_at_most(DcmItem& item, const DcmTagKey& tag, std::uint64_t bytes) {
  DcmElement* element = nullptr;
  return item.findAndGetElement(tag, element).bad() || element->getLengthField() <= bytes;
}

std::string text_of(DcmItem& item, const DcmTagKey& tag) {
  DcmElement* element = nullptr;
  OFString value;
  if (item.findAndGetElement(tag, element).bad() || element->getLengthField() > kLongestValue) return {};
  constexpr Uint32 kLong = 4096;  // for each value of a longer list of dates DCMTK would read the whole list again
  char* whole = nullptr;
  if (element->getLengthField() > kLong && dynamic_cast<DcmByteString*>(element)) {
    if (element->getString(whole).bad() || !whole) return {};
    value = whole;
  } else if (element->getOFStringArray(value).bad()) {
    return {};
  }
  std::string text(value.c_str());  // ends at a zero, which some writers use as padding
  const auto last = text.find_last_not_of(' ');
  return last == std::string::npos ? "" : text.substr(0, last + 1);
}

namespace {

/// The value of an attribute that is a UID. A value far longer than the 64 characters of PS3.5 9.1 is replaced by a
/// hash, which tells it apart and takes less memory.
std::string uid_of(DcmItem& item, const DcmTagKey& tag) {
  constexpr std::size_t kLongest = 128, kKept = 32;
  const std::string uid = text_of(item, tag);
  if (uid.size() <= kLongest) return uid;
  return uid.substr(0, kKept) + "... (" + std::to_string(uid.size()) + " characters, SHA-256 " +
         Sha256().add(uid).hex() + ")";
}

DicomFileHeader header_of(DcmDataset& data, DcmMetaInfo& meta, const std::filesystem::path& file) {
  DicomFileHeader header;
  header.file = file;
  header.transfer_syntax_uid = text_of(meta, DCM_TransferSyntaxUID);
  header.encoding = data.getOriginalXfer();
  if (header.transfer_syntax_uid.empty())
    header.transfer_syntax_uid = DcmXfer(header.encoding).getXferID();
  else
    header.encoding = DcmXfer(header.transfer_syntax_uid.c_str()).getXfer();
  header.sop_class_uid = uid_of(data, DCM_SOPClassUID);
  if (header.sop_class_uid.empty()) header.sop_class_uid = text_of(meta, DCM_MediaStorageSOPClassUID);
  if (header.sop_class_uid == UID_PrivateGenericFileSOPClass) header.sop_class_uid.clear();  // DCMTK's word for unknown
  header.sop_instance_uid = uid_of(data, DCM_SOPInstanceUID);
  header.series_uid = uid_of(data, DCM_SeriesInstanceUID);
  header.study_uid = uid_of(data, DCM_StudyInstanceUID);
  header.frame_of_reference_uid = uid_of(data, DCM_FrameOfReferenceUID);
  header.modality = text_of(data, DCM_Modality);
  header.image_type = split(text_of(data, DCM_ImageType));
  header.series_number = integer_of(data, DCM_SeriesNumber);
  header.instance_number = integer_of(data, DCM_InstanceNumber).value_or(0);
  header.private_compression = text_of(data, DcmTagKey(0x07a1, 0x1011));
  header.character_set = text_of(data, DCM_SpecificCharacterSet);
  header.traits = read_traits(data);
  header.secret_traits = traits_naming_patient(data, header.traits);
  read_geometry(data, header);
  header.pixels = pixel_format_of(data);
  return header;
}

}  // namespace

DicomFileHeader header_of(DcmFileFormat& format, const std::filesystem::path& file) {
  return header_of(*format.getDataset(), *format.getMetaInfo(), file);
}

DicomFileHeader header_of(DcmDataset& data) {
  DcmMetaInfo none;
  return header_of(data, none, {});
}

DicomFileHeader frame_header(DcmDataset& slice, const DicomFileHeader& whole, int frame) {
  DicomFileHeader header = header_of(slice);
  header.file = whole.file;
  header.frame = frame;
  header.encoding = whole.encoding;
  header.transfer_syntax_uid = whole.transfer_syntax_uid;
  header.file_bytes = whole.file_bytes;
  header.pixels.frames = whole.pixels.frames;
  header.pixel_bytes = whole.pixel_bytes;
  if (header.pixel_bytes && pixel_coding(header.transfer_syntax_uid) == PixelCoding::native) {
    const std::uint64_t before = slice_bytes(header.pixels) * static_cast<std::uint64_t>(frame);
    header.pixel_bytes = *header.pixel_bytes - std::min(*header.pixel_bytes, before);
  }
  return header;
}

namespace {

/// The headers of all frames; if the frames cannot be told apart, the one of the file.
std::vector<DicomFileHeader> headers_of_frames(DcmDataset& data, DicomFileHeader whole) {
  const EnhancedFrames frames(data);
  whole.no_frames = frames.problem();
  if (!whole.no_frames.empty()) return {std::move(whole)};
  std::vector<DicomFileHeader> headers;
  for (int frame = 0; frame < frames.count(); ++frame)
    headers.push_back(frame_header(*frames.slice(frame), whole, frame));
  return headers;
}

}  // namespace

std::vector<DicomFileHeader> read_dicom_headers(const std::filesystem::path& file) {
  prepare_dcmtk();
  DicomFileHeader header;
  header.file = file;
  const auto opened = std::make_shared<OpenedFile>(file);
  sniff(*opened, header);
  if (!header.skip.empty()) return {std::move(header)};

  DcmFileFormat format;
  const DicomRead read = parse_dicom(format, opened, DCM_PixelData, ERM_autoDetect, kLargestInflatedHeader);
  header = header_of(format, file);
  if (read.result.bad()) header.damage = read.result.text();
  header.file_bytes = opened->size();
  if (read.result.good() && read.rest > 0) header.pixel_bytes = read.rest;
  header.skip = no_image_reason(header);
  header.broken = !header.skip.empty() && !header.damage.empty() && header.sop_class_uid.empty();
  if (is_enhanced_ct(header.sop_class_uid) && header.damage.empty())
    return headers_of_frames(*format.getDataset(), std::move(header));
  return {std::move(header)};
}

}  // namespace tetwarp
