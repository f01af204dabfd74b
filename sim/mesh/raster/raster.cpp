#include "sim/mesh/raster/raster.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <string>

#include <Eigen/LU>
#include <fmt/format.h>
#include <omp.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

constexpr std::int64_t kStep = 1 << 14;  // grid lines a pixel
constexpr double kGuard = 1 << 15;       // no corner is farther from the image's origin [pixels]; a product of two
                                         // distances on the grid then has 62 bits
constexpr int kBandRows = 16;            // drawn by one thread

using Corners = std::array<SeenPoint, 3>;

/// A place of the image on the grid.
struct GridPoint {
  std::int64_t x;
  std::int64_t y;
};

/// A part of a face on the image, its corners clockwise as one sees them.
struct Piece {
  std::array<GridPoint, 3> corners;
  int face;
  int first_row;
  int end_row;
};

/// A convex polygon in the plane of a face; every plane that cuts it adds at most one corner.
struct ClippedFace {
  static constexpr std::size_t kMostCorners = 8;

  std::array<SeenPoint, kMostCorners> corners;
  std::size_t count = 0;
};

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

/// The part of a face that is no nearer than `near` [m] and seen at |u| <= guard, |v| <= guard. Where two faces share
/// an edge, both are cut at the same point of it, to the bit.
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

GridPoint on_grid(const SeenPoint& corner) {
  const auto snapped = [&](double value) { return std::llround(value / corner[2] * static_cast<double>(kStep)); };
  return {snapped(corner[0]), snapped(corner[1])};
}

/// The first pixel whose middle is at or after a place.
std::int64_t pixel_from(std::int64_t at) { return (at + kStep / 2 - 1) >> 14; }

Corners corners_of(const SeenPoints& seen, const Triangles& triangles, Eigen::Index face) {
  return {seen.col(triangles(0, face)), seen.col(triangles(1, face)), seen.col(triangles(2, face))};
}

void add_piece(std::array<GridPoint, 3> corners, int face, int rows, std::vector<Piece>& pieces) {
  const auto& [a, b, c] = corners;
  const std::int64_t twice_area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
  if (twice_area == 0) {
    return;
  }
  const auto [low, high] = std::minmax({a.y, b.y, c.y});
  const auto first = std::clamp<std::int64_t>(pixel_from(low), 0, rows);
  const auto end = std::clamp<std::int64_t>(pixel_from(high + 1), 0, rows);
  if (first == end) {
    return;
  }
  if (twice_area < 0) {
    std::swap(corners[1], corners[2]);
  }
  pieces.push_back({corners, face, static_cast<int>(first), static_cast<int>(end)});
}

/// The face on the grid, cut where it comes nearer than the camera sees or goes far beyond the image.
void add_face(const Camera& camera, const Corners& corners, int face, std::vector<Piece>& pieces) {
  int near = 0;
  int far = 0;
  for (const SeenPoint& corner : corners) {
    near += corner[3] < camera.near ? 1 : 0;
    far += std::max(std::abs(corner[0]), std::abs(corner[1])) > kGuard * corner[2] ? 1 : 0;
  }
  if (near == 3) {
    return;
  }
  if (near + far == 0) {
    add_piece({on_grid(corners[0]), on_grid(corners[1]), on_grid(corners[2])}, face, camera.height, pieces);
    return;
  }
  const ClippedFace part = clipped(corners, camera.near, kGuard);
  for (std::size_t i = 2; i < part.count; ++i) {
    add_piece({on_grid(part.corners[0]), on_grid(part.corners[i - 1]), on_grid(part.corners[i])}, face, camera.height,
              pieces);
  }
}

/// All pieces in the order of the faces.
std::vector<Piece> pieces_of(const Camera& camera, const SeenPoints& seen, const Triangles& triangles) {
  std::vector<std::vector<Piece>> shares(static_cast<std::size_t>(omp_get_max_threads()));
#pragma omp parallel
  {
    std::vector<Piece>& mine = shares[static_cast<std::size_t>(omp_get_thread_num())];
#pragma omp for schedule(static)  // one run of faces a thread, in the threads' order
    for (Eigen::Index face = 0; face < triangles.cols(); ++face) {
      add_face(camera, corners_of(seen, triangles, face), static_cast<int>(face), mine);
    }
  }
  std::vector<Piece> pieces;
  for (const std::vector<Piece>& share : shares) {
    pieces.insert(pieces.end(), share.begin(), share.end());
  }
  return pieces;
}

