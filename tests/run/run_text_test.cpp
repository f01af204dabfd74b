#include "sim/run/run_text.h"

#include <nlohmann/json.hpp>

#include "sim/run/text_table.h"
#include "tests/support/output_support.h"
#include "tests/support/testing.h"

namespace touchfield::run_text_test {

TEST(Describe, SaysWhatThereIs) {
  const std::string text = describe_run(full_run());
  for (const char* part :
       {"complete          yes", "faces 48, vertices 35, area 24 cm2", "6 transducers", "t4010a1",
        "target faces      3\n", "2000 Pa", "surface", "paper-2", "35.0 %", "stalled", "direct", "side 5 x 1 x 4",
        "0123456789ab", "coarse mesh", "evaluation        edge\n", "evaluation scheme burton_miller_polished\n",
        "faces 80, vertices", "resonance check   1.25 %\n"}) {
    EXPECT_THAT(text, HasSubstr(part));
  }
  EXPECT_THAT(text,
              ContainsRegex("  pressure +burton_miller_polished +GMRES, matrix-free .*single refined +10,842 +3 +14 "
                            "+2 +3.1e-06 +yes +1.25\n"));
  EXPECT_THAT(text, ContainsRegex("  evaluation +chief +LU +.*double +80 +1 +0 +0 +- +no +0.333\n"));
  EXPECT_THAT(text, Not(HasSubstr(" nan")));
}

/// A run at a frequency with fields of one point.
RunData with_points(double frequency) {
  RunData run = full_run();
  run.frequency = frequency;
  for (const auto& [name, inside] : {std::pair{"left_ear", 0}, std::pair{"lost", 1}}) {
    FieldResult field{{name, Vector3(0, 0, 0.5), Vector3::Ones(), {1, 1, 1}}, {static_cast<unsigned char>(inside)}, {}};
    field.pressure.emplace_back("surface", Eigen::VectorXcd::Constant(1, Complex(0.0, inside != 0 ? 0.0 : 20.0)));
    run.fields.push_back(field);
  }
  return run;
}

TEST(Levels, AreOfFieldsOfOnePointBesideTheLimitsOfTheirBand) {
  const std::string text = levels_text(with_points(40e3));
  EXPECT_THAT(text, ContainsRegex("left_ear +surface +20 +117\n"));
  EXPECT_THAT(text, ContainsRegex("lost +surface +- +-\n"));
  EXPECT_THAT(text, ContainsRegex("INIRC-IRPA 1984 +public +100\n"));
  EXPECT_THAT(text, HasSubstr("band of 40 kHz; no assessment of safety"));
  EXPECT_THAT(text, Not(HasSubstr("side")));  // a plane
  EXPECT_THAT(describe_run(with_points(40e3)), ContainsRegex("left_ear +surface +20 +117\n"));
  const std::string high = levels_text(with_points(150e3));
  EXPECT_THAT(high, AllOf(HasSubstr("no published limit is known here for 150 kHz"), Not(HasSubstr("INIRC"))));
}

TEST(MetricsCsv, OneLineAMethodAndQuotesWhereTheyAreNeeded) {
  const TemporaryDirectory directory;
  const std::string path = directory.file("metrics.csv");
  RunData run = full_run();
  run.methods[0].scheme = "chief, 3 \"points\"";
  run.methods[1].metrics.relative_error = -kNotComputed;
  write_metrics_csv(path, run);
  std::istringstream lines(read_bytes(path));
  std::string header;
  std::string first;
  std::string second;
  std::string rest;
  ASSERT_TRUE(std::getline(lines, header) && std::getline(lines, first) && std::getline(lines, second));
  EXPECT_FALSE(std::getline(lines, rest));
  std::string expected = "name,method,scheme";
  for (const MetricField& field : metric_fields()) expected += std::string(",") + field.name;
  EXPECT_EQ(header, expected + ",status");
  EXPECT_THAT(first, AllOf(StartsWith("surface,paper,\"chief, 3 \"\"points\"\"\",0.35,nan,"), EndsWith(",stalled")));
  EXPECT_THAT(second, StartsWith("paper-2,paper,chief,nan,nan,"));
}

}  // namespace touchfield::run_text_test
