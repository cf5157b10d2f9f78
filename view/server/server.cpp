// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "view/server/server.h"

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <deque>
#include <thread>
#include <utility>

#include "deform/errors.h"
#include "view/server/messages.h"
#include "view/server/page_files.h"
#include "view/server/rules.h"

namespace tetwarp::viewer {

namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
using std::chrono::seconds;

constexpr std::size_t kMostHeaderBytes = 8192;
constexpr int kMostConnections = 32;
constexpr seconds kHttpTimeout(10), kIdleTimeout(20);
constexpr double kMessagesPerSecond = 1000, kMessagesAtOnce = 2000;
/// Messages that may wait for a page that reads slowly. Pictures and states do not pile up, so that only answers to
/// its own requests can.
constexpr std::size_t kMostWaiting = 1000;

class Connection;

/// What all connections share. Everything runs on one thread.
struct Hub {
  const Server::Setup setup = {};
  Admission admission = Admission(setup.frames);
  std::uint16_t port = 0;
  int connections = 0;
  std::shared_ptr<Connection> page = {};  ///< the one that looks
};

using HttpRequest = http::request<http::empty_body>;
using HttpAnswer = http::response<http::string_body>;

/// A refusal, after which the line is closed.
HttpAnswer refusal(const HttpRequest& request, const Hub& hub, http::status status, const char* why) {
  HttpAnswer answer(status, request.version());
  for (const auto& [name, value] : safety_headers(hub.setup.frames)) answer.set(name, value);
  answer.set(http::field::content_type, "text/plain; charset=utf-8");
  answer.keep_alive(false);
  answer.body() = why;
  answer.prepare_payload();
  return answer;
}

HttpAnswer answer_to(const HttpRequest& request, const Hub& hub) {
  const auto text = [](beast::string_view view) { return std::string_view(view.data(), view.size()); };
  if (request.count(http::field::host) != 1 || !is_own_host(text(request[http::field::host]), hub.port)) {
    return refusal(request, hub, http::status::misdirected_request,
                   "this server answers to the name of this machine alone\n");
  }
  HttpAnswer answer = refusal(request, hub, http::status::not_found, "there is no such page\n");
  if (request.method() != http::verb::get && request.method() != http::verb::head) {
    answer = refusal(request, hub, http::status::method_not_allowed, "only GET\n");
    answer.set(http::field::allow, "GET, HEAD");
    return answer;
  }
  for (const PageFile& file : page_files()) {
    if (text(request.target()) != file.path) continue;
    answer.result(http::status::ok);
    answer.keep_alive(request.keep_alive());
    answer.set(http::field::content_type, beast::string_view(file.type.data(), file.type.size()));
    answer.body() = std::string(file.bytes);
    answer.prepare_payload();
  }
  if (request.method() == http::verb::head) answer.body().clear();  // the length stays
  return answer;
}

/// A browser's connection: answers what it asks, or becomes a WebSocket.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(tcp::socket socket, Hub& hub)
      : hub_(hub), stream_(std::move(socket)), limit_(kMessagesPerSecond, kMessagesAtOnce) {
    ++hub_.connections;
  }
  ~Connection() { --hub_.connections; }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void begin() { read_request(); }

  void send(std::string bytes, bool is_text, bool replaces) {
    if (is_closing_) return;
    for (std::size_t n = is_writing_ ? 1 : 0; replaces && n < waiting_.size(); ++n) {
      if (!waiting_[n].replaces) continue;
      waiting_.erase(waiting_.begin() + static_cast<std::ptrdiff_t>(n));
      break;
    }
    if (waiting_.size() >= kMostWaiting) return close(websocket::close_code::try_again_later, "");
    waiting_.push_back({std::move(bytes), is_text, replaces});
    if (!is_writing_) write_next();
  }

  /// Sends what waits, a last message, and ends.
  void close(websocket::close_code code, const std::string& last) {
    if (is_closing_) return;
    if (!last.empty()) send(message_of_refusal(last), true, false);
    is_closing_ = true;
    close_code_ = code;
    leave();
    if (!is_writing_) close_now();
  }

