#include "sim/core/files.h"

#include <csignal>
#include <filesystem>
#include <fstream>
#include <functional>
#include <string>
#include <sys/stat.h>
#include <sys/wait.h>
#include <thread>
#include <unistd.h>
#include <utility>
#include <vector>

#include "sim/core/errors.h"
#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::files_test {

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

TEST(Leftover, IsKnownByItsName) {
  EXPECT_EQ(target_of_temporary(".a.txt.tmp-0123456789abcdef"), "a.txt");
  for (const char* other :
       {"a.txt", ".a.txt.tmp-", ".a.txt.tmp-0123456789abcde", ".a.txt.tmp-0123456789abcdeg",
        ".b.txt.tmp-0123456789abcdef", ".a.txt.tmp-0123456789abcdef0", "a.txt.tmp-0123456789abcdef"}) {
    EXPECT_NE(target_of_temporary(other), "a.txt") << other;
  }
}

using State = FileLock::State;

class Lock : public ::testing::TestWithParam<bool> {
 protected:
  FileLock lock() const { return GetParam() ? FileLock::of_folder(path_) : FileLock::of_file(path_); }

  const TemporaryDirectory temporary_;
  const std::string path_ = (temporary_.path() / "one").string();
};

TEST_P(Lock, IsOfOneAtATimeAndMovesWithItsObject) {
  {
    FileLock first = lock();
    EXPECT_EQ(first.state(), State::kHeld);
    const FileLock moved = std::move(first);
    EXPECT_EQ(lock().state(), State::kElsewhere);
  }
  EXPECT_EQ(lock().state(), State::kHeld);
  EXPECT_EQ(std::filesystem::is_directory(path_), GetParam());
}

TEST_P(Lock, EndsWithTheObjectThoughACopyOfTheProcessLives) {
  pid_t copy = -1;
  {
    const FileLock own = lock();
    copy = ::fork();
    if (copy == 0) {
      ::pause();
      ::_exit(0);
    }
    EXPECT_EQ(lock().state(), State::kElsewhere);
  }
  EXPECT_EQ(lock().state(), State::kHeld);
  ::kill(copy, SIGKILL);
  ::waitpid(copy, nullptr, 0);
}

TEST_P(Lock, IsOfTheNameAsItIsNow) {
  const FileLock renamed = lock();
  std::filesystem::rename(path_, path_ + ".old");
  EXPECT_EQ(lock().state(), State::kHeld);
}

TEST_P(Lock, SaysWhatCannotBeLocked) {
  std::filesystem::create_directory(path_ + ".d");
  const std::string nowhere = path_ + "/none";
  EXPECT_THAT(message_of<IoError>([&] { FileLock::of_folder(nowhere); }), HasSubstr(nowhere + " cannot be made"));
  EXPECT_THROW(FileLock::of_file(path_ + ".d"), IoError);
}

INSTANTIATE_TEST_SUITE_P(Of, Lock, ::testing::Bool());

}  // namespace touchfield::files_test
