#include "sim/scene/quantity.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/core/units.h"

namespace touchfield::schema {

namespace {

bool is_digit(char c) { return c >= '0' && c <= '9'; }

// The exponent after the e, kept within bounds that the addition of a power cannot leave.
std::optional<int> parse_exponent(std::string_view text) {
  constexpr int kBound = 1'000'000;
  const bool negative = text.starts_with('-');
  if (text.starts_with('+')) {
    text.remove_prefix(1);
  }
  if (text.find_first_not_of("0123456789", negative ? 1 : 0) != std::string_view::npos) {
    return std::nullopt;
  }
  int exponent = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), exponent);
  if (end != text.data() + text.size() || error == std::errc::invalid_argument) {
    return std::nullopt;
  }
  if (error == std::errc::result_out_of_range) {
    return negative ? -kBound : kBound;
  }
  return std::clamp(exponent, -kBound, kBound);
}

// True if "digits with an optional point" and at least one digit.
bool is_mantissa(std::string_view text) {
  const auto point = std::count(text.begin(), text.end(), '.');
  return point <= 1 && static_cast<long>(text.size()) > point &&
         std::all_of(text.begin(), text.end(), [](char c) { return c == '.' || is_digit(c); });
}

// Decimal exponent of the first digit that is not 0; 0 if there is none.
int leading_exponent(std::string_view mantissa) {
  const auto digit = mantissa.find_first_not_of("0.");
  if (digit == std::string_view::npos) {
    return 0;
  }
  const auto point = std::min(mantissa.find('.'), mantissa.size());
  return digit < point ? static_cast<int>(point - digit) - 1 : -static_cast<int>(digit - point);
}

}  // namespace

std::string Range::text() const {
  std::string below = low ? fmt::format("{} {}", low_excluded ? ">" : ">=", decimal_text(*low)) : "";
  if (!high) {
    return below;
  }
  if (!low) {
    return fmt::format("<= {}", decimal_text(*high));
  }
  if (low_excluded) {
    return fmt::format("{} and <= {}", below, decimal_text(*high));
  }
  return fmt::format("{} to {}", decimal_text(*low), decimal_text(*high));
}

std::optional<std::string> Range::broken_by(double value) const {
  if (low && (low_excluded ? value <= *low : value < *low)) {
    return text();
  }
  if (high && value > *high) {
    return text();
  }
  if (low == 0.0 && low_excluded && value < kSmallest) {
    return fmt::format(">= {}", decimal_text(kSmallest));
  }
  const bool limited = (value < 0 ? low : high).has_value();
  if (!limited && std::abs(value) > kLargest) {
    return fmt::format("at most {} in magnitude", decimal_text(kLargest));
  }
  return std::nullopt;
}

Range above(double low) { return {.low = low, .high = std::nullopt, .low_excluded = true}; }
Range at_least(double low) { return {.low = low, .high = std::nullopt, .low_excluded = false}; }
Range above_to(double low, double high) { return {.low = low, .high = high, .low_excluded = true}; }
Range between(double low, double high) { return {.low = low, .high = high, .low_excluded = false}; }

std::optional<double> parse_decimal(std::string_view text, int power) {
  const bool negative = !text.empty() && text.front() == '-';
  if (negative || (!text.empty() && text.front() == '+')) {
    text.remove_prefix(1);
  }
  const auto mark = text.find_first_of("eE");
  const std::string_view mantissa = text.substr(0, mark);
  int exponent = 0;
  if (mark != std::string_view::npos) {
    const auto written = parse_exponent(text.substr(mark + 1));
    if (!written) {
      return std::nullopt;
    }
    exponent = *written;
  }
  if (!is_mantissa(mantissa)) {
    return std::nullopt;
  }

  const std::string shifted = fmt::format("{}e{}", mantissa, exponent + power);
  double value = 0;
  const auto [end, error] = std::from_chars(shifted.data(), shifted.data() + shifted.size(), value);
  if (error == std::errc::result_out_of_range) {
    const bool small = leading_exponent(mantissa) + exponent + power < 0;
    value = small ? 0.0 : std::numeric_limits<double>::infinity();
  } else if (error != std::errc{} || end != shifted.data() + shifted.size()) {
    return std::nullopt;
  }
  return negative ? -value : value;
}

std::string decimal_text(double value, int power) {
  std::array<char, 64> buffer{};
  const auto written =
      std::to_chars(buffer.data(), buffer.data() + buffer.size(), std::abs(value), std::chars_format::scientific);
  const std::string_view text(buffer.data(), static_cast<std::size_t>(written.ptr - buffer.data()));
  const auto mark = text.find('e');
  std::string digits(text.substr(0, mark));
  std::erase(digits, '.');
  const int exponent = value == 0 ? 0 : *parse_exponent(text.substr(mark + 1)) - power;

  const std::string sign = std::signbit(value) ? "-" : "";
  constexpr int kLongestFraction = 5;  // zeros after the point before the text turns to an exponent
  constexpr int kLongestInteger = 16;
  const int count = static_cast<int>(digits.size());
  if (exponent < -kLongestFraction || exponent >= kLongestInteger) {
    const std::string fraction = count > 1 ? "." + digits.substr(1) : "";
    return fmt::format("{}{}{}e{}", sign, digits.front(), fraction, exponent);
  }
  if (exponent < 0) {
    return fmt::format("{}0.{}{}", sign, std::string(static_cast<std::size_t>(-exponent - 1), '0'), digits);
  }
  if (exponent >= count - 1) {
    return sign + digits + std::string(static_cast<std::size_t>(exponent - count + 1), '0');
  }
  const auto point = static_cast<std::size_t>(exponent) + 1;
  return fmt::format("{}{}.{}", sign, digits.substr(0, point), digits.substr(point));
}

std::optional<double> Unit::si(std::string_view text) const {
  const auto number = parse_decimal(text, kind_ == Kind::kPowerOfTen ? power_ : 0);
  if (!number) {
    return std::nullopt;
  }
  if (kind_ == Kind::kDegree) {
    return *number * kDegree;
  }
  if (kind_ == Kind::kCelsius) {
    return *number + kZeroCelsius;
  }
  return number;
}

std::string Unit::text(double si) const {
  if (kind_ == Kind::kPowerOfTen) {
    return decimal_text(si, power_);
  }
  const double near = kind_ == Kind::kDegree ? si / kDegree : si - kZeroCelsius;
  constexpr int kMostDigits = 17;
  for (int digits = 1; digits <= kMostDigits; ++digits) {
    std::string candidate = decimal_text(*parse_decimal(fmt::format("{:.{}e}", near, digits - 1)));
    if (this->si(candidate) == si) {
      return candidate;
    }
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  for (const double direction : {-kInfinity, kInfinity}) {
    std::string candidate = decimal_text(std::nextafter(near, direction));
    if (this->si(candidate) == si) {
      return candidate;
    }
  }
  return decimal_text(near);
}

}  // namespace touchfield::schema
