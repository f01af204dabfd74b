// Files that appear whole under their name, and what stands beside them meanwhile.

#include <filesystem>
#include <fstream>
#include <string>
#include <sys/stat.h>
#include <unistd.h>

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
  fs::create_symlink(folder_ / "precious", folder_ / "a.txt");
  write_atomically((folder_ / "a.txt").string(), {"text"});
  EXPECT_EQ(read_bytes(folder_ / "precious"), "mine");
  EXPECT_EQ(read_bytes(folder_ / "a.txt"), "text");
  EXPECT_FALSE(fs::is_symlink(folder_ / "a.txt"));
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
