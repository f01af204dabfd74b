#pragma once

#include <cstddef>
#include <cstdint>
#include <netinet/in.h>
#include <optional>
#include <string>
#include <vector>

#include "hardware/links/autd3_udp_protocol.h"
#include "sim/core/child_process.h"

namespace touchfield {

/// AUTD3 units in a row on one network, unit after unit in the order of the cables.
///
/// throws   DeviceError from everything that touches the network: nobody answers, several chains answer, a firmware
///          that is not known, another number of units, a unit that refuses or no longer answers
class Autd3UdpChain {
 public:
  /// A list of commands, of one unit.
  using Program = std::vector<autd3_udp::Command>;

  /// host   a network interface by name, or an address if there is a port; empty: the one interface where units answer
  /// port   of the address, 0: host names an interface
  Autd3UdpChain(std::string host, int port, std::size_t units);

  /// "the network interface eth0", "[::1] port 44336"
  std::string place() const;
  /// Of the protocol, once it is open.
  int version() const { return version_; }
  std::size_t size() const { return units_.size(); }
  bool is_open() const { return socket_.number() >= 0; }

  /// Numbers the units in the order of the chain and sets their clocks in step: about a second, at most 15 s.
  void open();
  /// Takes the units as another process has numbered them, within 0.1 s; those that do not answer count as lost.
  /// returns  false if none has a number
  bool adopt();
  void close() noexcept { socket_.close(); }

  /// Sends each unit its own commands, each confirmed before the next. All units are served at the same time. A command
  /// without an answer is sent again every 10 ms.
  ///
  /// programs   one of each unit, or one for all
  /// what       for messages, e.g. "frame 3"
  /// patience   for all of it [s]
  /// returns    the answer of each unit to its last command
  std::vector<autd3_udp::Bytes> run(const std::vector<Program>& programs, const std::string& what, double patience);

 private:
  struct Unit {
    sockaddr_in6 address{};
    bool there = false;         // it has an address
    bool in_step = false;       // its next sequence number is known
    std::uint8_t sequence = 0;  // the next
  };
  struct Heard {
    sockaddr_in6 from{};
    autd3_udp::Answer answer;
  };
  struct Progress;

  void open_socket();
  std::vector<sockaddr_in6> groups() const;
  void find_group();
  void require_known(const std::vector<Heard>& heard);
  void number_units();
  [[noreturn]] void fail_many() const;
  std::optional<sockaddr_in6> unit_without_number();
  void assign(std::size_t unit, const sockaddr_in6& address);
  void set_clock();
  void require_firmware();
  void send_next(Unit& unit, Progress& at);
  std::vector<std::size_t> lose_step(const std::vector<Progress>& progress);
  [[noreturn]] void fail_lost(const std::string& what, const std::vector<Progress>& progress);

  /// The answer of a unit that has a number, asked several times.
  autd3_udp::Bytes ask(std::size_t unit, autd3_udp::Kind kind, const autd3_udp::Bytes& body);
  /// returns  the number of the message, which its answers have
  std::uint16_t request(const sockaddr_in6& to, autd3_udp::Kind kind, const autd3_udp::Bytes& body = {});
  void transmit(const sockaddr_in6& to, const autd3_udp::Bytes& bytes);
  /// The answers to a request that come within a time, but no longer once there are `enough`.
  std::vector<Heard> collect(std::uint16_t message, double seconds, std::size_t enough);
  bool receive(Heard& heard);
  void wait(double until) const;

  std::string host_;
  int port_;
  std::vector<Unit> units_;
  Descriptor socket_;
  sockaddr_in6 group_{};
  int version_ = autd3_udp::kNewest;
  std::uint16_t message_ = 0;
  std::string refusal_;  // of the system, the last time that it did not send
};

}  // namespace touchfield
