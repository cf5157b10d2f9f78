// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/hash.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

using tetwarp::Sha256;
using tetwarp::uid_from_digest;

namespace {

std::span<const std::byte> bytes(std::string_view text) { return std::as_bytes(std::span(text)); }

Sha256::Digest digest_of(int first, int step) {
  Sha256::Digest digest;
  for (std::size_t i = 0; i < digest.size(); ++i)
    digest[i] = static_cast<std::byte>(first + step * static_cast<int>(i));
  return digest;
}

// Values of FIPS 180-4's examples (NIST CSRC, SHA256.pdf).
TEST(Sha256, GivesTheDigestsOfTheStandardsExamples) {
  EXPECT_EQ(Sha256().hex(), "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855");
  EXPECT_EQ(Sha256().add(bytes("abc")).hex(), "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Sha256().add(bytes("abcdbcdecdefdefgefghfghighijhijkijkljklmklmnlmnomnopnopq")).hex(),
            "248d6a61d20638b8e5c026930c3e6039a33ce45964ff2167f6ecedd419db06c1");
}

TEST(Sha256, BytesAddUpWhateverTheSplit) {
  EXPECT_EQ(Sha256().add(bytes("ab")).add(bytes("c")).hex(), Sha256().add(bytes("abc")).hex());
}

TEST(Sha256, TextsDoNotRunIntoEachOther) {
  EXPECT_NE(Sha256().add("ab").add("c").hex(), Sha256().add("a").add("bc").hex());
  EXPECT_NE(Sha256().add("").hex(), Sha256().hex());
}

TEST(Sha256, GoesOnAfterADigestWasAskedFor) {
  Sha256 hash;
  hash.add(bytes("ab"));
  EXPECT_EQ(hash.hex(), hash.hex());
  EXPECT_EQ(hash.add(bytes("c")).hex(), Sha256().add(bytes("abc")).hex());
}

TEST(Sha256, BlocksAreHashedByThemselvesWhateverTheThreads) {
  constexpr std::size_t kBlock = std::size_t{1} << 20;
  std::vector<std::byte> data(2 * kBlock + 17);
  for (std::size_t n = 0; n < data.size(); ++n) data[n] = static_cast<std::byte>(n * 2654435761U >> 13);
  Sha256 expected;
  for (std::size_t begin = 0; begin < data.size(); begin += kBlock) {
    const std::span<const std::byte> block = std::span(data).subspan(begin, std::min(kBlock, data.size() - begin));
    expected.add(Sha256().add(block).digest());
  }
  for (const int threads : {1, 2, 0}) EXPECT_EQ(Sha256().add_blocks(data, threads).hex(), expected.hex());
  EXPECT_EQ(Sha256().add_blocks({}).hex(), Sha256().hex());
}

TEST(Sha256, CanBeMoved) {
  Sha256 first;
  first.add(bytes("abc"));
  const Sha256 second = std::move(first);
  EXPECT_EQ(second.hex(), Sha256().add(bytes("abc")).hex());
}

// Expected: Python's uuid.UUID(bytes=..., version 8 and variant set by hand).int
TEST(UidFromDigest, IsTheDecimalValueOfAVersion8Uuid) {
  EXPECT_EQ(uid_from_digest(digest_of(0, 1)), "2.25.5233100606847278184134747173490191");
  EXPECT_EQ(uid_from_digest(digest_of(0, 0)), "2.25.604472133179351442128896");
}

TEST(UidFromDigest, IsAtMost44CharactersLong) {
  EXPECT_EQ(uid_from_digest(digest_of(255, 0)), "2.25.340282366920937934553716840013076889599");
  EXPECT_EQ(uid_from_digest(digest_of(255, 0)).size(), 44U);
}

}  // namespace
