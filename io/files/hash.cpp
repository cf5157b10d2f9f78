// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/hash.h"

#include <openssl/evp.h>
#include <openssl/hmac.h>

#include <algorithm>
#include <cstdint>
#include <vector>

#include "deform/errors.h"
#include "io/parallel.h"

namespace tetwarp {

struct Sha256::State {
  EVP_MD_CTX* context = EVP_MD_CTX_new();

  State() = default;
  State(const State&) = delete;
  State& operator=(const State&) = delete;
  ~State() { EVP_MD_CTX_free(context); }
};

namespace {

void check(int openssl_result) {
  if (openssl_result != 1) throw Error("SHA-256 failed in OpenSSL; check that its default provider is usable");
}

}  // namespace

Sha256::Sha256() : state_(std::make_unique<State>()) {
  check(EVP_DigestInit_ex(state_->context, EVP_sha256(), nullptr));
}
Sha256::~Sha256() = default;
Sha256::Sha256(Sha256&&) noexcept = default;
Sha256& Sha256::operator=(Sha256&&) noexcept = default;

Sha256& Sha256::add(std::span<const std::byte> bytes) {
  check(EVP_DigestUpdate(state_->context, bytes.data(), bytes.size()));
  return *this;
}

Sha256& Sha256::add(std::string_view text) {
  std::array<std::byte, 8> length;  // little endian on every machine
  for (std::size_t i = 0; i < length.size(); ++i) length[i] = static_cast<std::byte>(text.size() >> (8 * i));
  return add(length).add(std::as_bytes(std::span(text)));
}

Sha256& Sha256::add_blocks(std::span<const std::byte> bytes, int threads) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  std::vector<Digest> digests((bytes.size() + kBlock - 1) / kBlock);
  for_each_index(digests.size(), threads, {}, [&](std::size_t n) {
    const std::span<const std::byte> rest = bytes.subspan(n * kBlock);
    digests[n] = Sha256().add(rest.first(std::min(kBlock, rest.size()))).digest();
  });
  return add(std::as_bytes(std::span(digests)));
}

Sha256::Digest Sha256::digest() const {
  State copy;
  check(EVP_MD_CTX_copy_ex(copy.context, state_->context));
  Digest digest;
  check(EVP_DigestFinal_ex(copy.context, reinterpret_cast<unsigned char*>(digest.data()), nullptr));
  return digest;
}

std::string Sha256::hex() const {
  constexpr char kDigits[] = "0123456789abcdef";
  std::string text;
  for (const std::byte b : digest()) {
    text += kDigits[std::to_integer<int>(b >> 4)];
    text += kDigits[std::to_integer<int>(b & std::byte{15})];
  }
  return text;
}

Sha256::Digest keyed_digest(std::span<const std::byte> key, std::string_view message) {
  Sha256::Digest digest;
  const auto* result = HMAC(EVP_sha256(), key.data(), static_cast<int>(key.size()),
                            reinterpret_cast<const unsigned char*>(message.data()), message.size(),
                            reinterpret_cast<unsigned char*>(digest.data()), nullptr);
  check(result ? 1 : 0);
  return digest;
}

std::string uid_from_digest(const Sha256::Digest& digest) {
  std::array<std::byte, 16> uuid;
  std::copy_n(digest.begin(), uuid.size(), uuid.begin());
  uuid[6] = (uuid[6] & std::byte{0x0f}) | std::byte{0x80};  // version 8: RFC 9562 section 5.8
  uuid[8] = (uuid[8] & std::byte{0x3f}) | std::byte{0x80};  // variant 10
  unsigned __int128 value = 0;
  for (const std::byte b : uuid) value = (value << 8) | std::to_integer<unsigned>(b);
  std::string decimal;
  for (; value != 0; value /= 10) decimal += static_cast<char>('0' + static_cast<int>(value % 10));
  std::reverse(decimal.begin(), decimal.end());
  return "2.25." + decimal;
}

}  // namespace tetwarp
