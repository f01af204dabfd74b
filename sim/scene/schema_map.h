#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "sim/scene/schema.h"

/// The tables of maps: one row per key, which names the member of a struct that keeps its value.
namespace touchfield::schema {

/// The checks of a map that its table alone decides: it is a map of known keys, each once, none missing, alternatives
/// not mixed. Reports what is wrong.
bool check_keys(const Input& in, const MapInfo& info);
/// The value that a member holds; null if it holds none.
template <class T>
const T* held(const T& member) {
  return &member;
}
template <>
inline const std::string* held(const std::string& member) {
  return member.empty() ? nullptr : &member;
}
template <class T>
const T* held(const std::optional<T>& member) {
  return member ? &*member : nullptr;
}
template <class T, class... Others>
const T* held(const std::variant<Others...>& member) {
  return std::get_if<T>(&member);
}
template <class T>
const T* held(const std::vector<T>& member) {
  return member.size() == 1 ? member.data() : nullptr;
}

/// The table of a map that is kept as an S. The members' initial values in S are the defaults.
template <class S>
class Map {
 public:
  using Read = Shared<bool(const Input&, S&)>;
  using Write = Shared<std::optional<Node>(const S&)>;

  /// An optional key; its default is the member's initial value.
  template <class T, class Base>
  Map& key(const std::string& name, T Base::*member, const Codec<T>& codec, const std::string& help) {
    required(name, member, codec, "", help);
    info_.keys.back().required = false;
    return defaults_to(flow_text(codec.write(S{}.*member)));
  }

  template <class T, class Base>
  Map& required(const std::string& name, T Base::*member, const Codec<T>& codec, const std::string& example,
                const std::string& help) {
    return add(
        {.name = name, .type = codec.type, .help = help, .required = true, .example = example},
        [member, codec](const Input& in, S& s) { return codec.read(in, s.*member); },
        [member, codec](const S& s) { return std::optional<Node>(codec.write(s.*member)); });
  }

  /// A key that may be absent. The member holds the value or none: an optional, a variant, a list of one, or a text
  /// that may be empty.
  template <class T, class Holder, class Base>
  Map& maybe(const std::string& name, Holder Base::*member, const Codec<T>& codec, const std::string& example,
             const std::string& help) {
    return add(
        {.name = name, .type = codec.type, .help = help, .example = example},
        [member, codec](const Input& in, S& s) {
          T value{};
          const bool good = codec.read(in, value);
          s.*member = Holder{std::move(value)};
          return good;
        },
        [member, codec](const S& s) {
          const T* value = held<T>(s.*member);
          return value ? std::optional<Node>(codec.write(*value)) : std::nullopt;
        });
  }

  /// The keys of another table, kept in a part of S.
  template <class Part, class Base>
  Map& part(Part Base::*member, const Map<Part>& table) {
    for (std::size_t i = 0; i < table.info_.keys.size(); ++i) {
      add(
          table.info_.keys[i], [member, read = table.reads_[i]](const Input& in, S& s) { return read(in, s.*member); },
          [member, write = table.writes_[i]](const S& s) { return write(s.*member); });
    }
    return *this;
  }

  Map& add(KeyInfo info, Read read, Write write) {
    info_.keys.push_back(std::move(info));
    reads_.push_back(std::move(read));
    writes_.push_back(std::move(write));
    return *this;
  }

  /// The key added last is written of some values alone. What the keys of the group ask for holds without it: the first
  /// of them that has a value is written, and those allowed beside it.
  Map& written_if(std::function<bool(const S&)> test) {
    writes_.back() = [test = std::move(test), write = writes_.back()](const S& s) {
      return test(s) ? write(s) : std::nullopt;
    };
    return *this;
  }
  Map& defaults_to(const std::string& fallback) {
    info_.keys.back().fallback = fallback;
    return *this;
  }
  /// The key added last is allowed only beside one of these keys of the group.
  Map& allowed_with(std::vector<std::string> keys) {
    info_.keys.back().only_with = std::move(keys);
    return *this;
  }
  /// The key added last is required beside these keys of the group and allowed beside no other.
  Map& needed_with(std::vector<std::string> keys) {
    info_.keys.back().required = true;
    return allowed_with(std::move(keys));
  }
  /// The key added last is required beside the first keys of the group and may be given beside the second ones. It is
  /// allowed beside no other.
  Map& needed_with(std::vector<std::string> keys, std::vector<std::string> optional) {
    info_.keys.back().also_with = std::move(optional);
    return needed_with(std::move(keys));
  }
  /// What editors show for the key added last, instead of its default.
  Map& shown_as(const std::string& example) {
    info_.keys.back().example = example;
    return *this;
  }
  /// The list added last has this many items beside a key of the group.
  Map& items_with(const std::string& key, std::size_t count) {
    info_.keys.back().items_with.emplace_back(key, count);
    return *this;
  }
  Map& exactly_one(std::vector<std::string> keys) {
    info_.group = Group{std::move(keys), true};
    return *this;
  }
  Map& at_most_one(std::vector<std::string> keys) {
    info_.group = Group{std::move(keys), false};
    return *this;
  }
  /// A check that needs more than one key; called once all keys are read, whether or not they were good.
  Map& check(std::function<bool(const Input&, S&, bool good)> check) {
    check_ = std::move(check);
    return *this;
  }

  Codec<S> codec() const {
    auto info = std::make_shared<const MapInfo>(info_);
    return {TypeInfo{.kind = TypeInfo::Kind::kMap, .map = info},
            [info, reads = reads_, check = check_](const Input& in, S& s) {
              bool good = check_keys(in, *info);
              if (in.node().kind != Node::Kind::kMap) {
                return false;
              }
              for (std::size_t i = 0; i < reads.size(); ++i) {
                const Entry* entry = in.node().find(info->keys[i].name);
                if (entry) {
                  good = reads[i](in.at(*entry), s) && good;
                }
              }
              if (check) {
                good = check(in, s, good) && good;
              }
              return good;
            },
            [info, writes = writes_](const S& s) {
              std::vector<std::pair<std::string, Node>> entries;
              std::string chosen;  // of the group
              for (std::size_t i = 0; i < writes.size(); ++i) {
                const KeyInfo& key = info->keys[i];
                const bool of_group = info->group && contains(info->group->keys, key.name);
                if (of_group ? !chosen.empty() : !key.fits(chosen)) {
                  continue;
                }
                if (auto node = writes[i](s)) {
                  entries.emplace_back(key.name, std::move(*node));
                  chosen = of_group ? key.name : chosen;
                }
              }
              return map(std::move(entries));
            }};
  }

 private:
  template <class>
  friend class Map;

  MapInfo info_;
  std::vector<Read> reads_;
  std::vector<Write> writes_;
  std::function<bool(const Input&, S&, bool)> check_;
};

}  // namespace touchfield::schema
