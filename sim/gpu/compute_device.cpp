#include "sim/gpu/compute_device.h"

#include <charconv>
#include <string_view>

namespace touchfield {

namespace {
constexpr std::string_view kCard = "cuda:";
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

}  // namespace touchfield
