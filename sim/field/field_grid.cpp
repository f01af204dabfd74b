#include "sim/field/field_grid.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/core/errors.h"

namespace touchfield {

Points FieldGrid::points() const {
  Points all(3, size());
  Eigen::Index j = 0;
  for (int z = 0; z < count[2]; ++z) {
    for (int y = 0; y < count[1]; ++y) {
      for (int x = 0; x < count[0]; ++x) {
        all.col(j++) = origin + spacing.cwiseProduct(Vector3(x, y, z));
      }
    }
  }
  return all;
}

FieldGrid centred_grid(const std::string& name, const Vector3& centre, const Vector3& size, double spacing) {
  if (!(spacing > 0) || !std::isfinite(spacing)) {
    throw InputError(fmt::format("field {}: spacing = {} m must be > 0", name, spacing));
  }
  FieldGrid grid{name, centre, Vector3::Constant(spacing), {1, 1, 1}};
  for (int axis = 0; axis < 3; ++axis) {
    if (!(size(axis) >= 0) || !std::isfinite(size(axis))) {
      throw InputError(fmt::format("field {}: size = {} m must be >= 0", name, size(axis)));
    }
    // A size that is a multiple of the spacing but for rounding must not gain an interval.
    const int intervals = static_cast<int>(std::ceil(size(axis) / spacing * (1.0 - 1e-12)));
    if (intervals > 0) {
      grid.count[static_cast<std::size_t>(axis)] = intervals + 1;
      grid.spacing(axis) = size(axis) / intervals;
      grid.origin(axis) = centre(axis) - 0.5 * size(axis);
    }
  }
  return grid;
}

}  // namespace touchfield
