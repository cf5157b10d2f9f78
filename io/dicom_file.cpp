#include "io/dicom_file.h"

#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcmetinf.h>
#include <dcmtk/dcmdata/dcostrmb.h>
#include <dcmtk/dcmdata/dcuid.h>
#include <dcmtk/dcmdata/dcvrobow.h>
#include <fcntl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <span>
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

void write_bytes(int file, std::span<const std::byte> bytes, const std::filesystem::path& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(file, bytes.data(), bytes.size());
    if (count < 0 && errno == EINTR) continue;
    if (count <= 0) throw Error("cannot write " + path.string() + ": " + std::generic_category().message(errno));
    bytes = bytes.subspan(static_cast<std::size_t>(count));
  }
}

}  // namespace

std::vector<std::byte> encoded(DcmDataset& dataset) {
  check(dataset.computeGroupLengthAndPadding(EGL_withoutGL, EPD_withoutPadding, kSyntax, EET_ExplicitLength));
  return written(dataset, dataset.calcElementLength(kSyntax, EET_ExplicitLength));
}

void write_dicom_file(const std::filesystem::path& path, DcmDataset& dataset) {
  drop(dataset, DCM_SOPInstanceUID);
  const std::string uid = uid_from_digest(Sha256().add("tetwarp instance").add(encoded(dataset)).digest());
  put(dataset, DCM_SOPInstanceUID, uid);
  const std::vector<std::byte> meta = encoded_meta(text_of(dataset, DCM_SOPClassUID), uid);
  const std::vector<std::byte> data = encoded(dataset);

  const int file = ::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
  if (file < 0) throw Error("cannot create " + path.string() + ": " + std::generic_category().message(errno));
  try {
    write_bytes(file, meta, path);
    write_bytes(file, data, path);
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
