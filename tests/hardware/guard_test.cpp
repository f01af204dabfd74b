// A guarded link to a SonicSurface behind a pseudo-terminal, with this program as its guard.
#include <atomic>
#include <chrono>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <poll.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <thread>
#include <unistd.h>

#include "hardware/guard/guard_process.h"
#include "hardware/guard/guarded_link.h"
#include "hardware/links/sonicsurface_link.h"
#include "tests/support/testing.h"

namespace touchfield::guard_test {

/// A pipe that any process inherits which is not kept from it.
struct OpenPipe {
  OpenPipe() { EXPECT_EQ(::pipe(ends.data()), 0); }
  ~OpenPipe() {
    for (const int end : ends) ::close(end);
  }
  OpenPipe(const OpenPipe&) = delete;
  OpenPipe& operator=(const OpenPipe&) = delete;

  std::array<int, 2> ends{-1, -1};
};

/// What the single board of a line would emit.
class Board {
 public:
  Board() {
    ::openpty(&master_, &slave_, name_.data(), nullptr, nullptr);
    ::ioctl(slave_, TIOCNXCL);
    thread_ = std::thread([this] { read(); });
  }
  ~Board() {
    ended_ = true;
    thread_.join();
    ::close(master_);
    ::close(slave_);
  }
  Board(const Board&) = delete;
  Board& operator=(const Board&) = delete;

  std::string address() const { return "sonicsurface:" + std::string(name_.data()); }
  /// Lets another process in, as a port that its last owner closed does.
  void release() const { ::ioctl(slave_, TIOCNXCL); }
  bool becomes(bool on) const {
    for (int k = 0; k < 5000 && on_ != on; ++k) std::this_thread::sleep_for(std::chrono::milliseconds(2));
    return on_ == on;
  }

 private:
  void read() {
    std::array<std::uint8_t, 4096> bytes{};
    while (!ended_) {
      pollfd watched{master_, POLLIN, 0};
      if (::poll(&watched, 1, 20) <= 0) continue;
      const ssize_t size = ::read(master_, bytes.data(), bytes.size());
      for (ssize_t k = 0; k < size; ++k) hear(bytes[static_cast<std::size_t>(k)]);
    }
  }

  void hear(std::uint8_t byte) {
    if (byte == sonicsurface::kCommit) {
      std::swap(front_, back_);
      on_ = front_ || back_;
    } else if (byte == sonicsurface::kSelectBoard || byte == sonicsurface::kSelectBoard + 1) {
      listens_ = byte == sonicsurface::kSelectBoard;
    } else if (listens_ && byte == sonicsurface::kStart) {
      back_ = false;
    } else if (listens_ && byte < sonicsurface::kOff) {
      back_ = true;
    }
  }

  int master_ = -1;
  int slave_ = -1;
  std::array<char, 64> name_{};
  bool front_ = true;  // one of its transducers is on
  bool back_ = true;
  bool listens_ = true;
  std::atomic<bool> on_ = true;
  std::atomic<bool> ended_ = false;
  std::thread thread_;
};

pid_t child_of(pid_t process) {
  pid_t child = -1;
  std::ifstream("/proc/" + std::to_string(process) + "/task/" + std::to_string(process) + "/children") >> child;
  return child;
}

DriveFrame loud_frame() { return {std::vector<std::uint8_t>(256, 3), std::vector<std::uint8_t>(256, 1)}; }

class Guarded : public testing::Test {
 protected:
  void emit() {
    link_.open();
    ASSERT_TRUE(board_.becomes(false)) << "a board that was just powered emits";
    link_.set_modulation(StaticModulation{});
    link_.send(loud_frame());
    guard_ = child_of(::getpid());
    board_.release();
    ASSERT_GT(guard_, 0);
    ASSERT_TRUE(board_.becomes(true));
  }

  /// What the program is told that goes on with its own.
  std::string loss() {
    try {
      for (;;) link_.check();
    } catch (const DeviceError& error) {
      return error.what();
    }
  }

