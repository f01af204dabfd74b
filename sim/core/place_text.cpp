#include "sim/core/place_text.h"

#include <cmath>

#include <fmt/format.h>

#include "sim/core/units.h"

namespace touchfield {

std::string place_text(const Vector3& point, int decimals) {
  const double parts = std::pow(10.0, decimals);
  const Vector3 mm = (parts / kMillimetre * point).array().round() / parts + 0.0;  // no -0.0
  return fmt::format("({:.{}f}, {:.{}f}, {:.{}f}) mm", mm.x(), decimals, mm.y(), decimals, mm.z(), decimals);
}

}  // namespace touchfield