/// The numbers of the pieces that a band of rows meets, band after band, each in the order of the faces.
struct Bands {
  std::vector<std::size_t> first;  // of each band, and the end
  std::vector<std::size_t> pieces;
};

Bands bands_of(const std::vector<Piece>& pieces, int rows) {
  const auto count = static_cast<std::size_t>((rows + kBandRows - 1) / kBandRows);
  Bands bands{std::vector<std::size_t>(count + 1, 0), {}};
  const auto for_each = [&](const auto& visit) {
    for (std::size_t p = 0; p < pieces.size(); ++p) {
      for (int band = pieces[p].first_row / kBandRows; band * kBandRows < pieces[p].end_row; ++band) {
        visit(static_cast<std::size_t>(band), p);
      }
    }
  };
  for_each([&](std::size_t band, std::size_t /*p*/) { ++bands.first[band + 1]; });
  for (std::size_t band = 0; band < count; ++band) {
    bands.first[band + 1] += bands.first[band];
  }
  bands.pieces.resize(bands.first.back());
  std::vector<std::size_t> next = bands.first;
  for_each([&](std::size_t band, std::size_t p) { bands.pieces[next[band]++] = p; });
  return bands;
}

std::int64_t floor_divided(std::int64_t value, std::int64_t by) {
  const std::int64_t quotient = value / by;
  return value % by < 0 ? quotient - 1 : quotient;
}

/// Columns first .. end - 1 of a row whose middles are on the inner side of the line from a to b.
void keep_inner_side(const GridPoint& a, const GridPoint& b, int row, std::int64_t& first, std::int64_t& end) {
  const std::int64_t dx = b.x - a.x;
  const std::int64_t dy = b.y - a.y;
  const bool owned = dy < 0 || (dy == 0 && dx > 0);  // a left or an upper edge
  const std::int64_t y = row * kStep + kStep / 2;
  // At least 0 inside; of column i it is i dy kStep less.
  const std::int64_t side = dx * (y - a.y) - dy * (kStep / 2 - a.x) - (owned ? 0 : 1);
  if (dy > 0) {
    end = std::min(end, floor_divided(side, dy * kStep) + 1);
  } else if (dy < 0) {
    first = std::max(first, -floor_divided(side, -dy * kStep));
  } else if (side < 0) {
    end = first;
  }
}

/// The weights of a face's corners where the ray through (u, v) meets it. Coverage is decided on the grid, so that the
/// ray may pass by the face by half a grid line: the weights are then those of its rim.
Vector3 weights_at(double u, double v, const Corners& corners) {
  std::array<Eigen::Vector2d, 3> offset;
  for (std::size_t c = 0; c < 3; ++c) {
    offset[c] = corners[c].head<2>() - corners[c][2] * Eigen::Vector2d(u, v);
  }
  const auto cross = [](const Eigen::Vector2d& a, const Eigen::Vector2d& b) { return a.x() * b.y() - a.y() * b.x(); };
  Vector3 weights(cross(offset[1], offset[2]), cross(offset[2], offset[0]), cross(offset[0], offset[1]));
  weights = (weights.sum() < 0.0 ? Vector3(-weights) : weights).cwiseMax(0.0);
  const double sum = weights.sum();
  return sum > 0.0 ? Vector3(weights / sum) : Vector3::Constant(1.0 / 3.0);
}

