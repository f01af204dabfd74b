#include "sim/view/view_server.h"

#include <algorithm>
#include <array>
#include <asio/buffer.hpp>
#include <asio/io_context.hpp>
#include <asio/ip/tcp.hpp>
#include <asio/post.hpp>
#include <asio/read_until.hpp>
#include <asio/steady_timer.hpp>
#include <asio/write.hpp>
#include <atomic>
#include <pthread.h>
#include <set>
#include <string_view>
#include <sys/resource.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <omp.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

using asio::error_code;
using asio::ip::tcp;
using Clock = std::chrono::steady_clock;
using Text = std::shared_ptr<const std::string>;

constexpr std::size_t kMostConnections = 32;
constexpr std::size_t kLongestRequest = 32'768;  // [bytes]: browsers send the cookies of all servers of this machine
constexpr int kSendBuffer = 65'536;              // [bytes]: what a viewer that falls behind has still to read
constexpr int kNiceness = 10;
constexpr std::chrono::milliseconds kLastWords{300};

/// A response after which the connection ends; without a body it goes on until then.
Text response(const std::string& status, const char* type, const std::optional<std::string>& body) {
  return std::make_shared<const std::string>(fmt::format(
      "HTTP/1.1 {}\r\nContent-Type: {}; charset=utf-8\r\n{}Connection: close\r\nCache-Control: no-store\r\n"
      "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\nCross-Origin-Resource-Policy: same-origin\r\n"
      "Content-Security-Policy: default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; "
      "img-src data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'\r\n\r\n{}",
      status, type, body ? fmt::format("Content-Length: {}\r\n", body->size()) : "", body.value_or("")));
}

Text refusal(const std::string& status, const std::string& reason) {
  return response(status, "text/plain", reason + "\n");
}

/// The values of a field in the head of a request, which is in lower case.
std::vector<std::string> values(const std::string& head, const std::string& field) {
  const std::string name = "\r\n" + field + ":";
  std::vector<std::string> found;
  for (std::size_t at = head.find(name); at != head.npos; at = head.find(name, at + 1)) {
    const std::size_t from = head.find_first_not_of(" \t", at + name.size());
    const std::string value = head.substr(from, head.find("\r\n", from) - from);
    found.push_back(value.substr(0, value.find_last_not_of(" \t") + 1));
  }
  return found;
}

/// Why a request is not answered; null: it is.
///
/// request   its head, to the empty line
Text refused(std::string_view request, int port) {
  std::string head(request);
  std::ranges::transform(head, head.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c - 'A' + 'a') : c; });
  const std::vector<std::string> hosts = values(head, "host");
  if (hosts != std::vector{fmt::format("127.0.0.1:{}", port)} &&
      hosts != std::vector{fmt::format("localhost:{}", port)}) {
    return refusal("403 Forbidden", fmt::format("This page has the address http://127.0.0.1:{} alone.", port));
  }
  const std::string own = "http://" + hosts.front();
  if (std::ranges::any_of(values(head, "origin"), [&](const auto& origin) { return origin != own; }) ||
      std::ranges::any_of(values(head, "sec-fetch-site"),
                          [](const auto& site) { return site != "none" && site != "same-origin"; })) {
    return refusal("403 Forbidden", fmt::format("Other pages may not ask: type the address {}.", own));
  }
  return request.starts_with("GET /") ? nullptr
                                      : refusal("405 Method Not Allowed\r\nAllow: GET", "Only GET is answered.");
}

}  // namespace

/// All but `watched` and `end` runs in one thread.
class ViewServer::Service {
 public:
  Service(int port, double patience)
      : patience_(patience),
        acceptor_(context_, tcp::endpoint(asio::ip::address_v4::loopback(), static_cast<std::uint16_t>(port))),
        port_(acceptor_.local_endpoint().port()) {}

  ~Service() {
    context_.stop();
    join();
  }

  void start(ViewSource source) {
    source_ = std::move(source);
    accept();
    thread_ = std::thread([this] {
      ::pthread_setname_np(::pthread_self(), "viewer");
      const auto self = static_cast<id_t>(::gettid());
      ::setpriority(PRIO_PROCESS, self, ::getpriority(PRIO_PROCESS, self) + kNiceness);
      omp_set_num_threads(1);
      context_.run();
    });
  }

  void end(const std::string& why) {
    asio::post(context_, [this, text = std::make_shared<const std::string>("event: end\ndata: " + why + "\n\n")] {
      last_ = text;
      acceptor_.close();
      tell(nullptr);
      tick_.expires_after(kLastWords);
      tick_.async_wait([this](const error_code&) { context_.stop(); });
    });
    join();
    for (const Shared& connection : std::set(connections_)) {
      drop(connection);
    }
  }

  int port() const { return port_; }
  bool watched() const { return viewers_ > 0; }

 private:
  /// Of one browser.
  struct Connection {
    tcp::socket socket;
    std::string request{};
    bool views = false;
    bool busy = true;                        // with a request or a text
    Clock::time_point since = Clock::now();  // when it became so
  };
  using Shared = std::shared_ptr<Connection>;

  void join() {
    if (thread_.joinable()) {
      thread_.join();
    }
  }

