// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what image_file.cpp, the formats and field_file.cpp share.
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include "io/image_file.h"

namespace tetwarp {

enum class ImageFormat : std::uint8_t { nifti, nrrd, mha };

/// The format that a suffix names, in upper or lower case.
std::optional<ImageFormat> image_format(const std::filesystem::path& path);

/// How it is known that a NIfTI file has vectors: its intent code states it (1006 or 1007, on the fifth axis), or the
/// caller declares it. Then three values are vectors on the fifth axis whatever the intent, and on the fourth, that of
/// time, as MRtrix and FSL write them.
enum class NiftiVectors : std::uint8_t { stated, declared };

/// How the voxels lie in the file.
struct StoredVoxels {
  std::uint64_t offset = 0;     ///< of the first byte (of the decompressed stream, for NIfTI)
  std::size_t value_bytes = 0;  ///< of one number
  bool encoded = false;         ///< compressed, or text
};

/// A volume file whose header was read; its voxels go straight into the caller's buffer.
class ImageReader {
 public:
  ImageReader(std::filesystem::path path, ImageHeader header, StoredVoxels stored)
      : path_(std::move(path)), header_(std::move(header)), stored_(stored) {}
  virtual ~ImageReader() = default;

  const ImageHeader& header() const { return header_; }
  const StoredVoxels& stored() const { return stored_; }
  std::size_t value_count() const;  ///< voxels times components
  /// Fills the buffer of `value_count()` values of the header's type: components side by side, i fastest, native byte
  /// order. @throws InputError for a file that is truncated or damaged
  virtual void read(std::span<std::byte> voxels) const = 0;

 protected:
  std::filesystem::path path_;
  ImageHeader header_;
  StoredVoxels stored_;
};

/// @throws InputError naming the file: missing, no regular file, empty, without the right to read it
void require_readable_file(const std::filesystem::path& path);

/// @throws InputError naming the file, unless the columns of the direction have length 1 and stand at right angles,
///         within what the formats' digits (float32 in NIfTI) can hold
void require_orthogonal(const Geometry& geometry, const std::string& file);

/// Reads and checks the header; a header that promises more than the file can hold is refused here, before anything is
/// allocated. @throws InputError as `read_image_header`
std::unique_ptr<ImageReader> open_image(const std::filesystem::path& path, NiftiFrame frame = NiftiFrame::sform,
                                        NiftiVectors vectors = NiftiVectors::stated);

}  // namespace tetwarp
