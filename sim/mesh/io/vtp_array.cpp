#include "sim/mesh/io/vtp_array.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>
#include <type_traits>
#include <zlib.h>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/io/byte_string.h"
#include "sim/mesh/io/text_cursor.h"

namespace touchfield {

namespace {

[[noreturn]] void fail(const std::string& what, const std::string& message) {
  throw InputError(fmt::format("{}: {}", what, message));
}

/// Hands out the bytes of an array in order, decoding base64 on the way. Parts that were encoded one by one and are
/// padded each follow each other without a seam.
class ByteSource {
 public:
  ByteSource(std::string_view stored, bool base64, const std::string& what)
      : stored_(stored), base64_(base64), what_(what) {}

  /// An upper bound of the bytes that are left.
  std::uint64_t left() const {
    const std::uint64_t stored = stored_.size() - at_;
    return base64_ ? decoded_.size() - used_ + stored / 4 * 3 + 3 : stored;
  }

  std::string take(std::uint64_t count) {
    if (count > left()) {
      fail(what_, fmt::format("it should go on for {} bytes where fewer than {} are left", count, left() + 1));
    }
    std::string bytes;
    if (!base64_) {
      bytes = stored_.substr(at_, count);
      at_ += count;
      return bytes;
    }
    bytes.reserve(count);
    while (bytes.size() < count) {
      if (used_ == decoded_.size()) {
        decode_group();
      }
      bytes.push_back(decoded_[used_++]);
    }
    return bytes;
  }

 private:
  static int value_of(char c) {
    static constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    static const std::array<signed char, 256> kValues = [] {
      std::array<signed char, 256> values{};
      values.fill(-1);
      for (std::size_t i = 0; i < kDigits.size(); ++i) {
        values[static_cast<unsigned char>(kDigits[i])] = static_cast<signed char>(i);
      }
      return values;
    }();
    return kValues[static_cast<unsigned char>(c)];
  }

  /// Four digits are three bytes; one or two of them '=' take a byte each away.
  void decode_group() {
    std::array<char, 4> digits{};
    for (char& digit : digits) {
      at_ = std::min(stored_.find_first_not_of(" \t\r\n", at_), stored_.size());
      if (at_ == stored_.size()) {
        fail(what_, "its base64 text ends too early");
      }
      digit = stored_[at_++];
    }
    const int padding = digits[3] != '=' ? 0 : digits[2] != '=' ? 1 : 2;
    unsigned group = 0;
    for (std::size_t i = 0; i < 4; ++i) {
      const int value = static_cast<int>(i) < 4 - padding ? value_of(digits[i]) : 0;
      if (value < 0) {
        fail(what_, fmt::format("its base64 text has a character of code {}", static_cast<unsigned char>(digits[i])));
      }
      group = group << 6U | static_cast<unsigned>(value);
    }
    decoded_.clear();
    used_ = 0;
    for (int i = 0; i < 3 - padding; ++i) {
      decoded_.push_back(static_cast<char>(group >> (16U - 8U * static_cast<unsigned>(i)) & 0xffU));
    }
  }

