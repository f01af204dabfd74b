#include "sim/core/file_kind.h"

#include <algorithm>
#include <array>
#include <cctype>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

using namespace std::string_view_literals;

struct Beginning {
  std::string_view bytes;
  const char* kind;
};

constexpr std::array<Beginning, 17> kBeginnings = {{
    {"version https://git-lfs"sv, "a Git LFS pointer, not the file itself: run git lfs pull"},
    {"\x1F\x8B"sv, "a gzip file: unpack it first, by gunzip"},
    {"PK\x03\x04"sv, "a zip archive: unpack it first"},
    {"PK\x05\x06"sv, "an empty zip archive"},
    {"\xFD"
     "7zXZ\0"sv,
     "an xz file: unpack it first, by unxz"},
    {"BZh"sv, "a bzip2 file: unpack it first, by bunzip2"},
    {"\x28\xB5\x2F\xFD"sv, "a zstd file: unpack it first, by unzstd"},
    {"7z\xBC\xAF\x27\x1C"sv, "a 7z archive: unpack it first"},
    {"Rar!\x1A\x07"sv, "a rar archive: unpack it first"},
    {"%PDF-"sv, "a PDF document"},
    {"\x89PNG\r\n\x1A\n"sv, "a PNG image"},
    {"\xFF\xD8\xFF"sv, "a JPEG image"},
    {"\x89HDF\r\n\x1A\n"sv, "an HDF5 file"},
    {"\xFF\xFE\0\0"sv, "UTF-32 text: save it as UTF-8"},  // before UTF-16, which begins alike
    {"\0\0\xFE\xFF"sv, "UTF-32 text: save it as UTF-8"},
    {"\xFF\xFE"sv, "UTF-16 text: save it as UTF-8"},
    {"\xFE\xFF"sv, "UTF-16 text: save it as UTF-8"},
}};

/// Whether each of the first characters is a printable one of ASCII in two bytes.
bool is_unmarked_utf16(std::string_view bytes) {
  constexpr std::size_t kLooked = 32;
  const std::size_t count = std::min(bytes.size() / 2 * 2, kLooked);
  const auto holds = [&](std::size_t zero) {
    for (std::size_t i = 0; i < count; i += 2) {
      const auto character = static_cast<unsigned char>(bytes[i + 1 - zero]);
      if (bytes[i + zero] != '\0' || (std::isprint(character) == 0 && std::isspace(character) == 0)) {
        return false;
      }
    }
    return true;
  };
  return count >= 4 && (holds(0) || holds(1));
}

bool is_html(std::string_view bytes) {
  constexpr std::size_t kLongest = 14;
  bytes.remove_prefix(bytes.starts_with("\xEF\xBB\xBF"sv) ? 3 : 0);
  bytes.remove_prefix(std::min(bytes.find_first_not_of(" \t\r\n"), bytes.size()));
  std::string start(bytes.substr(0, kLongest));
  std::transform(start.begin(), start.end(), start.begin(), [](unsigned char c) { return std::tolower(c); });
  return start.starts_with("<!doctype html") || start.starts_with("<html") || start.starts_with("<head");
}

}  // namespace

std::optional<std::string> foreign_kind(std::string_view bytes) {
  const auto* found = std::find_if(kBeginnings.begin(), kBeginnings.end(),
                                   [&](const Beginning& known) { return bytes.starts_with(known.bytes); });
  if (found != kBeginnings.end()) {
    return found->kind;
  }
  if (is_html(bytes)) {
    return "an HTML page, not the file itself: download the file again, in its raw form";
  }
  return is_unmarked_utf16(bytes) ? std::optional<std::string>("UTF-16 text: save it as UTF-8") : std::nullopt;
}

std::string and_what_it_is(std::string_view bytes) {
  const auto kind = foreign_kind(bytes);
  return kind ? ": it is " + *kind : "";
}

void refuse_foreign(std::string_view bytes, const std::string& path) {
  if (const auto kind = foreign_kind(bytes)) {
    throw InputError(fmt::format("{}: this is {}", path, *kind));
  }
}

}  // namespace touchfield
