#include "sim/view/view_motion.h"

#include "sim/field/surface_gradient.h"
#include "sim/scene/scene_reader.h"
#include "tests/support/motion_support.h"
#include "tests/support/solve_support.h"
#include "tests/support/testing.h"

namespace touchfield::view_motion_test {

TEST(MotionView, HasEverySkinAndCurve) {
  const Motion motion = full_motion();
  const ViewData data = motion_view(motion);
  ASSERT_EQ(data.methods.size(), 2U);
  EXPECT_EQ(data.methods[1].name, "paper-2");
  ASSERT_EQ(data.skins.size(), 3U);
  EXPECT_TRUE(data.skins[0].sensed && data.skins[0].target && !data.skins[1].sensed);
  for (const ViewSkin& skin : data.skins) {
    ASSERT_EQ(skin.pressure.size(), 2U);
    EXPECT_EQ(skin.pressure[1].size(), skin.mesh.face_count());
  }
  std::set<std::string> labels;
  for (const ViewCurve& curve : data.curves) {
    labels.insert(curve.label);
    EXPECT_EQ(curve.times.size(), curve.values.size()) << curve.label;
    EXPECT_TRUE(std::ranges::is_sorted(curve.times, std::less_equal())) << curve.label;
  }
  EXPECT_EQ(labels, (std::set<std::string>{"error of |p| [%]", "mean |p| in target [Pa]", "displacement [mm]",
                                           "age [ms]", "latency [ms]", "|p| at places [Pa]"}));
}

TEST(MotionView, HasTheRadiationPressureOfItsScenesWave) {
  Motion motion = full_motion();
  motion.scene = resolved_yaml(small_scene());
  motion.methods[0].scores[3].metrics.relative_error_radiation = 0.41;
  const ViewData data = motion_view(motion);
  const Model model = small_model();
  const Wave& wave = model.fixed->wave;
  EXPECT_EQ(data.radiation_per_square, radiation_per_square(wave.medium()));
  for (const ViewSkin& skin : data.skins) {
    ASSERT_EQ(skin.radiation.size(), 2U);
    EXPECT_EQ(skin.radiation[1], radiation_pressure(SurfaceGradient(skin.mesh, wave.k()), wave, skin.pressure[1]));
  }
  EXPECT_EQ(data.methods[0].caption, "error of P 41.0 %, median");
  EXPECT_THAT(data.methods[1].caption, StartsWith("error of |p| "));
  EXPECT_TRUE(std::ranges::find(data.curves, "error of P [%]", &ViewCurve::label) != data.curves.end());
}

TEST(MotionView, ALongLineKeepsItsPeaks) {
  Motion motion = long_motion({"surface"});
  std::vector<MotionScore>& scores = motion.methods[0].scores;
  scores.assign(100'000, scores[5]);
  for (std::size_t i = 0; i < scores.size(); ++i) {
    scores[i].time = 1e-3 * static_cast<double>(i);
    scores[i].metrics.relative_error = i == 77'777 ? 0.9 : 0.3 + 1e-7 * static_cast<double>(i);
  }
  for (const std::size_t i : {0, 12'345}) {  // the first of a stretch, and one within
    scores[i].metrics.relative_error = kNotComputed;
  }
  const ViewCurve error = motion_view(motion).curves.front();
  EXPECT_EQ(error.values.size(), 2002U);
  EXPECT_EQ(std::ranges::count_if(error.values, [](double value) { return std::isnan(value); }), 2);
  EXPECT_EQ(error.times[1], scores[1].time);
  EXPECT_EQ(*std::ranges::max_element(error.values, {}, [](double value) { return std::isnan(value) ? 0 : value; }),
            90.0);
  EXPECT_TRUE(std::ranges::is_sorted(error.times, std::less_equal()));
}

}  // namespace touchfield::view_motion_test
