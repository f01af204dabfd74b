#include "sim/core/own_binary.h"

#include <dlfcn.h>
#include <link.h>

namespace touchfield {

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
