#include "sim/scene/scene_table.h"

namespace touchfield::schema {

Codec<FeltSpec> felt_codec() {
  using Layers = FeltSpec::Layers;
  constexpr int kMostPoints = 20;
  return Map<FeltSpec>()
      .key("layers", &FeltSpec::layers,
           choice<Layers>({{"on_bone", Layers::kOnBone},
                           {"half_space", Layers::kHalfSpace},
                           {"dermis_on_fat", Layers::kDermisOnFat}}),
           "The skin: one layer on bone, as in a finger; tissue without end, as in a thick palm; or dermis of 1.5 mm, "
           "10/3 of shear_kpa, on fat of 1/3 of it.")
      .key("bone_mm", &FeltSpec::bone, number(kMillimetres, between(2, 100)), "Depth of the bone [mm], with on_bone.")
      .key("shear_kpa", &FeltSpec::shear, number(Unit::power_of_ten(3), between(0.1, 10'000)),
           "Shear modulus of the middle skin at 200 Hz [kPa]. The soft skin has a third, the stiff one 10/3 of it.")
      .key("tan_delta", &FeltSpec::tan_delta, number(kPlain, between(0.1, 2)), "Loss tangent of the tissue.")
      .key("modulation_hz", &FeltSpec::modulation_hz, number(kPlain, between(1, 1000)),
           "Frequency at which the sound of a still is modulated, by a sine from 0 to its whole amplitude [Hz].")
      .maybe("frames_per_second", &FeltSpec::frames_hz, number(kPlain, kRate), "2000",
             "Frames of a pattern per second; default: as it was solved. Another draw speed needs no new phases.")
      .key("highest_hz", &FeltSpec::highest_hz, number(kPlain, between(10, 2000)),
           "Lines of a pattern's spectrum up to this frequency count [Hz].")
      .maybe("at_mm", &FeltSpec::at, vector3(kMillimetres, {}), "[0, 0, 200]",
             "Middle of the skin that is computed, 12 mm round it [mm]; default: the middle of the target or path.")
      .key("points_mm", &FeltSpec::points, list_of(vector3(kMillimetres, {}), 0, kMostPoints),
           "Places on the skin with spectra of their own [mm]. The dip is between the first two.")
      .shown_as("[[-3, 0, 200], [3, 0, 200]]")
      .maybe("reference", &FeltSpec::reference, text(1), "surface",
             "Method that the others are compared with; default: the first.")
      .codec();
}

}  // namespace touchfield::schema
