#include "sim/acoustics/array_geometry.h"

#include <limits>
#include <utility>

#include "sim/core/rigid_motion.h"
#include "sim/core/units.h"
#include "tests/support/testing.h"

namespace touchfield::array_geometry_test {

constexpr double kWavelength = 8.58e-3;  // at 40 kHz

TransducerArray built(const ArrayLayout& layout) { return make_array(layout, Directivity::omni(), 1, 1); }

std::string refusal(const ArrayLayout& layout, double wavelength = kWavelength) {
  return message_of<InputError>([&] { require_real_array(built(layout), wavelength, "array.grid", "is it in mm?"); });
}

ArrayLayout turned(const ArrayLayout& layout, const Vector3& degrees, const Vector3& shift = Vector3::Zero()) {
  return transformed(layout, extrinsic_rotation(degrees * kDegree), shift);
}

TEST(ArrayGeometry, IsDescribed) {
  const ArrayLayout below = grid_layout(4, 4, 0.01);
  const std::pair<ArrayLayout, const char*> table[] = {
      {sonicsurface_layout(), "256 transducers, 157.5 x 157.5 mm, pitch 10.5 mm, facing +z"},
      {turned(grid_layout(2, 1, 0.01), {0, 90, 0}), "2 transducers, 10 mm, pitch 10 mm, facing +x"},
      {turned(grid_layout(3, 2, 0.01), {180, 0, 0}), "6 transducers, 20 x 10 mm, pitch 10 mm, facing -z"},
      {turned(grid_layout(3, 1, 0.01), {30, 0, 0}), "facing (0.00, -0.50, 0.87)"},
      {grid_layout(1, 1, 0.01), "1 transducer at (0.00, 0.00, 0.00) mm"},
      {autd3_tiles(2, 1, kAutd3Pitch), "498 transducers, 364.7 x 132.1 mm"},  // the boards do not meet at the pitch
      {joined({below, turned(below, {180, 0, 0}, {0, 0, 0.2})}), "facing many ways"},
      {joined({below, turned(below, {40, 0, 0}, {0, 0.1, 0})}), "facing (0.00, -0.34, 0.94) within 20 degrees"}};
  for (const auto& [layout, phrase] : table) {
    EXPECT_THAT(describe_array(built(layout)), HasSubstr(phrase));
  }
  EXPECT_EQ(describe_array(plane_wave({0, 0, -1}, 1)), "a plane wave along (0.00, 0.00, -1.00)");
}

TEST(ArrayGeometry, ArraysThatNobodyBuiltAreRefused) {
  EXPECT_THAT(
      refusal(grid_layout(16, 16, 10.5e-6)),
      AllOf(HasSubstr("array.grid: transducers 0 and "),
            HasSubstr("are 0.0105 mm apart, at (-0.08, -0.08, 0.00) mm; they must be at least 1 mm apart: is it "
                      "in mm?")));
  EXPECT_THAT(refusal(joined({grid_layout(2, 1, 0.01), grid_layout(2, 1, 0.01)})), HasSubstr("are in one place, ("));
  EXPECT_THAT(refusal(grid_layout(16, 16, 10.5)), AllOf(HasSubstr("222.7 m across"), HasSubstr("at most 20 m")));
  EXPECT_NO_THROW(require_real_array(built(grid_layout(3, 3, 1e-3)), kWavelength, "", ""));
  EXPECT_NO_THROW(require_real_array(built(grid_layout(1, 1, 1e-3)), kWavelength, "", ""));
  EXPECT_NO_THROW(require_real_array(plane_wave({0, 0, 1}, 1), kWavelength, "", ""));
  // Half a wavelength at 200 kHz, as micromachined transducers have it.
  EXPECT_NO_THROW(require_real_array(built(grid_layout(3, 3, 0.86e-3)), 1.72e-3, "", ""));
  EXPECT_THAT(refusal(grid_layout(3, 3, 0.2e-3), 1.72e-3), HasSubstr("at least 0.2"));
}

TEST(ArrayGeometry, AxesMustHaveALength) {
  for (const double length : {0.0, 2.0, std::numeric_limits<double>::quiet_NaN()}) {
    ArrayLayout layout = grid_layout(2, 1, 0.01);
    layout.axes.col(1) *= length;
    EXPECT_THAT(message_of<InputError>([&] { built(layout); }), HasSubstr("the axis of transducer 1 has length"));
  }
}

TEST(ArrayGeometry, LikelySlipsAreWarnings) {
  EXPECT_THAT(array_warnings(built(sonicsurface_layout()), kWavelength), IsEmpty());
  EXPECT_THAT(array_warnings(built(grid_layout(200, 2, 10e-3)), kWavelength), IsEmpty());
  EXPECT_THAT(array_warnings(built(grid_layout(4, 4, 1.05e-3)), kWavelength),
              ElementsAre(AllOf(HasSubstr("array_pitch: transducers 0 and "), HasSubstr("are 1.05 mm apart"))));
  EXPECT_THAT(array_warnings(built(grid_layout(16, 16, 0.105)), kWavelength),
              ElementsAre(HasSubstr("array_size: the array is 2.227 m across")));
  // 10 mm at 4 kHz, where 40 was meant.
  EXPECT_THAT(array_warnings(built(grid_layout(4, 4, 10e-3)), 10 * kWavelength),
              ElementsAre(HasSubstr("is frequency_khz right?")));
  EXPECT_THAT(array_warnings(plane_wave({0, 0, 1}, 1), kWavelength), IsEmpty());
}

}  // namespace touchfield::array_geometry_test
