#include "sim/core/version.h"

#include <array>
#include <chrono>
#include <dlfcn.h>
#include <fstream>
#include <link.h>
#include <thread>
#include <unistd.h>

#include <fmt/chrono.h>
#include <fmt/format.h>

#include "sim/core/require.h"
#include "version_data.h"

namespace touchfield {

BuildInfo build_info() {
  return {TOUCHFIELD_VERSION, TOUCHFIELD_REVISION,   TOUCHFIELD_COMPILER,
          TOUCHFIELD_FLAGS,   TOUCHFIELD_BUILD_TYPE, TOUCHFIELD_YEAR};
}

void require_format(const std::string& path, int version, int own) {
  require(version == own, "{}: format version {} is not {}, the one that this program reads: {} reads it", path,
          version, own, version < own ? "touchfield 0.3.0" : "a newer touchfield");
}

std::string machine_description() {
  std::array<char, 256> name{};
  const std::string host = gethostname(name.data(), name.size() - 1) == 0 ? name.data() : "unknown host";
  std::string processor = "unknown processor";
  std::ifstream cpuinfo("/proc/cpuinfo");
  for (std::string line; std::getline(cpuinfo, line);) {
    const auto colon = line.find(": ");
    if (line.starts_with("model name") && colon != std::string::npos) {
      processor = line.substr(colon + 2);
      break;
    }
  }
  return fmt::format("{}, {}, {} logical cores", host, processor, std::thread::hardware_concurrency());
}

std::string utc_now() {
  const auto now = std::chrono::system_clock::to_time_t(std::chrono::system_clock::now());
  return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(now));
}

std::filesystem::path own_binary() {
  Dl_info about{};
  link_map* map = nullptr;
  if (dladdr1(reinterpret_cast<const void*>(&own_binary), &about, reinterpret_cast<void**>(&map), RTLD_DL_LINKMAP) !=
          0 &&
      *map->l_name != '\0') {
    return map->l_name;
  }
  // A program itself has no path there but what its caller calls it, which may be anything.
  std::error_code error;
  return std::filesystem::read_symlink("/proc/self/exe", error);
}

}  // namespace touchfield
