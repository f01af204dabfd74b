#include "hardware/links/sonicsurface_link.h"

#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <numeric>
#include <poll.h>
#include <stdexcept>
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

#include "hardware/device_lock.h"
#include "sim/core/errors.h"

namespace touchfield::sonicsurface {

namespace {

constexpr int kSide = 16;
constexpr int kBlockColumns = 4;                                // a block of 64 bytes is four columns wide
constexpr int kGroup = 8;                                       // and goes down two rows every 8 bytes
constexpr int kGroupColumn[kGroup] = {0, 2, 3, 1, 0, 3, 2, 1};  // of each byte of a group in its block
constexpr int kGroupRow[kGroup] = {0, 0, 0, 1, 1, 1, 1, 0};
constexpr int kBytePhases = 32;

std::uint8_t board_byte(int board) { return static_cast<std::uint8_t>(kSelectBoard + board); }

}  // namespace

std::array<int, kTransducers> wiring(SonicsurfaceOrder order) {
  std::array<int, kTransducers> byte_of{};
  if (order == SonicsurfaceOrder::kNatural) {
    std::iota(byte_of.begin(), byte_of.end(), 0);
    return byte_of;
  }
  for (int byte = 0; byte < kTransducers; ++byte) {
    const int block = byte / (kBlockColumns * kSide);
    const int group = byte / kGroup % (kSide / 2);
    const int column = kBlockColumns * block + kGroupColumn[byte % kGroup];
    const int row = 2 * group + kGroupRow[byte % kGroup];
    const int place = row * kSide + column;
    byte_of[static_cast<std::size_t>(place)] = byte;
  }
  return byte_of;
}

int phase_levels(SonicsurfaceFirmware firmware) {
  return firmware == SonicsurfaceFirmware::kTactile ? kBytePhases / 2 : kBytePhases;
}

std::vector<double> modulation_frequencies(SonicsurfaceFirmware firmware) {
  constexpr double kTicks = 640e3;               // [Hz]
  constexpr double kSteps = 2.0 * kTransducers;  // in a period
  constexpr int kStepLengths = 32;
  std::vector<double> frequencies;
  if (firmware == SonicsurfaceFirmware::kTactile) {
    for (int s = 0; s < kStepLengths; ++s) {
      frequencies.push_back(kTicks / (kSteps * (s + 1)));
    }
  }
  return frequencies;
}

std::uint8_t modulation_byte(std::size_t s) { return static_cast<std::uint8_t>(0xA0 | s); }

std::vector<std::uint8_t> frame_bytes(const DriveFrame& frame, SonicsurfaceFirmware firmware, SonicsurfaceOrder order) {
  const int per_step = kBytePhases / phase_levels(firmware);
  const std::array<int, kTransducers> byte_of = wiring(order);
  std::vector<std::uint8_t> bytes(kBytesPerFrame);
  bytes.front() = kStart;
  bytes.back() = kCommit;
  for (std::size_t n = 0; n < kTransducers; ++n) {
    bytes[1 + static_cast<std::size_t>(byte_of[n])] =
        frame.intensity[n] == 0 ? kOff : static_cast<std::uint8_t>(per_step * frame.phase[n]);
  }
  return bytes;
}

std::vector<std::uint8_t> silent_bytes(SonicsurfaceFirmware firmware) {
  std::vector<std::uint8_t> bytes;
  const bool tactile = firmware == SonicsurfaceFirmware::kTactile;
  for (int buffer = 0; buffer < 2; ++buffer) {
    for (int board = 0; board < (tactile ? 1 : 2); ++board) {
      if (!tactile) bytes.push_back(board_byte(board));
      bytes.push_back(kStart);
      bytes.insert(bytes.end(), kTransducers, kOff);
    }
    bytes.push_back(kCommit);
  }
  if (!tactile) {
    bytes.push_back(board_byte(firmware == SonicsurfaceFirmware::kPrimary ? 0 : 1));
  }
  return bytes;
}

}  // namespace touchfield::sonicsurface