  void accept() {
    acceptor_.async_accept([this](const error_code& error, tcp::socket socket) {
      if (!acceptor_.is_open()) {
        return;
      }
      if (!error && connections_.size() < kMostConnections) {
        error_code ignored;
        socket.set_option(tcp::socket::send_buffer_size(kSendBuffer), ignored);
        const auto connection = std::make_shared<Connection>(Connection{std::move(socket)});
        connections_.insert(connection);
        asio::async_read_until(
            connection->socket, asio::dynamic_buffer(connection->request, kLongestRequest), "\r\n\r\n",
            [this, connection](const error_code& failure, std::size_t size) { answer(connection, failure, size); });
        look();
      }
      accept();
    });
  }

  void answer(const Shared& connection, const error_code& failure, std::size_t size) {
    if (failure && failure != asio::error::not_found) {
      drop(connection);
      return;
    }
    const std::string_view request = std::string_view(connection->request).substr(0, size);
    Text text =
        failure ? refusal("431 Request Header Fields Too Large", "This request is too long.") : refused(request, port_);
    if (!text) {
      text = answered(request.substr(4, request.find_first_of(" ?\r", 4) - 4), *connection);
    }
    send(connection, text, !connection->views);
    drain(connection);
  }

  Text answered(std::string_view path, Connection& connection) {
    if (path == "/") {
      return response("200 OK", "text/html", source_.page);
    }
    if (path != "/events") {
      return refusal("404 Not Found", "Here are / and /events.");
    }
    if (viewers_ == kMostViewers) {
      return refusal("503 Service Unavailable", fmt::format("{} viewers watch already: close one.", kMostViewers));
    }
    connection.views = true;
    ++viewers_;
    return response("200 OK", "text/event-stream", std::nullopt);
  }

  void send(const Shared& connection, const Text& text, bool last) {
    connection->busy = true;
    connection->since = Clock::now();
    asio::async_write(connection->socket, asio::buffer(*text),
                      [this, connection, text, last](const error_code& error, std::size_t) {
                        connection->busy = last;
                        if (error) {
                          drop(connection);
                        } else if (last) {  // the browser closes the connection, or time does
                          error_code ignored;
                          connection->socket.shutdown(tcp::socket::shutdown_send, ignored);
                          leave(*connection);
                        } else if (last_) {
                          send(connection, last_, true);
                        }
                      });
  }

  /// Hears that a browser has gone; what it says meanwhile counts for nothing.
  void drain(const Shared& connection) {
    connection->socket.async_read_some(
        asio::buffer(ignored_),
        [this, connection](const error_code& error, std::size_t) { error ? drop(connection) : drain(connection); });
  }

  void drop(const Shared& connection) {
    leave(*connection);
    connections_.erase(connection);
    error_code ignored;
    connection->socket.close(ignored);
  }

  void leave(Connection& connection) {
    viewers_ -= std::exchange(connection.views, false) ? 1 : 0;
    if (last_ && viewers_ == 0) {
      context_.stop();
    }
  }

  /// Begins with the first connection, and ends with the last one.
  void look() {
    if (!std::exchange(looks_, true)) {
      tick_.expires_after(kApart);
      tick_.async_wait([this](const error_code& error) {
        looks_ = false;
        if (!error) {
          turn();
        }
      });
    }
  }

  void turn() {
    const Clock::time_point now = Clock::now();
    for (const Shared& connection : std::set(connections_)) {
      if (connection->busy && now - connection->since > patience_) {
        drop(connection);
      }
    }
    if (std::ranges::any_of(connections_, &Service::listens)) {
      if (const Text event = next_event()) {
        tell(event);
      }
    }
    if (!connections_.empty()) {
      look();
    }
  }

  /// Null: none. What `next` throws ends the page, not the program.
  Text next_event() {
    try {
      const std::optional<std::string> event = source_.next();
      return event ? std::make_shared<const std::string>("data: " + *event + "\n\n") : nullptr;
    } catch (const std::exception& error) {
      std::string why = error.what();
      std::ranges::replace(why, '\n', ' ');
      source_.next = [] { return std::nullopt; };
      return std::make_shared<const std::string>("event: end\ndata: " + why + "\n\n");
    }
  }

  static bool listens(const Shared& connection) { return connection->views && !connection->busy; }

  /// An event, or the last one.
  void tell(const Text& text) {
    if (last_ && viewers_ == 0) {
      context_.stop();
    }
    for (const Shared& connection : std::set(connections_)) {
      if (listens(connection)) {
        send(connection, text ? text : last_, text == nullptr);
      }
    }
  }

  std::chrono::duration<double> patience_;
  asio::io_context context_{1};
  tcp::acceptor acceptor_;
  asio::steady_timer tick_{context_};
  int port_;
  ViewSource source_;
  std::set<Shared> connections_;
  std::atomic<int> viewers_ = 0;
  bool looks_ = false;
  Text last_;
  std::array<char, 4096> ignored_{};
  std::thread thread_;
};

ViewServer::ViewServer(int port, double patience) {
  try {
    service_ = std::make_unique<Service>(port, patience);
  } catch (const std::system_error& error) {
    throw InputError(
        fmt::format("--view {}: 127.0.0.1 does not give this port: {}; another number is another port, 0 "
                    "any free one",
                    port, error.code().message()));
  }
}
ViewServer::~ViewServer() = default;
int ViewServer::port() const { return service_->port(); }
void ViewServer::start(ViewSource source) { service_->start(std::move(source)); }
bool ViewServer::watched() const { return service_->watched(); }
void ViewServer::end(const std::string& why) { service_->end(why); }

}  // namespace touchfield
