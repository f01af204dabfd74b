// Files that appear whole under their name, and what stands beside them meanwhile.

#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <sys/stat.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include "sim/core/files.h"
#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::atomic_file_test {

namespace fs = std::filesystem;

class AtomicFile : public ::testing::Test {
 protected:
  const TemporaryDirectory temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(AtomicFile, ReplacesAFileAndLeavesNothingElse) {
  const fs::path path = folder_ / "a.txt";
  write_atomically(path.string(), {"one ", "two"});
  write_atomically(path.string(), {"three"});
  EXPECT_EQ(read_bytes(path), "three");
  EXPECT_EQ(temporary_.entries(), 1U);
}

// Somebody who may write to the folder expects the next name and leads it elsewhere.
TEST_F(AtomicFile, NoLinkThatLiesInWaitIsFollowed) {
  std::ofstream(folder_ / "precious") << "mine";
  fs::create_symlink(folder_ / "precious", folder_ / (".a.txt.tmp-" + std::to_string(::getpid())));
  write_atomically((folder_ / "a.txt").string(), {"text"});
  EXPECT_EQ(read_bytes(folder_ / "precious"), "mine");
  EXPECT_EQ(read_bytes(folder_ / "a.txt"), "text");
}

TEST_F(AtomicFile, NothingButAFileIsReplaced) {
  const std::string path = (folder_ / "a").string();
  const std::vector<std::pair<std::string, std::function<void()>>> kinds = {
      {"a link", [&] { fs::create_symlink(folder_ / "precious", path); }},
      {"a folder", [&] { fs::create_directory(path); }},
      {"a pipe", [&] { ASSERT_EQ(::mkfifo(path.c_str(), 0600), 0); }},
  };
  std::ofstream(folder_ / "precious") << "mine";
  for (const auto& [kind, make] : kinds) {
    make();
    const fs::file_type type = fs::symlink_status(path).type();
    for (const bool force : {false, true}) {
      EXPECT_THAT(message_of<InputError>([&] { require_free(path, force, "remedy"); }),
                  HasSubstr(path + ": is " + kind));
    }
    EXPECT_THAT(message_of<IoError>([&] { write_atomically(path, {"text"}); }), HasSubstr("it is " + kind));
    EXPECT_EQ(fs::symlink_status(path).type(), type);
    fs::remove(path);
  }
  EXPECT_THAT(message_of<InputError>([] { require_free("/dev/null", true, ""); }), HasSubstr("is a device"));
  EXPECT_EQ(temporary_.entries(), 1U);
  EXPECT_EQ(read_bytes(folder_ / "precious"), "mine");
  require_free(path, false, "");
  EXPECT_THAT(message_of<InputError>([&] { require_free((folder_ / "precious").string(), false, "remedy"); }),
              HasSubstr("the file exists; remedy"));
}

TEST_F(AtomicFile, HasTheModeThatTheUserWants) {
  const fs::path path = folder_ / "a.txt";
  const mode_t before = ::umask(027);
  write_atomically(path.string(), {"text"});
  ::umask(before);
  struct stat about {};
  ASSERT_EQ(::stat(path.c_str(), &about), 0);
  EXPECT_EQ(about.st_mode & 07777U, 0640U);
}

TEST_F(AtomicFile, AFailureLeavesNothing) {
  fs::create_directory(folder_ / "a.txt");
  const std::string path = (folder_ / "a.txt").string();
  EXPECT_THAT(message_of<IoError>([&] { write_atomically(path, {"text"}); }), HasSubstr(path));
  EXPECT_EQ(temporary_.entries(), 1U);
}

TEST(Leftover, IsKnownByItsName) {
  EXPECT_EQ(target_of_temporary(".a.txt.tmp-0123456789abcdef"), "a.txt");
  for (const char* other :
       {"a.txt", ".a.txt.tmp-", ".a.txt.tmp-0123456789abcde", ".a.txt.tmp-0123456789abcdeg",
        ".b.txt.tmp-0123456789abcdef", ".a.txt.tmp-0123456789abcdef0", "a.txt.tmp-0123456789abcdef"}) {
    EXPECT_NE(target_of_temporary(other), "a.txt") << other;
  }
}

}  // namespace touchfield::atomic_file_test
