// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <cstddef>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace tetwarp {

/// SHA-256 (FIPS 180-4) of what was added, in order.
class Sha256 {
 public:
  using Digest = std::array<std::byte, 32>;

  Sha256();
  ~Sha256();
  Sha256(Sha256&&) noexcept;
  Sha256& operator=(Sha256&&) noexcept;

  Sha256& add(std::span<const std::byte> bytes);
  /// Adds the length and then the characters, so that ("ab", "c") and ("a", "bc") differ.
  Sha256& add(std::string_view text);
  /// Adds the digests of consecutive blocks of 1 MiB (the last may be shorter), which are found in parallel: for large
  /// arrays. @param threads  0: all that this process may use
  Sha256& add_blocks(std::span<const std::byte> bytes, int threads = 0);
  Digest digest() const;    ///< of everything added so far; more may follow
  std::string hex() const;  ///< digest() in 64 lower-case hexadecimal digits

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// HMAC-SHA-256 (FIPS 198-1): nobody without the key can find it, or what it was made of by trying.
Sha256::Digest keyed_digest(std::span<const std::byte> key, std::string_view message);

/// DICOM UID of a digest: "2.25." and the decimal value of a version 8 UUID (RFC 9562) made of its first 128 bits
/// (PS3.5 B.2). At most 44 characters.
std::string uid_from_digest(const Sha256::Digest& digest);

}  // namespace tetwarp
