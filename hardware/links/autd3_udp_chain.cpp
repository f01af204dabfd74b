#include "hardware/links/autd3_udp_chain.h"

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstring>
#include <limits>
#include <map>
#include <poll.h>
#include <random>
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

constexpr double kAnswerTime = 0.1;     // [s] for answers to a question to all
constexpr double kForgetTime = 0.1;     // [s] until all units have forgotten their numbers
constexpr double kFindPatience = 3;     // [s] until every unit was found: one that was just switched on starts up
constexpr double kClockPatience = 10;   // [s] until all clocks are in step
constexpr double kClockLook = 0.05;     // [s]
constexpr double kRepeat = 0.01;        // [s] after which what was not answered is sent again
constexpr double kStartPatience = 0.5;  // [s] for a unit to clear itself
constexpr double kSettle = 0.05;        // [s] in which late copies of the first reset come
constexpr double kDiagnosis = 0.05;     // [s] to find out why a unit does not answer
constexpr int kAttempts = 5;
constexpr int kAdoptions = 10;
constexpr double kNotSent = -1;       // as a time
constexpr double kClockSlack = 1;     // [s] between the clocks of the units and of this machine,
constexpr double kClockDrift = 1e-3;  // and per second

// Series of firmware with each version of the protocol.
const std::map<int, std::vector<std::string>> kSeries{{2, {"0.10", "0.11"}}, {3, {"0.12"}}};

}  // namespace

/// How far a unit is with its program.
struct Autd3UdpChain::Progress {
  const Program* program = nullptr;
  std::size_t next = 0;
  double deadline = 0;        // of the answer to the command that it works at
  double sent_at = kNotSent;  // that command, the last time
  std::uint16_t message = 0;
  Bytes bytes;
  Bytes data;  // that it answered last

  bool over() const { return next == program->size(); }
  bool resets() const { return (*program)[next].number == kReset.number; }
};

Autd3UdpChain::Autd3UdpChain(std::string host, int port, std::size_t units)
    : place_{std::move(host), port}, units_(units) {}

void Autd3UdpChain::open() {
  open_socket();
  for (Unit& unit : units_) {
    unit = {};
  }
  taken_ = false;
  find_group();
  number_units();
  set_clock();
  run({{kReset}}, "the start", kStartPatience);
  std::this_thread::sleep_for(std::chrono::duration<double>(kSettle));
  require_firmware();
  run({{kClear, kSynchronize}}, "the start", kStartPatience);
}

