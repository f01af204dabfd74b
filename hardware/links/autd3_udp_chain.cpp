#include "hardware/links/autd3_udp_chain.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <ifaddrs.h>
#include <map>
#include <net/if.h>
#include <netdb.h>
#include <poll.h>
#include <sys/socket.h>
#include <thread>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/version.h"

namespace touchfield {

using namespace autd3_udp;

namespace {

constexpr double kAnswerTime = 0.1;    // [s] for answers to a question to all
constexpr double kForgetTime = 0.1;    // [s] until all units have forgotten their numbers
constexpr double kFindPatience = 3;    // [s] until every unit was found: one that was just switched on starts up
constexpr double kClockPatience = 10;  // [s] until all clocks are in step
constexpr double kClockLook = 0.05;    // [s]
constexpr double kRepeat = 0.01;       // [s] after which what was not answered is sent again
constexpr double kStartPatience = 1;   // [s] for a unit to clear itself
constexpr double kDiagnosis = 0.015;   // [s] to find out why a unit does not answer
constexpr int kAttempts = 5;
constexpr int kTimes = 3;                  // that a command is sent before the sequence begins again
constexpr double kNotSent = -1;            // as a time
constexpr std::uint8_t kAfterReset = 255;  // as the number of the command that was executed last

// Series of firmware with each version of the protocol.
const std::map<int, std::vector<std::string>> kSeries{{2, {"0.10", "0.11"}}, {3, {"0.12"}}};

[[noreturn]] void fail(const std::string& what) { throw DeviceError("autd3-udp: " + what); }

bool same(const sockaddr_in6& a, const sockaddr_in6& b) {
  return a.sin6_port == b.sin6_port && std::memcmp(&a.sin6_addr, &b.sin6_addr, sizeof a.sin6_addr) == 0;
}

std::string interface_name(unsigned number) {
  std::array<char, IF_NAMESIZE> name{};
  return ::if_indextoname(number, name.data()) != nullptr ? name.data() : std::to_string(number);
}

// Where all units of an interface listen.
sockaddr_in6 all_units(unsigned interface) {
  sockaddr_in6 group{};
  group.sin6_family = AF_INET6;
  group.sin6_port = htons(kPort);
  group.sin6_scope_id = interface;
  group.sin6_addr.s6_addr[0] = 0xff;
  group.sin6_addr.s6_addr[1] = 0x02;
  group.sin6_addr.s6_addr[15] = 0x01;
  return group;
}

}  // namespace

/// How far a unit is with its program.
struct Autd3UdpChain::Progress {
  const Program* program = nullptr;
  std::size_t next = 0;
  double sent_at = kNotSent;  // the command that it works at, or the reset before it
  std::uint16_t message = 0;
  int times = 0;  // that it was sent
  Bytes bytes;
  Bytes data;  // that it answered last

