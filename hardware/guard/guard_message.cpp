#include "hardware/guard/guard_message.h"

#include <algorithm>

#include <nlohmann/json.hpp>

#include "sim/core/errors.h"

namespace touchfield {

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

}  // namespace touchfield
