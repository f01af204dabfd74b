// A directory that one process works in: who else may, what is removed from it, what links lead to.

#include "sim/core/own_directory.h"

#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <string>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::own_directory_test {

namespace fs = std::filesystem;

class OwnDirectoryTest : public ::testing::Test {
 protected:
  OwnDirectoryTest() {
    fs::create_directories(folder_ / "out/images");
    fs::create_directories(folder_ / "elsewhere");
    std::ofstream(folder_ / "elsewhere/precious") << "mine";
  }

  std::string out() const { return (folder_ / "out").string(); }
  std::string refusal(const std::string& lock_file = {}) const {
    return message_of<InputError>([&] { OwnDirectory(out(), lock_file); });
  }
  bool precious() const { return fs::file_size(folder_ / "elsewhere/precious") == 4; }

  const TemporaryDirectory temporary_;
  const fs::path folder_ = temporary_.path();
};

TEST_F(OwnDirectoryTest, IsOfOneAtATime) {
  {
    const OwnDirectory own(out());
    EXPECT_THAT(refusal(), AllOf(HasSubstr(out()), HasSubstr("another process works in it")));
    fs::create_directory_symlink(folder_ / "out", folder_ / "link");
    EXPECT_THROW(OwnDirectory((folder_ / "link").string()), InputError);
  }
  const OwnDirectory again(out());
  EXPECT_EQ(std::distance(fs::directory_iterator(out()), fs::directory_iterator()), 1);  // no file is needed
}

TEST_F(OwnDirectoryTest, EndsWithTheObjectThoughACopyOfTheProcessLives) {
  pid_t copy = -1;
  {
    const OwnDirectory own(out(), "a.lock");
    copy = ::fork();
    if (copy == 0) {
      ::pause();
      ::_exit(0);
    }
    EXPECT_THAT(refusal(), HasSubstr("another process"));
  }
  { const OwnDirectory again(out(), "a.lock"); }
  ::kill(copy, SIGKILL);
  ::waitpid(copy, nullptr, 0);
}

TEST_F(OwnDirectoryTest, IsMovedWithoutBeingLetGo) {
  OwnDirectory first(out());
  const OwnDirectory second(std::move(first));
  EXPECT_THAT(refusal(), HasSubstr("another process"));
}

TEST_F(OwnDirectoryTest, ALockFileIsLockedToo) {
  std::ofstream(folder_ / "out/a.lock") << "kept";
  const int other = ::open((folder_ / "out/a.lock").c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_EQ(::flock(other, LOCK_EX), 0);
  EXPECT_THAT(refusal("a.lock"), HasSubstr("another process"));
  ::close(other);
  { const OwnDirectory own(out(), "a.lock"); }
  EXPECT_EQ(fs::file_size(folder_ / "out/a.lock"), 4U);
}

TEST_F(OwnDirectoryTest, ALockFileThatIsALinkIsRefused) {
  fs::create_symlink("../elsewhere/precious", folder_ / "out/a.lock");
  EXPECT_THAT(refusal("a.lock"), AllOf(HasSubstr("a.lock is a link"), EndsWith("remove it")));
  fs::remove(folder_ / "out/a.lock");
  fs::create_symlink("../elsewhere/none", folder_ / "out/a.lock");
  EXPECT_THAT(refusal("a.lock"), HasSubstr("a.lock is a link"));
  EXPECT_FALSE(fs::exists(folder_ / "elsewhere/none"));
  EXPECT_TRUE(precious());
}

TEST_F(OwnDirectoryTest, NothingOutsideIsRemoved) {
  fs::create_directory_symlink("../elsewhere", folder_ / "out/link");
  fs::create_symlink("../elsewhere/precious", folder_ / "out/alias");
  fs::create_hard_link(folder_ / "elsewhere/precious", folder_ / "out/hard");
  std::ofstream(folder_ / "out/images/1.png") << "image";
  const OwnDirectory own(out());
  for (const char* name : {"link/precious", "alias", "hard", "images/1.png", "images", "none", "none/none"}) {
    own.remove(name);
  }
  EXPECT_TRUE(precious());
  EXPECT_TRUE(fs::is_symlink(folder_ / "out/link"));
  EXPECT_FALSE(fs::exists(fs::symlink_status(folder_ / "out/alias")));
  EXPECT_FALSE(fs::exists(folder_ / "out/hard"));
  EXPECT_TRUE(fs::is_empty(folder_ / "out/images"));
  EXPECT_THAT(message_of<InputError>([&] { own.require_own_folder("link"); }), HasSubstr("its folder link is a link"));
  own.require_own_folder("images");
  own.require_own_folder("none");
}

TEST_F(OwnDirectoryTest, LeftoversOfTheDeadGo) {
  const auto temporary = [&](const std::string& folder, char digit) {
    const fs::path path = folder_ / folder / (".1.png.tmp-" + std::string(16, digit));
    std::ofstream(path) << "half";
    return path;
  };
  fs::create_directory_symlink("../elsewhere", folder_ / "out/link");
  const fs::path dead = temporary("out/images", '0');
  const fs::path living = temporary("out/images", '1');
  const fs::path outside = temporary("elsewhere", '2');
  const int writer = ::open(living.c_str(), O_RDWR | O_CLOEXEC);
  ASSERT_EQ(::flock(writer, LOCK_SH), 0);
  const OwnDirectory own(out());
  const auto is_image = [](const std::string& name) { return name == "1.png"; };
  own.remove_leftovers("images", [](const std::string& name) { return name == "2.png"; });
  EXPECT_TRUE(fs::exists(dead));
  own.remove_leftovers("images", is_image);
  own.remove_leftovers("link", is_image, true);
  own.remove_leftovers("none", is_image);
  EXPECT_FALSE(fs::exists(dead));
  EXPECT_TRUE(fs::exists(living));
  EXPECT_TRUE(fs::exists(outside));
  own.remove_leftovers("images", is_image, true);
  EXPECT_FALSE(fs::exists(living));
  ::close(writer);
}

}  // namespace touchfield::own_directory_test
