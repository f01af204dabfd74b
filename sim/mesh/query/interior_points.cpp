#include "sim/mesh/query/interior_points.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/random.h"
#include "sim/core/require.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

/// The draw of this number and purpose: uniform in 0 <= u < 1, the same on every machine.
double uniform(std::uint64_t number, std::uint64_t purpose) {
  return unit_number(mixed_bits(mixed_bits(number) + purpose));
}

using Cell = Eigen::Array<Index, 3, 1>;

/// Cells from `first` up to `last`, the last excluded along each axis.
struct CellBox {
  Cell first;
  Cell last;
};

template <class Visit>
void for_each_cell(const CellBox& box, const Visit& visit) {
  for (Index k = box.first(2); k < box.last(2); ++k) {
    for (Index j = box.first(1); j < box.last(1); ++j) {
      for (Index i = box.first(0); i < box.last(0); ++i) {
        visit(Cell(i, j, k));
      }
    }
  }
}

/// Cubes of half a spacing that cover a box, with one dart at a random place in each.
class Darts {
 public:
  /// throws   InputError if there are too many
  Darts(const Vector3& lower, const Vector3& upper, double spacing) : lower_(lower), pitch_(0.5 * spacing) {
    constexpr double kMost = 20e6;
    const Eigen::Array3d cells = ((upper - lower) / pitch_).array().ceil().max(1.0);
    if (!(cells.prod() <= kMost)) {
      throw InputError(
          fmt::format("interior points: a spacing of {:.3g} mm makes {:.3g} candidates; at most {:.0f} are allowed",
                      spacing * 1e3, cells.prod(), kMost));
    }
    cells_ = cells.cast<Index>();
  }

  const Cell& cells() const { return cells_; }
  Index count() const { return cells_.prod(); }
  Index number(const Cell& cell) const { return (cell(2) * cells_(1) + cell(1)) * cells_(0) + cell(0); }
  Cell cell(Index number) const {
    return {number % cells_(0), number / cells_(0) % cells_(1), number / cells_(0) / cells_(1)};
  }

  /// Lower corner of a cell [m].
  Vector3 corner(const Cell& cell) const { return lower_ + pitch_ * cell.cast<double>().matrix(); }

  Vector3 operator()(Index number) const {
    const auto draw = static_cast<std::uint64_t>(number);
    return corner(cell(number)) + pitch_ * Vector3(uniform(draw, 0), uniform(draw, 1), uniform(draw, 2));
  }

 private:
  Vector3 lower_;
  double pitch_;
  Cell cells_;
};

/// How far a point has to be from each face.
struct DartClearance {
  Eigen::VectorXd of_face;  // [m]
  double most;

  bool has(const FaceTree& tree, const Vector3& x) const {
    const SkinPoint skin = tree.nearest(x, most);
    return skin.face < 0 || skin.distance >= of_face(skin.face);
  }
};

/// Marks the darts, among those of `side`^3 cells from `first` on, that are inside with the clearance. Cells far from
/// the skin are one question, the others are asked in eight parts.
void mark_inside(const FaceTree& tree, const Darts& darts, const DartClearance& clearance, const Cell& first,
                 Index side, std::vector<char>& hit) {
  const CellBox cells{first, (first + side).min(darts.cells())};
  if ((cells.last <= cells.first).any()) {
    return;
  }
  if (side == 1) {
    const Index n = darts.number(first);
    const Vector3 x = darts(n);
    hit[static_cast<std::size_t>(n)] = clearance.has(tree, x) && tree.winding_number(x) > 0.5;
    return;
  }
  const Vector3 centre = 0.5 * (darts.corner(cells.first) + darts.corner(cells.last));
  const double radius = (darts.corner(cells.last) - centre).norm();
  if (tree.nearest(centre, radius + clearance.most).face < 0) {
    const bool inside = tree.winding_number(centre) > 0.5;
    for_each_cell(cells, [&](const Cell& cell) { hit[static_cast<std::size_t>(darts.number(cell))] = inside; });
    return;
  }
  for_each_cell({Cell::Zero(), Cell::Constant(2)},
                [&](const Cell& part) { mark_inside(tree, darts, clearance, first + side / 2 * part, side / 2, hit); });
}

