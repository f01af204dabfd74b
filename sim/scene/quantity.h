#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace touchfield::schema {

/// Bounds of a number in the unit the scene gives it in. On a side without a bound the magnitude is at most kLargest. A
/// number that must be > 0 must be at least kSmallest. Sums, squares and quotients of lengths and pressures then stay
/// finite and do not vanish.
struct Range {
  static constexpr double kLargest = 1e9;
  static constexpr double kSmallest = 1e-9;

  std::optional<double> low;
  std::optional<double> high;
  bool low_excluded = false;

  /// "> 0", "1 to 200", "> 0 and <= 1"; empty if there is no bound.
  std::string text() const;
  /// The rule that a finite value breaks, as it follows "must be"; nothing if it keeps all.
  std::optional<std::string> broken_by(double value) const;
};

Range above(double low);
Range at_least(double low);
Range above_to(double low, double high);
Range between(double low, double high);

/// "; if 0.088 is in metres write 88" of a value out of range that is in it when taken in another unit; else empty.
///
/// key   with the unit that the value was taken in, e.g. breadth_mm; a share has none
std::string other_unit(std::string_view key, double value, const Range& range);

/// The double nearest to a decimal number as YAML writes it (no hexadecimal, no nan, no inf). One too large for a
/// double is infinity, one too small 0. Nothing if the text is not such a number.
std::optional<double> parse_decimal(std::string_view text);

/// The shortest decimal text that parse_decimal() turns into exactly this finite value.
std::string decimal_text(double value);

/// The unit a scene gives a quantity in, and its way to SI and back.
class Unit {
 public:
  /// A unit of 10^power SI units: -3 for millimetres, 3 for kilohertz, 0 for the SI unit itself.
  static Unit power_of_ten(int power);
  static Unit degree();
  static Unit celsius();

  /// A number of this unit in SI, in doubles: within their rounding of the decimal result.
  double si(double number) const { return number * times_ / over_ + plus_; }
  /// The same of a text; nothing if it is no number.
  std::optional<double> si(std::string_view text) const;

  /// The shortest text that si() turns into exactly this value. A value that no text in this unit can give is written
  /// with 17 digits, which give its neighbour.
  std::string text(double si) const;

 private:
  Unit(double times, double over, double plus) : times_(times), over_(over), plus_(plus) {}

  double times_;  // whole powers of ten both, so that neither is rounded
  double over_;
  double plus_;
};

}  // namespace touchfield::schema
