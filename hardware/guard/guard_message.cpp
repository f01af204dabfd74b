#include "hardware/guard/guard_message.h"

#include <algorithm>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

/// The numbers of a matrix, column by column.
template <class Matrix>
std::vector<typename Matrix::Scalar> numbers_of(const Matrix& matrix) {
  return {matrix.data(), matrix.data() + matrix.size()};
}

/// A list, or points one behind the other.
template <class Matrix>
void read_numbers(const GuardMessage& message, Matrix& matrix) {
  constexpr int kRows = Matrix::RowsAtCompileTime == Eigen::Dynamic ? 1 : Matrix::RowsAtCompileTime;
  const auto numbers = message.get<std::vector<typename Matrix::Scalar>>();
  const auto count = static_cast<Eigen::Index>(numbers.size()) / kRows;
  matrix.resize(Matrix::RowsAtCompileTime == Eigen::Dynamic ? count : kRows, kRows == 1 ? 1 : count);
  std::copy_n(numbers.begin(), matrix.size(), matrix.data());
}

}  // namespace

std::vector<std::uint8_t> packed(const GuardMessage& message) {
  return message.is_null() ? std::vector<std::uint8_t>() : GuardMessage::to_msgpack(message);
}

GuardMessage unpacked(const std::vector<std::uint8_t>& bytes) {
  GuardMessage message = bytes.empty() ? GuardMessage() : GuardMessage::from_msgpack(bytes, true, false);
  if (message.is_discarded()) {
    throw IoError("link guard: a message that is none");
  }
  return message;
}

void to_json(GuardMessage& message, const Modulation& modulation) {
  if (const auto* sine = std::get_if<SineModulation>(&modulation)) {
    message = *sine;
  } else if (const auto* samples = std::get_if<SampledModulation>(&modulation)) {
    message = *samples;
  }
}

void from_json(const GuardMessage& message, Modulation& modulation) {
  if (message.is_null()) {
    modulation = StaticModulation{};
  } else if (message.contains("depth")) {
    modulation = message.get<SineModulation>();
  } else {
    modulation = message.get<SampledModulation>();
  }
}

void to_json(GuardMessage& message, const ArrayLayout& layout) {
  message = {{"positions", numbers_of(layout.positions)},
             {"axes", numbers_of(layout.axes)},
             {"device", numbers_of(layout.device)},
             {"channel", numbers_of(layout.channel)}};
}

void from_json(const GuardMessage& message, ArrayLayout& layout) {
  read_numbers(message.at("positions"), layout.positions);
  read_numbers(message.at("axes"), layout.axes);
  read_numbers(message.at("device"), layout.device);
  read_numbers(message.at("channel"), layout.channel);
}

}  // namespace touchfield