/// The darts that are inside with the clearance, in random order.
std::vector<Index> darts_inside(const FaceTree& tree, const Darts& darts, const DartClearance& clearance) {
  constexpr Index kBlock = 8;  // cells a side, a power of two
  const Cell blocks = (darts.cells() + (kBlock - 1)) / kBlock;
  std::vector<char> hit(static_cast<std::size_t>(darts.count()), 0);
#pragma omp parallel for collapse(3) schedule(dynamic)
  for (Index k = 0; k < blocks(2); ++k) {
    for (Index j = 0; j < blocks(1); ++j) {
      for (Index i = 0; i < blocks(0); ++i) {
        mark_inside(tree, darts, clearance, kBlock * Cell(i, j, k), kBlock, hit);
      }
    }
  }
  std::vector<std::pair<double, Index>> order;
  for (Index n = 0; n < darts.count(); ++n) {
    if (hit[static_cast<std::size_t>(n)] != 0) {
      order.emplace_back(uniform(static_cast<std::uint64_t>(n), 3), n);
    }
  }
  std::sort(order.begin(), order.end());
  std::vector<Index> numbers;
  numbers.reserve(order.size());
  for (const auto& [draw, n] : order) {
    numbers.push_back(n);
  }
  return numbers;
}

/// Diagonal of the box round the mesh [m].
double extent(const TriangleMesh& mesh) {
  return (mesh.vertices().rowwise().maxCoeff() - mesh.vertices().rowwise().minCoeff()).norm();
}

/// Radius of the largest ball inside the surface that touches it at the centroid of face f, somewhat too large: a ball
/// grows until skin is well inside, then shrinks to the one through the nearest skin until none is.
///
/// size     a ball as large as this grows no more [m]
/// source   Ma, Bae, Choi, 3D medial axis point approximation using nearest neighbors, Vis. Comput. 28 (2012) 7
double inner_radius(const TriangleMesh& mesh, const FaceTree& tree, Index f, double size) {
  // Of the radius. With 1 the search would look at every face that the ball touches: at all of a sphere's. A ball that
  // doubles cannot miss the far skin: what it leaves out near its rim was inside, or is beyond, the one before.
  constexpr double kWellInside = 0.9;
  constexpr int kMostSteps = 100;  // some ten suffice
  const Vector3 touch = mesh.centroids().col(f);
  const Vector3 normal = mesh.normals().col(f);
  double radius = 0.25 * mesh.local_edge(f);
  bool grows = true;
  for (int step = 0; step < kMostSteps && radius < size; ++step) {
    const SkinPoint skin = tree.nearest(touch - radius * normal, kWellInside * radius);
    if (skin.face >= 0) {
      const Vector3 chord = touch - skin.at;
      radius = chord.squaredNorm() / (2.0 * chord.dot(normal));
      grows = false;
    } else if (grows) {
      radius *= 2.0;
    } else {
      break;
    }
  }
  return radius;
}

/// A place under the skin, if the body is not too thin there.
struct Place {
  Vector3 at;
  double depth;  // [m]
  double edges;  // depth over the edge of the nearest face, 0 outside
};

constexpr double kLeastDepth = 1.5;     // local edges
constexpr double kLargestShare = 0.95;  // of the inner radius: farther on are axes and planes of symmetry

class PlaceFinder {
 public:
  explicit PlaceFinder(const TriangleMesh& mesh) : mesh_(mesh), tree_(mesh), size_(extent(mesh)) {}