void draw_piece(const Piece& piece, const Corners& corners, int first_row, int end_row, Raster& raster) {
  const auto& [a, b, c] = piece.corners;
  const auto [low, high] = std::minmax({a.x, b.x, c.x});
  const auto left = std::clamp<std::int64_t>(pixel_from(low), 0, raster.width);
  const auto right = std::clamp<std::int64_t>(pixel_from(high + 1), 0, raster.width);
  for (int row = std::max(first_row, piece.first_row); row < std::min(end_row, piece.end_row); ++row) {
    std::int64_t first = left;
    std::int64_t end = right;
    keep_inner_side(a, b, row, first, end);
    keep_inner_side(b, c, row, first, end);
    keep_inner_side(c, a, row, first, end);
    for (std::int64_t column = first; column < end; ++column) {
      const std::size_t pixel = raster.index(static_cast<int>(column), row);
      const double depth = weights_at(static_cast<double>(column) + 0.5, row + 0.5, corners)
                               .dot(Vector3(corners[0][3], corners[1][3], corners[2][3]));
      if (depth < raster.depth[pixel]) {
        raster.depth[pixel] = depth;
        raster.face[pixel] = piece.face;
      }
    }
  }
}

}  // namespace

void require_camera(const Camera& camera) {
  constexpr int kMostPixels = 16384;
  constexpr double kRotation = 1e-9;  // how far the axes may be from a rotation
  const auto require = [](bool holds, const char* member, const std::string& value, const char* rule) {
    touchfield::require(holds, "camera: {} = {}: must be {}", member, value, rule);
  };
  const auto pixels = [&](int value, const char* member) {
    require(value >= 1 && value <= kMostPixels, member, std::to_string(value), "1 to 16384 pixels");
  };
  pixels(camera.width, "width");
  pixels(camera.height, "height");
  require(camera.eye.allFinite(), "eye", "nan or inf", "finite");
  require(camera.centre.allFinite(), "centre", "nan or inf", "finite");
  require((camera.axes.transpose() * camera.axes).isIdentity(kRotation) && camera.axes.determinant() > 0.0, "axes",
          "no rotation", "right, down, forward: unit, perpendicular, right-handed");
  for (const double focal : camera.focal) {
    require(focal > 0.0 && std::isfinite(focal), "focal", std::to_string(focal), "> 0");
  }
  const bool pinhole = camera.projection == Camera::Projection::kPinhole;
  require(pinhole ? camera.near > 0.0 && std::isfinite(camera.near) : camera.near < HUGE_VAL, "near",
          std::to_string(camera.near), pinhole ? "> 0 m" : "a number or -inf");
}

SeenPoints seen_points(const Camera& camera, const Points& points) {
  const Points local = camera.axes.transpose() * (points.colwise() - camera.eye);
  SeenPoints seen(4, points.cols());
  if (camera.projection == Camera::Projection::kPinhole) {
    seen.row(2) = local.row(2);
  } else {
    seen.row(2).setOnes();
  }
  for (int axis = 0; axis < 2; ++axis) {
    seen.row(axis) = camera.focal[axis] * local.row(axis) + camera.centre[axis] * seen.row(2);
  }
  seen.row(3) = local.row(2);
  return seen;
}

Raster rasterise(const Camera& camera, const Points& vertices, const Triangles& triangles) {
  require_camera(camera);
  require(vertices.allFinite(), "faces to draw: a vertex is not finite");
  if (triangles.size() > 0 && (triangles.minCoeff() < 0 || triangles.maxCoeff() >= vertices.cols())) {
    throw InputError(fmt::format("faces to draw: a face names vertex {}, but they are 0 to {}",
                                 triangles.minCoeff() < 0 ? triangles.minCoeff() : triangles.maxCoeff(),
                                 vertices.cols() - 1));
  }
  const SeenPoints seen = seen_points(camera, vertices);
  const std::vector<Piece> pieces = pieces_of(camera, seen, triangles);
  const Bands bands = bands_of(pieces, camera.height);
  Raster raster{camera.width, camera.height, {}, {}};
  const std::size_t pixels = raster.index(0, camera.height);
  raster.depth.assign(pixels, std::numeric_limits<double>::infinity());
  raster.face.assign(pixels, Raster::kNothing);
#pragma omp parallel for schedule(dynamic)
  for (std::size_t band = 0; band < bands.first.size() - 1; ++band) {
    const int first_row = static_cast<int>(band) * kBandRows;
    for (std::size_t p = bands.first[band]; p < bands.first[band + 1]; ++p) {
      const Piece& piece = pieces[bands.pieces[p]];
      draw_piece(piece, corners_of(seen, triangles, piece.face), first_row, first_row + kBandRows, raster);
    }
  }
  return raster;
}

}  // namespace touchfield
