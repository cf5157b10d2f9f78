// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/server/rules.h"

#include <sys/random.h>

#include <algorithm>
#include <array>

#include "deform/errors.h"

namespace tetwarp::viewer {

namespace {

constexpr std::string_view kHosts[] = {"127.0.0.1", "localhost", "[::1]"};

std::vector<std::pair<std::string, std::string>> headers_for(const std::string& ancestors) {
  return {{"Content-Security-Policy",
           "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
           "base-uri 'none'; form-action 'none'; frame-ancestors " +
               ancestors},
          {"Cache-Control", "no-store"},
          {"X-Content-Type-Options", "nosniff"},
          {"Referrer-Policy", "no-referrer"},
          {"Cross-Origin-Resource-Policy", "same-origin"},
          {"Cross-Origin-Opener-Policy", "same-origin"}};
}

}  // namespace

void require_plain_name(std::string_view name) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_";
  require(!name.empty() && name.size() <= 64 && name.front() != '-' &&
              name.find_first_not_of(kPlain) == std::string_view::npos,
          "a name has letters, digits, hyphens and underscores, up to 64 of them");
}

std::string make_token() {
  std::array<unsigned char, 32> random{};
  if (getrandom(random.data(), random.size(), 0) != static_cast<ssize_t>(random.size()))
    throw Error("the system gives no random numbers for the secret of the page");
  std::string token;
  for (const unsigned char byte : random) {
    token += "0123456789abcdef"[byte >> 4];
    token += "0123456789abcdef"[byte & 15];
  }
  return token;
}

bool is_same_secret(std::string_view given, std::string_view secret) {
  unsigned different = given.size() == secret.size() ? 0 : 1;
  for (std::size_t n = 0; n < secret.size(); ++n) {
    const char one = n < given.size() ? given[n] : '\0';
    different |= static_cast<unsigned char>(one ^ secret[n]);
  }
  return different == 0;
}

std::string Admission::token() const {
  const std::lock_guard lock(mutex_);
  return token_;
}

bool Admission::may_enter(std::string_view said) const {
  const std::lock_guard lock(mutex_);
  const bool knows_token = is_same_secret(said, token_);
  const bool knows_secret = !secret_.empty() && is_same_secret(said, secret_);
  return knows_token || knows_secret;
}

std::string Admission::enter(std::string_view said) {
  const std::lock_guard lock(mutex_);
  if (!once_ || !is_same_secret(said, token_)) return {};
  token_ = make_token();
  secret_ = make_token();
  return secret_;
}

bool is_own_host(std::string_view host, std::uint16_t port) {
  return std::any_of(std::begin(kHosts), std::end(kHosts),
                     [&](std::string_view one) { return host == std::string(one) + ":" + std::to_string(port); });
}

bool is_own_origin(std::string_view origin, std::uint16_t port) {
  constexpr std::string_view kScheme = "http://";
  return origin.substr(0, kScheme.size()) == kScheme && is_own_host(origin.substr(kScheme.size()), port);
}

const std::vector<std::pair<std::string, std::string>>& safety_headers(bool frames) {
  static const auto alone = headers_for("'none'");
  // Browsers know no address of IPv6 here.
  static const auto framed = headers_for("http://127.0.0.1:* http://localhost:*");
  return frames ? framed : alone;
}

bool RateLimit::take(Clock::time_point now) {
  if (last_ != Clock::time_point{}) {
    const double seconds = std::chrono::duration<double>(now - last_).count();
    left_ = std::min(burst_, left_ + std::max(0.0, seconds) * per_second_);
  }
  last_ = now;
  if (left_ < 1) return false;
  left_ -= 1;
  return true;
}

}  // namespace tetwarp::viewer
