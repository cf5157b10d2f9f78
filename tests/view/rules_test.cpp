// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/server/rules.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "deform/errors.h"

namespace tetwarp::viewer {
namespace {

TEST(ViewRules, ATokenIsAnotherOneEachTime) {
  std::set<std::string> seen;
  for (int n = 0; n < 100; ++n) {
    const std::string token = make_token();
    EXPECT_EQ(token.size(), 64u);
    EXPECT_EQ(token.find_first_not_of("0123456789abcdef"), std::string::npos);
    EXPECT_TRUE(seen.insert(token).second);
  }
}

TEST(ViewRules, OnlyTheWholeSecretIsTheSecret) {
  const std::string secret = make_token();
  EXPECT_TRUE(is_same_secret(secret, secret));
  EXPECT_FALSE(is_same_secret("", secret));
  EXPECT_FALSE(is_same_secret(secret.substr(1), secret));
  EXPECT_FALSE(is_same_secret(secret + "0", secret));
  for (std::size_t n = 0; n < secret.size(); ++n) {
    std::string other = secret;
    other[n] = other[n] == '0' ? '1' : '0';
    EXPECT_FALSE(is_same_secret(other, secret)) << n;
  }
}

TEST(ViewRules, APlainNameIsThatOfAFileInTheFolder) {
  for (const char* const name : {"a", "by-hand", "_x", "A_1-b"}) EXPECT_NO_THROW(require_plain_name(name)) << name;
  EXPECT_NO_THROW(require_plain_name(std::string(64, 'a')));
  using namespace std::string_view_literals;
  for (const std::string_view name :
       {""sv, "-a"sv, "a.b"sv, "../a"sv, "a/b"sv, "a\n"sv, "a\0b"sv, "\xc3\xa4"sv, "a b"sv})
    EXPECT_THROW(require_plain_name(name), InputError) << name;
  EXPECT_THROW(require_plain_name(std::string(65, 'a')), InputError);
}

TEST(ViewRules, ATokenThatWorksOnceIsReplacedByASecretOfItsPage) {
  Admission admission(true);
  const std::string first = admission.token();
  EXPECT_TRUE(admission.may_enter(first));
  EXPECT_TRUE(admission.may_enter(first));  // asking uses nothing up
  for (const std::string& wrong : {std::string(), first.substr(1), first + "0", make_token()}) {
    EXPECT_FALSE(admission.may_enter(wrong));
    EXPECT_EQ(admission.enter(wrong), "");
  }
  EXPECT_EQ(admission.token(), first);
  const std::string secret = admission.enter(first), second = admission.token();
  EXPECT_EQ(secret.size(), 64u);
  EXPECT_EQ((std::set<std::string>{first, secret, second}.size()), 3u);
  EXPECT_FALSE(admission.may_enter(first));
  EXPECT_EQ(admission.enter(first), "");
  EXPECT_FALSE(admission.may_enter(""));
  EXPECT_TRUE(admission.may_enter(secret));
  EXPECT_EQ(admission.enter(secret), "");  // it stays, and uses no token up
  EXPECT_EQ(admission.token(), second);
  const std::string other = admission.enter(second);
  EXPECT_TRUE(admission.may_enter(other));
  EXPECT_FALSE(admission.may_enter(secret));
}

TEST(ViewRules, ATokenThatStaysIsTheOnlySecret) {
  Admission admission(false);
  const std::string token = admission.token();
  EXPECT_FALSE(admission.may_enter(""));
  for (int n = 0; n < 3; ++n) {
    EXPECT_TRUE(admission.may_enter(token));
    EXPECT_EQ(admission.enter(token), "");
    EXPECT_EQ(admission.token(), token);
  }
}

TEST(ViewRules, OnlyTheNamesOfThisMachineAreItsHost) {
  for (const char* own : {"127.0.0.1:8000", "localhost:8000", "[::1]:8000"}) EXPECT_TRUE(is_own_host(own, 8000)) << own;
  for (const char* other : {"", "127.0.0.1", "127.0.0.1:80", "127.0.0.1:80000", "127.0.0.1:8000.evil.org", "evil.org",
                            "evil.org:8000", "localhost.evil.org:8000", "xlocalhost:8000", "LOCALHOST:8000",
                            "127.0.0.2:8000", "0.0.0.0:8000", "::1:8000", " 127.0.0.1:8000", "127.0.0.1:8000 "})
    EXPECT_FALSE(is_own_host(other, 8000)) << other;
}

TEST(ViewRules, OnlyPagesOfThisServerAreItsOrigin) {
  for (const char* own : {"http://127.0.0.1:8000", "http://localhost:8000", "http://[::1]:8000"})
    EXPECT_TRUE(is_own_origin(own, 8000)) << own;
  for (const char* other : {"", "null", "127.0.0.1:8000", "https://127.0.0.1:8000", "http://127.0.0.1:8001",
                            "http://evil.org", "http://evil.org:8000", "http://127.0.0.1:8000/", "file://",
                            "http://127.0.0.1:8000@evil.org", "HTTP://127.0.0.1:8000"})
    EXPECT_FALSE(is_own_origin(other, 8000)) << other;
}

TEST(ViewRules, EveryAnswerForbidsWhatThePageDoesNotNeed) {
  const auto value = [](const char* name, bool frames) {
    for (const auto& [key, text] : safety_headers(frames))
      if (key == name) return text;
    return std::string();
  };
  const std::string policy = value("Content-Security-Policy", false);
  EXPECT_EQ(policy.find("default-src 'none'"), 0u);
  EXPECT_NE(policy.find("frame-ancestors 'none'"), std::string::npos);
  EXPECT_EQ(policy.find("unsafe"), std::string::npos);
  EXPECT_EQ(policy.find('*'), std::string::npos);
  const std::string framed = value("Content-Security-Policy", true), who = "frame-ancestors ";
  EXPECT_EQ(framed.substr(framed.find(who) + who.size()), "http://127.0.0.1:* http://localhost:*");
  EXPECT_EQ(framed.substr(0, framed.find(who)), policy.substr(0, policy.find(who)));
  EXPECT_EQ(value("Cache-Control", false), "no-store");
  EXPECT_EQ(value("Referrer-Policy", false), "no-referrer");
  EXPECT_EQ(value("X-Content-Type-Options", false), "nosniff");
  EXPECT_EQ(value("Access-Control-Allow-Origin", false), "");
}

TEST(ViewRules, ALimitLetsABurstThroughAndThenItsRate) {
  RateLimit limit(10, 5);
  RateLimit::Clock::time_point now{std::chrono::hours(1)};
  int taken = 0;
  for (int n = 0; n < 100; ++n) taken += limit.take(now) ? 1 : 0;
  EXPECT_EQ(taken, 5);
  now += std::chrono::milliseconds(250);
  taken = 0;
  for (int n = 0; n < 100; ++n) taken += limit.take(now) ? 1 : 0;
  EXPECT_EQ(taken, 2);
  now += std::chrono::hours(1);
  taken = 0;
  for (int n = 0; n < 100; ++n) taken += limit.take(now) ? 1 : 0;
  EXPECT_EQ(taken, 5);
}

}  // namespace
}  // namespace tetwarp::viewer
