#include "sim/scene/random_range.h"

#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "sim/core/text.h"

namespace touchfield::schema {

std::optional<double> number_in(const Node& node) {
  const auto value = node.kind == Node::Kind::kScalar && !node.quoted ? number_of<double>(node.text) : std::nullopt;
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string RandomRange::draw(Uniform& uniform) const {
  const double u = uniform();
  const double v = uniform();
  switch (kind) {
    case Kind::kUniform:
      return fmt::format("{}", first + u * (second - first));
    case Kind::kInteger:
      return fmt::format("{:.0f}", first + std::floor(u * (second - first + 1.0)));
    case Kind::kLog:
      return fmt::format("{}", first * std::pow(second / first, u));
    case Kind::kNormal:
      return fmt::format("{}",
                         first + second * std::sqrt(-2.0 * std::log1p(-u)) * std::cos(2.0 * std::numbers::pi * v));
  }
  return "";
}

std::optional<RandomRange> read_range(const Entry& entry, Reading& reading) {
  const Node* pair = &entry.value;
  RandomRange range;
  if (pair->kind == Node::Kind::kMap && pair->entries.size() == 1) {
    const std::string& kind = pair->entries.front().key;
    range.kind = kind == "integer"  ? RandomRange::Kind::kInteger
                 : kind == "log"    ? RandomRange::Kind::kLog
                 : kind == "normal" ? RandomRange::Kind::kNormal
                                    : RandomRange::Kind::kUniform;
    pair = range.kind == RandomRange::Kind::kUniform ? pair : &pair->entries.front().value;
  }
  const bool two = pair->kind == Node::Kind::kList && pair->items.size() == 2;
  const auto first = two ? number_in(pair->items[0]) : std::nullopt;
  const auto second = two ? number_in(pair->items[1]) : std::nullopt;
  if (!first || !second) {
    reading.add(entry.value.place, fmt::format("random.ranges.{}: must be [low, high], {{integer: [low, high]}}, "
                                               "{{log: [low, high]}} or {{normal: [mean, sigma]}}",
                                               entry.key));
    return std::nullopt;
  }
  range.first = *first;
  range.second = *second;
  const bool whole = range.first == std::floor(range.first) && range.second == std::floor(range.second);
  const char* rule = nullptr;
  if (range.kind == RandomRange::Kind::kNormal) {
    rule = range.second >= 0 ? nullptr : "sigma >= 0";
  } else if (!(range.first <= range.second)) {
    rule = "low <= high";
  } else if (range.kind == RandomRange::Kind::kLog && !(range.first > 0)) {
    rule = "low > 0";
  } else if (range.kind == RandomRange::Kind::kInteger && !whole) {
    rule = "whole numbers";
  }
  if (rule != nullptr) {
    reading.add(entry.value.place, fmt::format("random.ranges.{}: must have {}", entry.key, rule));
    return std::nullopt;
  }
  return range;
}

}  // namespace touchfield::schema