bool Autd3UdpChain::adopt() {
  open_socket();
  std::size_t found = 0;
  const auto first = static_cast<std::uint16_t>(message_ + 1);
  for (int attempt = 0; attempt < kAdoptions && found < units_.size(); ++attempt) {
    for (const sockaddr_in6& group : place_.groups()) {
      request(group, Kind::kReadUnit);
      for (const Heard& heard : collect(first, kRepeat, units_.size())) {
        if (heard.answer.version < version_ && heard.answer.version >= kOldest) {
          version_ = heard.answer.version;
        }
        const auto info = unit_info_of(heard.answer);
        if (info && (info->flags & kAssigned) != 0 && info->id < units_.size() && !units_[info->id].there &&
            heard.from.sin6_scope_id == group.sin6_scope_id) {
          if (found == 0) {
            lock_ = lock_of(group);
            clock_ = info->clock;
            clock_since_ = steady_now();
          }
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

void Autd3UdpChain::close() noexcept {
  socket_.close();
  lock_ = {};
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

DeviceLock Autd3UdpChain::lock_of(const sockaddr_in6& group) const {
  return {lock_key(group), "autd3-udp: the units on " +
                               (group.sin6_scope_id != 0 ? "network interface " + interfaces_of({group}) : place())};
}

// Asks everywhere, and keeps the one place where somebody answers.
void Autd3UdpChain::find_group() {
  const std::vector<sockaddr_in6> candidates = place_.groups();
  std::vector<sockaddr_in6> answering;
  for (const sockaddr_in6& group : candidates) {
    DeviceLock lock = lock_of(group);
    std::vector<Heard> heard;
    for (int attempt = 0; attempt < kAttempts && heard.empty(); ++attempt) {
      heard = collect(request(group, Kind::kReadUnit), kAnswerTime, 1);
    }
    if (!heard.empty()) {
      group_ = group;
      lock_ = std::move(lock);
      require_known(heard);
      answering.push_back(group);
    }
  }
  if (answering.empty()) {
    fail(fmt::format(
        "no unit answers on {}{}; check the cable, the supply of the units, and that the firewall lets UDP "
        "port {} through",
        place_.port > 0
            ? place()
            : fmt::format("the network interface{} {}", candidates.size() == 1 ? "" : "s", interfaces_of(candidates)),
        refusal_.empty() ? "" : ": " + refusal_, ntohs(candidates.front().sin6_port)));
  }
  if (answering.size() > 1) {
    fail(fmt::format("units answer on the network interfaces {}; name one, as autd3-udp:{}", interfaces_of(answering),
                     interfaces_of({answering.front()})));
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

// The clock of the first unit begins at a time that no other program chooses, and the others follow it.
void Autd3UdpChain::set_clock() {
  constexpr std::uint64_t kSecond = 1'000'000'000;
  std::random_device entropy;
  clock_ = kSecond * std::uniform_int_distribution<std::uint64_t>(1, 1U << 30U)(entropy);
  clock_since_ = steady_now();
  ask(0, Kind::kSetTime, clock_bytes(clock_));
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
      if (!info || (info->flags & kClockInStep) != kClockInStep) continue;
      const bool foreign = is_foreign(info->clock);
      if (foreign && info->id == 0) fail_taken("the clocks");  // the others may follow it late
      in_step += foreign ? 0 : 1;
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
  std::vector<Progress> progress(units_.size());
  std::size_t missing = 0;
  for (std::size_t unit = 0; unit < units_.size(); ++unit) {
    progress[unit].program = &programs[programs.size() == 1 ? 0 : unit];
    progress[unit].deadline = steady_now() + patience;
    missing += progress[unit].over() ? 0 : 1;
  }
  Heard heard;
  while (missing > 0) {
    double next = std::numeric_limits<double>::infinity();
    double deadline = next;
    // The last first: the others are still being sent when it answers.
    for (std::size_t unit = units_.size(); unit-- > 0;) {
      Progress& at = progress[unit];
      if (at.over()) continue;
      if (units_[unit].there && steady_now() >= at.sent_at + kRepeat) {
        send_next(units_[unit], at);
      }
      deadline = std::min(deadline, at.deadline);
      next = std::min({next, deadline, units_[unit].there ? at.sent_at + kRepeat : deadline});
    }
    bool confirmed = false;
    while (receive(heard)) {
      if (hear(heard, progress, what)) {
        Progress& at = progress[unit_at(heard.from)];
        at.deadline = steady_now() + patience;
        missing -= at.over() ? 1 : 0;
        confirmed = true;
      }
    }
    if (confirmed) continue;
    if (steady_now() >= deadline) fail_lost(what, progress);
    wait(next);
  }
  std::vector<Bytes> data;
  for (Progress& at : progress) {
    data.push_back(std::move(at.data));
  }
  return data;
}

std::size_t Autd3UdpChain::unit_at(const sockaddr_in6& address) const {
  return static_cast<std::size_t>(
      std::ranges::find_if(units_, [&](const Unit& one) { return one.there && same(one.address, address); }) -
      units_.begin());
}

bool Autd3UdpChain::hear(const Heard& heard, std::vector<Progress>& progress, const std::string& what) {
  const auto answer = frame_answer_of(heard.answer);
  const std::size_t number = unit_at(heard.from);
  if (!answer || number == units_.size()) return false;
  Progress& at = progress[number];
  if (at.over() || at.sent_at == kNotSent || heard.answer.message != at.message) return false;
  if (is_foreign(answer->clock)) fail_taken(what);
  Unit& unit = units_[number];
  const auto wanted = at.resets() ? kAfterReset : static_cast<std::uint8_t>(unit.sequence + 1);
  if (answer->sequence != wanted) {
    if (at.resets() || answer->sequence == unit.sequence) return false;  // it is still in the queue of the unit
    fail_taken(what);
  }
  if (answer->status != 0) {
    fail(fmt::format("{}: unit {} refuses command {:#04x}: {}", what, number, (*at.program)[at.next].number,
                     status_text(answer->status)));
  }
  unit.sequence = wanted;
  ++at.next;
  at.sent_at = kNotSent;
  at.data = answer->data;
  return true;
}

void Autd3UdpChain::send_next(const Unit& unit, Progress& at) {
  if (at.sent_at == kNotSent) {
    at.message = ++message_;
    at.bytes = frame(version_, at.message, at.resets() ? 0 : static_cast<std::uint8_t>(unit.sequence + 1),
                     (*at.program)[at.next]);
  }
  transmit(unit.address, at.bytes);
  at.sent_at = steady_now();
}

bool Autd3UdpChain::is_foreign(std::uint64_t clock) const {
  const double ours = steady_now() - clock_since_;
  const double theirs = 1e-9 * static_cast<double>(static_cast<std::int64_t>(clock - clock_));
  return clock != 0 && std::abs(theirs - ours) > kClockSlack + kClockDrift * ours;
}

void Autd3UdpChain::fail_taken(const std::string& what) {
  taken_ = true;
  fail(what + ": another program drives these units");
}

void Autd3UdpChain::fail_lost(const std::string& what, const std::vector<Progress>& progress) {
  std::vector<std::size_t> lost;
  for (std::size_t unit = 0; unit < units_.size(); ++unit) {
    if (!progress[unit].over()) lost.push_back(unit);
  }
  std::string cause = refusal_.empty() ? "" : ": " + refusal_;
  for (const Heard& heard : collect(request(group_, Kind::kReadUnit), kDiagnosis, units_.size())) {
    const auto info = unit_info_of(heard.answer);
    if (!info) continue;
    const bool numbered = (info->flags & kAssigned) != 0;
    // Where the first clock is not set yet, the number is new.
    const bool unset = info->id == 0 && (info->flags & kClockInStep) != kClockInStep;
    if (numbered && (unset || is_foreign(info->clock))) fail_taken(what);
    if (!numbered) {
      cause = lost.front() == 0 ? ": another program drives these units, or unit 0 has restarted"
                                : ": a unit has restarted";
    }
  }
  fail(
      fmt::format("{}: the link is lost: unit{} {} {} not answer{}; a unit that hears nothing switches off after 0.5 s",
                  what, lost.size() == 1 ? "" : "s", fmt::join(lost, ", "), lost.size() == 1 ? "does" : "do", cause));
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

std::vector<Autd3UdpChain::Heard> Autd3UdpChain::collect(std::uint16_t since, double seconds, std::size_t enough) {
  const double until = steady_now() + seconds;
  std::vector<Heard> all;
  Heard heard;
  do {
    wait(until);
    while (receive(heard)) {
      if (static_cast<std::uint16_t>(heard.answer.message - since) <= static_cast<std::uint16_t>(message_ - since) &&
          heard.answer.kind != static_cast<std::uint8_t>(Kind::kFrame)) {
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
