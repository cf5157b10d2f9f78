#include "io/dicom_file.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcmetinf.h>
#include <dcmtk/dcmdata/dcostrmb.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <dcmtk/dcmdata/dcvrobow.h>
#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <bit>
#include <cerrno>
#include <cstdio>
#include <system_error>

#include "deform/errors.h"
#include "deform/version.h"
#include "io/dicom_header.h"
#include "io/dicom_put.h"
#include "io/hash.h"

namespace tetwarp {

namespace {

constexpr E_TransferSyntax kSyntax = EXS_LittleEndianExplicit;
constexpr char kImplementationUid[] = "2.25.324787139072084515251162254271812699336";

void check(const OFCondition& condition) {
  if (condition.bad()) throw Error(std::string("cannot encode the DICOM data set: ") + condition.text());
}

/// What DcmObject::write makes of an object, in a buffer of `size` bytes or less.
template <class Object>
std::vector<std::byte> written(Object& object, std::size_t size) {
  std::vector<std::byte> bytes(size + size % 2);
  DcmOutputBufferStream stream(bytes.data(), static_cast<offile_off_t>(bytes.size()));
  object.transferInit();
  const OFCondition condition = object.write(stream, kSyntax, EET_ExplicitLength, nullptr);
  object.transferEnd();
  check(condition);
  void* buffer = nullptr;
  offile_off_t length = 0;
  stream.flushBuffer(buffer, length);
  bytes.resize(static_cast<std::size_t>(length));
  return bytes;
}

/// Preamble, "DICM" and group 0002.
std::vector<std::byte> encoded_meta(const std::string& sop_class, const std::string& sop_instance) {
  DcmMetaInfo meta;
  const Uint8 header_version[2] = {0, 1};
  check(meta.putAndInsertUint32(DCM_FileMetaInformationGroupLength, 0));
  check(meta.putAndInsertUint8Array(DCM_FileMetaInformationVersion, header_version, 2));
  put(meta, DCM_MediaStorageSOPClassUID, sop_class);
  put(meta, DCM_MediaStorageSOPInstanceUID, sop_instance);
  put(meta, DCM_TransferSyntaxUID, UID_LittleEndianExplicitTransferSyntax);
  put(meta, DCM_ImplementationClassUID, kImplementationUid);
  put(meta, DCM_ImplementationVersionName, ascii(std::string("TETWARP_") + version(), 16));
  check(meta.computeGroupLengthAndPadding(EGL_withGL, EPD_noChange, kSyntax, EET_ExplicitLength));
  return written(meta, meta.calcElementLength(kSyntax, EET_ExplicitLength));
}

/// Tag, value representation and length of Pixel Data (PS3.5 7.1.2), as `kSyntax` has them.
std::array<std::byte, 12> pixel_data_start(std::size_t value_bytes) {
  constexpr std::uint64_t kLargest = 0xfffffffe;
  require(value_bytes <= kLargest, "a slice of " + std::to_string(value_bytes) +
                                       " bytes; Pixel Data of DICOM hold at most " + std::to_string(kLargest));
  std::array<std::byte, 12> bytes{std::byte{0xe0}, std::byte{0x7f}, std::byte{0x10},
                                  std::byte{0},    std::byte{'O'},  std::byte{'W'}};
  for (std::size_t n = 0; n < 4; ++n) bytes[8 + n] = static_cast<std::byte>(value_bytes >> (8 * n));
  return bytes;
}

void write_bytes(int file, std::span<const std::byte> bytes, const std::filesystem::path& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw Error("cannot write " + path.string() + ": " + std::generic_category().message(errno));
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

/// Lets the disk begin while other slices are made; it is waited for when the series gets its name. A wish.
void begin_flush([[maybe_unused]] int file) {
#ifdef SYNC_FILE_RANGE_WRITE
  ::sync_file_range(file, 0, 0, SYNC_FILE_RANGE_WRITE);
#endif
}

}  // namespace

std::vector<std::byte> encoded(DcmDataset& dataset) {
  check(dataset.computeGroupLengthAndPadding(EGL_withoutGL, EPD_withoutPadding, kSyntax, EET_ExplicitLength));
  return written(dataset, dataset.calcElementLength(kSyntax, EET_ExplicitLength));
}

void write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset, std::span<const std::int16_t> voxels) {
  static_assert(std::endian::native == std::endian::little);
  const std::span<const std::byte> pixels = std::as_bytes(voxels);
  const std::array<std::byte, 12> pixel_start = pixel_data_start(pixels.size());
  drop(dataset, DCM_SOPInstanceUID);
  const std::vector<std::byte> nameless = encoded(dataset);
  const std::string uid =
      uid_from_digest(Sha256().add("tetwarp instance").add(nameless).add(pixel_start).add(pixels).digest());
  put(dataset, DCM_SOPInstanceUID, uid);
  std::vector<std::byte> start = encoded_meta(text_of(dataset, DCM_SOPClassUID), uid);
  const std::vector<std::byte> data = encoded(dataset);
  start.insert(start.end(), data.begin(), data.end());
  start.insert(start.end(), pixel_start.begin(), pixel_start.end());

  const int file = ::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
  if (file < 0) throw Error("cannot create " + path.string() + ": " + std::generic_category().message(errno));
  try {
    write_bytes(file, start, path);
    write_bytes(file, pixels, path);
    begin_flush(file);
  } catch (...) {
    ::close(file);
    throw;
  }
  if (::close(file) != 0) throw Error("cannot write " + path.string() + ": " + std::generic_category().message(errno));
}

std::string dicom_file_name(int instance_number) {
  char name[32];
  std::snprintf(name, sizeof name, "IM%05d.dcm", instance_number);
  return name;
}

}  // namespace tetwarp
