#include "hardware/links/serial_port.h"

#include <cerrno>
#include <chrono>
#include <cstring>
#include <fcntl.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <termios.h>
#include <thread>
#include <unistd.h>
#include <utility>

#define ASIO_STANDALONE
#include <asio/io_context.hpp>
#include <asio/serial_port.hpp>
#include <asio/write.hpp>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

using Clock = std::chrono::steady_clock;

std::chrono::nanoseconds nanoseconds(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
}

[[noreturn]] void fail(const std::string& port, const std::string& what) {
  throw DeviceError(fmt::format("serial port {}: {}", port, what));
}

}  // namespace

struct SerialPort::Port {
  asio::io_context context;
  asio::serial_port serial{context};
};

SerialPort::SerialPort(std::string name, unsigned baud) : name_(std::move(name)), port_(std::make_unique<Port>()) {
  struct stat status {};
  if (::stat(name_.c_str(), &status) != 0) {
    fail(name_, errno == ENOENT ? "no device has this name" : std::strerror(errno));
  }
  // Opening a pipe or a tape can have effects of its own.
  if (!S_ISCHR(status.st_mode)) {
    fail(name_, "it is not a serial port");
  }
  asio::error_code error;
  port_->serial.open(name_, error);
  if (error) {
    fail(name_, error.value() == ENOTTY || error.value() == EINVAL ? "it is not a serial port"
                : error.value() == EBUSY                           ? "it is busy: another program has it"
                                                                   : error.message());
  }
  // Root passes the exclusive mode, and programs that know nothing of locks pass the lock: both are set.
  const int descriptor = port_->serial.native_handle();
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0 || ::ioctl(descriptor, TIOCEXCL) != 0) {
    fail(name_, errno == EWOULDBLOCK ? "it is busy: another program has it" : std::strerror(errno));
  }
  using asio::serial_port;
  const auto set = [&](const auto& option, const char* what) {
    port_->serial.set_option(option, error);
    if (error) fail(name_, fmt::format("{} cannot be set: {}", what, error.message()));
  };
  set(serial_port::baud_rate(baud), "its speed");
  set(serial_port::character_size(8), "its data bits");
  set(serial_port::parity(serial_port::parity::none), "its parity");
  set(serial_port::stop_bits(serial_port::stop_bits::one), "its stop bits");
  set(serial_port::flow_control(serial_port::flow_control::none), "its flow control");
}

SerialPort::~SerialPort() {
  ::ioctl(port_->serial.native_handle(), TIOCNXCL);
  asio::error_code ignored;
  port_->serial.close(ignored);
}

void SerialPort::write(const std::vector<std::uint8_t>& bytes, double patience) {
  asio::error_code result;
  bool done = false;
  asio::async_write(port_->serial, asio::buffer(bytes), [&](const asio::error_code& error, std::size_t) {
    result = error;
    done = true;
  });
  port_->context.restart();
  port_->context.run_for(nanoseconds(patience));
  if (!done) {
    port_->serial.cancel(result);
    port_->context.restart();
    port_->context.run();
    fail(name_, fmt::format("it took no more bytes for {:g} s", patience));
  }
  if (result) {
    fail(name_, fmt::format("the device is lost: {}", result.message()));
  }
  written_ = Clock::now();
}

void SerialPort::drain(double patience) {
  for (;;) {
    const bool over = Clock::now() >= written_ + nanoseconds(patience);
    const int waiting = unsent();
    if (waiting <= 0) {
      return;
    }
    if (over) {
      fail(name_,
           fmt::format("it does not respond: {} bytes have not left this machine after {:g} s", waiting, patience));
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
}

int SerialPort::unsent() {
  int waiting = 0;
  if (::ioctl(port_->serial.native_handle(), TIOCOUTQ, &waiting) != 0) {
    const bool cannot = errno == ENOTTY || errno == EINVAL;
    fail(name_, fmt::format("{}: {}", cannot ? "it does not report whether its bytes have left" : "the device is lost",
                            std::strerror(errno)));
  }
  return waiting;
}

void SerialPort::discard() { ::tcflush(port_->serial.native_handle(), TCOFLUSH); }

void SerialPort::check() {
  pollfd watched{port_->serial.native_handle(), 0, 0};
  if (::poll(&watched, 1, 0) != 0) {
    fail(name_, "the device is lost: it hung up");
  }
}

}  // namespace touchfield
