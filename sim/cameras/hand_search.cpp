#include "sim/cameras/hand_search.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <optional>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/topology.h"

namespace touchfield {

SkinGrid::SkinGrid(const TriangleMesh& skin, double cell, double margin) : cell_(cell) {
  least_ = skin.vertices().rowwise().minCoeff() - Vector3::Constant(margin);
  const Vector3 size = skin.vertices().rowwise().maxCoeff() + Vector3::Constant(margin) - least_;
  count_ = (size / cell).array().ceil().cast<int>();
  last_ = (count_ - 1).cast<double>();
  const FaceTree tree(skin);
  nearest_.resize(static_cast<std::size_t>(count_.prod()));
#pragma omp parallel for
  for (int z = 0; z < count_.z(); ++z) {
    for (int y = 0; y < count_.y(); ++y) {
      for (int x = 0; x < count_.x(); ++x) {
        const SkinPoint found = tree.nearest(least_ + cell * Vector3(x + 0.5, y + 0.5, z + 0.5));
        const int place = (z * count_.y() + y) * count_.x() + x;
        nearest_[static_cast<std::size_t>(place)] = {found.at, skin.normals().col(found.face)};
      }
    }
  }
}

namespace {

constexpr double kThin = 8e-3;    // [m]
constexpr double kApart = 15e-3;  // [m]
constexpr Eigen::Index kLeastPartPoints = 20;
constexpr std::size_t kMostParts = 4;
constexpr double kWholeHand = 0.26;  // [m]

/// Which cube of a grid a point is in; neighbours along x, y, z differ by 1, kRow, kRow^2.
constexpr std::int64_t kRow = 1 << 20;
std::int64_t cube_of(const Vector3& x, double size) {
  const auto i = (x / size).array().floor().cast<std::int64_t>().eval();
  return (i.z() * kRow + i.y()) * kRow + i.x();
}

}  // namespace

SkinSamples SkinSamples::thinned(Eigen::Index most) const {
  const Eigen::Index step = std::max<Eigen::Index>(1, at.cols() / most);
  const auto some = Eigen::seqN(0, (at.cols() + step - 1) / step, step);
  return {at(Eigen::all, some), normal(Eigen::all, some)};
}

SkinSamples thinned_evenly(const HandPoints& points) {
  std::vector<std::pair<std::int64_t, Eigen::Index>> order;
  for (Eigen::Index p = 0; p < points.size(); ++p) {
    order.emplace_back(cube_of(points.at.col(p), kThin), p);
  }
  std::ranges::sort(order);
  SkinSamples samples{Points::Zero(3, points.size()), Points::Zero(3, points.size())};
  Eigen::Index count = 0;
  for (std::size_t first = 0; first < order.size();) {
    std::size_t last = first;
    for (; last < order.size() && order[last].first == order[first].first; ++last) {
      samples.at.col(count) += points.at.col(order[last].second);
      samples.normal.col(count) += points.normal.col(order[last].second);
    }
    samples.at.col(count) /= static_cast<double>(last - first);
    samples.normal.col(count++).normalize();
    first = last;
  }
  samples.at.conservativeResize(3, count);
  samples.normal.conservativeResize(3, count);
  return samples;
}

std::vector<SkinSamples> parts_of(const SkinSamples& samples) {
  std::vector<std::int64_t> cubes;
  for (const auto& x : samples.at.colwise()) {
    cubes.push_back(cube_of(x, kApart));
  }
  std::vector<std::int64_t> full = cubes;
  std::ranges::sort(full);
  full.erase(std::unique(full.begin(), full.end()), full.end());
  const auto place = [&](std::int64_t cube) {
    const auto found = std::ranges::lower_bound(full, cube);
    return found != full.end() && *found == cube ? found - full.begin() : -1;
  };
  DisjointSets sets(static_cast<Eigen::Index>(full.size()));
  for (std::size_t i = 0; i < full.size(); ++i) {
    for (int n = 14; n < 27; ++n) {  // half of the 26 neighbours
      const std::int64_t next = full[i] + ((n / 9 - 1) * kRow + n / 3 % 3 - 1) * kRow + n % 3 - 1;
      if (const auto other = place(next); other >= 0) {
        sets.join(static_cast<Eigen::Index>(i), other);
      }
    }
  }
  int count = 0;
  const std::vector<int> numbers = sets.numbered(count);
  std::vector<std::vector<Eigen::Index>> members(static_cast<std::size_t>(count));
  for (std::size_t s = 0; s < cubes.size(); ++s) {
    members[static_cast<std::size_t>(numbers[static_cast<std::size_t>(place(cubes[s]))])].push_back(
        static_cast<Eigen::Index>(s));
  }
  std::ranges::stable_sort(members, std::ranges::greater{}, &std::vector<Eigen::Index>::size);
  std::vector<SkinSamples> parts;
  for (const auto& member : members) {
    if (static_cast<Eigen::Index>(member.size()) >= kLeastPartPoints && parts.size() < kMostParts) {
      parts.push_back(samples.part(member));
    }
  }
  return parts;
}

Eigen::Matrix3d principal_axes(const Points& at) {
  const Points off = at.colwise() - at.rowwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(off * off.transpose());
  const Vector3 along = solver.eigenvectors().col(2);
  const Vector3 out = solver.eigenvectors().col(0);
  Eigen::Matrix3d axes;
  axes << along.cross(out), along, out;
  return axes;
}

std::vector<PossibleHand> possible_hands(const SkinSamples& part) {
  const Eigen::VectorXd along = principal_axes(part.at).col(1).transpose() * part.at;
  const double least = along.minCoeff();
  const double most = along.maxCoeff();
  std::vector<PossibleHand> hands;
  if (most - least < kWholeHand) {
    hands.push_back({part, 0});
  }
  for (const int end : {1, 2}) {
    for (const double length : {0.19, 0.12}) {
      if (most - least > 1.1 * length) {
        std::vector<Eigen::Index> which;
        for (Eigen::Index s = 0; s < along.size(); ++s) {
          if (end == 1 ? along(s) < least + length : along(s) > most - length) {
            which.push_back(s);
          }
        }
        hands.push_back({part.part(which), end});
      }
    }
  }
  return hands;
}

namespace {

constexpr Eigen::Index kRoughPoints = 100;  // that first tries go by
constexpr double kFar = 15e-3;              // D [m]
constexpr double kAgree = 0.2;              // cosine between normals of one side
constexpr double kSleeveCost = 0.2;
constexpr double kSleeve = 70e-3;   // its radius [m]
constexpr double kThrough = 12e-3;  // behind a point of the skin: what is seen there shows that no skin is [m]
constexpr double kNothingSeen = 0.7;
constexpr double kHidden = 0.5;
constexpr Eigen::Index kRoughStride = 3;  // of the skin's points, in first tries
constexpr std::size_t kPromising = 40;

/// The 60 rotations of an icosahedron with axes of two along x, y, z.
const std::vector<Eigen::Matrix3d>& turns() {
  static const std::vector<Eigen::Matrix3d> kTurns = [] {
    const std::array<Eigen::Matrix3d, 2> generators{
        Eigen::AngleAxisd(72 * kDegree, Vector3(0, 1, std::numbers::phi).normalized()).toRotationMatrix(),
        Eigen::AngleAxisd(180 * kDegree, Vector3::UnitZ()).toRotationMatrix()};
    std::vector<Eigen::Matrix3d> found{Eigen::Matrix3d::Identity()};
    for (std::size_t i = 0; i < found.size(); ++i) {
      for (const Eigen::Matrix3d& generator : generators) {
        const Eigen::Matrix3d next = generator * found[i];
        if (std::ranges::none_of(found, [&](const Eigen::Matrix3d& old) { return (old - next).norm() < 1e-6; })) {
          found.push_back(next);
        }
      }
    }
    return found;
  }();
  return kTurns;
}

}  // namespace

/// What the cameras see at some points.
struct HandSearch::Sight {
  const std::vector<DepthCamera>& cameras;
  const DepthFrame& frame;