  std::string_view stored_;
  bool base64_;
  const std::string& what_;
  std::size_t at_ = 0;
  std::string decoded_;  // the last group
  std::size_t used_ = 0;
};

std::uint64_t take_length(ByteSource& source, const VtpEncoding& encoding) {
  const std::string bytes = source.take(encoding.wide_header ? 8 : 4);
  return encoding.wide_header ? number_at<std::uint64_t>(bytes.data(), encoding.big_endian)
                              : number_at<std::uint32_t>(bytes.data(), encoding.big_endian);
}

void require_at_most(std::uint64_t most, std::uint64_t bytes, const std::string& what) {
  if (bytes > most) {
    fail(what, fmt::format("it announces {} bytes, at most {} fit what the file says of it", bytes, most));
  }
}

/// Blocks, their size, the size of the last one if it is smaller (else 0), the compressed sizes; then the blocks.
///
/// most   bytes that they may unpack to
std::string take_compressed(ByteSource& source, const VtpEncoding& encoding, std::uint64_t most,
                            const std::string& what) {
  const std::uint64_t blocks = take_length(source, encoding);
  if (blocks == 0) {
    return {};
  }
  const std::uint64_t size = take_length(source, encoding);
  const std::uint64_t rest = take_length(source, encoding);
  // Each block has its length in the header, and zlib makes nothing more than about 1032 times smaller.
  constexpr std::uint64_t kMostRatio = 1100;
  if (blocks > source.left() / 4 || rest > size || size > kMostRatio * source.left() ||
      blocks - 1 > kMostRatio * source.left() / std::max<std::uint64_t>(size, 1)) {
    fail(what, fmt::format("it announces {} blocks of {} bytes, too many for what is stored", blocks, size));
  }
  require_at_most(most, (blocks - 1) * size + (rest > 0 ? rest : size), what);
  std::vector<std::uint64_t> stored(blocks);
  for (std::uint64_t& length : stored) {
    length = take_length(source, encoding);
  }
  std::string bytes;
  for (std::uint64_t b = 0; b < blocks; ++b) {
    const std::string block = source.take(stored[b]);
    const std::uint64_t wanted = b + 1 == blocks && rest > 0 ? rest : size;
    const std::size_t before = bytes.size();
    bytes.resize(before + wanted);
    uLongf length = wanted;
    const int status = uncompress(reinterpret_cast<Bytef*>(bytes.data() + before), &length,
                                  reinterpret_cast<const Bytef*>(block.data()), block.size());
    if (status != Z_OK || length != wanted) {
      fail(what, fmt::format("block {} of {} is damaged: it is not {} bytes compressed by zlib", b, blocks, wanted));
    }
  }
  return bytes;
}

std::string take_bytes(const VtpArray& array, const VtpEncoding& encoding,
                       const std::optional<VtpAppendedData>& appended, std::uint64_t most, const std::string& what) {
  std::string_view stored = array.text;
  bool base64 = true;
  if (array.format == "appended") {
    std::int64_t offset = 0;
    if (!appended) {
      fail(what, "it is appended, but the file has no AppendedData");
    }
    if (!to_integer(array.offset, offset) || offset < 0 ||
        static_cast<std::uint64_t>(offset) >= appended->bytes.size()) {
      fail(what, fmt::format("its offset '{}' is none of the {} bytes of the AppendedData", array.offset.substr(0, 40),
                             appended->bytes.size()));
    }
    stored = appended->bytes.substr(static_cast<std::size_t>(offset));
    base64 = appended->base64;
  }
  ByteSource source(stored, base64, what);
  if (encoding.compressed) {
    return take_compressed(source, encoding, most, what);
  }
  const std::uint64_t length = take_length(source, encoding);
  require_at_most(most, length, what);
  return source.take(length);
}

template <class Result, class Number>
Result converted(Number value, const std::string& what) {
  if constexpr (std::is_floating_point_v<Number> && std::is_integral_v<Result>) {
    fail(what, "it must be of an integer type");
  } else if constexpr (std::is_same_v<Number, std::uint64_t> && std::is_integral_v<Result>) {
    if (value > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) {
      fail(what, fmt::format("it has the value {}, which is too large", value));
    }
    return static_cast<Result>(value);
  } else {
    return static_cast<Result>(value);
  }
}

template <class Result, class Number>
std::vector<Result> from_bytes(const std::string& bytes, bool big_endian, const std::string& what) {
  if (bytes.size() % sizeof(Number) != 0) {
    fail(what, fmt::format("its {} bytes are no whole count of values of {}", bytes.size(), sizeof(Number)));
  }
  std::vector<Result> values;
  values.reserve(bytes.size() / sizeof(Number));
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(Number)) {
    values.push_back(converted<Result>(number_at<Number>(bytes.data() + at, big_endian), what));
  }
  return values;
}

template <class Result>
std::vector<Result> from_text(std::string_view text, const std::string& what) {
  std::vector<Result> values;
  for (std::string_view word = take_word(text); !word.empty(); word = take_word(text)) {
    Result value = 0;
    bool is_number = false;
    if constexpr (std::is_integral_v<Result>) {
      is_number = to_integer(word, value);
    } else {
      is_number = to_number(word, value);
    }
    if (!is_number) {
      fail(what,
           fmt::format("'{}' is not {} number", word.substr(0, 40), std::is_integral_v<Result> ? "a whole" : "a"));
    }
    values.push_back(value);
  }
  return values;
}

template <class Result>
struct NumberType {
  const char* name;
  std::uint64_t bytes;
  std::vector<Result> (*decoder)(const std::string& bytes, bool big_endian, const std::string& what);
};

template <class Result, class Number>
constexpr NumberType<Result> type_of(const char* name) {
  return {name, sizeof(Number), from_bytes<Result, Number>};
}

template <class Result>
const NumberType<Result>& number_type(const std::string& type, const std::string& what) {
  static constexpr std::array<NumberType<Result>, 10> kTypes = {
      type_of<Result, std::int8_t>("Int8"),   type_of<Result, std::uint8_t>("UInt8"),
      type_of<Result, std::int16_t>("Int16"), type_of<Result, std::uint16_t>("UInt16"),
      type_of<Result, std::int32_t>("Int32"), type_of<Result, std::uint32_t>("UInt32"),
      type_of<Result, std::int64_t>("Int64"), type_of<Result, std::uint64_t>("UInt64"),
      type_of<Result, float>("Float32"),      type_of<Result, double>("Float64")};
  const auto* found =
      std::find_if(kTypes.begin(), kTypes.end(), [&](const NumberType<Result>& known) { return known.name == type; });
  if (found == kTypes.end()) {
    fail(what, fmt::format("its type is '{}', it must be Int8 to UInt64, Float32 or Float64", type.substr(0, 40)));
  }
  return *found;
}

}  // namespace

template <class Result>
std::vector<Result> decode(const VtpArray& array, const VtpEncoding& encoding,
                           const std::optional<VtpAppendedData>& appended, std::int64_t most, const std::string& what) {
  const NumberType<Result>& type = number_type<Result>(array.type, what);
  if (array.format == "ascii") {
    return from_text<Result>(array.text, what);
  }
  if (array.format != "binary" && array.format != "appended") {
    fail(what, fmt::format("its format is '{}', it must be ascii, binary or appended", array.format.substr(0, 40)));
  }
  const std::uint64_t most_bytes = static_cast<std::uint64_t>(most) * type.bytes;
  return type.decoder(take_bytes(array, encoding, appended, most_bytes, what), encoding.big_endian, what);
}

template std::vector<double> decode(const VtpArray&, const VtpEncoding&, const std::optional<VtpAppendedData>&,
                                    std::int64_t, const std::string&);
template std::vector<std::int64_t> decode(const VtpArray&, const VtpEncoding&, const std::optional<VtpAppendedData>&,
                                          std::int64_t, const std::string&);

}  // namespace touchfield