  /// Places at random depths under random ones of these faces, without those less deep than 1.5 local edges.
  std::vector<Place> draw(const std::vector<Index>& faces, std::uint64_t draws, std::uint64_t seed) const {
    std::vector<Place> places(faces.empty() ? 0 : draws);
#pragma omp parallel for schedule(dynamic, 16)
    for (std::size_t i = 0; i < places.size(); ++i) {
      const std::uint64_t number = mixed_bits(seed) + i;
      const Index f = faces[static_cast<std::size_t>(uniform(number, 0) * static_cast<double>(faces.size()))];
      const double most = largest_depth(f);
      const double least = std::min(kLeastDepth * mesh_.local_edge(f), most);
      places[i] = under(f, least + uniform(number, 1) * (most - least));
    }
    std::erase_if(places, [](const Place& place) { return place.edges < kLeastDepth; });
    return places;
  }

  /// Faces under which there are places deeper than 1.5 local edges.
  ///
  /// throws   InputError if there are none
  std::vector<Index> deep_faces() const {
    std::vector<Place> deepest(static_cast<std::size_t>(mesh_.face_count()));
#pragma omp parallel for schedule(dynamic, 64)
    for (Index f = 0; f < mesh_.face_count(); ++f) {
      deepest[static_cast<std::size_t>(f)] = under(f, largest_depth(f));
    }
    std::vector<Index> deep;
    for (Index f = 0; f < mesh_.face_count(); ++f) {
      if (deepest[static_cast<std::size_t>(f)].edges >= kLeastDepth) {
        deep.push_back(f);
      }
    }
    if (deep.empty()) {
      const Place best = *std::max_element(deepest.begin(), deepest.end(),
                                           [](const Place& p, const Place& q) { return p.edges < q.edges; });
      throw InputError(
          fmt::format("interior sources: the body must be deeper than {} edges a little off its middle; it comes "
                      "closest with {:.3f} mm where the edge is {:.3f} mm",
                      kLeastDepth, best.depth * 1e3, best.depth / best.edges * 1e3));
    }
    return deep;
  }

 private:
  double largest_depth(Index f) const { return kLargestShare * inner_radius(mesh_, tree_, f, size_); }

  Place under(Index f, double depth) const {
    const Vector3 at = mesh_.centroids().col(f) - depth * mesh_.normals().col(f);
    const SkinPoint skin = tree_.nearest(at);
    return {at, skin.distance, tree_.winding_number(at) > 0.5 ? skin.distance / mesh_.local_edge(skin.face) : 0.0};
  }

  const TriangleMesh& mesh_;
  FaceTree tree_;
  double size_;
};

/// Appends to `chosen`, from the places in their order, those that are farther than `spacing` from those chosen before,
/// until there are `count`.
void choose(const std::vector<Place>& places, double spacing, std::size_t count, std::vector<Vector3>& chosen) {
  for (const Place& place : places) {
    if (chosen.size() == count) {
      return;
    }
    const bool free = std::all_of(chosen.begin(), chosen.end(), [&](const Vector3& other) {
      return (place.at - other).squaredNorm() > spacing * spacing;
    });
    if (free) {
      chosen.push_back(place.at);
    }
  }
}

/// The same at the largest spacing, of a falling series, that finds them all. Finds fewer only if there are too few.
void choose_spaced(const std::vector<Place>& places, double largest, std::size_t count, std::vector<Vector3>& chosen) {
  constexpr double kStep = 0.9;
  constexpr double kSmallest = 1e-3;  // of the largest: from here on the order alone decides
  const std::vector<Vector3> before = chosen;
  for (double spacing = largest; spacing > kSmallest * largest && chosen.size() < count; spacing *= kStep) {
    chosen = before;
    choose(places, spacing, count, chosen);
  }
  if (chosen.size() < count) {
    chosen = before;
    choose(places, 0.0, count, chosen);
  }
}

void require_positive(const char* name, double value) {
  require(value > 0 && std::isfinite(value), "{} = {} must be > 0", name, value);
}

}  // namespace

