#include "sim/mesh/raster/clip.h"

namespace touchfield {

namespace {

/// Keeps what has plane . corner >= offset (Sutherland and Hodgman, Commun. ACM 17 (1974) 32).
ClippedFace clipped_by(const ClippedFace& face, const SeenPoint& plane, double offset) {
  ClippedFace kept;
  for (std::size_t i = 0; i < face.count; ++i) {
    const SeenPoint& from = face.corners[i];
    const SeenPoint& to = face.corners[(i + 1) % face.count];
    const double from_side = plane.dot(from) - offset;
    const double to_side = plane.dot(to) - offset;
    if (from_side >= 0.0) {
      kept.corners[kept.count++] = from;
    }
    if ((from_side >= 0.0) != (to_side >= 0.0)) {
      // Always from the kept end, so that the way round the face does not matter.
      const bool forwards = from_side >= 0.0;
      const SeenPoint& in = forwards ? from : to;
      const SeenPoint& out = forwards ? to : from;
      const double in_side = forwards ? from_side : to_side;
      const double out_side = forwards ? to_side : from_side;
      kept.corners[kept.count++] = in + in_side / (in_side - out_side) * (out - in);
    }
  }
  return kept;
}

}  // namespace

ClippedFace clipped(const std::array<SeenPoint, 3>& corners, double near, double guard) {
  ClippedFace face;
  for (const SeenPoint& corner : corners) {
    face.corners[face.count++] = corner;
  }
  face = clipped_by(face, {0, 0, 0, 1}, near);  // the first, so that W > 0 from here on
  for (const double side : {-1.0, 1.0}) {
    face = clipped_by(face, {side, 0, guard, 0}, 0.0);
    face = clipped_by(face, {0, side, guard, 0}, 0.0);
  }
  return face;
}

}  // namespace touchfield
