#include "sim/model/clear_transducers.h"

#include <algorithm>
#include <functional>
#include <string>
#include <variant>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/remesh/cut.h"
#include "sim/model/meshed_body.h"
#include "sim/model/scene_slips.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

/// distance   from the skin, negative inside [m]
[[noreturn]] void refuse_place(const BodySpec& body, const TransducerArray& array, Index transducer, double distance) {
  const std::string place = called(body) + ".place.at_mm";
  const std::string at = place_text(array.positions.col(transducer), 2);
  const std::string hint = metres_hint(body.place.at);
  require(!(distance < 0), "{} puts transducer {} at {} inside the body; change it or array.at_mm{}", place, transducer,
          at, hint);
  throw InputError(
      fmt::format("{} puts the body {:.1f} mm from the array, from transducer {} at {}; it must be >= {} mm "
                  "away{}",
                  place, distance / kMillimetre, transducer, at, kLeastClearance / kMillimetre, hint));
}

double signed_distance(const PointClearance& clearance) {
  return clearance.inside ? -clearance.distance : clearance.distance;
}

/// Signed distances of points from a body's skin [m], negative inside, both in its own frame.
using Distances = std::function<Eigen::VectorXd(const Points&)>;

struct DistancesOf {
  const BodySpec& spec;
  KeptBodies* kept;

  Distances operator()(const HandShape& shape) const {
    return [&shape](const Points& x) { return hand_distances(hand_options(shape, HandOptions().edge), x); };
  }
  Distances operator()(const SphereShape& shape) const {
    return [&shape](const Points& x) { return Eigen::VectorXd(x.colwise().norm().array() - shape.radius); };
  }
  Distances operator()(const CapsuleShape& shape) const {
    return [&shape](const Points& x) {
      const double half = 0.5 * shape.length;
      Points from_axis = x;
      from_axis.row(1) -= x.row(1).cwiseMax(-half).cwiseMin(half);
      return Eigen::VectorXd(from_axis.colwise().norm().array() - shape.radius);
    };
  }
  Distances operator()(const BoxShape& shape) const {
    return [&shape](const Points& x) {
      const Points beyond = x.cwiseAbs().colwise() - 0.5 * shape.size;
      return Eigen::VectorXd(beyond.cwiseMax(0.0).colwise().norm() + beyond.colwise().maxCoeff().cwiseMin(0.0));
    };
  }
  Distances operator()(const MeshShape& /*shape*/) const {
    return [skin = plain_body(spec, 0.0, kept).mesh](const Points& x) {
      const std::vector<PointClearance> found = point_clearances(skin, x);
      Eigen::VectorXd distances(x.cols());
      for (std::size_t n = 0; n < found.size(); ++n) {
        distances(static_cast<Index>(n)) = signed_distance(found[n]);
      }
      return distances;
    };
  }
};

/// Whether a point is by the part of a body that keep_within leaves: the straight way to its centre stays by the flesh.
bool is_by_kept_part(double keep_within, const Vector3& x, const Vector3& centre, const Distances& distances) {
  constexpr int kSteps = 30;
  constexpr double kFarthest = 3.0 * kMillimetre;
  if (cube_distance(x, centre) > keep_within) {
    return false;
  }
  Points way(3, kSteps);
  for (int i = 0; i < kSteps; ++i) {
    way.col(i) = x + (i + 0.5) / kSteps * (centre - x);
  }
  return distances(way).maxCoeff() < kFarthest;
}

}  // namespace

bool lies_apart(const TransducerArray& array, const TriangleMesh& mesh, double distance) {
  const Vector3 gap = (mesh.vertices().rowwise().minCoeff() - array.positions.rowwise().maxCoeff())
                          .cwiseMax(array.positions.rowwise().minCoeff() - mesh.vertices().rowwise().maxCoeff());
  return gap.maxCoeff() > distance;
}

