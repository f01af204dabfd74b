// The server of live pages, asked over its own port.
#include "sim/view/view_server.h"

#include <atomic>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <fmt/format.h>

#include "sim/core/child_process.h"
#include "tests/support/testing.h"

namespace touchfield::view_server_test {

/// A browser's connection.
class Browser {
 public:
  explicit Browser(int port) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in place{};
    place.sin_family = AF_INET;
    place.sin_port = htons(static_cast<std::uint16_t>(port));
    place.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket_.number(), reinterpret_cast<const sockaddr*>(&place), sizeof place), 0);
  }

  void say(const std::string& text) {
    EXPECT_EQ(::send(socket_.number(), text.data(), text.size(), MSG_NOSIGNAL), static_cast<ssize_t>(text.size()));
  }

  /// What comes up to this, or until the connection ends.
  std::string hear(const std::string& until = "\nnever\n") {
    std::vector<char> part(100'000);
    while (heard_.find(until) == heard_.npos) {
      const ssize_t count = ::recv(socket_.number(), part.data(), part.size(), 0);
      if (count <= 0) return std::exchange(heard_, "");
      heard_.append(part.data(), static_cast<std::size_t>(count));
    }
    const std::size_t end = heard_.find(until) + until.size();
    const std::string found = heard_.substr(0, end);
    heard_.erase(0, end);
    return found;
  }

 private:
  Descriptor socket_;
  std::string heard_;
};

class Viewing : public ::testing::Test {
 protected:
  static constexpr double kPatience = 1;

  void SetUp() override {
    server_.start({"<p>page", [this] {
                     ++asked_;
                     if (throws_) throw InputError("no\nskin");
                     return std::optional(fmt::format(R"({{"number": {}, "more": "{}"}})", asked_.load(), more_));
                   }});
  }

  std::string head(const std::string& path = "/") const {
    return fmt::format("GET {} HTTP/1.1\r\nHost: 127.0.0.1:{}\r\n", path, server_.port());
  }
  std::string answer(const std::string& request) {
    Browser browser(server_.port());
    browser.say(request);
    return browser.hear();
  }
  Browser viewer() {
    Browser browser(server_.port());
    browser.say(head("/events") + "\r\n");
    EXPECT_THAT(browser.hear("\r\n\r\n"), HasSubstr("text/event-stream"));
    return browser;
  }
  void wait_until_watched(bool watched) {
    while (server_.watched() != watched) ::usleep(1000);
  }

  std::atomic<int> asked_ = 0;
  std::string more_;
  std::atomic<bool> throws_ = false;
  ViewServer server_{0, kPatience};
};

TEST_F(Viewing, GivesThePage) {
  const std::string page = answer(head() + "\r\n");
  EXPECT_THAT(page, StartsWith("HTTP/1.1 200 OK\r\nContent-Type: text/html"));
  EXPECT_THAT(page, EndsWith("\r\n\r\n<p>page"));
  for (const char* field : {"Content-Security-Policy: default-src 'none'; ", "Cache-Control: no-store\r\n",
                            "X-Content-Type-Options: nosniff\r\n", "Content-Length: 7\r\n"}) {
    EXPECT_THAT(page, HasSubstr(field));
  }
  EXPECT_THAT(answer(head("/?now") + "\r\n"), EndsWith("<p>page"));
  EXPECT_THAT(answer(head("/other") + "\r\n"), StartsWith("HTTP/1.1 404"));
  EXPECT_EQ(asked_, 0) << "nobody listens";
}

TEST_F(Viewing, AnswersItsOwnPageAlone) {
  const int port = server_.port();
  const std::string host = fmt::format("Host: 127.0.0.1:{}\r\n", port);
  const std::vector<std::pair<std::string, std::string>> rows = {
      {fmt::format("GET / HTTP/1.1\r\nhOST:LocalHost:{} \r\n", port), "200"},
      {head() + fmt::format("Origin: http://127.0.0.1:{}\r\nSec-Fetch-Site: same-origin\r\n", port), "200"},
      {head() + "Sec-Fetch-Site: none\r\n", "200"},
      {"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\n", "403"},
      {fmt::format("GET / HTTP/1.1\r\nHost: attacker.example:{}\r\n", port), "403"},
      {"GET / HTTP/1.1\r\n", "403"},
      {"GET / HTTP/1.1\r\nHost:\r\n", "403"},
      {head() + host, "403"},
      {head() + "Origin: http://attacker.example\r\n", "403"},
      {head() + "Origin: null\r\n", "403"},
      {head() + fmt::format("Origin: http://localhost:{}\r\n", port), "403"},
      {head() + "Sec-Fetch-Site: cross-site\r\n", "403"},
      {head() + "Sec-Fetch-Site: same-site\r\n", "403"},
      {"POST / HTTP/1.1\r\n" + host, "405"},
      {"HEAD / HTTP/1.1\r\n" + host, "405"},
      {"OPTIONS * HTTP/1.1\r\n" + host, "405"},
      {"what\r\n" + host, "405"},
      {head() + "Cookie: " + std::string(40'000, 'c') + "\r\n", "431"},
  };
  for (const auto& [request, status] : rows) {
    EXPECT_THAT(answer(request + "\r\n"), StartsWith("HTTP/1.1 " + status)) << request;
  }
}

TEST_F(Viewing, TheNinthViewerIsRefused) {
  std::vector<Browser> viewers;
  for (int k = 0; k < ViewServer::kMostViewers; ++k) viewers.push_back(viewer());
  EXPECT_THAT(answer(head("/events") + "\r\n"), HasSubstr("503 Service Unavailable"));
  EXPECT_THAT(answer(head() + "\r\n"), HasSubstr("200 OK"));
  viewers.clear();
  wait_until_watched(false);
  viewer();
}

TEST_F(Viewing, AllGetTheSameEvents) {
  Browser a = viewer();
  Browser b = viewer();
  for (int k = 0; k < 3; ++k) {
    const std::string event = b.hear("\n\n");
    EXPECT_THAT(a.hear(event), EndsWith(event));
  }
}

// Events go on for another viewer, and the one that does not read is dropped.
TEST_F(Viewing, NobodyWaitsForAViewerThatStopsReading) {
  more_.assign(300'000, '.');
  Browser stopped = viewer();
  {
    Browser reads = viewer();
    for (int k = 0; k < 10; ++k) EXPECT_THAT(reads.hear("\n\n"), EndsWith("\n\n"));
  }
  wait_until_watched(false);
  const std::string rest = stopped.hear();
  EXPECT_LT(std::ranges::count(rest, '\n'), 2 * 10) << "it lost events, then its connection";
}

TEST_F(Viewing, WhoAsksNothingIsDropped) {
  Browser silent(server_.port());
  silent.say("GET / HTTP/1.1\r\n");
  EXPECT_EQ(silent.hear(), "");
}

TEST_F(Viewing, HearsWhyThereIsNoEvent) {
  throws_ = true;
  EXPECT_EQ(viewer().hear("\n\n"), "event: end\ndata: no skin\n\n");
}

TEST_F(Viewing, EndsWithAWord) {
  Browser reads = viewer();
  server_.end("over");
  EXPECT_THAT(reads.hear(), EndsWith("event: end\ndata: over\n\n"));
}

TEST(ViewServerPort, IsHadByOneProgram) {
  const ViewServer first(0);
  EXPECT_THAT([&] { ViewServer second(first.port()); },
              ThrowsMessage<InputError>(HasSubstr(fmt::format("--view {}: 127.0.0.1", first.port()))));
}

}  // namespace touchfield::view_server_test
