// A SonicSurface's line whose driver says what of the bytes has left: here as this test wants it.
#include <algorithm>
#include <array>
#include <atomic>
#include <cstdarg>
#include <memory>
#include <pty.h>
#include <string>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "hardware/links/sonicsurface_link.h"
#include "sim/core/errors.h"

namespace {

std::atomic<int> waiting = 0;  // bytes that have not left
std::atomic<int> leaving = 0;  // of them before the next question

}  // namespace

// In place of the system's: a pseudo-terminal has no queue of its own.
extern "C" int ioctl(int fd, unsigned long request, ...) noexcept {
  va_list arguments;
  va_start(arguments, request);
  void* argument = va_arg(arguments, void*);
  va_end(arguments);
  if (request == TIOCOUTQ) {
    *static_cast<int*>(argument) = waiting;
    waiting = std::max(0, waiting - leaving);
    return 0;
  }
  return static_cast<int>(::syscall(SYS_ioctl, fd, request, argument));
}

namespace touchfield {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class SerialQueue : public testing::Test {
 protected:
  SerialQueue() {
    std::array<char, 64> name{};
    ::openpty(&master_, &slave_, name.data(), nullptr, nullptr);
    link_ = std::make_unique<SonicsurfaceLink>(name.data(), SonicsurfaceFirmware::kPrimary, SonicsurfaceOrder::kFpga);
    waiting = leaving = 0;
    link_->open();
  }
  ~SerialQueue() override {
    link_->close();
    ::close(master_);
    ::close(slave_);
  }
  SerialQueue(const SerialQueue&) = delete;
  SerialQueue& operator=(const SerialQueue&) = delete;

  int master_ = -1;
  int slave_ = -1;
  std::unique_ptr<SonicsurfaceLink> link_;
};

TEST_F(SerialQueue, QuietIsAnErrorIfItsBytesStay) {
  waiting = 17;
  EXPECT_THAT([&] { link_->quiet(); }, ThrowsMessage<DeviceError>(HasSubstr("17 bytes have not left this machine")));
}

TEST_F(SerialQueue, QuietWaitsForItsLastByte) {
  waiting = 17;
  leaving = 5;
  EXPECT_NO_THROW(link_->quiet());
  EXPECT_EQ(waiting, 0);
}

}  // namespace
}  // namespace touchfield
