#include "sim/store/hdf5_content.h"

#include <cstring>
#include <filesystem>
#include <limits>
#include <system_error>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/types.h"
#include "sim/store/hdf5_calls.h"
#include "sim/store/hdf5_wire.h"

namespace touchfield::hdf5 {

struct ContentValues {
  ValueKind kind = ValueKind::kOther;
  Shape shape;
  std::string_view bytes;
};

/// A group, a dataset or something else.
struct ContentNode {
  ObjectKind kind = ObjectKind::kOther;
  std::vector<std::pair<std::string, ContentValues>> attributes;
  std::vector<std::pair<std::string, std::shared_ptr<const ContentNode>>> links;
  ContentValues values;
  std::shared_ptr<const void> owner;  // of the bytes
};

namespace {

[[noreturn]] void refuse_content(const std::string& place, std::string_view what) {
  throw InputError(fmt::format("{}: {}", place, what));
}

/// Takes apart what the other process has sent, which may be anything if the file has got hold of it.
class Receiver {
 public:
  Receiver(const std::string& path, const WorkOutput& output)
      : path_(path), owner_(output.owner), left_(output.bytes) {}

  std::shared_ptr<const ContentNode> whole() {
    auto root = object(0);
    if (!left_.empty()) {
      refuse();
    }
    return root;
  }

  std::uint64_t number() {
    std::uint64_t value = 0;
    const std::string_view bytes = take(sizeof value);
    std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }

  std::string_view text() { return take(number()); }

  bool at_end() const { return left_.empty(); }

 private:
  [[noreturn]] void refuse() const { refuse_content(path_, "is damaged: reading it gives no sense"); }

  std::string_view take(std::uint64_t size) {
    if (size > left_.size()) {
      refuse();
    }
    const std::string_view bytes = left_.substr(0, size);
    left_.remove_prefix(size);
    return bytes;
  }

  template <class Kind>
  Kind kind() {
    const auto value = static_cast<unsigned char>(take(1).front());
    if (value > static_cast<unsigned char>(Kind::kOther)) {
      refuse();
    }
    return static_cast<Kind>(value);
  }

  void count() {
    if (++parts_ > kMostParts) {
      refuse();
    }
  }

  std::shared_ptr<const ContentNode> object(int depth) {
    count();
    auto node = std::make_shared<ContentNode>();
    node->owner = owner_;
    node->kind = kind<ObjectKind>();
    if (node->kind == ObjectKind::kGroup) {
      for (std::uint64_t left = number(); left > 0; --left) {
        count();
        const std::string_view name = text();
        node->attributes.emplace_back(name, values());
      }
      for (std::uint64_t left = number(); left > 0; --left) {
        if (depth >= kDeepestObject) {
          refuse();
        }
        const std::string_view name = text();
        node->links.emplace_back(name, object(depth + 1));
      }
    } else if (node->kind == ObjectKind::kDataset) {
      node->values = values();
    }
    return node;
  }

  ContentValues values() {
    ContentValues values;
    values.kind = kind<ValueKind>();
    for (std::uint64_t left = number(); left > 0; --left) {
      values.shape.push_back(number());
    }
    values.bytes = text();
    if (values.kind == ValueKind::kTexts) {
      Receiver texts(path_, {owner_, values.bytes});
      std::uint64_t count = 0;
      for (; !texts.at_end(); ++count) {
        texts.text();
      }
      require_count(values.shape, count);
    } else if (values.kind != ValueKind::kOther) {
      const std::size_t size = values.kind == ValueKind::kComplex ? sizeof(Complex) : sizeof(double);
      if (values.bytes.size() % size != 0) {
        refuse();
      }
      require_count(values.shape, values.bytes.size() / size);
    }
    return values;
  }

  void require_count(const Shape& shape, std::uint64_t count) const {
    std::uint64_t product = 1;
    for (const std::uint64_t size : shape) {
      if (size != 0 && product > std::numeric_limits<std::uint64_t>::max() / size) {
        refuse();
      }
      product *= size;
    }
    if (product != count) {
      refuse();
    }
  }

