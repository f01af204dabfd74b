#include "sim/scene/quantity.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include <fmt/format.h>

#include "sim/core/units.h"

namespace touchfield::schema {

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

std::string other_unit(std::string_view key, double value, const Range& range) {
  struct Slip {
    std::string_view key;  // it ends in this
    double times;
    double plus;
    const char* taken;
    double least = 0.0;  // lower bound of the range, where the slip is no more likely than another
  };
  constexpr Slip kSlips[] = {{"_mm", 1e3, 0.0, "metres"},
                             {"_mm", 10.0, 0.0, "centimetres", 10.0},
                             {"_khz", 1e-3, 0.0, "Hz"},
                             {"_khz", 1e3, 0.0, "MHz"},
                             {"temperature_c", 1.0, -kZeroCelsius, "kelvin", -kZeroCelsius},
                             {"level", 1e-2, 0.0, "percent"},
                             {"gain", 1e-2, 0.0, "percent"}};
  key = key.substr(0, key.find('['));
  for (const Slip& slip : kSlips) {
    const double meant = slip.times * value + slip.plus;
    const bool is_likely = std::abs(value) >= 10.0 || slip.times > 1.0;  // a level of 1.5 is none in percent
    if (is_likely && key.ends_with(slip.key) && range.low.value_or(slip.least) >= slip.least &&
        !range.broken_by(meant)) {
      return fmt::format("; if {} is in {} write {:.6g}", decimal_text(value), slip.taken, meant);
    }
  }
  return "";
}

std::optional<double> parse_decimal(std::string_view text) {
  const bool mixed = text.starts_with("+-");
  text.remove_prefix(text.starts_with('+') ? 1 : 0);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (mixed || text.find_first_not_of("0123456789.eE+-") != std::string_view::npos ||
      end != text.data() + text.size() || error == std::errc::invalid_argument) {
    return std::nullopt;
  }
  if (error == std::errc::result_out_of_range) {
    const auto mark = text.find_first_of("eE");
    const bool small =
        mark != std::string_view::npos ? text[mark + 1] == '-' : text.find('.') < text.find_first_of("123456789");
    value = std::copysign(small ? 0.0 : std::numeric_limits<double>::infinity(), text.starts_with('-') ? -1.0 : 1.0);
  }
  return value;
}

std::string decimal_text(double value) {
  std::string text = fmt::format("{}", value);
  if (const auto mark = text.find('e'); mark != std::string::npos) {  // e+16 and e-05 as e16 and e-5
    const bool negative = text[mark + 1] == '-';
    text.erase(mark + (negative ? 2 : 1), !negative || text[mark + 2] == '0' ? 1 : 0);
  }
  return text;
}

Unit Unit::power_of_ten(int power) {
  return {std::pow(10.0, std::max(power, 0)), std::pow(10.0, std::max(-power, 0)), 0.0};
}
Unit Unit::degree() { return {kDegree, 1.0, 0.0}; }
Unit Unit::celsius() { return {1.0, 1.0, kZeroCelsius}; }

std::optional<double> Unit::si(std::string_view text) const {
  const auto number = parse_decimal(text);
  return number ? std::optional(si(*number)) : std::nullopt;
}

std::string Unit::text(double si) const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  const double near = (si - plus_) * over_ / times_;
  for (const double number : {near, std::nextafter(near, -kInfinity), std::nextafter(near, kInfinity)}) {
    for (const int digits : {9, 12, 15, 16, 17}) {  // few first: the difference of two temperatures has no more
      std::string candidate = decimal_text(*parse_decimal(fmt::format("{:.{}g}", number, digits)));
      if (this->si(candidate) == si) {
        return candidate;
      }
    }
  }
  return decimal_text(near);
}

}  // namespace touchfield::schema
