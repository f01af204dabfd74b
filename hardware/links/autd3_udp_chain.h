#pragma once

#include <cstddef>
#include <cstdint>
#include <netinet/in.h>
#include <optional>
#include <string>
#include <vector>

#include "hardware/device_lock.h"
#include "hardware/links/autd3_udp_place.h"
#include "hardware/links/autd3_udp_protocol.h"
#include "sim/core/child_process.h"

namespace touchfield {

/// AUTD3 units in a row on one network, unit after unit in the order of the cables.
///
/// One program drives them at a time. On this machine a lock keeps the others away. Another machine is noticed by what
/// the units answer. Each program sets their clock to a time of its own, and only its commands move their sequence on.
///
/// throws   DeviceError from everything that touches the network: nobody answers, several chains answer, a firmware
///          that is not known, another number of units, a unit that refuses or no longer answers, another program
class Autd3UdpChain {
 public:
  /// A list of commands, of one unit.
  using Program = std::vector<autd3_udp::Command>;

  /// host   a network interface by name, or an address if there is a port; empty: the one interface where units answer
  /// port   of the address, 0: host names an interface
  Autd3UdpChain(std::string host, int port, std::size_t units);

  /// "the network interface eth0", "[::1] port 44336"
  std::string place() const { return place_.text(); }
  /// Of the protocol, once it is open.
  int version() const { return version_; }
  std::size_t size() const { return units_.size(); }
  bool is_open() const { return socket_.number() >= 0; }
  /// Whether another program has begun to drive the units.
  bool is_taken() const { return taken_; }

  /// Numbers the units in the order of the chain and sets their clocks in step: about a second, at most 15 s.
  void open();
  /// Takes the units as another process has numbered them, within 0.1 s; those that do not answer count as lost.
  /// returns  false if none has a number
  bool adopt();
  void close() noexcept;

  /// Sends each unit its own commands, each confirmed before the next. All units are served at the same time. A command
  /// without an answer is sent again every 10 ms. After open() only kReset begins the sequence again.
  ///
  /// programs   one of each unit, or one for all
  /// what       for messages, e.g. "frame 3"
  /// patience   for each answer [s]
  /// returns    the answer of each unit to its last command
  std::vector<autd3_udp::Bytes> run(const std::vector<Program>& programs, const std::string& what, double patience);

 private:
  struct Unit {
    sockaddr_in6 address{};
    bool there = false;                              // it has an address
    std::uint8_t sequence = autd3_udp::kAfterReset;  // that it has executed last
  };
  struct Heard {
    sockaddr_in6 from{};
    autd3_udp::Answer answer;
  };
  struct Progress;

  void open_socket();
  DeviceLock lock_of(const sockaddr_in6& group) const;
  void find_group();
  void require_known(const std::vector<Heard>& heard);
  void number_units();
  [[noreturn]] void fail_many() const;
  std::optional<sockaddr_in6> unit_without_number();
  void assign(std::size_t unit, const sockaddr_in6& address);
  void set_clock();
  void require_firmware();
  /// The number of the unit at an address, or how many units there are.
  std::size_t unit_at(const sockaddr_in6& address) const;
  void send_next(const Unit& unit, Progress& at);
  /// returns  whether an answer confirms the command that its unit works at
  bool hear(const Heard& heard, std::vector<Progress>& progress, const std::string& what);
  /// Whether another program has set a clock; 0 is that of a unit that cannot tell.
  bool is_foreign(std::uint64_t clock) const;
  [[noreturn]] void fail_taken(const std::string& what);
  [[noreturn]] void fail_lost(const std::string& what, const std::vector<Progress>& progress);

  /// The answer of a unit that has a number, asked several times.
  autd3_udp::Bytes ask(std::size_t unit, autd3_udp::Kind kind, const autd3_udp::Bytes& body);
  /// returns  the number of the message, which its answers have
  std::uint16_t request(const sockaddr_in6& to, autd3_udp::Kind kind, const autd3_udp::Bytes& body = {});
  void transmit(const sockaddr_in6& to, const autd3_udp::Bytes& bytes);
  /// The answers to the requests since one that come within a time, but no longer once there are `enough`.
  std::vector<Heard> collect(std::uint16_t since, double seconds, std::size_t enough);
  bool receive(Heard& heard);
  void wait(double until) const;

  autd3_udp::Place place_;
  std::vector<Unit> units_;
  Descriptor socket_;
  DeviceLock lock_;
  sockaddr_in6 group_{};
  std::uint64_t clock_ = 0;  // of the units [ns], at a time of this machine [s]
  double clock_since_ = 0;
  bool taken_ = false;
  int version_ = autd3_udp::kNewest;
  std::uint16_t message_ = 0;
  std::string refusal_;  // of the system, the last time that it did not send
};

}  // namespace touchfield
