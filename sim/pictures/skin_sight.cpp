#include "sim/pictures/skin_sight.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace touchfield {

Eigen::Vector2d SkinView::pixel(const Vector3& point) const {
  const Vector3 offset = (point - centre) / scale;
  return {panel.x + 0.5 * panel.width + offset.dot(right()), panel.y + 0.5 * panel.height + offset.dot(up)};
}

Vector3 facing(const TransducerArray& array, const Vector3& centre) {
  constexpr double kCancelled = 1e-3;  // of the mean of unit vectors: no direction is left in it
  const Vector3 axis = array.axes.rowwise().mean();
  if (axis.norm() > kCancelled) {
    return axis.normalized();
  }
  const Vector3 across = centre - array.positions.rowwise().mean();
  return across.norm() > 0 ? across.normalized() : Vector3::UnitZ();
}

SkinView fitted_view(const PixelBox& panel, const Vector3& direction, const Points& points, double share) {
  constexpr double kParallel = 0.99;
  return fitted_view(panel, direction, std::abs(direction.y()) < kParallel ? Vector3::UnitY() : Vector3::UnitX(),
                     points, share);
}

SkinView fitted_view(const PixelBox& panel, const Vector3& direction, const Vector3& vertical, const Points& points,
                     double share) {
  SkinView view{.panel = panel,
                .direction = direction,
                .up = (vertical - vertical.dot(direction) * direction).normalized(),
                .centre = Vector3::Zero(),
                .scale = 1.0};
  Eigen::Matrix3d frame;
  frame << view.right(), view.up, view.direction;
  const Points seen = frame.transpose() * points;
  const Vector3 low = seen.rowwise().minCoeff();
  const Vector3 high = seen.rowwise().maxCoeff();
  const Vector3 size = high - low;
  view.centre = frame * (0.5 * (low + high));
  view.scale = std::max(size.x() / panel.width, size.y() / panel.height) / share;
  return view;
}

namespace {

constexpr int kSamples = 4;       // a pixel, along each side
constexpr double kAmbient = 0.7;  // the share of a face's colour that shading leaves alone
constexpr double kCrease = 0.8;   // cosine of the angle between a face and its vertices from which on it is flat

Camera camera_of(const SkinView& view) {
  Camera camera;
  camera.projection = Camera::Projection::kOrthographic;
  camera.width = kSamples * view.panel.width;
  camera.height = kSamples * view.panel.height;
  camera.eye = view.centre;
  camera.axes << view.right(), -view.up, view.direction;
  camera.focal.setConstant(kSamples / view.scale);
  camera.centre << 0.5 * camera.width, 0.5 * camera.height;
  camera.near = -HUGE_VAL;
  return camera;
}

/// True if none of the samples round a place sees only what is nearer than it.
bool seen_at(const Raster& raster, const SeenPoint& place) {
  const int column = static_cast<int>(std::floor(place[0]));
  const int row = static_cast<int>(std::floor(place[1]));
  if (column < 1 || row < 1 || column + 1 >= raster.width || row + 1 >= raster.height) {
    return false;
  }
  double farthest = -HUGE_VAL;
  for (int j = row - 1; j <= row + 1; ++j) {
    for (int i = column - 1; i <= column + 1; ++i) {
      farthest = std::max(farthest, raster.depth[raster.index(i, j)]);
    }
  }
  constexpr double kSlack = 1e-6;  // [m], for edges along faces seen head-on
  return place[3] <= farthest + kSlack;
}

/// Means of the normals of the faces round each vertex, weighted by area; not of unit length.
Points vertex_normals(const TriangleMesh& mesh) {
  Points normals = Points::Zero(3, mesh.vertex_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      normals.col(mesh.triangles()(c, f)) += mesh.areas()(f) * mesh.normals().col(f);
    }
  }
  return normals;
}

/// The light on a face at a place of the image.
class FaceLight {
 public:
  FaceLight(const Camera& camera, const Vector3& direction, const TriangleMesh& mesh)
      : direction_(direction),
        mesh_(mesh),
        seen_(seen_points(camera, mesh.vertices())),
        normals_(vertex_normals(mesh).colwise().normalized()) {}

  double operator()(Eigen::Index face, double column, double row) const {
    const auto corners = mesh_.triangles().col(face);
    const Vector3 flat = mesh_.normals().col(face);
    Eigen::Matrix2d sides;
    sides << seen_.col(corners[1]).head<2>() - seen_.col(corners[0]).head<2>(),
        seen_.col(corners[2]).head<2>() - seen_.col(corners[0]).head<2>();
    const Eigen::Vector2d from = Eigen::Vector2d(column, row) - seen_.col(corners[0]).head<2>();
    const Eigen::Vector2d along = sides.inverse() * from;
    const Vector3 smooth = ((1.0 - along.sum()) * normals_.col(corners[0]) + along[0] * normals_.col(corners[1]) +
                            along[1] * normals_.col(corners[2]))
                               .normalized();
    const Vector3& normal = smooth.dot(flat) > kCrease ? smooth : flat;
    return kAmbient + (1.0 - kAmbient) * std::abs(direction_.dot(normal));
  }

