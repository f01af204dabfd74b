#include "hardware/guard/guard_message.h"

#include <algorithm>
#include <cerrno>
#include <poll.h>
#include <sys/socket.h>

#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/version.h"

namespace touchfield {

namespace {

constexpr std::uint32_t kMostBytes = 1U << 24;  // of a message; an array of a hundred thousand transducers has fewer
constexpr double kMessagePatience = 0.2;        // for the rest of a message that has begun [s]

/// Whether there is something to do with a socket within kPatienceStep.
bool ready(int descriptor, short what) {
  pollfd watched{descriptor, what, 0};
  return ::poll(&watched, 1, static_cast<int>(kPatienceStep * 1e3)) > 0;
}

}  // namespace

using Json = nlohmann::json;

namespace {

/// The numbers of a matrix, column by column.
template <class Matrix>
std::vector<typename Matrix::Scalar> numbers_of(const Matrix& matrix) {
  return {matrix.data(), matrix.data() + matrix.size()};
}

/// A list, or points one behind the other.
template <class Matrix>
void read_numbers(const Json& message, Matrix& matrix) {
  constexpr int kRows = Matrix::RowsAtCompileTime == Eigen::Dynamic ? 1 : Matrix::RowsAtCompileTime;
  const auto numbers = message.get<std::vector<typename Matrix::Scalar>>();
  const auto count = static_cast<Eigen::Index>(numbers.size()) / kRows;
  matrix.resize(Matrix::RowsAtCompileTime == Eigen::Dynamic ? count : kRows, kRows == 1 ? 1 : count);
  std::copy_n(numbers.begin(), matrix.size(), matrix.data());
}

}  // namespace

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(Gaps, count, longest)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(GuardLimits, level, seconds)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(DriveFrame, phase, intensity)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(StoredFrames, first, frames)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(StoredPlay, count, rate)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SineModulation, frequency, depth)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(SampledModulation, samples, rate)

void to_json(Json& message, const Modulation& modulation) {
  if (const auto* sine = std::get_if<SineModulation>(&modulation)) {
    message = *sine;
  } else if (const auto* samples = std::get_if<SampledModulation>(&modulation)) {
    message = *samples;
  }
}

void from_json(const Json& message, Modulation& modulation) {
  if (message.is_null()) {
    modulation = StaticModulation{};
  } else if (message.contains("depth")) {
    modulation = message.get<SineModulation>();
  } else {
    modulation = message.get<SampledModulation>();
  }
}

void to_json(Json& message, const ArrayLayout& layout) {
  message = {{"positions", numbers_of(layout.positions)},
             {"axes", numbers_of(layout.axes)},
             {"device", numbers_of(layout.device)},
             {"channel", numbers_of(layout.channel)}};
}

void from_json(const Json& message, ArrayLayout& layout) {
  read_numbers(message.at("positions"), layout.positions);
  read_numbers(message.at("axes"), layout.axes);
  read_numbers(message.at("device"), layout.device);
  read_numbers(message.at("channel"), layout.channel);
}

NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(LinkSettings, address, array, frames, replace)
NLOHMANN_DEFINE_TYPE_NON_INTRUSIVE(GuardStart, limits, settings)

template <class Value>
GuardBytes packed(const Value& value) {
  return Json::to_msgpack(Json(value));
}

template <class Value>
Value unpacked(const GuardBytes& bytes) {
  try {
    return Json::from_msgpack(bytes).get<Value>();
  } catch (const Json::exception&) {
    throw IoError("link guard: malformed message");
  }
}

#define TOUCHFIELD_GUARD_VALUE(Value)       \
  template GuardBytes packed(const Value&); \
  template Value unpacked(const GuardBytes&);
TOUCHFIELD_GUARD_VALUE(std::string)
TOUCHFIELD_GUARD_VALUE(DriveFrame)
TOUCHFIELD_GUARD_VALUE(StoredFrames)
TOUCHFIELD_GUARD_VALUE(StoredPlay)
TOUCHFIELD_GUARD_VALUE(Gaps)
TOUCHFIELD_GUARD_VALUE(Modulation)
TOUCHFIELD_GUARD_VALUE(GuardStart)
#undef TOUCHFIELD_GUARD_VALUE

bool GuardChannel::send(const GuardMessage& message, double seconds) {
  const auto size = static_cast<std::uint32_t>(1 + message.with.size());
  const auto* length = reinterpret_cast<const std::uint8_t*>(&size);
  GuardBytes bytes(length, length + sizeof size);
  bytes.push_back(message.what);
  bytes.insert(bytes.end(), message.with.begin(), message.with.end());
  Patience patience(seconds, steady_now());
  for (std::size_t at = 0; at < bytes.size();) {
    const ssize_t sent = ::send(descriptor(), bytes.data() + at, bytes.size() - at, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (sent < 0 && errno != EINTR && errno != EAGAIN) {
      return false;
    }
    at += static_cast<std::size_t>(std::max<ssize_t>(sent, 0));
    if (sent < 0 && !ready(descriptor(), POLLOUT) && patience.over(steady_now())) {
      return false;
    }
  }
  return true;
}

bool GuardChannel::waits() const { return ready(descriptor(), POLLIN); }

std::optional<GuardMessage> GuardChannel::receive() {
  std::uint32_t size = 0;
  if (!receive_bytes(reinterpret_cast<std::uint8_t*>(&size), sizeof size) || size < 1 || size > kMostBytes) {
    return std::nullopt;
  }
  GuardMessage message(GuardReply::kDone, GuardBytes(size - 1));
  const bool whole = receive_bytes(&message.what, 1) && receive_bytes(message.with.data(), message.with.size());
  return whole ? std::optional(std::move(message)) : std::nullopt;
}

bool GuardChannel::receive_bytes(std::uint8_t* data, std::size_t size) {
  Patience patience(kMessagePatience, steady_now());
  while (size > 0) {
    if (!waits()) {
      if (patience.over(steady_now())) {
        return false;
      }
      continue;
    }
    const ssize_t got = ::recv(descriptor(), data, size, 0);
    if (got == 0 || (got < 0 && errno != EINTR)) {
      return false;
    }
    data += std::max<ssize_t>(got, 0);
    size -= static_cast<std::size_t>(std::max<ssize_t>(got, 0));
  }
  return true;
}

}  // namespace touchfield
