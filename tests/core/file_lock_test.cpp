// Locks of files and folders: of one holder at a time, whatever becomes of it and of their names.

#include <csignal>
#include <filesystem>
#include <sys/wait.h>
#include <unistd.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::file_lock_test {

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

}  // namespace touchfield::file_lock_test
