// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/files/gzip_inflate.h"

#include <fcntl.h>
#include <libdeflate.h>
#include <sys/stat.h>
#include <tbb/parallel_for.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <memory>
#include <new>
#include <optional>
#include <vector>

#include "deform/errors.h"
#include "deform/large_memory.h"
#include "io/files/gzip_member.h"
#include "io/files/gzip_pieces.h"

namespace tetwarp {
namespace {

/// A file that many threads may read at any place.
class InputFile {
 public:
  explicit InputFile(const std::filesystem::path& path) : descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC)) {
    struct stat status {};
    const bool open = descriptor_ >= 0 && ::fstat(descriptor_, &status) == 0;
    if (!open && descriptor_ >= 0) ::close(descriptor_);
    require(open, "cannot open, " + path.string());
    size_ = static_cast<std::uint64_t>(status.st_size);
  }
  ~InputFile() { ::close(descriptor_); }
  InputFile(const InputFile&) = delete;
  InputFile& operator=(const InputFile&) = delete;

  std::uint64_t size() const { return size_; }
  bool read(std::uint64_t offset, std::span<std::byte> bytes) const {
    while (!bytes.empty()) {
      const ssize_t got = ::pread(descriptor_, bytes.data(), bytes.size(), static_cast<off_t>(offset));
      if (got < 0 && errno == EINTR) continue;
      if (got <= 0) return false;
      offset += static_cast<std::uint64_t>(got);
      bytes = bytes.subspan(static_cast<std::size_t>(got));
    }
    return true;
  }

 private:
  int descriptor_;
  std::uint64_t size_ = 0;
};

/// Memory that is allocated but not filled with zeros.
class Buffer {
 public:
  explicit Buffer(std::size_t size) : bytes_(std::make_unique_for_overwrite<std::byte[]>(size)), size_(size) {}
  std::span<std::byte> bytes() const { return {bytes_.get(), size_}; }

 private:
  std::unique_ptr<std::byte[]> bytes_;
  std::size_t size_;
};

class Inflater {
 public:
  Inflater() : decompressor_(libdeflate_alloc_decompressor()) {
    if (!decompressor_) throw std::bad_alloc();
  }
  /// Inflates the member with which `packed` starts, and moves both spans past what was read and written.
  /// @return whether the member is whole and fits
  bool inflate(std::span<const std::byte>& packed, std::span<std::byte>& plain) const {
    std::size_t read = 0, written = 0;
    const libdeflate_result result = libdeflate_gzip_decompress_ex(decompressor_.get(), packed.data(), packed.size(),
                                                                   plain.data(), plain.size(), &read, &written);
    if (result != LIBDEFLATE_SUCCESS) return false;
    packed = packed.subspan(read);
    plain = plain.subspan(written);
    return true;
  }

 private:
  struct Free {
    void operator()(libdeflate_decompressor* decompressor) const { libdeflate_free_decompressor(decompressor); }
  };
  std::unique_ptr<libdeflate_decompressor, Free> decompressor_;
};

bool starts_like_member(std::span<const std::byte> bytes) {
  return bytes.size() >= 2 && bytes[0] == kMemberStart[0] && bytes[1] == kMemberStart[1];
}

bool is_zero(std::span<const std::byte> bytes) {
  return std::ranges::all_of(bytes, [](std::byte byte) { return byte == std::byte{0}; });
}

std::uint32_t u32(std::span<const std::byte> bytes) {
  std::uint32_t value = 0;
  for (std::size_t i = 0; i < 4; ++i) value |= std::to_integer<std::uint32_t>(bytes[i]) << 8 * i;
  return value;
}

struct Member {
  std::uint64_t begin = 0, plain_begin = 0;
  std::size_t bytes = 0, plain_bytes = 0;
};

/// The member at `begin`, if its header states its length. Time, level and system (bytes 4 to 9) may have any value.
std::optional<Member> stated_member(const InputFile& file, std::uint64_t begin, std::uint64_t plain_begin) {
  std::array<std::byte, kMemberHeaderBytes> header;
  std::array<std::byte, 4> plain_bytes;
  if (!file.read(begin, header)) return {};
  const bool ours = std::equal(kMemberStart.begin(), kMemberStart.begin() + 4, header.begin()) &&
                    std::equal(kMemberStart.begin() + 10, kMemberStart.end(), header.begin() + 10);
  const std::size_t bytes = u32(std::span(header).last(4));
  if (!ours || bytes < kMemberHeaderBytes + kMemberTrailerBytes || bytes > file.size() - begin) return {};
  if (!file.read(begin + bytes - 4, plain_bytes)) return {};
  return Member{begin, plain_begin, bytes, u32(plain_bytes)};
}

