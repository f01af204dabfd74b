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
#include <vector>

#include "sim/core/types.h"
#include "sim/scene/input.h"
#include "sim/scene/quantity.h"
#include "sim/scene/schema_info.h"

/// The language the scene's table is written in. A Codec says once what a value is: what the reader accepts, how the
/// value is written back, and what the schema pages say about it. Maps of keys: schema_map.h.
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

/// A value kept in a member of T.
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

/// Whether a value looks like one of this type.
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

}  // namespace touchfield::schema
