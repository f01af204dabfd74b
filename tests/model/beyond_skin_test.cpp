#include <cmath>

#include "sim/mesh/query/face_tree.h"
#include "sim/model/model.h"
#include "sim/run/solve_model.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::beyond_skin_test {

const std::vector<std::string> kLong = {"body.capsule.length_mm=60", "body.place.at_mm=[0, 20, 50]"};

Model long_model(std::vector<std::string> changes) {
  changes.insert(changes.begin(), kLong.begin(), kLong.end());
  return small_model(changes);
}

double skin_area(const Model& model) {
  double area = 0;
  for (Eigen::Index f = 0; f < model.body.mesh.face_count(); ++f) {
    area += model.fixed->skin[static_cast<std::size_t>(f)] != 0 ? model.body.mesh.areas()(f) : 0.0;
  }
  return area;
}

TEST(BeyondSkin, PartAndPatchesTogetherAreTheSkin) {
  const Model whole = long_model({});
  EXPECT_TRUE(whole.beyond.empty());
  for (const char* kept : {"14", "20", "30"}) {
    const Model model = long_model({std::string("body.keep_within_mm=") + kept});
    ASSERT_FALSE(model.beyond.empty());
    // Faces that reach over the border of what counts as skin are shared out by their middle: half a face round it.
    EXPECT_NEAR((skin_area(model) + model.beyond.areas.sum()) / whole.body.mesh.total_area(), 1.0, 0.02) << kept;
    const double border = 0.9e-3 * std::stod(kept);
    const Points centres = model.beyond.centres();
    EXPECT_GT((centres.colwise() - Vector3(0, 20e-3, 50e-3)).cwiseAbs().colwise().maxCoeff().minCoeff(), border - 2e-3);
    EXPECT_LT(FaceTree(whole.body.mesh).nearest(centres.col(0)).distance, 1e-5);
    // 0.9 wavelengths apart at most.
    EXPECT_LT(model.beyond.areas.mean(), std::pow(0.9 * model.fixed->wave.wavelength(), 2));
  }
  EXPECT_TRUE(long_model({"body.keep_within_mm=200"}).beyond.empty());
}

TEST(BeyondSkin, OtherBodiesLieBeyondAsAWhole) {
  const std::string two =
      "bodies=[{name: one, capsule: {radius_mm: 6, length_mm: 10}, edge_mm: 2.5, place: {landmark: bottom, at_mm: [0, "
      "0, "
      "50]}, keep_within_mm: 30}, {name: other, sphere: {radius_mm: 8}, edge_mm: 2.5, keep_within_mm: 30, place: "
      "{at_mm: [70, 0, 60]}}]";
  const std::string target = "target.box={at: one.bottom, size_mm: [6, 12, 5]}";
  const Model model = small_model({two, "body=null", target});
  EXPECT_THAT(model.fixed->owner, Each(0));
  EXPECT_THAT(model.fixed->cut, ElementsAre(1));
  EXPECT_THAT(model.beyond.owner, Each(1));
  const double sphere = 4 * std::acos(-1.0) * 64e-6;
  EXPECT_NEAR(model.beyond.areas.sum() / sphere, 1.0, 0.03);
  EXPECT_NEAR((model.beyond.centres().colwise() - Vector3(70e-3, 0, 60e-3)).colwise().norm().mean(), 8e-3, 0.3e-3);
  const EvaluationMesh evaluation = model.fixed->evaluation.mesh(model);
  EXPECT_THAT(evaluation.owner, Contains(1));
  // It has to be there where it is pressed on, or where nothing may lie beyond.
  EXPECT_THROW(
      small_model({two, "body=null",
                   "target.boxes=[{at: one.bottom, size_mm: [6, 12, 5]}, {at: other.bottom, size_mm: [6, 6, 5]}]",
                   "target.box=null"}),
      InputError);
}

/// The skin beyond is minded: with it the whole body gets a better pattern than without.
TEST(BeyondSkin, PhasesMindTheSkinThatIsNotSolved) {
  const std::vector<std::string> changes = {
      "array.grid.count=[16, 16]", "body.keep_within_mm=14", "target.pressure_pa=1500",
      "solve.methods=[surface, {paper: {faces: area}}]", "evaluation={edge_mm: 2.2}"};
  const auto errors = [&](const std::vector<std::string>& more) {
    std::vector<std::string> all = changes;
    all.insert(all.end(), more.begin(), more.end());
    const touchfield::Run run = solve_model(long_model(all));
    return std::pair(run.methods[0].metrics.relative_error, run.methods[1].metrics.relative_error);
  };
  const auto [surface, paper] = errors({});
  const auto [surface_of_whole, paper_of_whole] = errors({"body.keep_within_mm=null"});
  EXPECT_LT(surface, surface_of_whole + 0.03);
  EXPECT_LT(paper, paper_of_whole + 0.02);
}

TEST(BeyondSkin, PatchesAreSeenAsTheSkinIs) {
  const std::vector<std::string> kept = {"body.keep_within_mm=14"};
  const Model truth = long_model(kept);
  const Model moved = long_model({kept[0], "sensing={noise_mm_rms: 0, offset_mm: [0.5, -0.6, 0.7]}"});
  ASSERT_EQ(moved.beyond.size(), truth.beyond.size());
  EXPECT_LT((moved.beyond.corners - (truth.beyond.corners.colwise() + Vector3(0.5e-3, -0.6e-3, 0.7e-3)))
                .cwiseAbs()
                .maxCoeff(),
            1e-12);
  const Model noisy = long_model({kept[0], "sensing={noise_mm_rms: 0.3, correlation_mm: 5, seed: 2}"});
  const Points shift = noisy.beyond.centres() - truth.beyond.centres();
  const Eigen::VectorXd along = shift.cwiseProduct(truth.beyond.normals()).colwise().sum();
  EXPECT_NEAR(std::sqrt(along.squaredNorm() / static_cast<double>(along.size())), 0.3e-3, 0.1e-3);
  EXPECT_LT((shift - truth.beyond.normals() * along.asDiagonal()).cwiseAbs().maxCoeff(), 1e-12);
}

}  // namespace touchfield::beyond_skin_test
