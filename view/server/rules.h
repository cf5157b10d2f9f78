// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <chrono>
#include <cstdint>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

// What the viewer's server lets in. It listens on this machine alone, but every page of every browser here can reach
// it.
namespace tetwarp::viewer {

/// A secret of 256 random bits, 64 hexadecimal digits.
/// @throws Error where the system gives no random bits
std::string make_token();

/// Whether two texts are equal. The time does not depend on where they differ.
bool is_same_secret(std::string_view given, std::string_view secret);

/// Refuses a name that might be anything but that of a file in one folder.
/// @throws InputError unless it has up to 64 letters, digits, hyphens and underscores, and begins with no hyphen
void require_plain_name(std::string_view name);

/// Which pages may enter: those that know the token, or, where each token works once, the secret that its page was
/// told.
class Admission {
 public:
  /// @param once  whether a token works once
  explicit Admission(bool once) : once_(once), token_(make_token()) {}

  /// The token for the next page. From any thread.
  std::string token() const;
  /// Whether a page that says this may enter.
  bool may_enter(std::string_view said) const;
  /// A page that says this, and may, enters.
  /// @return  what it must say from now on, if that is something else; then what the page before it had to say counts
  ///          no more
  std::string enter(std::string_view said);

 private:
  const bool once_;
  mutable std::mutex mutex_;
  std::string token_;
  std::string secret_;  ///< of the page that used a token last; empty: none did
};

/// Whether a request names this server as its host, and nothing else: no page of another name may reach it, wherever
/// that name leads (DNS rebinding).
bool is_own_host(std::string_view host, std::uint16_t port);
/// Whether a page that opens a WebSocket comes from this server.
bool is_own_origin(std::string_view origin, std::uint16_t port);

/// The headers of every answer, names and values: what the page may load and who may frame it, and that nobody keeps
/// it.
/// @param frames  whether pages of this machine may show it in a frame
const std::vector<std::pair<std::string, std::string>>& safety_headers(bool frames);

/// Counts what a page sends, so that none can flood the server.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;
  /// @param per_second  messages  @param burst  that may come at once
  RateLimit(double per_second, double burst) : per_second_(per_second), burst_(burst), left_(burst) {}
  /// @return whether one more is within the limit
  bool take(Clock::time_point now);

 private:
  double per_second_, burst_, left_;
  Clock::time_point last_{};
};

}  // namespace tetwarp::viewer
