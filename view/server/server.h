// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>

#include "view/session/request.h"

namespace tetwarp::viewer {

/// Serves the page of the viewer to browsers on this machine, and talks with one page at a time.
///
/// It listens on 127.0.0.1, and on ::1 where there is one, and answers only those who name it as their host. A page
/// says the secret token in its first message, or is sent away. No text of a page becomes a path.
///
/// A token for a frame stands in the document that shows it, which may be kept. So where frames are allowed a token
/// works once: the page that says it is told a new secret, by which alone it may come back, and the next page needs
/// another token.
class Server {
 public:
  struct Setup {
    std::uint16_t port = 0;  ///< 0: one that is free
    std::string greeting;    ///< a message that each page gets first
    bool frames = false;  ///< whether pages of this machine may show the page in a frame, each with a token of its own
    /// Gets what a page asks for. Calls come from the thread of the server.
    std::function<void(Request)> ask;
    /// Gets whether a page looks.
    std::function<void(bool)> watch;
  };

  /// Begins to listen.
  /// @throws Error where the port is taken
  explicit Server(Setup setup);
  /// Closes all connections.
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// The port on which it listens.
  std::uint16_t port() const;
  /// What the next page that comes must know. It changes only where frames are allowed, whenever a page has used it.
  std::string token() const;

  // Messages to the page that looks, if one does. From any thread.

  /// @param replaces  whether an earlier text that was sent with this set, and is still waiting, is left out
  void send_text(std::string text, bool replaces = false);
  void send_bytes(std::string bytes);

 private:
  class Implementation;
  std::unique_ptr<Implementation> it_;
};

}  // namespace tetwarp::viewer
