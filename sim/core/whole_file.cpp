#include "sim/core/whole_file.h"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/utf8.h"

namespace touchfield {

std::string read_whole_file(const std::string& path, std::size_t most) {
  const auto refuse = [&](const std::string& what) { throw InputError(fmt::format("{}: {}", path, what)); };
  std::error_code error;
  if (std::filesystem::is_directory(path, error)) {
    refuse("a directory, must be a file");
  }
  errno = 0;
  std::ifstream file(path, std::ios::binary);
  constexpr std::size_t kBlock = 1U << 20U;
  std::string bytes;
  while (file) {
    const std::size_t size = bytes.size();
    bytes.resize(size + std::min(kBlock, most + 1 - size));
    file.read(bytes.data() + size, static_cast<std::streamsize>(bytes.size() - size));
    bytes.resize(size + static_cast<std::size_t>(file.gcount()));
    if (bytes.size() > most) {
      refuse(fmt::format("too long, must be at most {} bytes", most));
    }
  }
  if (!file.eof()) {
    refuse(errno == ENOENT ? "no such file" : fmt::format("cannot be read: {}", std::strerror(errno)));
  }
  return bytes;
}

std::string read_text_file(const std::string& path, std::size_t most) {
  std::string text = read_whole_file(path, most);
  require_text(text, path);
  text.erase(0, text.starts_with("\xEF\xBB\xBF") ? 3 : 0);
  return text;
}

}  // namespace touchfield
