#include "sim/view/view_felt.h"

#include <utility>

#include <fmt/format.h>

#include "sim/pictures/skin_picture.h"
#include "sim/run/run_text.h"
#include "sim/view/view_page.h"

namespace touchfield {

namespace {

constexpr const char* kWords =
    "<p>The skin is modelled by flat layers: soft, middle and stiff. Compare methods on one skin, and read the three "
    "skins side by side: they differ more than most methods do. Without mechanics the radiation pressure stands for "
    "the "
    "vibration. Grey skin was not computed.</p>\n"
    "<p>Nothing here is a detection, a strength of a sensation or a share of correct answers.</p>\n";

/// The sides of the patch's faces that no other of its faces shares.
Points border_of(const SkinPatch& patch, const TriangleMesh& mesh) {
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(patch.size());
  return target_outline(
      mesh, {.faces = patch.faces, .amplitudes = ones, .box = std::vector<int>(patch.faces.size()), .shares = ones});
}

/// The largest displacements.
std::string caption_of(const Felt& felt, const FeltMethod& method) {
  std::string text = "max";
  for (const SkinVibration& skin : method.skins) {
    if (skin.has_mechanics) {
      text += fmt::format("{}{} {:.2g}", &skin == &method.skins.front() ? " " : ", ", skin.skin,
                          felt_figures(felt, skin).displacement_um);
    }
  }
  return text + " um";
}

}  // namespace

ViewData felt_view(const Felt& felt) {
  ViewSkin skin{.mesh = felt.mesh, .border = border_of(felt.patch, felt.mesh)};
  ViewData data{.title = felt.name + ", vibration of the skin", .methods = {}, .array = {}, .skins = {}};
  ViewQuantity pressure{.name = "radiation pressure, rms", .unit = "Pa", .factor = 1.0};
  for (const FeltMethod& method : felt.methods) {
    data.methods.push_back({method.name, caption_of(felt, method)});
    pressure.values.push_back(radiation_on_skin(felt, method));
  }
  skin.quantities.push_back(std::move(pressure));
  for (std::size_t s = 0; s < felt.methods.front().skins.size(); ++s) {
    if (const SkinVibration& first = felt.methods.front().skins[s]; first.has_mechanics) {
      ViewQuantity displacement{.name = "displacement, rms, " + first.skin + " skin", .unit = "um", .factor = 1e6};
      for (const FeltMethod& method : felt.methods) {
        displacement.values.push_back(map_on_skin(felt, method.skins[s].displacement));
      }
      skin.quantities.push_back(std::move(displacement));
    }
  }
  data.skins.push_back(std::move(skin));
  return data;
}

std::string felt_page(const Felt& felt, const std::string& picture, const std::string& results) {
  return view_page(felt_view(felt), picture,
                   "<h2>Results</h2>\n<pre>" + markup_text(results) + "</pre>\n" + kWords +
                       remarks_markup(felt.warnings, {}) + provenance_markup(felt.provenance));
}

}  // namespace touchfield