std::optional<ArrayContact> array_contact(const ArraySpec& spec, const TransducerArray& array,
                                          const TriangleMesh& mesh) {
  if (array.kind == TransducerArray::Kind::kPlaneWave || lies_apart(array, mesh, kLeastClearance)) {
    return {};
  }
  const std::vector<PointClearance> clearances = point_clearances(mesh, array.positions);
  const auto nearest = std::ranges::min_element(clearances, {}, signed_distance);
  if (signed_distance(*nearest) < kLeastClearance) {
    return ArrayContact{nearest - clearances.begin(), signed_distance(*nearest), nearest->face, {}};
  }
  if (!std::holds_alternative<PositionsArray>(spec.layout)) {
    if (const auto hit = plate_collision(mesh, array.positions, array.device, 0.0)) {
      return ArrayContact{.face = hit->face, .board = hit};
    }
  }
  return {};
}

void require_clear_array(const ArraySpec& spec, const TransducerArray& array, const Posture& posture,
                         const TriangleMesh& mesh, const std::vector<int>& owner) {
  const auto contact = array_contact(spec, array, mesh);
  if (!contact) {
    return;
  }
  if (contact->board) {
    throw InputError(
        fmt::format("array: the body cuts through the board of array unit {} at {}; move the body by "
                    "body.place.at_mm or the array by array.at_mm",
                    contact->board->plate, place_text(contact->board->at, 2)));
  }
  const auto body = static_cast<std::size_t>(owner[static_cast<std::size_t>(contact->face)]);
  refuse_place(posture.bodies[body], array, contact->transducer, contact->distance);
}

Index count_behind(const TransducerArray& array, const Vector3& at) {
  if (array.kind == TransducerArray::Kind::kPlaneWave || array.directivity.kind() == Directivity::Kind::kOmni) {
    return 0;
  }
  const Eigen::RowVectorXd ahead = array.axes.cwiseProduct((-array.positions).colwise() + at).colwise().sum();
  return (ahead.array() <= 0).count();
}

void require_clear_points(const std::vector<FieldGrid>& fields, const TransducerArray& array,
                          const TriangleMesh& mesh) {
  constexpr double kOff = 0.5 * kMillimetre;  // from the skin, of the place that the message offers
  std::optional<FaceTree> tree;               // of the skin, for all points
  for (const FieldGrid& field : fields) {
    if (field.size() > 1) {
      continue;
    }
    const Vector3& at = field.origin;
    Index nearest = 0;
    require(array.kind == TransducerArray::Kind::kPlaneWave ||
                (array.positions.colwise() - at).colwise().norm().minCoeff(&nearest) >= kLeastClearance,
            "field {}: at_mm {} must be >= {} mm away from every transducer; it is nearer to transducer {}", field.name,
            place_text(at, 2), kLeastClearance / kMillimetre, nearest);
    if (!tree) {
      tree.emplace(mesh);
    }
    if (tree->touched(at).face < 0 && tree->winding_number(at) > 0.5) {
      const SkinPoint skin = tree->nearest(at);
      throw InputError(fmt::format(
          "field {}: at_mm {} is {:.2f} mm inside a body, where there is no sound; the nearest place in the air is {}",
          field.name, place_text(at, 2), skin.distance / kMillimetre,
          place_text(skin.at + kOff * mesh.normals().col(skin.face), 2)));
    }
  }
}

void require_clear_places(const Scene& scene, const BodyPlan& plan, const TransducerArray& array, KeptBodies* kept) {
  constexpr int kMostTried = 20;  // transducers in what keep_within leaves out; the mesh itself is looked at later
  if (array.kind == TransducerArray::Kind::kPlaneWave) {
    return;
  }
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const BodySpec& spec = scene.bodies[i];
    if (!spec.edge) {  // its mesh is the file's own, and looked at next
      continue;
    }
    const Distances distances_of = std::visit(DistancesOf{spec, kept}, spec.shape);
    const Points own = plan.own_frame(scene, i)(array.positions);
    Eigen::VectorXd distances = distances_of(own);
    Index nearest = 0;
    for (int tried = 0; tried < kMostTried && distances.minCoeff(&nearest) < kLeastClearance; ++tried) {
      if (!spec.keep_within ||
          is_by_kept_part(*spec.keep_within, own.col(nearest), plan.bodies[i].kept_about, distances_of)) {
        refuse_place(spec, array, nearest, distances(nearest));
      }
      distances(nearest) = std::numeric_limits<double>::infinity();
    }
  }
}

}  // namespace touchfield
