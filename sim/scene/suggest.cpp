#include "sim/scene/suggest.h"

#include <algorithm>
#include <array>

namespace touchfield::schema {

namespace {

// Longest first where one ends in another.
constexpr std::array kUnits = {"_percent", "_kg_m3", "_g_cm3", "_mm_s", "_pa_m", "_kpa", "_khz", "_mhz", "_deg",
                               "_rad",     "_m_s",   "_hz",    "_pa",   "_db",   "_mm",  "_cm",  "_um",  "_km",
                               "_in",      "_ms",    "_m",     "_c",    "_k",    "_f",   "_s"};

constexpr std::size_t kLongestTried = 64;  // no known word is near a longer one

// How many letters may differ.
std::size_t allowed_distance(std::string_view a, std::string_view b) {
  return std::max<std::size_t>(1, std::min(a.size(), b.size()) / 3);
}

std::string folded(std::string_view key) {
  std::string result(key);
  for (char& c : result) {
    if (c >= 'A' && c <= 'Z') {
      c = static_cast<char>(c - 'A' + 'a');
    }
    if (c == '-' || c == ' ') {
      c = '_';
    }
  }
  return result;
}

/// The word of least distance from a text, the first of several; empty if none is near.
template <class Distance>
std::string nearest(const std::vector<std::string>& words, std::string_view text, const Distance& distance) {
  if (text.size() > kLongestTried) {
    return {};
  }
  const std::string typed = folded(text);
  std::string best;
  std::size_t best_distance = TypeInfo::kNoLimit;
  for (const auto& word : words) {
    const std::size_t from_word = distance(word, typed);
    if (from_word <= allowed_distance(word, typed) && from_word < best_distance) {
      best = word;
      best_distance = from_word;
    }
  }
  return best;
}

}  // namespace

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::vector<std::size_t>> d(a.size() + 1, std::vector<std::size_t>(b.size() + 1));
  for (std::size_t i = 0; i <= a.size(); ++i) {
    d[i][0] = i;
  }
  for (std::size_t j = 0; j <= b.size(); ++j) {
    d[0][j] = j;
  }
  for (std::size_t i = 1; i <= a.size(); ++i) {
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t replaced = d[i - 1][j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1);
      d[i][j] = std::min({d[i - 1][j] + 1, d[i][j - 1] + 1, replaced});
      const bool swapped = i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1];
      if (swapped) {
        d[i][j] = std::min(d[i][j], d[i - 2][j - 2] + 1);
      }
    }
  }
  return d[a.size()][b.size()];
}

std::string_view without_unit(std::string_view key) {
  for (const std::string_view unit : kUnits) {
    if (key.size() > unit.size() && key.ends_with(unit)) {
      return key.substr(0, key.size() - unit.size());
    }
  }
  return key;
}

std::string nearest_word(const std::vector<std::string>& words, std::string_view text) {
  return nearest(words, text, edit_distance);
}

std::string nearest_key(const MapInfo& map, std::string_view unknown) {
  // A wrong unit is many letters away but the commonest slip.
  const auto distance = [](std::string_view known, std::string_view typed) {
    return without_unit(known) == without_unit(typed) ? 0 : edit_distance(known, typed);
  };
  if (std::string best = nearest(map.names(), unknown, distance); !best.empty() || unknown.size() > kLongestTried) {
    return best;
  }
  const std::string key = folded(unknown);
  for (const auto& known : map.keys) {
    if (!known.type.map) {
      continue;
    }
    for (const auto& below : known.type.map->keys) {
      if (below.name == key) {
        return known.name + "." + below.name;
      }
    }
  }
  return {};
}

}  // namespace touchfield::schema
