#pragma once

#include <algorithm>
#include <vector>

#include "sim/field/target.h"
#include "sim/run/run_archive.h"

/// A target in a group of run.h5 or motion.h5. Io is GroupWriter or GroupReader.
namespace touchfield {

inline void box_parts(const GroupWriter& io, const std::vector<TargetBox>& boxes) {
  const auto count = static_cast<Eigen::Index>(boxes.size());
  Points centres(3, count);
  Points sizes(3, count);
  Points axes(3, 3 * count);
  for (Eigen::Index b = 0; b < count; ++b) {
    const TargetBox& box = boxes[static_cast<std::size_t>(b)];
    centres.col(b) = box.centre;
    sizes.col(b) = box.size;
    axes.middleCols<3>(3 * b) = box.rotation;
  }
  io.columns("centre", centres, "m");
  io.columns("size", sizes, "m");
  io.columns("axis", axes, "1");
  const auto differs = [](const TargetBox& box) { return box.shape != TargetShape::kBox || box.level != 1.0; };
  if (std::ranges::any_of(boxes, differs)) {
    Eigen::VectorXd levels(count);
    std::vector<int> shapes;
    for (const TargetBox& box : boxes) {
      levels(static_cast<Eigen::Index>(shapes.size())) = box.level;
      shapes.push_back(static_cast<int>(box.shape));
    }
    io.list("level", levels, "1");
    io.list("shape", shapes, "1");
  }
}

inline void box_parts(const GroupReader& io, std::vector<TargetBox>& boxes) {
  Points centres;
  Points sizes;
  Points axes;
  io.columns("centre", centres, "m");
  io.columns("size", sizes, "m");
  io.columns("axis", axes, "1");
  if (sizes.cols() != centres.cols() || axes.cols() != 3 * centres.cols()) {
    io.fail("size must have as many rows as centre, axis three times as many");
  }
  if (!centres.allFinite() || !(sizes.array() > 0).all() || !sizes.allFinite() || !axes.allFinite()) {
    io.fail("centre, size and axis must be finite, size > 0");
  }
  Eigen::VectorXd levels;
  std::vector<int> shapes;
  io.optional_list("level", levels, "1");
  io.optional_list("shape", shapes, "1");
  const bool plain = levels.size() == 0 && shapes.empty();
  if (!plain && (levels.size() != centres.cols() || shapes.size() != static_cast<std::size_t>(centres.cols()))) {
    io.fail("level and shape must have as many values as centre has rows");
  }
  if (std::ranges::any_of(shapes,
                          [](int shape) { return shape < 0 || shape > static_cast<int>(TargetShape::kMask); })) {
    io.fail("shape must be 0 (box), 1 (cylinder) or 2 (mask)");
  }
  for (Eigen::Index b = 0; b < centres.cols(); ++b) {
    boxes.push_back({centres.col(b), sizes.col(b), axes.middleCols<3>(3 * b),
                     plain ? TargetShape::kBox : static_cast<TargetShape>(shapes[static_cast<std::size_t>(b)]),
                     plain ? 1.0 : levels(b)});
  }
}

template <class Io, class Target>
void target_parts(const Io& io, Target& target) {
  io.list("face", target.faces, "1");
  io.list("amplitude", target.amplitudes, "Pa");
  io.list("share", target.shares, "1");
  io.list("box", target.box, "1");
  io.part("boxes", !target.boxes.empty(), [&](const Io& part) { box_parts(part, target.boxes); });
}

}  // namespace touchfield