  /// How badly a point of a skin goes with what a camera sees there: 1 if it sees through the point, less if it sees
  /// nothing (free space, or a hole), or something before a point that faces it. Nothing if it does not look there.
  std::optional<double> doubt(std::size_t camera, const Vector3& x, const Vector3& normal) const {
    const std::optional<ImagePoint> point = image_point(cameras[camera], x);
    if (!point) {
      return {};
    }
    const DepthImage& image = frame.images[camera];
    const auto depth = static_cast<double>(image.depth[point->pixel(image.width)]);
    if (depth > point->depth + kThrough) {
      return 1.0;
    }
    if (!(depth > 0)) {
      return kNothingSeen;
    }
    return depth < point->depth - kThrough && normal.dot(cameras[camera].view.eye - x) > 0 ? kHidden : 0.0;
  }

  bool faces(const Vector3& x, const Vector3& normal) const {
    return std::ranges::any_of(cameras, [&](const DepthCamera& camera) { return normal.dot(camera.view.eye - x) > 0; });
  }
};

HandSearch::HandSearch(const std::vector<TriangleMesh>& skins, std::vector<double> sizes) : sizes_(std::move(sizes)) {
  require(!skins.empty() && !sizes_.empty(), "search of a hand: no skin to look for");
  constexpr Eigen::Index kPoints = 200;
  for (const TriangleMesh& mesh : skins) {
    const Eigen::Index step = std::max<Eigen::Index>(1, mesh.face_count() / kPoints);
    const auto some = Eigen::seqN(0, (mesh.face_count() + step - 1) / step, step);
    Skin skin{SkinGrid(mesh, 6e-3, 30e-3), mesh.centroids()(Eigen::all, some), mesh.normals()(Eigen::all, some),
              Vector3::Zero(), mesh.vertices().row(1).minCoeff() + 8e-3};
    skin.middle = skin.at.rowwise().mean();
    skins_.push_back(std::move(skin));
  }
}

double HandSearch::cost(const HandStart& start, const Points& at, const Points& normal, const Sight& sight,
                        Eigen::Index stride) const {
  const Skin& skin = skins_[start.skin];
  const Eigen::Matrix3d back = start.place.rotation.transpose();
  double sum = 0;
  for (Eigen::Index p = 0; p < at.cols(); ++p) {
    const Vector3 x = back * (at.col(p) - start.place.shift) / start.size;
    if (x.y() < skin.end) {
      sum += std::hypot(x.x(), x.z()) < kSleeve ? kSleeveCost : 1.0;
      continue;
    }
    const SkinGrid::Near& near = skin.grid.near(x);
    if (near.normal.dot(back * normal.col(p)) < kAgree) {
      sum += 1;
      continue;
    }
    const Vector3 off = start.size * (x - near.at);
    const double distance = std::max(std::abs(near.normal.dot(off)), off.norm() - start.size * skin.grid.cell());
    sum += std::min(1.0, distance * distance / (kFar * kFar));
  }
  double doubt = 0;
  double looked = 0;
  for (Eigen::Index i = 0; i < skin.at.cols(); i += stride) {
    const Vector3 x = start.place(Vector3(start.size * skin.at.col(i)));
    const Vector3 out = start.place.rotation * skin.normal.col(i);
    for (std::size_t c = 0; c < sight.cameras.size(); ++c) {
      if (const std::optional<double> found = sight.doubt(c, x, out)) {
        doubt += *found;
        looked += 1;
      }
    }
  }
  return sum / static_cast<double>(at.cols()) + (looked > 0 ? doubt / looked : 1.0);
}

/// Each step lets the points move rigidly, by t + w x (q - m) in the hand's frame, towards the planes of the skin that
/// are nearest to them and, a tenth as much, towards its points; those farther than `reach` count less.
void HandSearch::bring_closer(HandStart& start, const Points& at, const Points& normal, double reach, int steps) const {
  constexpr double kToPoints = 0.1;
  const Skin& skin = skins_[start.skin];
  const Vector3 skin_middle = start.size * skin.middle;
  for (int step = 0; step < steps; ++step) {
    const Eigen::Matrix3d back = start.place.rotation.transpose();
    Eigen::Matrix<double, 6, 6> matrix = Eigen::Matrix<double, 6, 6>::Zero();
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
    double total = 1e-9;
    Vector3 arms = Vector3::Zero();
    Eigen::Matrix3d squares = Eigen::Matrix3d::Identity() * 1e-9;
    for (Eigen::Index p = 0; p < at.cols(); ++p) {
      const Vector3 x = back * (at.col(p) - start.place.shift);
      if (x.y() < start.size * skin.end) {
        continue;
      }
      const SkinGrid::Near& near = skin.grid.near(x / start.size);
      const Vector3 off = x - start.size * near.at;
      const double reached = 1 + off.squaredNorm() / (reach * reach);
      const double agree = near.normal.dot(back * normal.col(p)) < kAgree ? 0.1 : 1.0;
      const double weight = agree / (reached * reached);
      const Vector3 arm = x - skin_middle;
      Eigen::Matrix<double, 6, 1> row;
      row << near.normal, arm.cross(near.normal);
      matrix.noalias() += (weight * row) * row.transpose();
      gradient += weight * near.normal.dot(off) * row;
      const double to_point = kToPoints * weight;
      total += to_point;
      arms += to_point * arm;
      squares += to_point * arm * arm.transpose();
      gradient.head<3>() += to_point * off;
      gradient.tail<3>() += to_point * arm.cross(off);
    }
    // The terms towards points: |off + t + w x arm|^2.
    Eigen::Matrix3d across;
    across << 0, -arms.z(), arms.y(), arms.z(), 0, -arms.x(), -arms.y(), arms.x(), 0;
    matrix.topLeftCorner<3, 3>().diagonal().array() += total;
    matrix.bottomLeftCorner<3, 3>() += across;
    matrix.bottomRightCorner<3, 3>() -= squares;
    matrix.bottomRightCorner<3, 3>().diagonal().array() += squares.trace();
    const Eigen::Matrix<double, 6, 1> change = matrix.selfadjointView<Eigen::Lower>().ldlt().solve(-gradient);
    const double angle = change.tail<3>().norm();
    const Eigen::Matrix3d turn =
        angle > 0 ? Eigen::AngleAxisd(std::min(angle, 0.5), change.tail<3>() / angle).toRotationMatrix()
                  : Eigen::Matrix3d::Identity();
    start.place.rotation = start.place.rotation * turn.transpose();
    start.place.shift -= start.place.rotation * (skin_middle + change.head<3>() - turn * skin_middle);
  }
}

/// Turned, and so that the middle of what of it faces a camera is there.
RigidMotion HandSearch::placed_at(const Skin& skin, double size, const Eigen::Matrix3d& rotation, const Vector3& middle,
                                  const Sight& sight) const {
  Vector3 sum = Vector3::Zero();
  double count = 0;
  for (Eigen::Index i = 0; i < skin.at.cols(); i += kRoughStride) {
    if (sight.faces(middle, rotation * skin.normal.col(i))) {
      sum += skin.at.col(i);
      count += 1;
    }
  }
  const Vector3 seen = count > 0 ? Vector3(sum / count) : skin.middle;
  return {rotation, middle - size * (rotation * seen)};
}

std::vector<HandStart> HandSearch::starts(const HandPoints& points, const std::vector<DepthCamera>& cameras,
                                          const DepthFrame& frame, std::size_t most,
                                          const std::vector<std::size_t>& skins) const {
  require_frame(cameras, frame);
  const Sight sight{cameras, frame};
  const std::vector<SkinSamples> parts = parts_of(thinned_evenly(points));
  struct Try {
    HandStart start;
    std::size_t part;
    std::size_t hand;
    std::size_t group;  // of tries at one end of one part
  };
  std::vector<Try> tries;
  std::vector<SkinSamples> hands;
  std::size_t groups = 0;
  for (std::size_t part = 0; part < parts.size(); ++part) {
    const SkinSamples rough_part = parts[part].thinned(kRoughPoints);
    int where = -1;
    for (const auto& [samples, end] : possible_hands(parts[part])) {
      groups += end != std::exchange(where, end) ? 1 : 0;
      const SkinSamples rough = samples.thinned(kRoughPoints);
      const Vector3 middle = samples.at.rowwise().mean();
      const Eigen::Matrix3d axes = principal_axes(samples.at);
      for (const std::size_t skin : skins) {
        for (const Eigen::Matrix3d& turn : turns()) {
          const double size = sizes_[sizes_.size() / 2];
          HandStart start{skin, size, placed_at(skins_[skin], size, axes * turn, middle, sight), 0};
          bring_closer(start, rough.at, rough.normal, 40e-3, 2);
          start.cost = cost(start, rough_part.at, rough_part.normal, sight, kRoughStride);
          tries.push_back({start, part, hands.size(), groups - 1});
        }
      }
      hands.push_back(samples);
    }
  }
  // The best of all, but of one group no more than its share: what is no hand may cost less than a hand of another
  // size.
  const auto best_of = [&](std::size_t count, const auto& allowed) {
    std::ranges::stable_sort(tries, {}, [](const Try& one) { return one.start.cost; });
    std::vector<std::size_t> left(groups, groups == 0 ? 0 : std::max<std::size_t>(1, count / groups));
    std::vector<Try> best;
    for (const Try& one : tries) {
      if (best.size() < count && left[one.group] > 0 && allowed(one, best)) {
        best.push_back(one);
        --left[one.group];
      }
    }
    return best;
  };
  tries = best_of(kPromising, [](const Try&, const std::vector<Try>&) { return true; });
  std::vector<Try> sized;
  for (const Try& rough_try : tries) {
    const SkinSamples rough = hands[rough_try.hand].thinned(2 * kRoughPoints);
    for (const double size : sizes_) {
      Try& one = sized.emplace_back(rough_try);
      const Vector3 middle = skins_[one.start.skin].middle;
      one.start.place.shift += (one.start.size - size) * (one.start.place.rotation * middle);
      one.start.size = size;
      bring_closer(one.start, rough.at, rough.normal, 25e-3, 4);
      bring_closer(one.start, rough.at, rough.normal, 12e-3, 4);
      one.start.cost = cost(one.start, parts[one.part].at, parts[one.part].normal, sight, 1);
    }
  }
  tries = std::move(sized);
  tries = best_of(most, [&](const Try& one, const std::vector<Try>& best) {
    const auto middle = [&](const HandStart& start) {
      return start.place(Vector3(start.size * skins_[start.skin].middle));
    };
    return std::ranges::none_of(best, [&](const Try& other) {
      return other.start.skin == one.start.skin && (middle(other.start) - middle(one.start)).norm() < 25e-3 &&
             Eigen::AngleAxisd(other.start.place.rotation.transpose() * one.start.place.rotation).angle() <
                 30 * kDegree;
    });
  });
  std::vector<HandStart> starts;
  std::ranges::transform(tries, std::back_inserter(starts), &Try::start);
  return starts;
}

}  // namespace touchfield
