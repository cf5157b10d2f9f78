// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/derive/dicom_file.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcmetinf.h>
#include <dcmtk/dcmdata/dcostrmb.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <dcmtk/dcmdata/dcvrobow.h>
#include <fcntl.h>
#include <unistd.h>

#include <bit>
#include <cerrno>
#include <cstdio>
#include <initializer_list>
#include <system_error>

#include "deform/errors.h"
#include "deform/version.h"
#include "io/dicom/codecs/dicom_compress.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/hash.h"

namespace tetwarp {

namespace {

constexpr E_TransferSyntax kSyntax = EXS_LittleEndianExplicit;
constexpr char kImplementationUid[] = "2.25.324787139072084515251162254271812699336";

void check(const OFCondition& condition) {
  if (condition.bad()) throw Error(std::string("cannot encode the DICOM data set: ") + condition.text());
}

/// The bytes that DcmObject::write makes of an object. @param size  at least as many bytes
template <class Object>
std::vector<std::byte> written(Object& object, std::size_t size, E_TransferSyntax syntax = kSyntax) {
  std::vector<std::byte> bytes(size + size % 2);
  DcmOutputBufferStream stream(bytes.data(), static_cast<offile_off_t>(bytes.size()));
  object.transferInit();
  const OFCondition condition = object.write(stream, syntax, EET_ExplicitLength, nullptr);
  object.transferEnd();
  check(condition);
  void* buffer = nullptr;
  offile_off_t length = 0;
  stream.flushBuffer(buffer, length);
  bytes.resize(static_cast<std::size_t>(length));
  return bytes;
}

/// Pixel Data as they are written to a file.
struct PixelData {
  std::vector<std::byte> start;      ///< tag, value representation and length (PS3.5 7.1.2), as `kSyntax` has them
  std::vector<std::byte> frame;      ///< the compressed voxels; empty if they are not compressed
  std::span<const std::byte> value;  ///< `frame`, or the voxels where they lie
  std::vector<std::byte> end;
};

void append_pixel_data_start(std::vector<std::byte>& bytes, DicomWords words, std::uint64_t length) {
  append_number(bytes, 0x7fe0, 2);
  append_number(bytes, 0x0010, 2);
  for (const char c : {'O', words == DicomWords::bytes ? 'B' : 'W', '\0', '\0'})
    bytes.push_back(static_cast<std::byte>(c));
  append_number(bytes, length, 4);
}

PixelData native_pixel_data(std::span<const std::byte> value, DicomWords words) {
  constexpr std::uint64_t kLargest = 0xfffffffe;
  require(value.size() <= kLargest, "pixels of " + std::to_string(value.size()) +
                                        " bytes; Pixel Data of DICOM hold at most " + std::to_string(kLargest));
  PixelData data;
  data.value = value;
  if (value.size() % 2 != 0) append_number(data.end, 0, 1);
  append_pixel_data_start(data.start, words, value.size() + data.end.size());
  return data;
}

PixelData compressed_pixel_data(DcmDataset& dataset, std::span<const std::int16_t> voxels, DicomEncoding encoding) {
  constexpr std::uint64_t kUndefined = 0xffffffff;
  constexpr unsigned kItem = 0xe000, kEnd = 0xe0dd;
  PixelData data;
  Uint16 rows = 0, columns = 0;
  check(dataset.findAndGetUint16(DCM_Rows, rows));
  check(dataset.findAndGetUint16(DCM_Columns, columns));
  data.frame = compressed_frame(voxels, rows, columns, encoding);
  data.value = data.frame;
  append_pixel_data_start(data.start, DicomWords::bytes, kUndefined);
  append_item_start(data.start, kItem, 0);  // Basic Offset Table, empty
  append_item_start(data.start, kItem, data.value.size());
  append_item_start(data.end, kEnd, 0);
  return data;
}

void write_bytes(int file, std::span<const std::byte> bytes, const std::filesystem::path& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw Error("cannot write " + path.string() + ": " + std::generic_category().message(errno));
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

/// Asks the system to start writing to the disk while other slices are made; the program waits for the disk when the
/// series gets its name. If the system does not, nothing is lost but time.
void begin_flush([[maybe_unused]] int file) {
#ifdef SYNC_FILE_RANGE_WRITE
  ::sync_file_range(file, 0, 0, SYNC_FILE_RANGE_WRITE);
#endif
}

/// Writes a file whole. @param mode  O_EXCL: the file must not exist; O_TRUNC: an existing file is replaced
void write_file(const std::filesystem::path& path, int mode, std::initializer_list<std::span<const std::byte>> parts) {
  const int file = ::open(path.c_str(), O_CREAT | mode | O_WRONLY | O_CLOEXEC, 0666);
  if (file < 0) throw Error("cannot create " + path.string() + ": " + std::generic_category().message(errno));
  try {
    for (const std::span<const std::byte> part : parts) write_bytes(file, part, path);
    begin_flush(file);
  } catch (...) {
    ::close(file);
    throw;
  }
  if (::close(file) != 0) throw Error("cannot write " + path.string() + ": " + std::generic_category().message(errno));
}

}  // namespace

std::vector<std::byte> encoded(DcmDataset& dataset, E_TransferSyntax syntax) {
  check(dataset.computeGroupLengthAndPadding(EGL_withoutGL, EPD_withoutPadding, syntax, EET_ExplicitLength));
  return written(dataset, dataset.calcElementLength(syntax, EET_ExplicitLength), syntax);
}

void append_number(std::vector<std::byte>& bytes, std::uint64_t value, std::size_t count) {
  for (std::size_t n = 0; n < count; ++n) bytes.push_back(static_cast<std::byte>(value >> (8 * n)));
}

void append_item_start(std::vector<std::byte>& bytes, unsigned element, std::size_t length) {
  append_number(bytes, 0xfffe, 2);
  append_number(bytes, element, 2);
  append_number(bytes, length, 4);
}

std::vector<std::byte> encoded_meta(const std::string& sop_class, const std::string& sop_instance,
                                    const std::string& transfer_syntax) {
  DcmMetaInfo meta;
  const Uint8 header_version[2] = {0, 1};
  check(meta.putAndInsertUint32(DCM_FileMetaInformationGroupLength, 0));
  check(meta.putAndInsertUint8Array(DCM_FileMetaInformationVersion, header_version, 2));
  put(meta, DCM_MediaStorageSOPClassUID, sop_class);
  put(meta, DCM_MediaStorageSOPInstanceUID, sop_instance);
  put(meta, DCM_TransferSyntaxUID, transfer_syntax);
  put(meta, DCM_ImplementationClassUID, kImplementationUid);
  put(meta, DCM_ImplementationVersionName, ascii(std::string("TETWARP_") + version(), 16));
  check(meta.computeGroupLengthAndPadding(EGL_withGL, EPD_noChange, kSyntax, EET_ExplicitLength));
  return written(meta, meta.calcElementLength(kSyntax, EET_ExplicitLength));
}

namespace {

/// Gives the data set its UID and writes it with its pixels.
/// @param existing  what open(2) does with an existing file: O_EXCL, O_TRUNC
std::string write_with_pixels(const std::filesystem::path& path, int existing, DcmDataset& dataset, PixelData pixels,
                              DicomEncoding encoding) {
  static_assert(std::endian::native == std::endian::little);
  drop(dataset, DCM_SOPInstanceUID);
  Sha256 hash;
  hash.add("tetwarp instance").add(encoded(dataset)).add(pixels.start).add(pixels.value).add(pixels.end);
  // Unlike compressed voxels, the bytes hashed so far do not show deflation.
  if (encoding == DicomEncoding::deflated) hash.add(uid_of(encoding));
  const std::string uid = uid_from_digest(hash.digest());
  put(dataset, DCM_SOPInstanceUID, uid);
  std::vector<std::byte> start = encoded_meta(text_of(dataset, DCM_SOPClassUID), uid, uid_of(encoding));
  std::vector<std::byte> data = encoded(dataset);
  data.insert(data.end(), pixels.start.begin(), pixels.start.end());
  if (encoding == DicomEncoding::deflated) {
    data.insert(data.end(), pixels.value.begin(), pixels.value.end());
    data = deflated(data);
    pixels.value = {};
  }
  start.insert(start.end(), data.begin(), data.end());
  write_file(path, existing, {start, pixels.value, pixels.end});
  return uid;
}

}  // namespace

std::string write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset,
                             std::span<const std::int16_t> voxels, DicomEncoding encoding) {
  return write_with_pixels(path, O_EXCL, dataset,
                           is_encapsulated(encoding) ? compressed_pixel_data(dataset, voxels, encoding)
                                                     : native_pixel_data(std::as_bytes(voxels), DicomWords::of_16_bits),
                           encoding);
}

std::string write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset, std::span<const std::byte> pixels,
                             DicomWords words) {
  return write_with_pixels(path, O_TRUNC, dataset, native_pixel_data(pixels, words), DicomEncoding::uncompressed);
}

std::string write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset) {
  constexpr E_TransferSyntax kImplicit = EXS_LittleEndianImplicit;
  drop(dataset, DCM_SOPInstanceUID);
  const std::string uid = uid_from_digest(Sha256().add("tetwarp instance").add(encoded(dataset, kImplicit)).digest());
  put(dataset, DCM_SOPInstanceUID, uid);
  const std::vector<std::byte> start =
      encoded_meta(text_of(dataset, DCM_SOPClassUID), uid, UID_LittleEndianImplicitTransferSyntax);
  write_file(path, O_TRUNC, {start, encoded(dataset, kImplicit)});
  return uid;
}

std::string dicom_file_name(int instance_number) {
  char name[32];
  std::snprintf(name, sizeof name, "IM%05d.dcm", instance_number);
  return name;
}

}  // namespace tetwarp