  bool over() const { return next == program->size(); }
};

Autd3UdpChain::Autd3UdpChain(std::string host, int port, std::size_t units)
    : host_(std::move(host)), port_(port), units_(units) {}

std::string Autd3UdpChain::place() const {
  return port_ > 0       ? fmt::format("[{}] port {}", host_, port_)
         : host_.empty() ? "the network interface where they answer"
                         : fmt::format("the network interface {}", host_);
}

void Autd3UdpChain::open() {
  open_socket();
  for (Unit& unit : units_) {
    unit = {};
  }
  find_group();
  number_units();
  set_clock();
  require_firmware();
  run({{kClear, kSynchronize}}, "the start", kStartPatience);
}

bool Autd3UdpChain::adopt() {
  open_socket();
  std::size_t found = 0;
  for (int attempt = 0; attempt < kAttempts && found < units_.size(); ++attempt) {
    for (const sockaddr_in6& group : groups()) {
      for (const Heard& heard : collect(request(group, Kind::kReadUnit), kRepeat, units_.size())) {
        if (heard.answer.version < version_ && heard.answer.version >= kOldest) {
          version_ = heard.answer.version;
        }
        const auto info = unit_info_of(heard.answer);
        if (info && (info->flags & kAssigned) != 0 && info->id < units_.size() && !units_[info->id].there) {
          units_[info->id].address = heard.from;
          units_[info->id].there = true;
          group_ = group;
          ++found;
        }
      }
    }
  }
  return found > 0;
}

void Autd3UdpChain::open_socket() {
  socket_ = Descriptor(::socket(AF_INET6, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_in6 any{};
  any.sin6_family = AF_INET6;
  if (socket_.number() < 0 || ::bind(socket_.number(), reinterpret_cast<const sockaddr*>(&any), sizeof any) != 0) {
    fail(fmt::format("no socket: {}", std::strerror(errno)));
  }
  const int no = 0;  // this machine is not a unit
  ::setsockopt(socket_.number(), IPPROTO_IPV6, IPV6_MULTICAST_LOOP, &no, sizeof no);
}

std::vector<sockaddr_in6> Autd3UdpChain::groups() const {
  std::vector<sockaddr_in6> groups;
  if (port_ > 0) {
    addrinfo wanted{};
    wanted.ai_family = AF_INET6;
    wanted.ai_socktype = SOCK_DGRAM;
    addrinfo* found = nullptr;
    const int failed = ::getaddrinfo(host_.c_str(), std::to_string(port_).c_str(), &wanted, &found);
    if (failed != 0) {
      fail(fmt::format("no IPv6 address of {}: {}", host_, ::gai_strerror(failed)));
    }
    std::memcpy(&groups.emplace_back(), found->ai_addr, sizeof(sockaddr_in6));
    ::freeaddrinfo(found);
    return groups;
  }
  ifaddrs* all = nullptr;
  if (::getifaddrs(&all) != 0) {
    fail(fmt::format("the network interfaces cannot be listed: {}", std::strerror(errno)));
  }
  for (const ifaddrs* at = all; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || at->ifa_addr->sa_family != AF_INET6 || (at->ifa_flags & IFF_LOOPBACK) != 0) {
      continue;
    }
    const auto* address = reinterpret_cast<const sockaddr_in6*>(at->ifa_addr);
    if (IN6_IS_ADDR_LINKLOCAL(&address->sin6_addr) && (host_.empty() || host_ == at->ifa_name)) {
      groups.push_back(all_units(address->sin6_scope_id));
    }
  }
  ::freeifaddrs(all);
  if (groups.empty()) {
    fail(host_.empty() ? "no network interface has a link-local IPv6 address; connect the units and switch IPv6 on"
                       : fmt::format("the network interface {} is missing, or has no link-local IPv6 address", host_));
  }
  return groups;
}

// Asks everywhere, and keeps the one place where somebody answers.
void Autd3UdpChain::find_group() {
  const std::vector<sockaddr_in6> candidates = groups();
  std::vector<sockaddr_in6> answering;
  for (const sockaddr_in6& group : candidates) {
    std::vector<Heard> heard;
    for (int attempt = 0; attempt < kAttempts && heard.empty(); ++attempt) {
      heard = collect(request(group, Kind::kReadUnit), kAnswerTime, 1);
    }
    if (!heard.empty()) {
      group_ = group;
      require_known(heard);
      answering.push_back(group);
    }
  }
  if (answering.empty()) {
    fail(fmt::format("no unit answers on {}{}", place(), refusal_.empty() ? "" : ": " + refusal_));
  }
  if (answering.size() > 1) {
    fail(fmt::format("units answer on the network interfaces {} and {}; name one, as autd3-udp:{}",
                     interface_name(answering[0].sin6_scope_id), interface_name(answering[1].sin6_scope_id),
                     interface_name(answering[0].sin6_scope_id)));
  }
  group_ = answering.front();
}

// Takes over the version of the protocol that the units have.
void Autd3UdpChain::require_known(const std::vector<Heard>& heard) {
  const int theirs = heard.front().answer.version;
  if (theirs == version_) return;
  const int ours = std::exchange(version_, theirs);
  const std::vector<Heard> again = collect(request(group_, Kind::kReadUnit), kAnswerTime, 1);
  const auto info = again.empty() ? std::nullopt : unit_info_of(again.front().answer);
  if (!kSeries.contains(theirs)) {
    fail(
        fmt::format("a unit has firmware {}, with version {} of the protocol; this program knows versions {} to {}, "
                    "of firmware 0.10 to 0.12",
                    info ? info->firmware : "unknown", theirs, kOldest, kNewest));
  }
  if (!info) {
    fail(fmt::format("a unit answers with version {} of the protocol to version {}, and to its own with nothing",
                     theirs, ours));
  }
}

// Each unit that gets a number opens the way to the next.
void Autd3UdpChain::number_units() {
  const double deadline = steady_now() + kFindPatience;
  std::size_t count = 0;
  do {
    collect(request(group_, Kind::kResetId), kAnswerTime, units_.size());
    std::this_thread::sleep_for(std::chrono::duration<double>(kForgetTime));
    count = 0;
    for (bool more = true; more;) {
      const auto next = unit_without_number();
      if (!next) break;
      if (count == units_.size()) fail_many();
      assign(count, *next);
      const Bytes answer = ask(count, Kind::kUnblock, {});
      more = answer.size() > 1 && answer[1] != 0;
      ++count;
    }
  } while (count < units_.size() && steady_now() < deadline);
  if (count < units_.size()) {
    fail(fmt::format("{} of {} units were found on {}", count, units_.size(), place()));
  }
  for (const Heard& heard : collect(request(group_, Kind::kReadUnit), kAnswerTime, units_.size() + 1)) {
    if (std::ranges::none_of(units_, [&](const Unit& unit) { return same(unit.address, heard.from); })) {
      fail_many();
    }
  }
}

void Autd3UdpChain::fail_many() const {
  fail(fmt::format("the chain on {} has more units than the {} of the run", place(), units_.size()));
}

std::optional<sockaddr_in6> Autd3UdpChain::unit_without_number() {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const std::uint16_t message = request(group_, Kind::kDiscover);
    std::vector<Heard> heard = collect(message, kAnswerTime, 1);
    if (heard.empty()) continue;
    for (const Heard& other : collect(message, kRepeat, 1)) {
      if (!same(other.from, heard.front().from)) {
        fail(fmt::format("two units on {} claim the same place; connect them in one chain", place()));
      }
    }
    return heard.front().from;
  }
  return std::nullopt;
}

// The unit changes its address with its number.
void Autd3UdpChain::assign(std::size_t unit, const sockaddr_in6& address) {
  const Bytes body{static_cast<std::uint8_t>(unit), static_cast<std::uint8_t>(unit == 0 ? 1 : 0)};
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    std::vector<Heard> heard = collect(request(address, Kind::kAssignId, body), kAnswerTime, 1);
    if (heard.empty()) {
      heard = collect(request(group_, Kind::kReadUnit), kAnswerTime, units_.size());
      std::erase_if(heard, [&](const Heard& one) {
        const auto info = unit_info_of(one.answer);
        return !info || info->id != unit;
      });
    }
    if (!heard.empty()) {
      units_[unit].address = heard.front().from;
      units_[unit].there = true;
      return;
    }
  }
  fail(fmt::format("unit {} does not take its number", unit));
}