  /// The server ends.
  void drop() {
    is_closing_ = true;
    error_code ignored;
    beast::get_lowest_layer(stream_).socket().close(ignored);
  }

 private:
  struct Message {
    std::string bytes;
    bool is_text, replaces;
  };

  void read_request() {
    parser_.emplace();
    parser_->header_limit(kMostHeaderBytes);
    parser_->body_limit(0);
    stream_.next_layer().expires_after(kHttpTimeout);
    http::async_read(stream_.next_layer(), buffer_, *parser_,
                     [self = shared_from_this()](error_code error, std::size_t) { self->on_request(error); });
  }

  void on_request(error_code error) {
    if (error) return end();
    const HttpRequest& request = parser_->get();
    if (websocket::is_upgrade(request)) return upgrade(request);
    answer_ = answer_to(request, hub_);
    write_answer();
  }

  void write_answer() {
    const auto written = [self = shared_from_this()](error_code error, std::size_t) {
      if (error || !self->answer_.keep_alive()) return self->end();
      self->read_request();
    };
    if (parser_->get().method() == http::verb::head) {
      head_.emplace(answer_);
      http::async_write_header(stream_.next_layer(), *head_, written);
    } else {
      http::async_write(stream_.next_layer(), answer_, written);
    }
  }

  void upgrade(const HttpRequest& request) {
    const auto of = [&](http::field field) {
      const beast::string_view value = request[field];
      return request.count(field) == 1 ? std::string_view(value.data(), value.size()) : std::string_view();
    };
    if (!is_own_host(of(http::field::host), hub_.port) || !is_own_origin(of(http::field::origin), hub_.port) ||
        request.target() != "/talk") {
      answer_ =
          refusal(request, hub_, http::status::forbidden, "a page of another place may not talk with this server\n");
      return write_answer();
    }
    beast::get_lowest_layer(stream_).expires_never();
    stream_.set_option(websocket::stream_base::timeout{kHttpTimeout, kIdleTimeout, true});
    stream_.read_message_max(kMostMessageBytes);
    stream_.auto_fragment(false);  // a picture is one frame
    stream_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (!error) self->read_message_of_page();
    });
  }

  void read_message_of_page() {
    stream_.async_read(buffer_,
                       [self = shared_from_this()](error_code error, std::size_t) { self->on_message(error); });
  }

  void on_message(error_code error) {
    if (error) return leave();
    if (is_closing_) return;
    const std::string text = beast::buffers_to_string(buffer_.data());
    buffer_.consume(buffer_.size());
    if (!limit_.take(RateLimit::Clock::now()))
      return close(websocket::close_code::policy_error, "this page sends too much");
    try {
      auto message = read_message(text);
      if (const auto* const hello = std::get_if<Hello>(&message)) {
        greet(*hello);
      } else if (hub_.page.get() == this) {
        hub_.setup.ask(std::move(std::get<Request>(message)));
      } else {
        return close(websocket::close_code::policy_error, "this page has not said who it is");
      }
    } catch (const InputError& problem) {
      return close(websocket::close_code::policy_error, std::string("a message was not understood: ") + problem.what());
    }
    if (!is_closing_) read_message_of_page();
  }

  void greet(const Hello& hello) {
    if (!hub_.admission.may_enter(hello.token)) return close(websocket::close_code::policy_error, wrong_token());
    if (hub_.page.get() == this) return;
    if (hub_.page && !hello.takes) return close(websocket::close_code::try_again_later, "another page is open");
    if (hub_.page) hub_.page->close(websocket::close_code::going_away, "another page took over");
    hub_.page = shared_from_this();
    if (const std::string secret = hub_.admission.enter(hello.token); !secret.empty())
      send(message_of_secret(secret), true, false);
    send(hub_.setup.greeting, true, false);
    hub_.setup.watch(true);
  }

  const char* wrong_token() const {
    return hub_.setup.frames ? "this address has been used: show the viewer again where it was shown"
                             : "wrong token: open the address that the program printed";
  }

  void write_next() {
    is_writing_ = true;
    stream_.text(waiting_.front().is_text);
    stream_.async_write(asio::buffer(waiting_.front().bytes),
                        [self = shared_from_this()](error_code error, std::size_t) { self->on_written(error); });
  }

  void on_written(error_code error) {
    is_writing_ = false;
    if (error) return leave();
    waiting_.pop_front();
    if (!waiting_.empty()) return write_next();
    if (is_closing_) close_now();
  }

  void close_now() {
    stream_.async_close(close_code_, [self = shared_from_this()](error_code) {});
  }

  /// The page looks no more.
  void leave() {
    if (hub_.page.get() != this) return;
    const std::shared_ptr<Connection> self = std::move(hub_.page);
    hub_.page = nullptr;
    hub_.setup.watch(false);
  }

  void end() {
    error_code ignored;
    stream_.next_layer().socket().shutdown(tcp::socket::shutdown_send, ignored);
  }

  Hub& hub_;
  websocket::stream<beast::tcp_stream> stream_;
  beast::flat_buffer buffer_{kMostMessageBytes + kMostHeaderBytes};
  std::optional<http::request_parser<http::empty_body>> parser_;
  HttpAnswer answer_;
  std::optional<http::response_serializer<http::string_body>> head_;
  RateLimit limit_;
  std::deque<Message> waiting_;  ///< the first one is being written
  bool is_writing_ = false, is_closing_ = false;
  websocket::close_code close_code_ = websocket::close_code::normal;
};

}  // namespace