Points spaced_interior_points(const TriangleMesh& mesh, double spacing, double clearance, double edges) {
  require_positive("interior_points.spacing", spacing);
  require(clearance >= 0 && std::isfinite(clearance), "interior_points.clearance = {} must be >= 0", clearance);
  require(edges >= 0 && std::isfinite(edges), "interior_points.edges = {} must be >= 0", edges);
  constexpr double kSeparation = 0.8;  // spacings; the darts that find room then number one a spacing^3
  constexpr Index kReach = 2;  // cells of half a spacing: two apart may be nearer than the separation, three not
  const Vector3 lower = mesh.vertices().rowwise().minCoeff().array() + clearance;
  const Vector3 upper = mesh.vertices().rowwise().maxCoeff().array() - clearance;
  if ((upper - lower).minCoeff() <= 0) {
    return Points(3, 0);
  }
  const Eigen::VectorXd sides = (4.0 / std::sqrt(3.0) * mesh.areas()).cwiseSqrt();
  DartClearance needed{(edges * sides).cwiseMax(clearance), 0.0};
  needed.most = needed.of_face.maxCoeff();
  const FaceTree tree(mesh);
  const Darts darts(lower, upper, spacing);
  const double least = kSeparation * kSeparation * spacing * spacing;
  std::vector<char> kept(static_cast<std::size_t>(darts.count()), 0);
  Points points(3, darts.count());
  Index count = 0;
  for (const Index n : darts_inside(tree, darts, needed)) {
    const Vector3 x = darts(n);
    const Cell cell = darts.cell(n);
    bool free = true;
    for_each_cell({(cell - kReach).max(0), (cell + kReach + 1).min(darts.cells())}, [&](const Cell& near) {
      const Index other = darts.number(near);
      free = free && (kept[static_cast<std::size_t>(other)] == 0 || (darts(other) - x).squaredNorm() >= least);
    });
    if (free) {
      kept[static_cast<std::size_t>(n)] = 1;
      points.col(count++) = x;
    }
  }
  return points.leftCols(count);
}

Points interior_sources(const TriangleMesh& mesh, const Vector3& target, double reach, int count, std::uint64_t seed) {
  require(target.allFinite(), "interior_sources.target must be finite numbers");
  require_positive("interior_sources.reach", reach);
  require(count > 0, "interior_sources.count = {} must be > 0", count);
  const auto wanted = static_cast<std::size_t>(count);
  const std::size_t draws = std::max<std::size_t>(1500, 20 * wanted);  // to choose from; more fill gaps no better
  const double size = extent(mesh);
  const PlaceFinder finder(mesh);
  std::vector<Index> all(static_cast<std::size_t>(mesh.face_count()));
  std::iota(all.begin(), all.end(), 0);

  // What is within reach of the target, on the skin, has its nearest skin within twice the reach.
  std::vector<Index> around;
  std::copy_if(all.begin(), all.end(), std::back_inserter(around),
               [&](Index f) { return (mesh.centroids().col(f) - target).norm() <= 2.0 * reach; });
  std::vector<Place> near = finder.draw(around, draws, seed);
  std::erase_if(near, [&](const Place& place) { return (place.at - target).norm() > reach; });
  std::stable_sort(near.begin(), near.end(), [](const Place& p, const Place& q) { return p.depth > q.depth; });
  near.resize((near.size() + 1) / 2);

  std::vector<Place> everywhere = finder.draw(all, draws, ~seed);
  if (everywhere.size() < draws / 4) {
    everywhere = finder.draw(finder.deep_faces(), draws, ~seed);
  }
  std::vector<Vector3> chosen;
  choose_spaced(near, std::min(2.0 * reach, size), (wanted + 1) / 2, chosen);
  choose_spaced(everywhere, size, wanted, chosen);
  require(chosen.size() >= wanted, "interior sources: {} of {} places found deeper than {} edges", chosen.size(),
          wanted, kLeastDepth);

  return as_columns(chosen);
}

}  // namespace touchfield
