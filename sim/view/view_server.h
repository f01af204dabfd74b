#pragma once

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace touchfield {

/// What a page that follows something live is made of.
struct ViewSource {
  std::string page;  // GET /: HTML with its script and style in it
  /// The newest state in one line; nothing if viewers know it. Called by the server's thread, at most 15
  /// times a second, and only while a viewer listens to GET /events. What it throws is the last that viewers hear.
  std::function<std::optional<std::string>()> next;
};

/// Serves such a page over HTTP to browsers of this machine, by one thread of low priority.
///
/// Nobody waits for a viewer. A viewer that is still busy with an event does not get the next one; one that takes
/// nothing for the time of `patience` is dropped. All viewers get the same text of an event.
///
/// It listens at 127.0.0.1 alone. Another Host than 127.0.0.1:PORT or localhost:PORT is refused (DNS rebinding). So are
/// requests from pages of another origin (Origin, Sec-Fetch-Site), methods other than GET, and more than kMostViewers.
/// The page may load nothing but what is in it and on this server (Content-Security-Policy).
class ViewServer {
 public:
  static constexpr int kMostViewers = 8;
  static constexpr std::chrono::microseconds kApart{66'667};  // events

  /// Takes the port. Browsers that ask before `start` wait.
  ///
  /// port       0: a free one
  /// patience   with a viewer or a request that does not go on [s]
  /// throws     InputError if it cannot have the port
  explicit ViewServer(int port, double patience = 5);
  ~ViewServer();
  ViewServer(const ViewServer&) = delete;
  ViewServer& operator=(const ViewServer&) = delete;

  int port() const;
  /// Once.
  void start(ViewSource source);
  /// Whether a viewer listens; may be asked by any thread.
  bool watched() const;
  /// Sends viewers an event `end` with this line and closes their connections. Viewers that are busy have 0.3 s.
  void end(const std::string& why);

 private:
  class Service;
  std::unique_ptr<Service> service_;
};

}  // namespace touchfield
