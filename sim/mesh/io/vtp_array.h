#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace touchfield {

/// How the arrays of a VTK XML file are stored.
struct VtpEncoding {
  bool big_endian = false;
  bool wide_header = false;  // lengths are 64-bit numbers, else 32-bit
  bool compressed = false;   // by zlib, in blocks
};

/// What follows <AppendedData> and its underscore.
struct VtpAppendedData {
  std::string_view bytes;
  bool base64 = false;
};

/// One <DataArray> of a VTK XML file, not decoded yet.
struct VtpArray {
  std::string type;
  std::string format;
  std::string offset;  // into the appended data
  std::string text;    // of an array that is not appended
};

/// The numbers of an array as doubles or as integers.
///
/// appended   none if the file has no appended data
/// most       numbers that there may be; an array that unpacks to more is refused before memory is taken for it
/// what       how an error calls the array, with the file
/// throws     InputError on an unknown type or format, damaged base64 or zlib data, lengths that do not match what
///            there is, a word that is no number, or, for integers, a number that is not a whole one
template <class Result>  // double or std::int64_t
std::vector<Result> decode(const VtpArray& array, const VtpEncoding& encoding,
                           const std::optional<VtpAppendedData>& appended, std::int64_t most, const std::string& what);

}  // namespace touchfield