  const std::string& path_;
  std::shared_ptr<const void> owner_;
  std::string_view left_;
  int parts_ = 0;
};

template <class T>
constexpr ValueKind wanted_kind() {
  return std::is_same_v<T, Complex>  ? ValueKind::kComplex
         : std::is_same_v<T, double> ? ValueKind::kFloats
                                     : ValueKind::kIntegers;
}

const char* name_of(ValueKind kind) {
  switch (kind) {
    case ValueKind::kFloats:
      return "floats";
    case ValueKind::kIntegers:
      return "integers";
    case ValueKind::kComplex:
      return "complex numbers {r, i}";
    case ValueKind::kTexts:
      return "texts of variable length";
    case ValueKind::kOther:
      break;
  }
  return "values of another kind";
}

void require_kind(const ContentValues& values, ValueKind wanted, const std::string& place) {
  if (values.kind != wanted) {
    refuse_content(place, fmt::format("does not hold {}", name_of(wanted)));
  }
}

/// Copies all values as T, in whose range they must be.
template <class T>
void copy(const ContentValues& values, T* out, const std::string& place) {
  require_kind(values, wanted_kind<T>(), place);
  if constexpr (wanted_kind<T>() != ValueKind::kIntegers || sizeof(T) == sizeof(std::int64_t)) {
    if (!values.bytes.empty()) {
      std::memcpy(static_cast<void*>(out), values.bytes.data(), values.bytes.size());
    }
  } else {
    for (std::size_t at = 0; at < values.bytes.size(); at += sizeof(std::int64_t)) {
      std::int64_t value = 0;
      std::memcpy(&value, values.bytes.data() + at, sizeof value);
      *out = static_cast<T>(value);
      if (static_cast<std::int64_t>(*out++) != value) {
        refuse_content(place, fmt::format("[{}] = {} is out of range", at / sizeof value, value));
      }
    }
  }
}

std::vector<std::string> texts_of(const ContentValues& values, const std::string& place) {
  require_kind(values, ValueKind::kTexts, place);
  Receiver receiver(place, {nullptr, values.bytes});
  std::vector<std::string> texts;
  while (!receiver.at_end()) {
    texts.emplace_back(receiver.text());
  }
  return texts;
}

std::string one_text(std::vector<std::string> texts, const std::string& place) {
  if (texts.size() != 1) {
    refuse_content(place, fmt::format("must be one text, has {}", texts.size()));
  }
  return std::move(texts.front());
}

template <class Value>
const Value* found(const std::vector<std::pair<std::string, Value>>& list, const std::string& name) {
  for (const auto& [key, value] : list) {
    if (key == name) {
      return &value;
    }
  }
  return nullptr;
}

const ContentValues& attribute(const ContentNode& node, const std::string& name, const std::string& place) {
  const ContentValues* values = found(node.attributes, name);
  if (values == nullptr) {
    refuse_content(place, "is missing");
  }
  return *values;
}

template <class T>
T attribute_number(const ContentNode& node, const std::string& name, const std::string& place) {
  const ContentValues& values = attribute(node, name, place);
  if (values.kind != wanted_kind<T>() || values.bytes.size() != sizeof(std::int64_t)) {
    refuse_content(place, fmt::format("is not one of {}", name_of(wanted_kind<T>())));
  }
  T value{};
  copy(values, &value, place);
  return value;
}

const ContentValues& dataset(const ContentNode& node, const std::string& name, const std::string& place) {
  const auto* data = found(node.links, name);
  if (data == nullptr || (*data)->kind != ObjectKind::kDataset) {
    refuse_content(place, data == nullptr ? "is missing" : "is no dataset");
  }
  return (*data)->values;
}

}  // namespace

Content Content::open(const std::string& name) const {
  const std::string place = joined(place_, name);
  const auto* group = found(node_->links, name);
  if (group == nullptr || (*group)->kind != ObjectKind::kGroup) {
    refuse_content(place, group == nullptr ? "is missing" : "is no group");
  }
  return {*group, place};
}

bool Content::has(const std::string& name) const { return found(node_->links, name) != nullptr; }

std::vector<std::string> Content::names() const {
  std::vector<std::string> names;
  for (const auto& [name, node] : node_->links) {
    names.push_back(name);
  }
  return names;
}

bool Content::has_attribute(const std::string& name) const { return found(node_->attributes, name) != nullptr; }

std::string Content::text_attribute(const std::string& name) const {
  return one_text(texts_attribute(name), attribute_place(place_, name));
}

double Content::number_attribute(const std::string& name) const {
  return attribute_number<double>(*node_, name, attribute_place(place_, name));
}

int Content::integer_attribute(const std::string& name) const {
  return attribute_number<int>(*node_, name, attribute_place(place_, name));
}

std::vector<std::string> Content::texts_attribute(const std::string& name) const {
  const std::string place = attribute_place(place_, name);
  return texts_of(attribute(*node_, name, place), place);
}

Shape Content::shape(const std::string& name) const { return dataset(*node_, name, joined(place_, name)).shape; }

template <class T>
void Content::read(const std::string& name, const Shape& expected, T* values) const {
  const std::string place = joined(place_, name);
  const ContentValues& data = dataset(*node_, name, place);
  if (data.shape != expected) {
    refuse_content(
        place, fmt::format("has shape [{}], must have [{}]", fmt::join(data.shape, ", "), fmt::join(expected, ", ")));
  }
  copy(data, values, place);
}

std::string Content::read_text(const std::string& name) const {
  return one_text(read_texts(name), joined(place_, name));
}

std::vector<std::string> Content::read_texts(const std::string& name) const {
  const std::string place = joined(place_, name);
  return texts_of(dataset(*node_, name, place), place);
}

template void Content::read(const std::string&, const Shape&, double*) const;
template void Content::read(const std::string&, const Shape&, int*) const;
template void Content::read(const std::string&, const Shape&, std::int64_t*) const;
template void Content::read(const std::string&, const Shape&, unsigned char*) const;
template void Content::read(const std::string&, const Shape&, Complex*) const;

Content read_content(const std::string& path) {
  std::error_code error;
  const std::uint64_t size = std::filesystem::file_size(path, error);
  if (error) {
    refuse_content(path, error.message());
  }
  constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20;
  WorkLimits limits;
  limits.output = 64 * kMebibyte + 64 * size;
  limits.memory = 128 * kMebibyte + limits.output;
  limits.seconds = static_cast<int>(2 + size / (16 * kMebibyte));
  const WorkOutput output =
      isolated(path + ": is damaged: reading it", limits, [&](const Emit& emit) { send_content(path, emit); });
  return {Receiver(path, output).whole(), path + ": /"};
}

}  // namespace touchfield::hdf5
