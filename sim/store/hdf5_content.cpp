#include "sim/store/hdf5_content.h"

#include <cstring>
#include <filesystem>
#include <limits>
#include <map>
#include <system_error>
#include <type_traits>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/types.h"
#include "sim/store/hdf5_calls.h"
#include "sim/store/hdf5_wire.h"

namespace touchfield::hdf5 {

struct Part {
  PartKind kind = PartKind::kOther;
  Shape shape;
  std::string_view bytes;
};

/// What a file holds, by place.
struct Parts {
  std::map<std::string, Part, std::less<>> by_place;
  std::shared_ptr<const void> owner;  // of the bytes
};

namespace {

[[noreturn]] void refuse_content(const std::string& place, std::string_view what) {
  throw InputError(fmt::format("{}: {}", place, what));
}

/// Takes apart what the other process has sent, which may be anything if the file has got hold of it.
class Receiver {
 public:
  Receiver(const std::string& path, std::string_view bytes) : path_(path), left_(bytes) {}

  bool at_end() const { return left_.empty(); }

  std::string_view text() { return take(number()); }

  Part part() {
    Part part;
    const auto kind = static_cast<unsigned char>(take(1).front());
    require(kind <= static_cast<unsigned char>(PartKind::kOther));
    part.kind = static_cast<PartKind>(kind);
    for (std::uint64_t left = number(); left > 0; --left) {
      part.shape.push_back(number());
    }
    part.bytes = text();
    require(part.kind == PartKind::kOther || count_of(part.shape) == count_of(part));
    return part;
  }

  void require(bool sense) const {
    if (!sense) {
      refuse_content(path_, "is damaged: its content makes no sense");
    }
  }

 private:
  std::uint64_t number() {
    std::uint64_t value = 0;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }

  std::string_view take(std::uint64_t size) {
    require(size <= left_.size());
    const std::string_view bytes = left_.substr(0, size);
    left_.remove_prefix(size);
    return bytes;
  }

  std::uint64_t count_of(const Shape& shape) const {
    std::uint64_t product = 1;
    for (const std::uint64_t size : shape) {
      require(size == 0 || product <= std::numeric_limits<std::uint64_t>::max() / size);
      product *= size;
    }
    return product;
  }

  std::uint64_t count_of(const Part& part) const {
    if (part.kind == PartKind::kTexts || part.kind == PartKind::kGroup) {
      Receiver texts(path_, part.bytes);
      std::uint64_t count = 0;
      for (; !texts.at_end(); ++count) {
        texts.text();
      }
      return count;
    }
    const std::size_t size = part.kind == PartKind::kComplex ? sizeof(Complex) : sizeof(double);
    require(part.bytes.size() % size == 0);
    return part.bytes.size() / size;
  }

  const std::string& path_;
  std::string_view left_;
};

template <class T>
constexpr PartKind wanted_kind() {
  return std::is_same_v<T, Complex>  ? PartKind::kComplex
         : std::is_same_v<T, double> ? PartKind::kFloats
                                     : PartKind::kIntegers;
}

const char* name_of(PartKind kind) {
  switch (kind) {
    case PartKind::kFloats:
      return "floats";
    case PartKind::kIntegers:
      return "integers";
    case PartKind::kComplex:
      return "complex numbers {r, i}";
    default:
      return "texts of variable length";
  }
}

void require_kind(const Part& part, PartKind wanted, const std::string& place) {
  if (part.kind != wanted) {
    refuse_content(place, fmt::format("does not hold {}", name_of(wanted)));
  }
}

/// Copies all values as T, in whose range they must be.
template <class T>
void copy(const Part& part, T* out, const std::string& place) {
  require_kind(part, wanted_kind<T>(), place);
  if constexpr (wanted_kind<T>() != PartKind::kIntegers || sizeof(T) == sizeof(std::int64_t)) {
    if (!part.bytes.empty()) {
      std::memcpy(static_cast<void*>(out), part.bytes.data(), part.bytes.size());
    }
  } else {
    for (std::size_t at = 0; at < part.bytes.size(); at += sizeof(std::int64_t)) {
      std::int64_t value = 0;
      std::memcpy(&value, part.bytes.data() + at, sizeof value);
      *out = static_cast<T>(value);
      if (static_cast<std::int64_t>(*out++) != value) {
        refuse_content(place, fmt::format("[{}] = {} is out of range", at / sizeof value, value));
      }
    }
  }
}

/// One number of an attribute.
template <class T>
T number_of(const Part& part, const std::string& place) {
  if (part.kind != wanted_kind<T>() || part.bytes.size() != sizeof(std::int64_t)) {
    refuse_content(place, fmt::format("is not one of {}", name_of(wanted_kind<T>())));
  }
  T value{};
  copy(part, &value, place);
  return value;
}

std::vector<std::string> texts_of(const Part& part, PartKind kind, const std::string& place) {
  require_kind(part, kind, place);
  Receiver receiver(place, part.bytes);
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

}  // namespace

const Part* Content::find(const std::string& place) const {
  const auto found = parts_->by_place.find(place);
  return found != parts_->by_place.end() ? &found->second : nullptr;
}

const Part& Content::existing(const std::string& place) const {
  const Part* part = find(place);
  if (part == nullptr) {
    refuse_content(place, "is missing");
  }
  return *part;
}

const Part& Content::dataset(const std::string& place) const {
  const Part& part = existing(place);
  if (part.kind == PartKind::kGroup) {
    refuse_content(place, "is not a dataset");
  }
  return part;
}

Content Content::open(const std::string& name) const {
  const std::string place = joined(place_, name);
  if (existing(place).kind != PartKind::kGroup) {
    refuse_content(place, "is not a group");
  }
  return {parts_, place};
}

bool Content::has(const std::string& name) const { return find(joined(place_, name)) != nullptr; }

std::vector<std::string> Content::names() const { return texts_of(*find(place_), PartKind::kGroup, place_); }

bool Content::has_attribute(const std::string& name) const { return find(attribute_place(place_, name)) != nullptr; }

std::string Content::text_attribute(const std::string& name) const {
  return one_text(texts_attribute(name), attribute_place(place_, name));
}

double Content::number_attribute(const std::string& name) const {
  const std::string place = attribute_place(place_, name);
  return number_of<double>(existing(place), place);
}

int Content::integer_attribute(const std::string& name) const {
  const std::string place = attribute_place(place_, name);
  return number_of<int>(existing(place), place);
}

std::vector<std::string> Content::texts_attribute(const std::string& name) const {
  const std::string place = attribute_place(place_, name);
  return texts_of(existing(place), PartKind::kTexts, place);
}

Shape Content::shape(const std::string& name) const { return dataset(joined(place_, name)).shape; }

template <class T>
void Content::read(const std::string& name, const Shape& expected, T* values) const {
  const std::string place = joined(place_, name);
  const Part& data = dataset(place);
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
  return texts_of(dataset(place), PartKind::kTexts, place);
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
  const auto parts = std::make_shared<Parts>();
  parts->owner = output.owner;
  Receiver receiver(path, output.bytes);
  for (int count = 0; !receiver.at_end(); ++count) {
    const std::string_view place = receiver.text();
    parts->by_place.emplace(place, receiver.part());
    receiver.require(count < kMostParts);
  }
  const std::string root = path + ": /";
  receiver.require(parts->by_place.contains(root) && parts->by_place[root].kind == PartKind::kGroup);
  return {parts, root};
}

}  // namespace touchfield::hdf5
