// The AUTD3 link over TCP: servers that are missing, silent, or stop mid-stream.
#include <netinet/in.h>
#include <sys/socket.h>
#include <thread>
#include <unistd.h>

#include "tests/hardware/autd3_support.h"
#include "tests/support/testing.h"

namespace touchfield::autd3_remote_test {

TEST_F(Autd3Test, ALibraryWithoutItsRemotePartIsNamed) {
  const TemporaryDirectory folder;
  const std::filesystem::path copy = folder.path() / "libautd3capi.so";
  std::filesystem::copy_file(Autd3Library(library_).file(), copy);
  Autd3Options alone = options("remote", 1);
  alone.library = copy.string();
  alone.host = "127.0.0.1";
  Autd3Link link(alone);
  EXPECT_THAT(message_of<InputError>([&] { link.open(); }), HasSubstr("libautd3capi_link_remote.so"));
}

// A TCP port of this machine, bound; listening if asked for.
class Port {
 public:
  explicit Port(bool listening) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    socklen_t size = sizeof(address);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), size), 0);
    EXPECT_EQ(::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    number_ = ntohs(address.sin_port);
    if (listening) {
      EXPECT_EQ(::listen(socket_, 4), 0);
    }
  }
  ~Port() { ::close(socket_); }
  Port(const Port&) = delete;
  Port& operator=(const Port&) = delete;
  int number() const { return number_; }
  int socket() const { return socket_; }

 private:
  int socket_;
  int number_ = 0;
};

// What a server of the remote link does: it takes units' messages and says that they were taken. After `frames` of them
// it falls silent, goes away, or answers on but for units that take nothing any more. A message is one byte of kind and
// a body; an answer begins with 0.
class Server {
 public:
  enum class End { kSilent, kGone, kUnitsSilent };

  Server(int frames, End end) : port_(true), thread_([this, frames, end] { serve(frames, end); }) {}
  ~Server() {
    ::shutdown(port_.socket(), SHUT_RDWR);
    thread_.join();
  }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;
  int port() const { return port_.number(); }

 private:
  static bool take(int from, std::vector<std::uint8_t>& bytes, std::size_t count) {
    bytes.resize(count);
    return count == 0 || ::recv(from, bytes.data(), count, MSG_WAITALL) == static_cast<ssize_t>(count);
  }

  void serve(int frames, End end) const {
    constexpr std::size_t kMessage = 626;  // bytes that go to a unit; the first is the number of the message
    const int client = ::accept(port_.socket(), nullptr, nullptr);
    std::vector<std::uint8_t> kind;
    std::vector<std::uint8_t> body;
    std::vector<std::uint8_t> answer;
    std::size_t units = 0;
    std::uint8_t taken = 0;
    while (client >= 0 && take(client, kind, 1)) {
      answer = {0};
      if (kind[0] == 0x10) {  // hello: version, name
        take(client, body, 13);
      } else if (kind[0] == 0x01) {  // where the units are
        take(client, body, 4);
        units = body[0];
        take(client, body, 28 * units);
      } else if (kind[0] == 0x03) {
        take(client, body, kMessage * units);
        if (frames-- > 0) {
          taken = body[0];
        } else if (end != End::kUnitsSilent) {
          break;
        }
      } else if (kind[0] == 0x04) {  // two bytes a unit: data, number of the message taken
        for (std::size_t u = 0; u < units; ++u) {
          answer.insert(answer.end(), {0, taken});
        }
      }
      ::send(client, answer.data(), answer.size(), MSG_NOSIGNAL);
    }
    if (end == End::kSilent) {
      take(client, body, 1U << 20U);  // until the other side lets go
    }
    ::close(client);
  }

  Port port_;
  std::thread thread_;
};

TEST_F(Autd3Test, ARemoteServerThatIsMissingIsNamed) {
  const Port port(false);
  Autd3Options remote = options("remote", 1);
  remote.host = "localhost";
  remote.port = port.number();
  Autd3Link link(remote);
  EXPECT_THAT(message_of<DeviceError>([&] { link.open(); }),
              AllOf(HasSubstr("refused"), HasSubstr("127.0.0.1:" + std::to_string(port.number()))));
}

TEST_F(Autd3Test, ARemoteServerThatNeverAnswersIsGivenUp) {
  const Port port(true);
  Autd3Options remote = options("remote", 1);
  remote.host = "127.0.0.1";
  remote.port = port.number();
  Autd3Link link(remote);
  // 90 ms for its answer; the rest is for a busy machine.
  EXPECT_LT(seconds_of([&] { EXPECT_THROW(link.open(), DeviceError); }), 1.0);
}

TEST_F(Autd3Test, ARemoteServerThatStopsMidStreamIsALostLink) {
  for (const Server::End end : {Server::End::kSilent, Server::End::kGone, Server::End::kUnitsSilent}) {
    const Server server(20, end);
    Autd3Options remote = options("remote", 2);
    remote.host = "127.0.0.1";
    remote.port = server.port();
    Autd3Link link(remote);
    link.open();
    int sent = 0;
    double waited = 0;
    EXPECT_THAT(message_of<DeviceError>([&] {
                  for (;; ++sent) {
                    const auto start = std::chrono::steady_clock::now();
                    try {
                      link.send(quiet_frame(2 * kPerUnit));
                    } catch (const DeviceError&) {
                      waited = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
                      throw;
                    }
                  }
                }),
                AllOf(HasSubstr("remote"), HasSubstr("lost")));
    EXPECT_GT(sent, 10) << "opening takes fewer than ten messages";
    EXPECT_LT(waited, kWait);
    EXPECT_LT(seconds_of([&] { EXPECT_THROW(link.quiet(), DeviceError); }), kWait);
    EXPECT_LT(seconds_of([&] { link.close(); }), kWait);
  }
}

}  // namespace touchfield::autd3_remote_test
