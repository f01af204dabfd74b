#pragma once

#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace touchfield {

struct NamedValue;

/// A tree of named values: what a command has to say, filled once, written as JSON for programs and as text for people.
/// A word of a name may be a unit, as in `residual_mm`: text shows it behind the number, metres as mm, radians as deg.
class Value {
 public:
  using List = std::vector<Value>;
  using Group = std::vector<NamedValue>;  // in the order in which they are written
  struct Number {
    double value;
    int digits;          // significant ones that text shows
    bool share = false;  // shown in percent
  };

  Value() = default;  // nothing: null
  Value(std::same_as<bool> auto flag) : data_(flag) {}
  template <std::integral Count>
  requires(!std::same_as<Count, bool>) Value(Count count) : data_(static_cast<std::int64_t>(count)) {}
  Value(double number, int digits = 4) : data_(Number{number, digits}) {}
  Value(const char* text) : data_(std::string(text)) {}
  Value(std::string text) : data_(std::move(text)) {}
  Value(List list) : data_(std::move(list)) {}
  Value(Group group);
  Value(std::initializer_list<NamedValue> group);
  template <class Kind>
  Value(const std::optional<Kind>& value) : Value(value ? Value(*value) : Value()) {}
  template <class Kind>
  Value(const std::vector<Kind>& values) : data_(List(values.begin(), values.end())) {}
  template <class First, class Second>
  Value(const std::pair<First, Second>& of_two_runs);  // {"a": first, "b": second}
  /// A group whose names are those of methods, landmarks, ...: text shows them as they are, with the unit of the whole.
  static Value by_name(Group group);
  /// A part of a whole: 0.123 is "12.3 %" in text.
  static Value share(double fraction, int digits = 4);

  template <class Kind>
  bool is() const {
    return std::holds_alternative<Kind>(data_);
  }
  /// True for what there is nothing to say of: null, and an empty text, list or group.
  bool empty() const;
  bool flag() const { return std::get<bool>(data_); }
  std::int64_t count() const { return std::get<std::int64_t>(data_); }
  double number() const { return std::get<Number>(data_).value; }
  const std::string& text() const { return std::get<std::string>(data_); }
  const List& list() const { return std::get<List>(data_); }
  const Group& group() const { return std::get<Group>(data_); }
  const auto& data() const { return data_; }
  bool is_by_name() const { return is_by_name_; }

  /// What a group holds under a name; null if it does not, or is no group.
  const Value& operator[](std::string_view name) const;
  void add(std::string name, Value value);
  void add(Value more);  // the entries of another group

  /// As JSON; a number that is not finite is null.
  std::string json(int indent = 2) const;

 private:
  std::variant<std::monostate, bool, std::int64_t, Number, std::string, List, Group> data_;
  bool is_by_name_ = false;
};

struct NamedValue {
  std::string name;
  Value value;
};

template <class First, class Second>
Value::Value(const std::pair<First, Second>& of_two_runs)
    : Value({{"a", of_two_runs.first}, {"b", of_two_runs.second}}) {}

/// A name without its unit, `largest distance` of `largest_distance_m`.
std::string label_of(std::string_view name);

/// A value in one line. A group as "label value, ...", one of `a` and `b` as "1 mm -> 2 mm (+100 %)".
///
/// name   says its unit
std::string value_text(const Value& value, std::string_view name = {});

/// A list of groups, a column for every name that has something in a row.
std::string table_text(const Value::List& rows, std::size_t most = 40);

/// A CSV file: the names of one group, and the scalars of others like it, a line each; flags as 1 and 0.
std::string csv_text(const Value& columns, const Value::List& rows);

/// A line for every entry of a group, "label  value", long groups indented; a list of groups as a table; nothing for
/// what is empty.
std::string lines_text(const Value& group);

}  // namespace touchfield
