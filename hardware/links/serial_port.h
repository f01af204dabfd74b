#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace touchfield {

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
  struct Port;
  std::string name_;
  std::unique_ptr<Port> port_;
  std::chrono::steady_clock::time_point written_{};  // the last time
};

}  // namespace touchfield
