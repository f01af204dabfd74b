#include <nlohmann/json.hpp>

#include "sim/view/page_values.h"
#include "sim/view/view_felt.h"
#include "sim/view/view_page.h"
#include "tests/support/felt_support.h"
#include "tests/support/output_support.h"
#include "tests/support/testing.h"

namespace touchfield::page_test {

/// The bytes of a text in base64, decoded without a table.
std::string decoded(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bits;
  for (const char c : text) {
    for (int bit = 5; bit >= 0 && c != '='; --bit) {
      bits += (digits.find(c) >> static_cast<unsigned>(bit)) % 2 == 1 ? '1' : '0';
    }
  }
  std::string bytes;
  for (std::size_t i = 0; i + 8 <= bits.size(); i += 8) {
    bytes += static_cast<char>(std::stoi(bits.substr(i, 8), nullptr, 2));
  }
  return bytes;
}

std::vector<unsigned> steps_of(const Json& json) {
  const std::string bytes = decoded(json["data"]);
  std::vector<unsigned> steps;
  for (std::size_t i = 0; i < bytes.size(); i += 2) {
    steps.push_back(static_cast<unsigned char>(bytes[i]) + 256U * static_cast<unsigned char>(bytes[i + 1]));
  }
  return steps;
}

Eigen::VectorXd unpacked(const Json& json) {
  const double low = json["low"];
  const double high = json["high"];
  const std::vector<unsigned> steps = steps_of(json);
  Eigen::VectorXd values(static_cast<Eigen::Index>(steps.size()));
  for (std::size_t i = 0; i < steps.size(); ++i) {
    values(static_cast<Eigen::Index>(i)) = low + (high - low) * steps[i] / 65534.0;
  }
  return values;
}

TEST(Page, PackedValuesAreWithinHalfAStep) {
  const Eigen::VectorXd values = Eigen::VectorXd::LinSpaced(1001, -3.0, 17.0).array().cube();
  const Json json = packed(values);
  EXPECT_LE((unpacked(json) - values).cwiseAbs().maxCoeff(), (values.maxCoeff() - values.minCoeff()) / 131067.0);
  EXPECT_EQ(unpacked(packed(Eigen::VectorXd::Constant(3, 2.5))), Eigen::VectorXd::Constant(3, 2.5));
  EXPECT_THAT(steps_of(packed(Eigen::Vector3d(1.0, kNotComputed, 2.0))), ElementsAre(0U, 65535U, 65534U));
  EXPECT_EQ(packed(Eigen::VectorXd())["data"], "");
}

TEST(Page, WantedPressureEndsAtTheTargetsBorder) {
  ViewSkin skin{.mesh = sheet(7, 5, 0.01)};
  skin.target = make_target(skin.mesh, {{.centre = Vector3(0.003, 0.002, 0.2), .size = Vector3(0.023, 0.017, 0.01)}},
                            TargetProfile::kUniform, 2000.0);
  const Json wanted = skin_json(skin)["wanted"];
  const Points corners = unpacked(wanted["corners"]).reshaped(3, unpacked(wanted["corners"]).size() / 3);
  double area = 0.0;
  for (Eigen::Index i = 0; i < corners.cols(); i += 3) {
    const Vector3 first = corners.col(i + 1) - corners.col(i);
    const Vector3 second = corners.col(i + 2) - corners.col(i);
    area += 0.5 * first.cross(second).norm();
  }
  EXPECT_NEAR(area, 0.023 * 0.017, 1e-3 * area);
  EXPECT_EQ(unpacked(wanted["p"]), Eigen::VectorXd::Constant(corners.cols() / 3, 2000.0));
}

TEST(Page, ShowsTheSkinThatMetricsAreOf) {
  RunData run = bare_run(sheet(3, 2, 0.01));
  run.methods.push_back(made_up_method("own", run, 0.5));
  EXPECT_EQ(run_view(run).skins.front().mesh.face_count(), run.mesh.face_count());
  run.evaluation_model = EvaluationModel{.scheme = "burton_miller", .mesh = sheet(6, 4, 0.005), .target = {}};
  run.methods.front().evaluation_pressure = Eigen::VectorXcd::Constant(run.evaluation_model->mesh.face_count(), 7.0);
  const ViewData data = run_view(run);
  EXPECT_EQ(data.skins.front().mesh.face_count(), run.evaluation_model->mesh.face_count());
  EXPECT_EQ(data.skins.front().pressure.front(), run.methods.front().evaluation_pressure);
}

TEST(Page, OfTheSkinHasQuantitiesOfItsOwn) {
  const Felt felt = made_up_felt({{"one", 10.0}, {"two", 5.0}});
  const Json json = page_json(felt_view(felt), "");
  const std::vector<std::string> units = {"Pa", "um", "um", "um"};
  ASSERT_EQ(json["quantities"].size(), units.size());
  const Json& methods = json["skins"][0]["methods"];
  for (std::size_t q = 0; q < units.size(); ++q) {
    const Json& own = json["quantities"][q];
    EXPECT_EQ(own["unit"], units[q]);
    const Eigen::VectorXd wanted = q == 0 ? radiation_on_skin(felt, felt.methods[1])
                                          : map_on_skin(felt, felt.methods[1].skins[q - 1].displacement);
    const Eigen::VectorXd found = unpacked(methods[1][own["key"].get<std::string>()]);
    for (Eigen::Index f = 0; f < wanted.size(); ++f) {
      if (!std::isnan(wanted(f))) {
        EXPECT_NEAR(found(f), wanted(f), 1e-5 * own["top"].get<double>());
      }
    }
  }
  const std::vector<unsigned> steps = steps_of(methods[0]["own0"]);
  EXPECT_EQ(std::ranges::count(steps, 65535U), felt.mesh.face_count() - felt.patch.size());
  EXPECT_FALSE(json["skins"][0]["outline"].is_null());
}

TEST(Page, NamesCannotEndTheScript) {
  ViewData data{.title = "</script><b>\"&", .methods = {{"<i>", "</script>"}}, .array = {}, .skins = {}};
  const std::string page = view_page(data, "", "");
  EXPECT_THAT(page, HasSubstr("<h1>&lt;/script>&lt;b>&quot;&amp;</h1>"));
  std::size_t ends = 0;
  for (std::size_t at = page.find("</script>"); at != std::string::npos; at = page.find("</script>", at + 1)) {
    ++ends;
  }
  EXPECT_EQ(ends, 2U);
  EXPECT_THAT(page, Not(HasSubstr("http:")));
  EXPECT_THAT(page, Not(HasSubstr("https:")));
}

}  // namespace touchfield::page_test
