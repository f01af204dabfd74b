#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

struct FieldForm {
  std::string name;
  std::optional<std::string> plane;
  std::optional<Vector3> through;
  std::optional<Vector3> centre;
  std::optional<Vector3> at;
  std::vector<double> size;
  double spacing = FieldSpec{}.spacing;
};

int axis_number(char axis) { return axis - 'x'; }

std::optional<FieldSpec> to_field(const Input& in, const FieldForm& form) {
  FieldSpec field{.name = form.name, .plane = form.plane.value_or(""), .spacing = form.spacing};
  if (form.at) {
    field.centre = *form.at;
    return field;
  }
  field.centre = form.plane ? form.through.value_or(Vector3::Zero()) : form.centre.value_or(Vector3::Zero());
  const std::string axes = form.plane.value_or("xyz");
  for (std::size_t i = 0; i < axes.size(); ++i) {
    field.size[axis_number(axes[i])] = form.size[i];
  }

  // As many points as the field's grid gets: at most `spacing` apart.
  constexpr double kMostPoints = 20e6;
  double count = 1;
  for (const double extent : field.size) {
    count *= std::max(0.0, std::ceil(extent / field.spacing - 1e-9)) + 1;
  }
  if (count > kMostPoints) {
    in.problem(fmt::format("{:.0f} points, must be at most {:.0f}", count, kMostPoints));
    return std::nullopt;
  }
  return field;
}

FieldForm to_form(const FieldSpec& field) {
  FieldForm form;
  form.name = field.name;
  form.spacing = field.spacing;
  if (field.size.isZero()) {
    form.at = field.centre;
    return form;
  }
  (field.plane.empty() ? form.centre : form.through) = field.centre;
  if (!field.plane.empty()) {
    form.plane = field.plane;
  }
  for (const char axis : form.plane.value_or("xyz")) {
    form.size.push_back(field.size[axis_number(axis)]);
  }
  return form;
}

}  // namespace

Codec<std::vector<FieldSpec>> fields_codec() {
  const auto form = Map<FieldForm>()
                        .required("name", &FieldForm::name, name(), "side", "Name of the field in the results.")
                        .maybe("plane", &FieldForm::plane, word({"xy", "xz", "yz"}), "xz", "Axes of the plane.")
                        .maybe("through_mm", &FieldForm::through, vector3(kMillimetres, {}), "[0, 0, 200]",
                               "Centre of the plane [mm].")
                        .needed_with({"plane"})
                        .maybe("centre_mm", &FieldForm::centre, vector3(kMillimetres, {}), "[0, 0, 200]",
                               "Centre of a box of points, instead of a plane [mm].")
                        .maybe("at_mm", &FieldForm::at, vector3(kMillimetres, {}), "[0, -300, 400]",
                               "One point, such as an ear, instead of a plane [mm]. The run prints the sound level "
                               "there.")
                        .required("size_mm", &FieldForm::size, list_of(number(kMillimetres, above(0)), 2, 3),
                                  "[120, 240]", "Extent along the plane's two axes, or along x, y and z [mm].")
                        .needed_with({"plane", "centre_mm"})
                        .items_with("plane", 2)
                        .items_with("centre_mm", 3)
                        .key("spacing_mm", &FieldForm::spacing, number(kMillimetres, above(0)),
                             "Largest distance between points [mm]. A field may have 20 million points.")
                        .allowed_with({"plane", "centre_mm"})
                        .exactly_one({"plane", "centre_mm", "at_mm"})
                        .codec();
  const auto field = kept_as<FieldSpec, FieldForm>(form, to_field, [](const FieldSpec& f) { return to_form(f); });
  return list_of<FieldSpec>(field, 0, kMostItems, {.name = [](const FieldSpec& f) { return f.name; }, .advice = ""});
}

}  // namespace touchfield::schema
