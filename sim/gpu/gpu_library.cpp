#include "sim/gpu/gpu_library.h"

#include <array>
#include <charconv>
#include <cstdlib>
#include <dlfcn.h>
#include <filesystem>
#include <map>
#include <mutex>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/text.h"
#include "sim/core/version.h"

namespace touchfield {

namespace {

constexpr std::string_view kCard = "cuda:";

using CountCards = int (*)(char* why);
using OpenCard = Gpu* (*)(int index, const GpuLimits& limits);

struct Loaded {
  GpuLibrary said;
  OpenCard open = nullptr;
};

std::filesystem::path library_path() {
  if (const char* given = std::getenv("TOUCHFIELD_GPU_LIBRARY")) {
    return given;
  }
  std::error_code error;
  const auto own = own_binary();
  const auto beside = std::filesystem::path(own).replace_filename("libtouchfield_gpu.so");
  if (std::filesystem::exists(beside, error)) {
    return beside;
  }
  for (const char* folder : {"lib", "lib/touchfield", "lib/x86_64-linux-gnu/touchfield", "lib64/touchfield"}) {
    const auto path = own.parent_path().parent_path() / folder / "libtouchfield_gpu.so";
    if (std::filesystem::exists(path, error)) {
      return path;
    }
  }
  return {};
}

Loaded load() {
  const std::filesystem::path path = library_path();
  if (path.empty()) {
    return {{0, "this touchfield was built without CUDA"}};
  }
  // Never unloaded: CUDA's libraries do not all bear it.
  void* library = dlopen(path.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) {
    return {{0, fmt::format("CUDA's libraries are missing: {}", dlerror())}};
  }
  const auto count = reinterpret_cast<CountCards>(dlsym(library, "touchfield_gpu_count"));
  const auto open = reinterpret_cast<OpenCard>(dlsym(library, "touchfield_gpu_open"));
  if (count == nullptr || open == nullptr) {
    return {{0, fmt::format("{} is not of this touchfield", path.string())}};
  }
  std::array<char, 256> why{};
  Loaded loaded;
  loaded.open = open;
  loaded.said.cards = count(why.data());
  if (loaded.said.cards == 0) {
    loaded.said.why_none = fmt::format("no graphics card: {}", why[0] != '\0' ? why.data() : "none found");
  }
  return loaded;
}

/// The number above 0 that an environment variable holds.
double number_in(const char* name, double otherwise) {
  const char* given = std::getenv(name);
  if (given == nullptr) {
    return otherwise;
  }
  const auto number = number_of<double>(given);
  if (!number || !(*number > 0) || *number > 1e9) {
    throw InputError(fmt::format("{}: {}: must be a number above 0, at most 1e9", name, given));
  }
  return *number;
}

GpuLimits limits_given() {
  GpuLimits limits;
  limits.memory = static_cast<std::size_t>(number_in("TOUCHFIELD_GPU_MEMORY_MB", 0.0) * 1048576.0);
  limits.fail_after = static_cast<int>(number_in("TOUCHFIELD_GPU_FAIL_AFTER", -1.0));
  return limits;
}

const Loaded& loaded() {
  static const Loaded once = load();
  return once;
}

}  // namespace

std::optional<ComputeDevice> compute_device(const std::string& text) {
  if (text == "auto" || text == "cpu" || text == "cuda") {
    const auto kind = text == "auto"  ? ComputeDevice::Kind::kAuto
                      : text == "cpu" ? ComputeDevice::Kind::kCpu
                                      : ComputeDevice::Kind::kCuda;
    return ComputeDevice{kind, 0};
  }
  if (!text.starts_with(kCard)) {
    return std::nullopt;
  }
  int card = 0;
  const char* const end = text.data() + text.size();
  const auto [rest, error] = std::from_chars(text.data() + kCard.size(), end, card);
  if (error != std::errc() || rest != end || card < 0) {
    return std::nullopt;
  }
  return ComputeDevice{ComputeDevice::Kind::kCuda, card};
}

std::string to_string(const ComputeDevice& choice) {
  switch (choice.kind) {
    case ComputeDevice::Kind::kAuto:
      return "auto";
    case ComputeDevice::Kind::kCpu:
      return "cpu";
    case ComputeDevice::Kind::kCuda:
      break;
  }
  return choice.card == 0 ? "cuda" : "cuda:" + std::to_string(choice.card);
}

const GpuLibrary& gpu_library() { return loaded().said; }

std::vector<std::string> separate_cards() {
  const int cards = gpu_library().cards;
  std::vector<std::string> names;
  if (cards < 2) {
    return names;
  }
  if (const char* visible = std::getenv("CUDA_VISIBLE_DEVICES")) {
    std::istringstream list(visible);
    for (std::string name; std::getline(list, name, ',') && std::ssize(names) < cards;) {
      names.push_back(name);
    }
    return names;
  }
  for (int card = 0; card < cards; ++card) {
    names.push_back(std::to_string(card));
  }
  return names;
}

void require_card(const ComputeDevice& choice) {
  const GpuLibrary& library = gpu_library();
  if (library.cards == 0) {
    throw NotBuiltError(fmt::format("device {}: {}", to_string(choice), library.why_none));
  }
  if (choice.card < 0 || choice.card >= library.cards) {
    throw NotBuiltError(fmt::format("device {}: there {} {} graphics card{}, counted from 0", to_string(choice),
                                    library.cards == 1 ? "is" : "are", library.cards, library.cards == 1 ? "" : "s"));
  }
  limits_given();
}

std::shared_ptr<Gpu> shared_gpu(int index) {
  static std::mutex mutex;
  static std::map<int, std::shared_ptr<Gpu>> cards;
  const std::lock_guard lock(mutex);
  std::shared_ptr<Gpu>& card = cards[index];
  if (!card) {
    card = open_gpu(index);
  }
  return card;
}

std::shared_ptr<Gpu> open_gpu(int index, GpuLimits limits) {
  require_card({ComputeDevice::Kind::kCuda, index});
  const GpuLimits given = limits_given();
  limits.memory = limits.memory != 0 ? limits.memory : given.memory;
  limits.fail_after = limits.fail_after >= 0 ? limits.fail_after : given.fail_after;
  try {
    return std::shared_ptr<Gpu>(loaded().open(index, limits));
  } catch (const GpuFailure& failure) {
    throw DeviceError(failure.what());
  }
}

}  // namespace touchfield
