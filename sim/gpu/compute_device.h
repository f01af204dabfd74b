#pragma once

#include <optional>
#include <string>

namespace touchfield {

struct ComputeDevice {
  enum class Kind {
    kAuto,  // the graphics card where there is one and it pays
    kCpu,
    kCuda,  // the graphics card, or an error
  };
  Kind kind = Kind::kAuto;
  int card = 0;  // counted from 0

  bool operator==(const ComputeDevice&) const = default;
};

/// auto, cpu, cuda (the first card) or cuda:N; nothing of any other text.
std::optional<ComputeDevice> compute_device(const std::string& text);
std::string to_string(const ComputeDevice& choice);

}  // namespace touchfield