Bytes Autd3UdpChain::ask(std::size_t unit, Kind kind, const Bytes& body) {
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    for (const Heard& heard : collect(request(units_[unit].address, kind, body), kAnswerTime, 1)) {
      if (heard.answer.body[0] == 0) {
        return heard.answer.body;
      }
      fail(fmt::format("unit {} refuses request {}: status {:#04x}", unit, static_cast<int>(kind),
                       heard.answer.body[0]));
    }
  }
  fail(fmt::format("unit {} does not answer request {}", unit, static_cast<int>(kind)));
}

// The clock of the first unit begins at 0, and the others follow it.
void Autd3UdpChain::set_clock() {
  ask(0, Kind::kSetTime, Bytes(sizeof(std::uint64_t), 0));
  const double deadline = steady_now() + kClockPatience;
  std::size_t in_step = 0;
  while (in_step < units_.size()) {
    if (steady_now() >= deadline) {
      fail(fmt::format("the clocks of {} of {} units are not in step after {:g} s", units_.size() - in_step,
                       units_.size(), kClockPatience));
    }
    std::this_thread::sleep_for(std::chrono::duration<double>(kClockLook));
    in_step = 0;
    for (const Heard& heard : collect(request(group_, Kind::kReadUnit), kAnswerTime, units_.size())) {
      const auto info = unit_info_of(heard.answer);
      in_step += info && (info->flags & kClockInStep) == kClockInStep ? 1 : 0;
    }
  }
}

