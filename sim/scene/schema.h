#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "sim/core/types.h"
#include "sim/scene/input.h"
#include "sim/scene/quantity.h"
#include "sim/scene/schema_info.h"

/// The language the scene's table is written in. A Codec says once what a value is: what the reader accepts, how the
/// value is written back, and what the schema pages say about it.
namespace touchfield::schema {

/// A function that its copies share: a codec is made of others, which it copies many times over.
template <class Signature>
class Shared;
template <class Result, class... Arguments>
class Shared<Result(Arguments...)> {
 public:
  template <class Function>
  requires(std::is_invocable_r_v<Result, const Function&, Arguments...> && !std::is_same_v<Function, Shared>)
      Shared(Function function)
      : function_(std::make_shared<const std::function<Result(Arguments...)>>(std::move(function))) {}

  Result operator()(Arguments... arguments) const { return (*function_)(std::forward<Arguments>(arguments)...); }

 private:
  std::shared_ptr<const std::function<Result(Arguments...)>> function_;
};

/// How values of type T are read, written and described.
template <class T>
struct Codec {
  TypeInfo type;
  /// Reads a value; on a problem reports it and returns false.
  Shared<bool(const Input&, T&)> read;
  Shared<Node(const T&)> write;
};

Codec<double> number(Unit unit, const Range& range);
Codec<int> integer(const Range& range);
Codec<unsigned> seed();
Codec<bool> flag();
Codec<std::string> name();
Codec<std::string> text(std::size_t fewest_bytes);
/// The name of a file; its path once read (see Reading::resolve).
Codec<std::string> file();
/// The same as an absolute path, so that a resolved scene can be read from anywhere.
Codec<std::string> absolute_file();
Codec<std::string> word(std::vector<std::string> words);
/// A list of 3.
Codec<Vector3> vector3(Unit unit, const Range& range);
/// A list of lists of 3.
Codec<Points> points(Unit unit, const Range& range);

/// Reports and returns false unless the value is a list of as many items as its type says.
bool check_list(const Input& in, const TypeInfo& type);
/// Reports a name that an earlier item has; advice: added to the message.
bool check_new_name(const Input& item, const std::string& name, const std::vector<std::string>& taken,
                    const std::string& advice);

/// A value read as a Form, the shape it has in the file, and kept as a T.
///
/// to     the T of a Form; reports and returns nothing if there is none
/// from   the Form that reads as this T
template <class T, class Form>
Codec<T> kept_as(Codec<Form> form, std::function<std::optional<T>(const Input&, const Form&)> to,
                 std::function<Form(const T&)> from) {
  return {form.type,
          [form, to](const Input& in, T& out) {
            Form read{};
            if (!form.read(in, read)) {
              return false;
            }
            auto value = to(in, read);
            if (!value) {
              return false;
            }
            out = std::move(*value);
            return true;
          },
          [form, from](const T& value) { return form.write(from(value)); }};
}

template <class T, class Part>
Codec<T> kept_in(Part T::*member, const Codec<Part>& codec) {
  return {codec.type, [=](const Input& in, T& out) { return codec.read(in, out.*member); },
          [=](const T& value) { return codec.write(value.*member); }};
}

/// A map of free names, each once, to values of one kind.
template <class T>
Codec<std::map<std::string, T>> table_of(const Codec<T>& value) {
  const TypeInfo type{.kind = TypeInfo::Kind::kTable, .of = {value.type}};
  return {type,
          [type, value](const Input& in, std::map<std::string, T>& out) {
            if (in.node().kind != Node::Kind::kMap) {
              return in.must_be(phrase(type, false));
            }
            bool good = true;
            for (const auto& entry : in.node().entries) {
              if (entry.value.removed) {
                continue;
              }
              const auto report = [&](const std::string& text) {
                in.reading().add(entry.place, in.path_of(entry.key) + ": " + text);
                good = false;
              };
              T read{};
              good = value.read(in.at(entry), read) && good;
              if (!is_name(entry.key)) {
                report("a name that must be " + phrase(name().type));
              }
              if (!out.emplace(entry.key, std::move(read)).second) {
                report("given twice");
              }
            }
            return good;
          },
          [value](const std::map<std::string, T>& values) {
            std::vector<std::pair<std::string, Node>> entries;
            for (const auto& [key, item] : values) {
              entries.emplace_back(key, value.write(item));
            }
            return map(std::move(entries));
          }};
}

/// A word for each of some values.
template <class E>
Codec<E> choice(const std::vector<std::pair<std::string, E>>& values) {
  std::vector<std::string> words;
  for (const auto& [text, value] : values) {
    words.push_back(text);
  }
  using Value = std::pair<std::string, E>;
  return kept_as<E, std::string>(
      word(words),
      [values](const Input&, const std::string& text) {
        return std::optional(std::ranges::find(values, text, &Value::first)->second);
      },
      [values](const E& value) { return std::ranges::find(values, value, &Value::second)->first; });
}

/// What must differ between the items of a list.
template <class T>
struct Unique {
  std::function<std::string(const T&)> name;
  std::string advice;  // how to give another name, for the message
};

template <class T>
Codec<std::vector<T>> list_of(Codec<T> item, std::size_t fewest, std::size_t most = TypeInfo::kNoLimit,
                              Unique<T> unique = {}) {
  TypeInfo type{.kind = TypeInfo::Kind::kList, .fewest = fewest, .most = most, .of = {item.type}};
  return {type,
          [type, item, unique](const Input& in, std::vector<T>& out) {
            bool good = check_list(in, type);
            if (in.node().kind != Node::Kind::kList) {
              return false;
            }
            std::vector<T> values;
            std::vector<std::string> names;
            for (std::size_t i = 0; i < in.node().items.size(); ++i) {
              T value{};
              const Input item_in = in.at(i);
              if (!item.read(item_in, value)) {
                good = false;
                if (unique.name) {
                  names.emplace_back();
                }
                continue;
              }
              if (unique.name) {
                good = check_new_name(item_in, unique.name(value), names, unique.advice) && good;
                names.push_back(unique.name(value));
              }
              values.push_back(std::move(value));
            }
            if (good) {
              out = std::move(values);
            }
            return good;
          },
          [item](const std::vector<T>& values) {
            std::vector<Node> nodes;
            nodes.reserve(values.size());
            for (const auto& value : values) {
              nodes.push_back(item.write(value));
            }
            return list(std::move(nodes));
          }};
}

template <class T, std::size_t n>
Codec<std::array<T, n>> tuple_of(const Codec<T>& item) {
  using Tuple = std::array<T, n>;
  return kept_as<Tuple, std::vector<T>>(
      list_of(item, n, n),
      [](const Input&, const std::vector<T>& values) {
        Tuple tuple;
        std::ranges::copy(values, tuple.begin());
        return std::optional(tuple);
      },
      [](const Tuple& tuple) { return std::vector<T>(tuple.begin(), tuple.end()); });
}

bool looks_like(const TypeInfo& type, const Node& node);

/// A value that is written in one of two ways; of what looks like neither the message names both.
///
/// is_first      which values are written in the first way
/// takes_first   what it reads, faults included; absent: what looks like it
template <class T>
Codec<T> either(const Codec<T>& first, const Codec<T>& second, std::function<bool(const T&)> is_first,
                std::function<bool(const Node&)> takes_first = nullptr) {
  const TypeInfo type{.kind = TypeInfo::Kind::kAny, .of = {first.type, second.type}};
  return {type,
          [=](const Input& in, T& out) {
            if (takes_first ? takes_first(in.node()) : looks_like(first.type, in.node())) {
              return first.read(in, out);
            }
            if (looks_like(second.type, in.node())) {
              return second.read(in, out);
            }
            return in.must_be(phrase(type));
          },
          [=](const T& value) { return (is_first(value) ? first : second).write(value); }};
}

// The tables of maps: one row per key, which names the member of a struct that keeps its value.

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
