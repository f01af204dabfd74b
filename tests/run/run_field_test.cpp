#include "sim/run/evaluate_methods.h"
#include "sim/run/solve_model.h"
#include "tests/support/far_field.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::run_field_test {

/// A card that computes no more than a field, by what a test gives it.
class FieldCard : public Gpu {
 public:
  explicit FieldCard(std::function<void(const GpuField&)> work) : work_(std::move(work)) {}

  const GpuInfo& info() const override { return info_; }
  std::size_t taken() const override { return 0; }
  std::size_t most_taken() const override { return 0; }
  std::size_t allowed() const override { return 0; }
  std::unique_ptr<GpuBody> body(const GpuBodySpec&) override { return nullptr; }
  void field(const GpuBodySpec&, const GpuSources&, const GpuField& field) override { work_(field); }
  std::unique_ptr<SkinDevice> skin(const GpuComplex*, int, const GpuComplex*, int, int) override { return nullptr; }

 private:
  GpuInfo info_;
  std::function<void(const GpuField&)> work_;
};

/// A run with enough points about its body for the card to be asked.
struct Case {
  Model model = small_model({"body.edge_mm=1.2"});
  Run run = solve_model(model);
  Points points = points_about(run.mesh, 22);
};

const Case& solved() {
  static const Case kCase;
  return kCase;
}

TEST(RunField, TakesTheFarPartFromTheCard) {
  const auto& [model, run, points] = solved();
  int asked = 0;
  FieldValues by_pairs;
  FieldCard card([&](const GpuField& field) {
    ++asked;
    const Eigen::Map<const Eigen::MatrixXcd> surface(field.surface, run.mesh.face_count(), field.columns);
    const Eigen::Map<const Eigen::MatrixXcd> drives(field.drives, run.array.size(), field.columns);
    const Eigen::Map<const Points> at(field.points, 3, field.count);
    const FarField far = reference_far_field(run.mesh, run.array, model.fixed->wave, at, surface, drives);
    std::ranges::copy(far.pressure.reshaped(), field.pressure);
    std::ranges::copy(far.winding, field.winding);
    std::ranges::copy(far.near, field.near);
    by_pairs = with_near_faces(run.mesh, model.fixed->wave, at, surface, far.pressure, far.winding, far.near);
  });
  const FieldValues expected = run_field(run, model.fixed->wave, points);
  const FieldValues found = run_field(run, model.fixed->wave, points, &card);
  EXPECT_EQ(asked, 1);
  EXPECT_EQ(found.inside, expected.inside);
  EXPECT_EQ(found.inside, by_pairs.inside);
  EXPECT_LT((found.pressure - by_pairs.pressure).cwiseAbs().maxCoeff(),
            1e-11 * by_pairs.pressure.cwiseAbs().maxCoeff());
  // The processor sums by a grid here, which is 2e-4 off at the worst point (kFieldTolerance).
  EXPECT_LT((found.pressure - expected.pressure).cwiseAbs().maxCoeff(), 3e-4 * expected.pressure.cwiseAbs().maxCoeff());
}

TEST(RunField, TellsWantOfMemoryFromFailure) {
  const auto& [model, run, points] = solved();
  FieldCard full([](const GpuField&) { throw GpuMemoryFailure("full"); });
  FieldCard broken([](const GpuField&) { throw GpuFailure("broken"); });
  EXPECT_THROW(run_field(run, model.fixed->wave, points, &full), GpuMemoryFailure);
  EXPECT_THROW(run_field(run, model.fixed->wave, points, &broken), DeviceError);
}

}  // namespace touchfield::run_field_test
