#include "io/dicom_bytes.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <cerrno>
#include <cstring>
#include <optional>

#include "deform/errors.h"
#include "io/dicom_stream.h"

namespace tetwarp {
namespace {

/// A file that is open for reading.
class OpenFile {
 public:
  explicit OpenFile(const std::filesystem::path& path)
      : path_(path), file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    require(file_ >= 0, refusal());
  }
  ~OpenFile() { ::close(file_); }
  OpenFile(const OpenFile&) = delete;
  OpenFile& operator=(const OpenFile&) = delete;

  std::size_t size() const {
    struct stat status {};
    require(::fstat(file_, &status) == 0 && S_ISREG(status.st_mode), refusal());
    return static_cast<std::size_t>(status.st_size);
  }
  /// Up to `bytes.size()` of the next bytes; less at the end of the file.
  std::size_t read(std::span<std::byte> bytes) const {
    std::size_t done = 0;
    while (done < bytes.size()) {
      const ssize_t count = ::read(file_, bytes.data() + done, bytes.size() - done);
      if (count < 0 && errno == EINTR) continue;
      require(count >= 0, refusal());
      if (count == 0) break;
      done += static_cast<std::size_t>(count);
    }
    return done;
  }

 private:
  std::string refusal() const {
    return "cannot be read, " + path_.string() + ": " + std::strerror(errno) + "; check the file";
  }

  const std::filesystem::path& path_;
  int file_;
};

bool is_little_endian(E_TransferSyntax encoding) {
  return encoding == EXS_LittleEndianExplicit || encoding == EXS_LittleEndianImplicit;
}

/// Bytes that the value of Pixel Data has by its own length field, which ends at `at` (PS3.5 7.1); none for what DCMTK
/// has to look at: other value representations, lengths that are undefined or odd.
std::optional<std::size_t> native_length(std::span<const std::byte> bytes, std::size_t at, E_TransferSyntax encoding) {
  const auto byte = [&](std::size_t back) { return std::to_integer<std::uint32_t>(bytes[at - back]); };
  const auto starts_with = [&](std::size_t back, const std::array<std::uint32_t, 4>& tag) {
    for (std::size_t n = 0; n < tag.size(); ++n) {
      if (byte(back - n) != tag[n]) return false;
    }
    return true;
  };
  constexpr std::array<std::uint32_t, 4> pixel_data{0xe0, 0x7f, 0x10, 0x00}, words{'O', 'W', 0, 0};
  const bool known = encoding == EXS_LittleEndianExplicit
                         ? at >= 12 && starts_with(12, pixel_data) && starts_with(8, words)
                         : at >= 8 && starts_with(8, pixel_data);
  if (!known) return std::nullopt;
  const std::uint32_t length = byte(4) | byte(3) << 8 | byte(2) << 16 | byte(1) << 24;
  return length % 2 == 0 ? std::optional<std::size_t>(length) : std::nullopt;
}

/// The attributes before Pixel Data, if these are words that end the file, 16 bits each.
std::optional<ParsedSlice> parse_native(std::span<const std::byte> bytes, const std::filesystem::path& file) {
  static_assert(std::endian::native == std::endian::little);
  ParsedSlice slice;
  slice.format = std::make_unique<DcmFileFormat>();
  const DicomRead read = parse_dicom(*slice.format, bytes, DCM_PixelData);
  if (read.result.bad() || read.rest == 0 || read.rest >= bytes.size()) return std::nullopt;
  const std::size_t at = bytes.size() - read.rest;
  slice.header = header_of(*slice.format, file);
  const E_TransferSyntax encoding = slice.header.encoding;
  if (!is_little_endian(encoding) || slice.format->getDataset()->getOriginalXfer() != encoding) return std::nullopt;
  const auto length = native_length(bytes, at, encoding);
  const std::uint64_t needed = slice_bytes(slice.header.pixels);
  if (slice.header.pixels.bits_allocated != 16 || length != bytes.size() - at || needed == 0 || *length < needed)
    return std::nullopt;
  slice.header.pixel_bytes = *length;
  slice.native = bytes.subspan(at, needed);
  return slice;
}

/// Bytes of Pixel Data that are there; compressed: of the file.
std::optional<std::uint64_t> pixel_bytes_of(DcmDataset& data, std::uint64_t file_bytes) {
  DcmElement* element = nullptr;
  if (data.findAndGetElement(DCM_PixelData, element).bad()) return std::nullopt;
  return element->getLengthField() == DCM_UndefinedLength ? file_bytes : element->getLength();
}

}  // namespace

std::span<const std::byte> FileBuffer::read(const std::filesystem::path& file) {
  const OpenFile open(file);
  const std::size_t size = open.size();
  if (room_ < size) {
    room_ = std::max(size, 2 * room_);
    bytes_ = std::make_unique_for_overwrite<std::byte[]>(room_);
  }
  const std::span<std::byte> bytes(bytes_.get(), size);
  require(open.read(bytes) == size, "cannot be read whole, " + file.string() + "; check the file");
  return bytes;
}

ParsedSlice parse_slice(std::span<const std::byte> bytes, const std::filesystem::path& file) {
  std::optional<ParsedSlice> native = parse_native(bytes, file);
  ParsedSlice slice;
  if (native) {
    slice = std::move(*native);
  } else {
    slice.format = std::make_unique<DcmFileFormat>();
    const OFCondition result = parse_dicom(*slice.format, bytes, DCM_UndefinedTagKey).result;
    require(result.good(),
            "truncated or damaged file, " + file.string() + ": " + result.text() + "; copy the file again");
    slice.header = header_of(*slice.format, file);
    slice.header.pixel_bytes = pixel_bytes_of(*slice.format->getDataset(), bytes.size());
  }
  slice.header.file_bytes = bytes.size();
  return slice;
}

}  // namespace tetwarp
