#include "sim/jobs/felt_result.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <iterator>
#include <limits>
#include <tuple>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/model/stages.h"
#include "sim/pictures/figures.h"
#include "sim/run/felt_file.h"
#include "sim/run/motion_file.h"
#include "sim/run/run_file.h"
#include "sim/run/text_table.h"
#include "sim/run/vtk_files.h"
#include "sim/scene/scene_reader.h"
#include "sim/view/view_felt.h"

namespace touchfield {

namespace {

double decibels(double value, double reference) {
  return value > 0.0 && reference > 0.0 ? 20.0 * std::log10(value / reference) : kNotComputed;
}

/// A method on a skin, and the reference on the same. `louder`: the largest rms of P over that of the reference [dB].
Json skin_value(const Felt& felt, const FeltMethod& method, std::size_t s, const FeltFigures& reference,
                double louder) {
  const FeltFigures figures = felt_figures(felt, method.skins[s]);
  Json value = {{"method", method.name},
                {"skin", method.skins[s].skin},
                {"displacement_rms_um", figures.displacement_um},
                {"velocity_rms_mm_s", figures.velocity_mm_s},
                {"pressure_rms_pa", figures.pressure_pa},
                {"spread_mm2", figures.spread_mm2}};
  for (std::size_t d = 0; d < figures.energy_j_m3.size(); ++d) {
    value[fmt::format("energy_{}_j_m3", kReceptorNames[d])] = figures.energy_j_m3[d];
  }
  for (std::size_t c = 0; c < figures.weighted.size(); ++c) {
    const double above = decibels(figures.weighted[c], reference.weighted[c]);
    const std::string channel = channel_name(kTouchChannels[c]);
    value[channel + "_db"] = above;
    value[channel + "_at_equal_rms_db"] = above - louder;
  }
  value["dip_db"] = figures.dip_db;
  return value;
}

Json skin_values(const Felt& felt, const std::optional<Felt>& against) {
  const Felt& other = against ? *against : felt;
  std::vector<FeltFigures> reference;
  for (const SkinVibration& skin : reference_of(other).skins) {
    reference.push_back(felt_figures(other, skin));
  }
  Json rows = Json::array();
  for (const FeltMethod& method : felt.methods) {
    const double louder = decibels(felt_figures(felt, method.skins.back()).pressure_pa, reference.back().pressure_pa);
    for (std::size_t s = 0; s < method.skins.size(); ++s) {
      rows.push_back(skin_value(felt, method, s, reference[s], louder));
    }
  }
  return rows;
}

Json spectrum_values(const Felt& felt) {
  Json rows = Json::array();
  for (const FeltMethod& method : felt.methods) {
    for (const SkinVibration& skin : method.skins) {
      for (std::size_t p = 0; p < felt.points.size(); ++p) {
        for (std::size_t l = 0; l < method.lines.hz.size(); ++l) {
          const std::complex<double> peak = skin.at_points(static_cast<Eigen::Index>(l), static_cast<Eigen::Index>(p));
          const double nothing = kNotComputed;
          rows.push_back(Json{{"method", method.name},
                              {"skin", skin.skin},
                              {"point", felt.points[p].name},
                              {"hz", method.lines.hz[l]},
                              {"displacement_peak_um", skin.has_mechanics ? 1e6 * std::abs(peak) : nothing},
                              {"pressure_peak_pa", skin.has_mechanics ? nothing : std::abs(peak)},
                              {"phase_rad", std::arg(peak)}});
        }
      }
    }
  }
  return rows;
}

std::string reference_name(const Felt& felt, const std::optional<Felt>& against) {
  return against ? against->name + ", " + reference_of(*against).name : reference_of(felt).name;
}

/// How many dB a method is above the reference, from the least to the most over the skins, and whether the sign is the
/// same on all.
class SkinRange {
 public:
  void add(double value) {
    least_ = std::fmin(least_, value);
    most_ = std::fmax(most_, value);
  }
  std::string text() const {
    if (!(least_ <= most_)) {
      return "-";
    }
    if (std::max(-least_, most_) < kSame) {
      return "0";
    }
    return fmt::format("{:+.1f} to {:+.1f}{}", least_, most_,
                       least_ > -kSame || most_ < kSame ? "" : ": depends on the skin");
  }

