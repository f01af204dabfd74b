// What is read as a file and what is not: pipes end, devices and sockets are refused before anything waits for them.

#include "sim/core/whole_file.h"

#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <fstream>
#include <string>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <thread>
#include <unistd.h>

#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::whole_file_test {

constexpr std::size_t kMost = 200000;

class WholeFile : public ::testing::Test {
 protected:
  std::string path(const char* name) const { return folder_.file(name); }
  static std::string refusal(const std::string& path) {
    return message_of<InputError>([&] { read_whole_file(path, kMost); });
  }

  const TemporaryDirectory folder_;
};

TEST_F(WholeFile, AFileIsReadUpToItsBound) {
  const std::string text(kMost, 'x');
  std::ofstream(path("a")) << text;
  EXPECT_EQ(read_whole_file(path("a"), kMost), text);
  std::ofstream(path("a")) << text << 'x';
  EXPECT_THAT(refusal(path("a")), EndsWith("a: too long, must be at most 200000 bytes"));
  std::ofstream(path("a")).close();
  EXPECT_EQ(read_whole_file(path("a"), kMost), "");
  EXPECT_THAT(refusal(path("b")), EndsWith("b: no such file"));
}

TEST_F(WholeFile, APipeIsReadToItsEndHoweverSlowlyItComes) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  std::thread writer([&] {
    std::ofstream pipe(path("pipe"));
    for (const char* part : {"one ", "two ", "three"}) {
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
      pipe << part << std::flush;
    }
  });
  EXPECT_EQ(read_whole_file(path("pipe"), kMost), "one two three");
  writer.join();
}

TEST_F(WholeFile, APipeThatIsTooLongIsRefused) {
  int ends[2];
  ASSERT_EQ(::pipe2(ends, O_CLOEXEC), 0);
  std::thread writer([&] {
    const std::string text(kMost + 1, 'x');
    EXPECT_EQ(::write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
    ::close(ends[1]);
  });
  EXPECT_THAT(refusal("/proc/self/fd/" + std::to_string(ends[0])), HasSubstr("too long"));
  std::string rest(kMost, ' ');
  while (::read(ends[0], rest.data(), rest.size()) > 0) {
  }
  writer.join();
  ::close(ends[0]);
}

TEST_F(WholeFile, NothingWaitsForWhatNeverComes) {
  ASSERT_EQ(::mkfifo(path("pipe").c_str(), 0600), 0);
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_THAT(refusal(path("pipe")), EndsWith("pipe: a pipe, and nothing writes to it; give a file"));
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(30));
}

TEST_F(WholeFile, WhatIsNoFileIsRefused) {
  EXPECT_THAT(refusal(folder_.path()), EndsWith("a directory, must be a file"));
  for (const char* device : {"/dev/zero", "/dev/null", "/dev/full"}) {
    EXPECT_EQ(refusal(device), device + std::string(": a device, must be a file"));
  }
  const int socket = ::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::strncpy(address.sun_path, path("socket").c_str(), sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  EXPECT_THAT(refusal(path("socket")), EndsWith("socket: a socket, must be a file"));
  ::close(socket);
}

}  // namespace touchfield::whole_file_test