 private:
  Vector3 direction_;
  const TriangleMesh& mesh_;
  SeenPoints seen_;
  Points normals_;
};

}  // namespace

SkinSight::SkinSight(const SkinView& view, const TriangleMesh& mesh)
    : view_(view),
      camera_(camera_of(view)),
      raster_(rasterise(camera_, mesh.vertices(), mesh.triangles())),
      shade_(raster_.face.size()) {
  const FaceLight light(camera_, view.direction, mesh);
#pragma omp parallel for schedule(static)
  for (int row = 0; row < raster_.height; ++row) {
    for (int column = 0; column < raster_.width; ++column) {
      const std::size_t at = raster_.index(column, row);
      if (raster_.face[at] != Raster::kNothing) {
        shade_[at] = static_cast<std::uint8_t>(std::lround(255.0 * light(raster_.face[at], column + 0.5, row + 0.5)));
      }
    }
  }
}

/// colour_of   (column, row) of a sample that sees a face
template <class ColourOf>
ColourImage SkinSight::made_image(const ColourOf& colour_of, int finer) const {
  const int samples = kSamples / finer;
  const int count = samples * samples;
  ColourImage image(finer * view_.panel.width, finer * view_.panel.height);
#pragma omp parallel for schedule(static)
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const int whole = 255 * count;
      std::array<int, 3> sum = {whole / 2, whole / 2, whole / 2};  // to the nearest
      for (int j = samples * row; j < samples * (row + 1); ++j) {
        for (int i = samples * column; i < samples * (column + 1); ++i) {
          const std::size_t at = raster_.index(i, j);
          const int face = raster_.face[at];
          const Colour colour = face == Raster::kNothing ? kPaper : colour_of(i, j);
          const int light = face == Raster::kNothing ? 255 : shade_[at];
          for (std::size_t c = 0; c < 3; ++c) {
            sum[c] += light * colour[c];
          }
        }
      }
      Colour& pixel = image.at(column, row);
      for (std::size_t c = 0; c < 3; ++c) {
        pixel[c] = static_cast<std::uint8_t>(sum[c] / whole);
      }
    }
  }
  return image;
}

ColourImage SkinSight::image(const std::vector<Colour>& colours, int finer) const {
  return made_image(
      [&](int column, int row) { return colours[static_cast<std::size_t>(raster_.face[raster_.index(column, row)])]; },
      finer);
}

ColourImage SkinSight::image(const ColourAt& colour_at, int finer) const {
  return made_image(
      [&](int column, int row) {
        const std::size_t at = raster_.index(column, row);
        const Eigen::Vector2d from =
            (Eigen::Vector2d(column + 0.5, row + 0.5) - camera_.centre).cwiseQuotient(camera_.focal);
        return colour_at(raster_.face[at], camera_.eye + camera_.axes * Vector3(from.x(), from.y(), raster_.depth[at]));
      },
      finer);
}

std::vector<Eigen::Vector2d> SkinSight::visible(const Points& points, const Eigen::Matrix2Xi& edges) const {
  constexpr double kPiece = 0.5 * kSamples;  // [samples]
  std::vector<Eigen::Vector2d> ends;
  const SeenPoints seen = seen_points(camera_, points);
  for (Eigen::Index e = 0; e < edges.cols(); ++e) {
    const SeenPoint from = seen.col(edges(0, e));
    const SeenPoint along = seen.col(edges(1, e)) - from;
    const int pieces = std::max(1, static_cast<int>(std::ceil(along.head<2>().norm() / kPiece)));
    const auto pixel = [&](int piece) {
      return view_.pixel(points.col(edges(0, e)) +
                         (static_cast<double>(piece) / pieces) * (points.col(edges(1, e)) - points.col(edges(0, e))));
    };
    int begin = -1;
    for (int piece = 0; piece <= pieces; ++piece) {
      const bool open = piece < pieces && seen_at(raster_, from + (piece + 0.5) / pieces * along);
      if (open && begin < 0) {
        begin = piece;
      } else if (!open && begin >= 0) {
        ends.insert(ends.end(), {pixel(begin), pixel(piece)});
        begin = -1;
      }
    }
  }
  return ends;
}

}  // namespace touchfield