class Server::Implementation {
 public:
  explicit Implementation(Setup setup) : hub_{std::move(setup)} {
    const std::uint16_t wanted = hub_.setup.port;
    listen(tcp::endpoint(asio::ip::address_v4::loopback(), wanted), true);
    hub_.port = acceptors_.front().local_endpoint().port();
    listen(tcp::endpoint(asio::ip::address_v6::loopback(), hub_.port), false);
    for (tcp::acceptor& acceptor : acceptors_) accept(acceptor);
    thread_ = std::thread([this] { context_.run(); });
  }

  ~Implementation() {
    asio::post(context_, [this] { context_.stop(); });
    thread_.join();
    if (hub_.page) hub_.page->drop();
    hub_.page.reset();
  }

  std::uint16_t port() const { return hub_.port; }
  std::string token() const { return hub_.admission.token(); }

  void send(std::string bytes, bool is_text, bool replaces) {
    asio::post(context_, [this, bytes = std::move(bytes), is_text, replaces]() mutable {
      if (hub_.page) hub_.page->send(std::move(bytes), is_text, replaces);
    });
  }

 private:
  void listen(const tcp::endpoint& endpoint, bool is_needed) {
    error_code error;
    tcp::acceptor acceptor(context_);
    acceptor.open(endpoint.protocol(), error);
    if (!error) acceptor.set_option(tcp::acceptor::reuse_address(true), error);
    if (!error) acceptor.bind(endpoint, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (!error) {
      acceptors_.push_back(std::move(acceptor));
    } else if (is_needed) {
      throw Error("cannot listen on 127.0.0.1, port " + std::to_string(endpoint.port()) + " (" + error.message() +
                  "); choose another one, or none");
    }
  }

  void accept(tcp::acceptor& acceptor) {
    acceptor.async_accept([this, &acceptor](error_code error, tcp::socket socket) {
      if (error == asio::error::operation_aborted) return;
      if (!error && hub_.connections < kMostConnections) {
        socket.set_option(tcp::no_delay(true), error);
        std::make_shared<Connection>(std::move(socket), hub_)->begin();
      }
      accept(acceptor);
    });
  }

  Hub hub_;  // first: connections that the context still holds refer to it
  asio::io_context context_{1};
  std::vector<tcp::acceptor> acceptors_;
  std::thread thread_;
};

Server::Server(Setup setup) : it_(std::make_unique<Implementation>(std::move(setup))) {}

Server::~Server() = default;

std::uint16_t Server::port() const { return it_->port(); }

std::string Server::token() const { return it_->token(); }

void Server::send_text(std::string text, bool replaces) { it_->send(std::move(text), true, replaces); }

void Server::send_bytes(std::string bytes) { it_->send(std::move(bytes), false, false); }

}  // namespace tetwarp::viewer