 private:
  static constexpr double kSame = 0.05;  // [dB]
  double least_ = std::numeric_limits<double>::infinity();
  double most_ = -std::numeric_limits<double>::infinity();
};

/// Every method relative to the reference, as it was solved and at the reference's largest rms of P.
std::string relative_text(const Json& rows, const std::string& reference) {
  Json all = Json::array();
  for (std::size_t first = 0, last = 0; first < rows.size(); first = last) {
    Json relative = {{"method", rows[first]["method"]}, {"against", reference}};
    while (last < rows.size() && rows[last]["method"] == rows[first]["method"]) {
      ++last;
    }
    for (const TouchChannel channel : kTouchChannels) {
      for (const char* scaled : {"_db", "_at_equal_rms_db"}) {
        SkinRange range;
        for (std::size_t i = first; i < last; ++i) {
          range.add(rows[i][channel_name(channel) + scaled].get<double>());
        }
        relative[channel_name(channel) + scaled] = range.text();
      }
    }
    all.push_back(relative);
  }
  return table_text(all);
}

}  // namespace

Felt felt_of_file(const std::string& file, const std::vector<std::string>& overrides, const Warn& warn) {
  for (const std::string& change : overrides) {
    require(change.starts_with("felt."), "--set {}: of a result only keys of felt can be set; run the scene again",
            change);
  }
  const auto felt = [&](const auto& result) {
    const Scene scene = read_scene_text(result.scene, file, "", overrides);
    return felt_of(result, scene, scene.felt.value_or(FeltSpec{}));
  };
  return archive_format(file) == kMotionArchive.name() ? felt(read_motion_file(file, warn))
                                                       : felt(read_run_file(file, warn));
}

std::vector<std::string> felt_files(const WriteSpec& write) {
  std::vector<std::string> files = {"felt.csv", "felt_spectrum.csv"};
  if (write.h5) {
    files.emplace_back("felt.h5");
  }
  if (write.vtp) {
    files.emplace_back("felt.vtp");
  }
  if (write.png) {
    files.insert(files.end(), {"felt.png", "felt.html"});
  }
  return files;
}

void write_felt(const Felt& felt, const std::optional<Felt>& against, const WriteSpec& write,
                const RunDirectory& directory) {
  const Json rows = skin_values(felt, against);
  write_text_file(directory.file("felt.csv"), csv_text(rows.front(), rows));
  const Json lines = spectrum_values(felt);
  write_text_file(directory.file("felt_spectrum.csv"), csv_text(lines.front(), lines));
  if (write.h5) {
    write_felt_file(directory.file("felt.h5"), felt);
  }
  if (write.vtp) {
    write_felt_vtp(directory.file("felt.vtp"), felt);
  }
  if (write.png) {
    const std::string picture = felt_picture(felt);
    write_atomically(directory.file("felt.png"), {picture});
    write_text_file(directory.file("felt.html"), felt_page(felt, picture, felt_text(felt, against)));
  }
}

template <class Result>
void add_felt(Result& result, const Scene& scene, const RunDirectory& directory, Progress& progress) {
  if (!scene.felt) {
    return;
  }
  std::vector<std::string> warnings;
  try {
    const Felt felt = timed(progress, "what the skin does", [&] { return felt_of(result, scene, *scene.felt); });
    write_felt(felt, std::nullopt, scene.write, directory);
    warnings = felt.warnings;
  } catch (const std::exception& error) {  // whatever it is, the result is kept
    warnings.push_back(fmt::format("felt_failed: {}", error.what()));
  }
  for (const std::string& warning : warnings) {
    progress.warn(warning);
    result.warnings.push_back(warning);
  }
}
template void add_felt(Run&, const Scene&, const RunDirectory&, Progress&);
template void add_felt(Motion&, const Scene&, const RunDirectory&, Progress&);

Json felt_value(const Felt& felt, const std::optional<Felt>& against, const std::string& directory) {
  return {{"name", felt.name},
          {"directory", directory},
          {"skins", skin_values(felt, against)},
          {"warnings", felt.warnings}};
}

std::string felt_text(const Felt& felt, const std::optional<Felt>& against) {
  std::vector<std::vector<std::string>> table = {{"method", "skin", "moves [um]", "[mm/s]", "P [Pa]", "spread [mm2]",
                                                  "energy sa1 [mJ/m3]", "ra", "pc", "p [dB]", "ra [dB]", "dip [dB]"}};
  const Json rows = skin_values(felt, against);
  const auto number = [](const Json& value, const char* format, double unit = 1.0) {
    return table_number(unit * value.get<double>(), format);
  };
  for (const Json& row : rows) {
    table.push_back({row["method"], row["skin"], number(row["displacement_rms_um"], "{:.3g}"),
                     number(row["velocity_rms_mm_s"], "{:.3g}"), number(row["pressure_rms_pa"], "{:.3g}"),
                     number(row["spread_mm2"], "{:.0f}"), number(row["energy_sa1_j_m3"], "{:.3g}", 1e3),
                     number(row["energy_ra_j_m3"], "{:.3g}", 1e3), number(row["energy_pc_j_m3"], "{:.3g}", 1e3),
                     number(row["p_db"], "{:.1f}"), number(row["ra_db"], "{:.1f}"), number(row["dip_db"], "{:.1f}")});
  }
  return aligned_table(table, {1}) +
         "largest rms on the skin; energy at the depths of receptors; p, ra: displacement weighted by the thresholds "
         "of two channels,\nrelative to " +
         reference_name(felt, against) + "; skin none: the pressure itself\n\n" +
         relative_text(rows, reference_name(felt, against));
}

Job<Felt> felt_job(Felt felt, std::optional<Felt> against, const WriteSpec& write) {
  const auto skin = [](const Felt& one) {
    return std::tuple(one.spec.layers, one.spec.bone, one.spec.shear, one.spec.tan_delta);
  };
  require(!against || skin(felt) == skin(*against),
          "felt: the two results have different skins in their scenes: set felt.layers, bone_mm, shear_kpa and "
          "tan_delta");
  reference_of(against ? *against : felt);
  const std::string name = felt.name;
  std::vector<std::string> files = {"felt.log", "failed.json"};
  std::ranges::copy(felt_files(write), std::back_inserter(files));
  const auto compute = [felt = std::move(felt), against, write](RunDirectory& directory, Progress& progress) {
    std::ranges::for_each(felt.warnings, [&](const std::string& warning) { progress.warn(warning); });
    write_felt(felt, against, write, directory);
    return felt;
  };
  return {name + "-felt", files, compute,
          [against](const Felt& felt, const std::string& directory) { return felt_value(felt, against, directory); },
          [against](const Felt& felt, const Json&, bool) { return felt_text(felt, against); }};
}

}  // namespace touchfield
