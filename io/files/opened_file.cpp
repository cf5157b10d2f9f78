// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/opened_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include "deform/errors.h"
#include "io/shown_text.h"

namespace tetwarp {

namespace {

constexpr std::size_t kPiece = 1 << 14;

}  // namespace

PathKind kind_at(const std::filesystem::path& path) {
  using std::filesystem::file_type;
  std::error_code error;
  const file_type type = std::filesystem::status(path, error).type();
  if (type == file_type::not_found) return PathKind::nothing;
  if (type == file_type::regular) return PathKind::file;
  if (type == file_type::directory) return PathKind::folder;
  require(type != file_type::none,
          "cannot be read (" + error.message() + "), " + shown(path) + "; check the name and your rights to it");
  throw InputError("neither a file nor a folder, " + shown(path) + "; name one of them");
}

std::string message_of(const std::filesystem::filesystem_error& error) {
  return "cannot be read (" + error.code().message() + "), " + shown(error.path1()) +
         "; check the name and your rights to it";
}

std::ifstream opened(const std::filesystem::path& path) {
  const bool folder = is_folder(path);
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  require(file.good() && !folder,
          "cannot be read (" + std::generic_category().message(folder ? EISDIR : errno) + "), " + shown(path));
  return file;
}

OpenedFile::OpenedFile(std::filesystem::path path)
    : path_(std::move(path)), file_(::open(path_.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  struct stat status {};
  if (file_ < 0 || ::fstat(file_, &status) != 0)
    problem_ = std::generic_category().message(errno);
  else if (!S_ISREG(status.st_mode))
    problem_ = "not a regular file";
  else
    size_ = static_cast<std::uint64_t>(status.st_size);
}

OpenedFile::~OpenedFile() {
  if (file_ >= 0) ::close(file_);
}

std::size_t OpenedFile::read(std::uint64_t offset, std::span<std::byte> bytes) {
  if (bytes.size() >= kPiece) return read_directly(offset, bytes);
  const bool there = offset >= piece_offset_ && offset + bytes.size() <= piece_offset_ + piece_bytes_;
  if (!there) {
    if (!piece_) piece_ = std::make_unique_for_overwrite<std::byte[]>(kPiece);
    piece_bytes_ = read_directly(offset, {piece_.get(), kPiece});
    piece_offset_ = offset;
  }
  const std::size_t begin = offset - piece_offset_;
  const std::size_t count = std::min(bytes.size(), piece_bytes_ - std::min(begin, piece_bytes_));
  std::copy_n(piece_.get() + begin, count, bytes.begin());
  return count;
}

std::size_t OpenedFile::read_directly(std::uint64_t offset, std::span<std::byte> bytes) {
  bytes = bytes.first(std::min<std::uint64_t>(bytes.size(), size_ - std::min(offset, size_)));
  std::size_t done = 0;
  while (done < bytes.size() && problem_.empty()) {
    const ssize_t count = ::pread(file_, bytes.data() + done, bytes.size() - done, static_cast<off_t>(offset + done));
    if (count < 0 && errno == EINTR) continue;
    if (count < 0) problem_ = std::generic_category().message(errno);
    if (count <= 0) break;
    done += static_cast<std::size_t>(count);
  }
  return done;
}

}  // namespace tetwarp