namespace touchfield {

namespace {

using Clock = std::chrono::steady_clock;

const char* firmware_name(SonicsurfaceFirmware firmware) {
  switch (firmware) {
    case SonicsurfaceFirmware::kPrimary:
      return "primary";
    case SonicsurfaceFirmware::kSecondary:
      return "secondary";
    case SonicsurfaceFirmware::kTactile:
      return "tactile";
  }
  throw std::logic_error("unknown firmware");
}

std::chrono::nanoseconds nanoseconds(double seconds) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
}

[[noreturn]] void fail(const std::string& port, const std::string& what) {
  throw DeviceError(fmt::format("serial port {}: {}", port, what));
}

}  // namespace

/// A serial line that is only written to: 8 data bits, no parity, one stop bit, no flow control, kept to this process.
class SerialPort {
 public:
  /// throws   DeviceError: missing, no permission, busy, no serial port, a speed it does not have
  SerialPort(std::string name, unsigned baud);
  ~SerialPort();
  SerialPort(const SerialPort&) = delete;
  SerialPort& operator=(const SerialPort&) = delete;

  /// Hands the bytes to the system, whole.
  /// patience   how long it may take nothing [s]
  /// throws     DeviceError if it does not take them, or the port is gone
  void write(const std::vector<std::uint8_t>& bytes, double patience);
  /// Waits until the bytes are out of this machine. Of a pseudo-terminal the system says so at once, read or not.
  /// patience   how long that may take since the last of them were written [s]
  /// throws     DeviceError if some are still there then, or the port does not tell
  void drain(double patience);
  /// Bytes that are not out of this machine.
  /// throws     DeviceError if the port does not tell
  int unsent();
  /// Throws away what is not out yet.
  void discard();
  /// throws   DeviceError if the port is gone
  void check();

 private:
  std::string name_;
  DeviceLock lock_;
  asio::io_context context_;
  asio::serial_port serial_{context_};
  std::chrono::steady_clock::time_point written_{};  // the last time
};

SerialPort::SerialPort(std::string name, unsigned baud) : name_(std::move(name)) {
  struct stat status {};
  if (::stat(name_.c_str(), &status) != 0) {
    fail(name_, errno == ENOENT ? "no device has this name" : std::strerror(errno));
  }
  // Opening a pipe or a tape can have effects of its own.
  if (!S_ISCHR(status.st_mode)) {
    fail(name_, "it is not a serial port");
  }
  lock_ = DeviceLock(fmt::format("serial {:x}", status.st_rdev), "serial port " + name_);  // by whatever name
  asio::error_code error;
  serial_.open(name_, error);
  if (error) {
    fail(name_, error.value() == ENOTTY || error.value() == EINVAL ? "it is not a serial port"
                : error.value() == EBUSY                           ? "it is busy: another program has it"
                                                                   : error.message());
  }
  // Root passes the exclusive mode, and programs that know nothing of locks pass the lock: both are set.
  const int descriptor = serial_.native_handle();
  if (::flock(descriptor, LOCK_EX | LOCK_NB) != 0 || ::ioctl(descriptor, TIOCEXCL) != 0) {
    fail(name_, errno == EWOULDBLOCK ? "it is busy: another program has it" : std::strerror(errno));
  }
  using asio::serial_port;
  const auto set = [&](const auto& option, const char* what) {
    serial_.set_option(option, error);
    if (error) fail(name_, fmt::format("{} cannot be set: {}", what, error.message()));
  };
  set(serial_port::baud_rate(baud), "its speed");
  set(serial_port::character_size(8), "its data bits");
  set(serial_port::parity(serial_port::parity::none), "its parity");
  set(serial_port::stop_bits(serial_port::stop_bits::one), "its stop bits");
  set(serial_port::flow_control(serial_port::flow_control::none), "its flow control");
}

SerialPort::~SerialPort() {
  ::ioctl(serial_.native_handle(), TIOCNXCL);
  asio::error_code ignored;
  serial_.close(ignored);
}