void Autd3UdpChain::require_firmware() {
  const std::vector<Bytes> answers = run({{kReadFirmware}}, "the firmware", kStartPatience);
  for (std::size_t unit = 0; unit < units_.size(); ++unit) {
    const std::span<const std::uint8_t> bytes = answers[unit];
    const std::string processor = firmware_text(bytes);
    const std::string gates = firmware_text(bytes.subspan(std::min<std::size_t>(3, bytes.size())));
    for (const std::string& firmware : {processor, gates}) {
      const auto& series = kSeries.at(version_);
      if (std::ranges::none_of(series, [&](const std::string& known) { return firmware.starts_with(known + "."); })) {
        fail(fmt::format("unit {} has firmware {} (gates {}); with version {} of the protocol this program knows {}",
                         unit, processor, gates, version_, fmt::join(series, ", ")));
      }
    }
  }
}

std::vector<Bytes> Autd3UdpChain::run(const std::vector<Program>& programs, const std::string& what, double patience) {
  const double deadline = steady_now() + patience;
  std::vector<Progress> progress(units_.size());
  std::size_t missing = 0;
  for (std::size_t unit = 0; unit < units_.size(); ++unit) {
    progress[unit].program = &programs[programs.size() == 1 ? 0 : unit];
    missing += progress[unit].over() ? 0 : 1;
  }
  Heard heard;
  while (missing > 0) {
    double next = deadline;
    // The last first: the others are still being sent when it answers.
    for (std::size_t unit = units_.size(); unit-- > 0;) {
      Progress& at = progress[unit];
      if (at.over() || !units_[unit].there) {
        continue;
      }
      if (steady_now() >= at.sent_at + kRepeat) {
        send_next(units_[unit], at);
      }
      next = std::min(next, at.sent_at + kRepeat);
    }
    while (receive(heard)) {
      const auto answer = frame_answer_of(heard.answer);
      const auto unit =
          std::ranges::find_if(units_, [&](const Unit& one) { return one.there && same(one.address, heard.from); });
      if (!answer || unit == units_.end()) {
        continue;
      }
      const auto number = static_cast<std::size_t>(unit - units_.begin());
      Progress& at = progress[number];
      if (at.over() || at.sent_at == kNotSent || heard.answer.message != at.message) {
        continue;
      }
      if (!unit->in_step) {
        unit->in_step = answer->sequence == kAfterReset;
        unit->sequence = 0;
        at.sent_at = unit->in_step ? kNotSent : at.sent_at;
        continue;
      }
      if (answer->sequence != unit->sequence) continue;  // it is still in the queue of the unit
      if (answer->status != 0) {
        lose_step(progress);
        fail(fmt::format("{}: unit {} refuses command {:#04x}: {}", what, number, (*at.program)[at.next].number,
                         status_text(answer->status)));
      }
      ++unit->sequence;
      ++at.next;
      at.sent_at = kNotSent;
      at.data = answer->data;
      missing -= at.over() ? 1 : 0;
    }
    const bool unsent = std::any_of(progress.begin(), progress.end(), [&](const Progress& at) {
      return !at.over() && at.sent_at == kNotSent && units_[static_cast<std::size_t>(&at - progress.data())].there;
    });
    if (missing > 0 && !unsent) {
      if (steady_now() >= deadline) break;
      wait(next);
    }
  }
  if (missing > 0) fail_lost(what, progress);
  std::vector<Bytes> data;
  for (Progress& at : progress) {
    data.push_back(std::move(at.data));
  }
  return data;
}

