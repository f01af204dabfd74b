#include "sim/core/place_text.h"

#include <fmt/format.h>

#include "sim/core/units.h"

namespace touchfield {

std::string place_text(const Vector3& point, int decimals) {
  const Vector3 mm = point / kMillimetre;
  return fmt::format("({:.{}f}, {:.{}f}, {:.{}f}) mm", mm.x(), decimals, mm.y(), decimals, mm.z(), decimals);
}

}  // namespace touchfield