void SerialPort::write(const std::vector<std::uint8_t>& bytes, double patience) {
  asio::error_code result;
  bool done = false;
  asio::async_write(serial_, asio::buffer(bytes), [&](const asio::error_code& error, std::size_t) {
    result = error;
    done = true;
  });
  context_.restart();
  context_.run_for(nanoseconds(patience));
  if (!done) {
    serial_.cancel(result);
    context_.restart();
    context_.run();
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
  if (::ioctl(serial_.native_handle(), TIOCOUTQ, &waiting) != 0) {
    const bool cannot = errno == ENOTTY || errno == EINVAL;
    fail(name_, fmt::format("{}: {}", cannot ? "it does not report whether its bytes have left" : "the device is lost",
                            std::strerror(errno)));
  }
  return waiting;
}

void SerialPort::discard() { ::tcflush(serial_.native_handle(), TCOFLUSH); }

void SerialPort::check() {
  pollfd watched{serial_.native_handle(), 0, 0};
  if (::poll(&watched, 1, 0) != 0) {
    fail(name_, "the device is lost: it hung up");
  }
}

SonicsurfaceLink::SonicsurfaceLink(std::string port, SonicsurfaceFirmware firmware, SonicsurfaceOrder order)
    : port_(std::move(port)), firmware_(firmware), order_(order), layout_(sonicsurface_layout()) {}

SonicsurfaceLink::~SonicsurfaceLink() = default;

void SonicsurfaceLink::close() noexcept { serial_.reset(); }

std::string SonicsurfaceLink::describe() const {
  return fmt::format("sonicsurface on {}, {} firmware{}", port_, firmware_name(firmware_),
                     order_ == SonicsurfaceOrder::kNatural ? ", natural order" : "");
}

LinkAbilities SonicsurfaceLink::abilities() const {
  return {{sonicsurface::phase_levels(firmware_), 2},
          sonicsurface::kFramesPerSecond,
          {0, 0, sonicsurface::modulation_frequencies(firmware_)}};
}

void SonicsurfaceLink::open() {
  serial_ = std::make_unique<SerialPort>(port_, sonicsurface::kBaud);
  free_at_ = Clock::now();
  stuck_ = false;
  silence();
  if (firmware_ != SonicsurfaceFirmware::kTactile) {
    write({sonicsurface::kClocksOn});
  }
}

void SonicsurfaceLink::set_modulation(const Modulation& modulation) {
  const ModulationAbility ability = abilities().modulation;
  require_ability(modulation, ability, describe());
  if (const auto* sine = std::get_if<SineModulation>(&modulation)) {
    write({sonicsurface::modulation_byte(own_frequency(*sine, ability, describe()))});
  }
}

void SonicsurfaceLink::send(const DriveFrame& frame) {
  require_fits(frame, abilities(), sonicsurface::kTransducers, describe());
  drain();
  write(sonicsurface::frame_bytes(frame, firmware_, order_));
}

void SonicsurfaceLink::check() {
  serial().check();
  drain();
}

void SonicsurfaceLink::silence() {
  if (stuck_ || serial().unsent() > 0) {
    serial().discard();
    free_at_ = Clock::now();
    stuck_ = false;
  }
  write(sonicsurface::silent_bytes(firmware_));
  drain();
}

void SonicsurfaceLink::drain() {
  std::this_thread::sleep_until(free_at_);
  unless_stuck([&] { serial().drain(kLinkPatience); });
}

void SonicsurfaceLink::write(const std::vector<std::uint8_t>& bytes) {
  constexpr double kBitsPerByte = 10;
  std::this_thread::sleep_until(free_at_);
  const auto carried =
      std::chrono::duration<double>(kBitsPerByte * static_cast<double>(bytes.size()) / sonicsurface::kBaud);
  const auto start = Clock::now();
  unless_stuck([&] { serial().write(bytes, kLinkPatience); });
  free_at_ = start + std::chrono::duration_cast<Clock::duration>(carried);
}

template <class Action>
void SonicsurfaceLink::unless_stuck(const Action& act) {
  try {
    act();
  } catch (const DeviceError&) {
    stuck_ = true;
    throw;
  }
}

SerialPort& SonicsurfaceLink::serial() {
  if (!serial_) {
    throw DeviceError(fmt::format("{}: it is not open", describe()));
  }
  return *serial_;
}

}  // namespace touchfield