  OpenPipe pipe_;
  Board board_;
  GuardedLink link_{{"/proc/self/exe", "guard"}, {board_.address(), {}, 1, false}, {1, 60}};
  pid_t guard_ = -1;
};

TEST_F(Guarded, IsSilentOnRequest) {
  emit();
  link_.check();
  link_.silence();
  EXPECT_TRUE(board_.becomes(false));
  link_.close();
}

TEST_F(Guarded, LetsNothingThroughThatDoesNotFit) {
  emit();
  EXPECT_THROW(link_.send({{1}, {1}}), InputError);
  link_.close();
  EXPECT_TRUE(board_.becomes(false)) << "closed without having been silenced";
}

TEST_F(Guarded, ASilentProgram) {
  emit();
  EXPECT_TRUE(board_.becomes(false));
  EXPECT_THAT(loss(), HasSubstr("the program that drove the array said nothing for 250 ms; the array is silent"));
}

TEST_F(Guarded, AStoppedGuard) {
  emit();
  ::kill(guard_, SIGSTOP);
  EXPECT_THAT(loss(), HasSubstr("link guard: it was stopped by a signal; the array is silent"));
  EXPECT_TRUE(board_.becomes(false));
}

TEST_F(Guarded, AKilledGuard) {
  emit();
  ::kill(guard_, SIGKILL);
  EXPECT_THAT(loss(), HasSubstr("link guard: it was ended by SIGKILL; the array is silent"));
  EXPECT_TRUE(board_.becomes(false));
}

TEST_F(Guarded, AKilledGuardThatIsClosed) {
  emit();
  ::kill(guard_, SIGKILL);
  testing::internal::CaptureStderr();
  link_.close();
  EXPECT_THAT(testing::internal::GetCapturedStderr(), HasSubstr("it was ended by SIGKILL; the array is silent"));
  EXPECT_TRUE(board_.becomes(false));
}

// As one that is frozen while its program is not. It continues before the program looks at it again.
TEST_F(Guarded, AGuardThatWasAwayDoesNotGoOn) {
  emit();
  ::kill(guard_, SIGSTOP);
  std::this_thread::sleep_for(std::chrono::milliseconds(400));
  ::kill(guard_, SIGCONT);
  EXPECT_THAT(loss(), MatchesRegex(".*did not supervise the array for [0-9.]+ s \\(at most 0\\.25 s\\).*the array is "
                                   "silent.*"));
  EXPECT_TRUE(board_.becomes(false));
}

TEST_F(Guarded, NothingResumesAfterALoss) {
  emit();
  ::kill(guard_, SIGKILL);
  loss();
  EXPECT_THROW(link_.send(loud_frame()), DeviceError);
  EXPECT_TRUE(board_.becomes(false));
}

TEST_F(Guarded, HoldsNoneOfTheProgramsOutput) {
  emit();
  const auto own = std::filesystem::read_symlink("/proc/self/fd/" + std::to_string(pipe_.ends[1]));
  const std::string open = "/proc/" + std::to_string(guard_) + "/fd/";
  EXPECT_EQ(std::filesystem::read_symlink(open + "0"), "/dev/null");
  EXPECT_EQ(std::filesystem::read_symlink(open + "1"), "/dev/null");
  for (const auto& entry : std::filesystem::directory_iterator(open)) {
    EXPECT_NE(std::filesystem::read_symlink(entry.path()), own) << entry.path();
  }
}

TEST(GuardProcess, IsNotStartedByHand) {
  ::close(kGuardDescriptor);
  EXPECT_THAT([] { run_guard(); }, ThrowsMessage<InputError>(HasSubstr("not for use by hand")));
}

}  // namespace touchfield::guard_test

int main(int argc, char** argv) {
  if (argc == 2 && std::string(argv[1]) == "guard") {
    touchfield::run_guard();
    return 0;
  }
  testing::InitGoogleTest(&argc, argv);
  return RUN_ALL_TESTS();
}
