#include "hardware/links/autd3_library.h"

#include <array>
#include <cmath>
#include <cstring>
#include <dlfcn.h>
#include <filesystem>
#include <utility>

#include <fmt/format.h>

namespace touchfield {

namespace {

constexpr const char* kMainFile = "libautd3capi.so";
constexpr const char* kRemoteFile = "libautd3capi_link_remote.so";
constexpr const char* kTwincatFile = "libautd3capi_link_twincat.so";
constexpr const char* kFirmware = "v12.";  // what version 38 is made for

std::string main_file(const std::string& path) {
  if (path.empty()) {
    throw InputError("autd3-legacy: no library is named: --library takes the path of the vendor's libautd3capi.so");
  }
  const std::filesystem::path given(path);
  std::error_code failed;
  if (!std::filesystem::exists(given, failed)) {
    throw InputError(fmt::format("autd3-legacy: library: {} does not exist", path));
  }
  std::filesystem::path file = given;
  if (std::filesystem::is_directory(given, failed)) {
    for (const char* below : {"", "bin", "pyautd3/bin"}) {
      file = given / below / kMainFile;
      if (std::filesystem::exists(file, failed)) {
        break;
      }
    }
    if (!std::filesystem::exists(file, failed)) {
      throw InputError(fmt::format("autd3-legacy: library: the folder {} holds no {}", path, kMainFile));
    }
  }
  if (!std::filesystem::is_regular_file(file, failed)) {  // the loader would wait for a pipe
    throw InputError(fmt::format("autd3-legacy: library: {} must be a file", file.string()));
  }
  // Without a slash the loader would look the name up in the system's folders.
  return std::filesystem::absolute(file).lexically_normal().string();
}

// The library tells no version of its own, and version 37 has the same names with other arguments. This call takes its
// arguments by value and only compares them, so it can be asked of any version: another one reads other members there.
bool has_known_arguments(const autd3::Calls& call) {
  return call.is_default({autd3_duration(1e-3), autd3_duration(1e-3), autd3_duration(-1)});
}

}  // namespace

autd3::Symbols::Symbols(std::string file)
    : file_(std::move(file)), handle_(dlopen(file_.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) {
  if (handle_ == nullptr) {
    const char* reason = dlerror();
    throw InputError(
        fmt::format("autd3-legacy: library: cannot load {}: {}", file_, reason != nullptr ? reason : "unknown"));
  }
}

autd3::Symbols::Symbol autd3::Symbols::operator()(const char* name) const {
  void* address = dlsym(handle_, name);
  if (address == nullptr) {
    throw InputError(fmt::format(
        "autd3-legacy: library: {} has no {}: it is not the AUTD3 vendor's C library, version 38, or a part of it",
        file_, name));
  }
  return {address};
}

Autd3Library::Autd3Library(const std::string& path)
    : file_(main_file(path)),
      folder_(std::filesystem::path(file_).parent_path().string()),
      call_{autd3::Symbols(file_)} {
  std::array<char, 257> text{};
  call_.latest_firmware(text.data());
  firmware_ = text.data();
  if (!firmware_.starts_with(kFirmware) || !has_known_arguments(call_)) {
    throw InputError(
        fmt::format("autd3-legacy: library: {} (for firmware {}) is not version 38 of the vendor's library, which "
                    "is for firmware {}x",
                    file_, firmware_, kFirmware));
  }
}

autd3::Link* Autd3Library::remote_link(const std::string& address, double patience) const {
  struct RemoteOption {
    autd3::OptionalDuration timeout;
  };
  const autd3::Symbols find(folder_ + "/" + kRemoteFile);
  autd3::Result<autd3::Link*> (*make)(const char*, RemoteOption) = find("AUTDLinkRemote");
  return value_of(make(address.c_str(), RemoteOption{autd3_duration(patience)}), "remote " + address);
}

autd3::Link* Autd3Library::twincat_link() const {
  const autd3::Symbols find(folder_ + "/" + kTwincatFile);
  autd3::Result<autd3::Link*> (*make)() = find("AUTDLinkTwinCAT");
  return value_of(make(), "twincat");
}

std::string Autd3Library::error_of(const void* error, std::uint32_t length) const {
  std::string text(static_cast<std::size_t>(length) + 1, '\0');
  call_.take_error(error, text.data());
  text.resize(std::strlen(text.c_str()));
  return text;
}

autd3::OptionalDuration autd3_duration(double seconds) {
  if (seconds < 0) {
    return {false, 0};
  }
  return {true, static_cast<std::uint64_t>(std::llround(1e9 * seconds))};
}

}  // namespace touchfield