/// Whether the file has nothing but zeros from `begin` on.
bool ends_at(const InputFile& file, std::uint64_t begin) {
  std::array<std::byte, 4096> part;
  while (begin < file.size()) {
    const std::span rest = std::span(part).first(std::min<std::uint64_t>(part.size(), file.size() - begin));
    if (!file.read(begin, rest) || !is_zero(rest)) return false;
    begin += rest.size();
  }
  return true;
}

/// The file's members from `begin` on, if all state their size, are no larger than those that `write_gzip` makes, hold
/// `size` plain bytes and end the file; else none.
std::vector<Member> stated_members(const InputFile& file, std::uint64_t size, std::uint64_t begin) {
  std::vector<Member> members;
  std::uint64_t plain = 0;
  while (const auto member = stated_member(file, begin, plain)) {
    if (member->plain_bytes > kGzipPieceBytes) return {};
    members.push_back(*member);
    begin += member->bytes;
    plain += member->plain_bytes;
  }
  if (plain != size || !ends_at(file, begin)) return {};
  return members;
}

/// Plain bytes of a file whose members state their size: it keeps only where each member lies, and inflates it when it
/// is read.
class StatedMembers {
 public:
  StatedMembers(std::shared_ptr<const InputFile> file, std::vector<Member> members)
      : file_(std::move(file)), members_(std::move(members)) {}

  bool operator()(std::uint64_t offset, std::span<std::byte> bytes) const {
    auto member = std::ranges::upper_bound(members_, offset, {}, &Member::plain_begin) - 1;
    const Inflater inflater;
    for (; !bytes.empty(); ++member) {
      if (member == members_.end()) return false;
      const auto skipped = static_cast<std::size_t>(offset - member->plain_begin);
      if (skipped > member->plain_bytes) return false;
      const std::size_t n = std::min(bytes.size(), member->plain_bytes - skipped);
      if (n == member->plain_bytes) {
        if (!inflate(inflater, *member, bytes.first(n))) return false;
      } else {
        const Buffer whole(member->plain_bytes);
        if (!inflate(inflater, *member, whole.bytes())) return false;
        std::ranges::copy(whole.bytes().subspan(skipped, n), bytes.begin());
      }
      offset += n;
      bytes = bytes.subspan(n);
    }
    return true;
  }

 private:
  bool inflate(const Inflater& inflater, const Member& member, std::span<std::byte> plain) const {
    const Buffer buffer(member.bytes);
    if (!file_->read(member.begin, buffer.bytes())) return false;
    std::span<const std::byte> packed = buffer.bytes();
    return inflater.inflate(packed, plain) && packed.empty() && plain.empty();
  }

  std::shared_ptr<const InputFile> file_;
  std::vector<Member> members_;
};

bool read_whole(const InputFile& file, std::uint64_t begin, std::span<std::byte> bytes) {
  constexpr std::size_t kPart = std::size_t{4} << 20;
  std::atomic<bool> good = true;
  tbb::parallel_for(std::size_t{0}, (bytes.size() + kPart - 1) / kPart, [&](std::size_t i) {
    if (!file.read(begin + i * kPart, bytes.subspan(i * kPart, std::min(kPart, bytes.size() - i * kPart))))
      good = false;
  });
  return good;
}

/// Inflates one member after the other from `begin` on. @return whether they are undamaged, fill `plain` exactly, and
/// nothing but zeros follows
bool inflate_in_order(const InputFile& file, std::uint64_t begin, std::span<std::byte> plain) {
  if (begin > file.size()) return false;
  const Buffer buffer(static_cast<std::size_t>(file.size() - begin));
  if (!read_whole(file, begin, buffer.bytes())) return false;
  std::span<const std::byte> packed = buffer.bytes();
  const Inflater inflater;
  while (starts_like_member(packed)) {
    if (!inflater.inflate(packed, plain)) return false;
  }
  return plain.empty() && is_zero(packed);
}

}  // namespace

PlainBytes inflate_at_once(const std::filesystem::path& path, std::uint64_t size, std::uint64_t begin) {
  const auto file = std::make_shared<const InputFile>(path);
  if (auto members = stated_members(*file, size, begin); !members.empty())
    return StatedMembers(file, std::move(members));
  if (size > kInflateAtMost) return {};
  const auto held = std::make_shared<const Buffer>(static_cast<std::size_t>(size));
  prepare_memory(held->bytes(), 0);  // by all threads, since only one inflates
  if (!inflate_in_order(*file, begin, held->bytes())) return {};
  return [held](std::uint64_t offset, std::span<std::byte> bytes) {
    const std::span<const std::byte> all = held->bytes();
    if (offset > all.size() || bytes.size() > all.size() - offset) return false;
    std::ranges::copy(all.subspan(static_cast<std::size_t>(offset), bytes.size()), bytes.begin());
    return true;
  };
}

}  // namespace tetwarp
