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

/// SHA-256 (FIPS 180-4) of the bytes that were added, in order.
class Sha256 {
 public:
  /// The 256 bits of a hash.
  using Digest = std::array<std::byte, 32>;

  /// The hash of nothing.
  Sha256();
  /// Frees the state.
  ~Sha256();
  /// Takes over the state of another hash.
  Sha256(Sha256&&) noexcept;
  /// Takes over the state of another hash.
  Sha256& operator=(Sha256&&) noexcept;

  /// Adds bytes.
  Sha256& add(std::span<const std::byte> bytes);
  /// Adds the length of a text and then its characters, so that ("ab", "c") and ("a", "bc") give different hashes.
  Sha256& add(std::string_view text);
  /// Adds the digests of consecutive blocks of 1 MiB (the last may be shorter), which are computed in parallel. It is
  /// meant for large arrays.
  /// @param bytes    the array
  /// @param threads  0: all that this process may use
  Sha256& add_blocks(std::span<const std::byte> bytes, int threads = 0);
  /// The hash of everything added so far; more may be added later.
  Digest digest() const;
  /// The hash of everything added so far as 64 lower-case hexadecimal digits.
  std::string hex() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// HMAC-SHA-256 (FIPS 198-1) of a message. Nobody without the key can compute it, or find the message by trying.
Sha256::Digest keyed_digest(std::span<const std::byte> key, std::string_view message);

/// The DICOM UID (PS3.5 B.2) of a digest: "2.25." and the decimal value of a version 8 UUID (RFC 9562) made from its
/// first 128 bits. It has at most 44 characters.
std::string uid_from_digest(const Sha256::Digest& digest);

}  // namespace tetwarp
