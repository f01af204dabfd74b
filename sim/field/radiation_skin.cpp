#include "sim/field/radiation_skin.h"

#include <cmath>
#include <utility>

#include "sim/field/metrics.h"
#include "sim/field/surface_gradient.h"

namespace touchfield {

namespace {

using Eigen::Index;

/// Faces with a centroid within the reach of that of a target's face, ascending.
std::vector<Index> faces_near(const TriangleMesh& mesh, const Target& target, double reach) {
  std::vector<Index> near;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (const Index own : target.faces) {
      if ((mesh.centroids().col(f) - mesh.centroids().col(own)).squaredNorm() <= reach * reach) {
        near.push_back(f);
        break;
      }
    }
  }
  return near;
}

}  // namespace

NearSkin near_skin(const TriangleMesh& mesh, const Target& target, const Wave& wave) {
  return near_skin(mesh, faces_near(mesh, target, NearSkin::kReach * wave.wavelength()), wave);
}

NearSkin near_skin(const TriangleMesh& mesh, std::vector<Index> faces, const Wave& wave) {
  NearSkin near;
  near.faces = std::move(faces);
  near.count = static_cast<Index>(near.faces.size());
  const SkinSlopes slopes = surface_slopes(mesh, wave.k(), near.faces);
  std::vector<Index> place(static_cast<std::size_t>(mesh.face_count()), -1);  // of each face among near.faces
  for (Index i = 0; i < near.count; ++i) {
    place[static_cast<std::size_t>(near.faces[static_cast<std::size_t>(i)])] = i;
  }
  std::vector<Eigen::Triplet<float>> entries;
  entries.reserve(static_cast<std::size_t>(slopes.nonZeros()));
  for (Index row = 0; row < slopes.rows(); ++row) {
    for (SkinSlopes::InnerIterator entry(slopes, row); entry; ++entry) {
      Index& at = place[static_cast<std::size_t>(entry.col())];
      if (at < 0) {
        at = static_cast<Index>(near.faces.size());
        near.faces.push_back(entry.col());
      }
      entries.emplace_back(row, at, entry.value());
    }
  }
  auto own = std::make_shared<SkinSlopes>(slopes.rows(), static_cast<Index>(near.faces.size()));
  own->setFromTriplets(entries.begin(), entries.end());
  near.slopes = std::move(own);
  return near;
}

RadiationSkin bare_skin(const Wave& wave) {
  RadiationSkin skin;
  skin.press = radiation_per_square(wave.medium());
  skin.flow = 0.25 / (wave.medium().density * std::pow(wave.omega(), 2));
  return skin;
}

RadiationSkin radiation_skin(const NearSkin& near, const TriangleMesh& mesh, const Target& target,
                             const Eigen::VectorXd& amplitudes, const OutsideSkin& outside, const Wave& wave,
                             double outside_weight, const Eigen::VectorXd& counted) {
  RadiationSkin skin = bare_skin(wave);
  const Eigen::VectorXd wanted = skin.press * amplitudes.cwiseAbs2();
  const Eigen::VectorXd areas = target.areas(mesh.areas());
  const double unit = wanted.maxCoeff() * areas.sum();  // S A_T
  skin.wanted = Eigen::VectorXd::Zero(near.count);
  skin.weights = mesh.areas()(near.faces).head(near.count) / (unit * wanted.maxCoeff());
  if (outside.faces.size() > 0) {
    skin.weights.array() *= outside.faces(near.faces).head(near.count).array();
  }
  for (Index i = 0, j = 0; i < near.count && j < target.size(); ++i) {
    if (near.faces[static_cast<std::size_t>(i)] == target.faces[static_cast<std::size_t>(j)]) {
      skin.wanted(i) = target.shares(j) * wanted(j);
      skin.constant += skin.weights(i) * (1.0 - target.shares(j)) * target.shares(j) * wanted(j) * wanted(j);
      ++j;
    }
  }
  skin.slopes = near.slopes;
  skin.energies = outside_weight * skin.press / unit * counted;
  return skin;
}

}  // namespace touchfield
