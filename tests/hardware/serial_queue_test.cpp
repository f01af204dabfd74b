// A SonicSurface's line whose driver says what of the bytes has left: here as this test wants it.
#include <atomic>
#include <chrono>
#include <cstdarg>
#include <fcntl.h>
#include <pty.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/syscall.h>
#include <thread>
#include <unistd.h>

#include "hardware/guard/guarded_link.h"
#include "hardware/links/sonicsurface_link.h"
#include "tests/support/testing.h"

namespace {

/// What the driver says, in this process and in the guards that it starts.
struct Queue {
  std::atomic<int> waiting;  // bytes that have not left
  std::atomic<int> leaving;  // of them before the next question
};

Queue& queue() {
  static Queue* const shared = [] {
    constexpr const char* kFile = "TOUCHFIELD_TEST_QUEUE";
    const char* path = std::getenv(kFile);
    const int file = path != nullptr ? ::open(path, O_RDWR) : ::memfd_create("queue", MFD_CLOEXEC);
    if (path == nullptr) {
      ::setenv(kFile, ("/proc/" + std::to_string(::getpid()) + "/fd/" + std::to_string(file)).c_str(), 1);
    }
    EXPECT_EQ(::ftruncate(file, sizeof(Queue)), 0);
    return static_cast<Queue*>(::mmap(nullptr, sizeof(Queue), PROT_READ | PROT_WRITE, MAP_SHARED, file, 0));
  }();
  return *shared;
}

}  // namespace

// In place of the system's: a pseudo-terminal has no queue of its own.
extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  if (request == TIOCOUTQ) {
    *static_cast<int*>(argument) = queue().waiting;
    queue().waiting = std::max(0, queue().waiting - queue().leaving);
    return 0;
  }
  return static_cast<int>(::syscall(SYS_ioctl, fd, request, argument));
}

namespace touchfield {
namespace {

DriveFrame all_on() { return {std::vector<std::uint8_t>(256, 5), std::vector<std::uint8_t>(256, 1)}; }

/// A pseudo-terminal whose other side nobody reads.
class SerialQueue : public testing::Test {
 protected:
  SerialQueue() {
    queue().waiting = queue().leaving = 0;
    ::openpty(&master_, &slave_, name_.data(), nullptr, nullptr);
  }
  ~SerialQueue() override {
    queue().waiting = queue().leaving = 0;
    ::close(master_);
    ::close(slave_);
  }
  SerialQueue(const SerialQueue&) = delete;
  SerialQueue& operator=(const SerialQueue&) = delete;

  /// What has come out on the other side.
  std::vector<std::uint8_t> out() const {
    std::vector<std::uint8_t> bytes(1 << 16);
    ::fcntl(master_, F_SETFL, O_NONBLOCK);
    std::size_t size = 0;
    for (ssize_t got = 0; (got = ::read(master_, bytes.data() + size, bytes.size() - size)) > 0;) {
      size += static_cast<std::size_t>(got);
    }
    bytes.resize(size);
    return bytes;
  }

  int master_ = -1;
  int slave_ = -1;
  std::array<char, 64> name_{};
};

class QueueOfALink : public SerialQueue {
 protected:
  QueueOfALink() {
    link_.open();
    out();
  }

  SonicsurfaceLink link_{name_.data(), SonicsurfaceFirmware::kPrimary, SonicsurfaceOrder::kFpga};
};

TEST_F(QueueOfALink, SilenceIsAnErrorIfItsBytesStay) {
  queue().waiting = 17;
  EXPECT_THAT([&] { link_.silence(); }, ThrowsMessage<DeviceError>(HasSubstr("17 bytes have not left this machine")));
}

TEST_F(QueueOfALink, SilenceWaitsForItsLastByte) {
  queue().waiting = 17;
  queue().leaving = 5;
  EXPECT_NO_THROW(link_.silence());
  EXPECT_EQ(queue().waiting, 0);
}

TEST_F(QueueOfALink, AFrameWaitsForTheOneBefore) {
  link_.send(all_on());
  queue().waiting = 200;
  queue().leaving = 50;
  link_.send(all_on());
  EXPECT_EQ(queue().waiting, 0);
  EXPECT_EQ(out().size(), 2U * sonicsurface::kBytesPerFrame);
}

TEST_F(QueueOfALink, NoFrameIsPutBehindOneThatStays) {
  link_.send(all_on());
  queue().waiting = 258;
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THAT(
      [&] { link_.send(all_on()); },
      ThrowsMessage<DeviceError>(HasSubstr("it does not respond: 258 bytes have not left this machine after 0.1 s")));
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(80));
  EXPECT_EQ(out().size(), std::size_t{sonicsurface::kBytesPerFrame});
}

TEST_F(QueueOfALink, AHeldFrameThatStaysIsNoticed) {
  link_.send(all_on());
  EXPECT_NO_THROW(link_.check());
  queue().waiting = 1;
  EXPECT_THAT([&] { link_.check(); }, ThrowsMessage<DeviceError>(HasSubstr("1 bytes have not left")));
}

// The silence is what leaves first, and in full: a board that has part of a frame begins anew with it.
TEST_F(QueueOfALink, SilenceTakesThePlaceOfWhatWaits) {
  link_.send(all_on());
  queue().waiting = 100;
  queue().leaving = 100;
  link_.silence();
  const std::vector<std::uint8_t> bytes = out();
  const std::vector<std::uint8_t> silence = sonicsurface::silent_bytes(SonicsurfaceFirmware::kPrimary);
  ASSERT_GE(bytes.size(), silence.size());
  EXPECT_TRUE(std::equal(silence.rbegin(), silence.rend(), bytes.rbegin()));
}

class QueueOfAGuard : public SerialQueue {
 protected:
  QueueOfAGuard() {
    link_.open();
    link_.send(all_on());
  }
  /// Holds the frame for so long as a player does.
  void hold(std::chrono::milliseconds time) {
    for (const auto end = std::chrono::steady_clock::now() + time; std::chrono::steady_clock::now() < end;) {
      link_.check();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  }

  GuardedLink link_{{"/proc/self/exe", "guard"}, {"sonicsurface:" + std::string(name_.data()), {}, 1, false}, {1, 60}};
};

TEST_F(QueueOfAGuard, ALineThatStandsStillEndsIt) {
  hold(std::chrono::milliseconds(60));
  queue().waiting = 258;
  EXPECT_THAT([&] { hold(std::chrono::seconds(5)); },
              ThrowsMessage<DeviceError>(AllOf(HasSubstr("it does not respond: 258 bytes have not left this machine"),
                                               HasSubstr("the array could not be silenced"),
                                               HasSubstr("may still be on: switch off its supply"))));
}

TEST_F(QueueOfAGuard, AShortStopOfTheLineIsAGapAndGoesOn) {
  std::jthread line([] {
    queue().waiting = 258;
    std::this_thread::sleep_for(std::chrono::milliseconds(70));
    queue().waiting = 0;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(5));
  link_.send(all_on());
  line.join();
  EXPECT_NO_THROW(hold(std::chrono::milliseconds(60)));
  link_.silence();
  link_.close();
  EXPECT_GE(link_.gaps().count, 1U);
  EXPECT_GT(link_.gaps().longest, kShownGap);
  EXPECT_THAT(link_.gaps().longest, Lt(kLongestGap));
}

}  // namespace
}  // namespace touchfield