void Autd3UdpChain::send_next(Unit& unit, Progress& at) {
  // Where a copy of the reset came late, the unit waits for number 0.
  if (at.times == kTimes) {
    unit.in_step = false;
  }
  if (at.sent_at == kNotSent || at.times == kTimes) {
    at.times = 0;
    at.message = ++message_;
    at.bytes = unit.in_step ? frame(version_, at.message, unit.sequence, (*at.program)[at.next])
                            : frame(version_, at.message, 0, kReset);
  }
  transmit(unit.address, at.bytes);
  ++at.times;
  at.sent_at = steady_now();
}

// A unit that may have executed a command without being heard would take the next one for its repetition.
std::vector<std::size_t> Autd3UdpChain::lose_step(const std::vector<Progress>& progress) {
  std::vector<std::size_t> lost;
  for (std::size_t unit = 0; unit < units_.size(); ++unit) {
    if (!progress[unit].over()) {
      units_[unit].in_step = false;
      lost.push_back(unit);
    }
  }
  return lost;
}

void Autd3UdpChain::fail_lost(const std::string& what, const std::vector<Progress>& progress) {
  const std::vector<std::size_t> lost = lose_step(progress);
  bool restarted = false;
  for (const Heard& heard : collect(request(group_, Kind::kReadUnit), kDiagnosis, units_.size())) {
    const auto info = unit_info_of(heard.answer);
    restarted = restarted || (info && (info->flags & kAssigned) == 0);
  }
  fail(
      fmt::format("{}: the link is lost: unit{} {} {} not answer{}{}; a unit that hears nothing switches off after "
                  "0.5 s",
                  what, lost.size() == 1 ? "" : "s", fmt::join(lost, ", "), lost.size() == 1 ? "does" : "do",
                  restarted ? ": a unit has restarted" : "", refusal_.empty() ? "" : ": " + refusal_));
}

std::uint16_t Autd3UdpChain::request(const sockaddr_in6& to, Kind kind, const Bytes& body) {
  ++message_;
  transmit(to, datagram(version_, kind, message_, body));
  return message_;
}

// What is not sent is not answered, and then sent again.
void Autd3UdpChain::transmit(const sockaddr_in6& to, const Bytes& bytes) {
  const auto sent = ::sendto(socket_.number(), bytes.data(), bytes.size(), MSG_DONTWAIT,
                             reinterpret_cast<const sockaddr*>(&to), sizeof to);
  refusal_ = sent < 0 ? std::strerror(errno) : "";
}

std::vector<Autd3UdpChain::Heard> Autd3UdpChain::collect(std::uint16_t message, double seconds, std::size_t enough) {
  const double until = steady_now() + seconds;
  std::vector<Heard> all;
  Heard heard;
  do {
    wait(until);
    while (receive(heard)) {
      if (heard.answer.message == message && heard.answer.kind != static_cast<std::uint8_t>(Kind::kFrame)) {
        all.push_back(heard);
      }
    }
  } while (all.size() < enough && steady_now() < until);
  return all;
}

bool Autd3UdpChain::receive(Heard& heard) {
  std::array<std::uint8_t, 2048> bytes{};
  for (;;) {
    socklen_t length = sizeof heard.from;
    const auto got = ::recvfrom(socket_.number(), bytes.data(), bytes.size(), MSG_DONTWAIT,
                                reinterpret_cast<sockaddr*>(&heard.from), &length);
    if (got < 0) {
      // Of what was sent before: "refused" comes back from a port where nobody listens.
      if (errno == ECONNREFUSED || errno == EINTR) continue;
      return false;
    }
    if (auto answer = answer_of(std::span(bytes).first(static_cast<std::size_t>(got)))) {
      heard.answer = std::move(*answer);
      return true;
    }
  }
}

// Returns at time `until`, or before that when something has come.
void Autd3UdpChain::wait(double until) const {
  const double seconds = std::max(0.0, until - steady_now());
  const timespec time{static_cast<time_t>(seconds), static_cast<long>((seconds - std::floor(seconds)) * 1e9)};
  pollfd watched{socket_.number(), POLLIN, 0};
  ::ppoll(&watched, 1, &time, nullptr);
}

}  // namespace touchfield
