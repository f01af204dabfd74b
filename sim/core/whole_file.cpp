#include "sim/core/whole_file.h"

#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <memory>
#include <system_error>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

[[noreturn]] void refuse_length(const std::string& path, std::uintmax_t most) {
  throw InputError(fmt::format("{}: too long, must be at most {} bytes", path, most));
}

}  // namespace

std::string read_whole_file(const std::string& path, std::size_t most) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (status.type() == std::filesystem::file_type::not_found) {
    throw InputError(path + ": no such file");
  }
  if (std::filesystem::is_directory(status)) {
    throw InputError(path + ": a directory, must be a file");
  }
  if (std::filesystem::is_regular_file(status) && std::filesystem::file_size(path, error) > most && !error) {
    refuse_length(path, most);
  }

  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> stream(std::fopen(path.c_str(), "rb"), &std::fclose);
  if (!stream) {
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  }
  std::string text;
  constexpr std::size_t kBlock = 1U << 16U;
  for (std::size_t got = kBlock; got == kBlock;) {
    const std::size_t size = text.size();
    if (size > most) {
      refuse_length(path, most);
    }
    text.resize(size + kBlock);
    got = std::fread(text.data() + size, 1, kBlock, stream.get());
    text.resize(size + got);
  }
  if (std::ferror(stream.get()) != 0) {
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  }
  return text;
}

}  // namespace touchfield
