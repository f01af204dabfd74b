#include <fstream>
#include <string>
#include <sys/stat.h>
#include <thread>

#include "sim/core/files.h"
#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::whole_file_test {

constexpr std::size_t kMost = 3'000'000;  // more than is read at once

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
  EXPECT_THAT(refusal(path("a")), EndsWith("a: too long, must be at most 3000000 bytes"));
  std::ofstream(path("a")).close();
  EXPECT_EQ(read_whole_file(path("a"), kMost), "");
  EXPECT_THAT(refusal(path("b")), EndsWith("b: no such file"));
  EXPECT_THAT(refusal(path("a") + "/b"), HasSubstr("cannot be read: Not a directory"));
  EXPECT_THAT(refusal(folder_.path()), EndsWith("a directory, must be a file"));
  EXPECT_THAT(refusal("/dev/zero"), HasSubstr("too long"));
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

TEST_F(WholeFile, ATextHasNoByteOrderMark) {
  std::ofstream(path("a")) << "\xEF\xBB\xBFtext\r\n";
  EXPECT_EQ(read_text_file(path("a"), kMost), "text\r\n");
  std::ofstream(path("a")) << "te\xFFxt";
  EXPECT_THAT(message_of<InputError>([&] { read_text_file(path("a"), kMost); }), HasSubstr("a:1:3: byte 0xff is not"));
}

}  // namespace touchfield::whole_file_test
