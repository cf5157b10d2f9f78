// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <memory>
#include <span>
#include <string>

namespace tetwarp {

/// What lies under a name that is to be read, links followed.
enum class PathKind { nothing, file, folder };

/// The one place that decides what a reader is given.
/// @throws InputError for what is neither file nor folder: a pipe, a socket or a device may never come to an end; and,
/// in the system's words, where it does not say what is there: no right to look, a name too long, links in a circle
PathKind kind_at(const std::filesystem::path& path);
inline bool is_folder(const std::filesystem::path& path) { return kind_at(path) == PathKind::folder; }
inline bool is_file(const std::filesystem::path& path) { return kind_at(path) == PathKind::file; }

/// What std::filesystem threw, as a message of ours: the system's words, the path, what to do.
std::string message_of(const std::filesystem::filesystem_error& error);

/// The bytes of a file, from the first on. @throws InputError that says in the system's words why it cannot be read,
/// and what `kind_at` throws
std::ifstream opened(const std::filesystem::path& path);

/// A regular file, opened once. Small reads are served from one piece of 16 KiB, so that the header of a slice takes
/// one or two calls of the system, and a file that is no DICOM no more than its first piece.
class OpenedFile {
 public:
  /// Never throws for what is there: see `problem`. A pipe or a device is not waited for.
  explicit OpenedFile(std::filesystem::path path);
  ~OpenedFile();
  OpenedFile(const OpenedFile&) = delete;
  OpenedFile& operator=(const OpenedFile&) = delete;

  /// Why it cannot be read, in the system's words, also of a read that failed; empty if it can.
  const std::string& problem() const { return problem_; }
  const std::filesystem::path& path() const { return path_; }
  std::uint64_t size() const { return size_; }
  /// Fills `bytes` from an offset of the file.
  /// @return number of bytes that were read; fewer than there is room for at the end of the file, or after an error
  std::size_t read(std::uint64_t offset, std::span<std::byte> bytes);

 private:
  std::size_t read_directly(std::uint64_t offset, std::span<std::byte> bytes);

  std::filesystem::path path_;
  int file_;
  std::uint64_t size_ = 0;
  std::string problem_;
  std::unique_ptr<std::byte[]> piece_;
  std::uint64_t piece_offset_ = 0;
  std::size_t piece_bytes_ = 0;
};

}  // namespace tetwarp
