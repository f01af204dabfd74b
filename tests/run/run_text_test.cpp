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

TEST(Describe, ATableOfMethodsFitsAScreenOf100Columns) {
  RunData run = full_run();
  for (MethodResult& method : run.methods) {
    for (const MetricField& field : metric_fields()) {
      method.metrics.*field.value = field.share ? 0.999 : 12.34;
    }
    method.metrics.seconds_total = 12345.6;
    method.metrics.force_target_n = 0.0176;
    method.metrics.abs_force_elsewhere_n = 0.00176;
  }
  run.methods.front().name = "unscattered";
  EXPECT_THAT(
      methods_table(run),
      ContainsRegex("\n  unscattered  99.9 %  99.9 % +100 % +12.3 +12.3  17.6 mN  1.76 mN +12.34  12345.6  99.9 %\n"));
  std::istringstream table(methods_table(run));
  for (std::string line; std::getline(table, line);) EXPECT_LE(line.size(), 100U) << line;
}

TEST(Describe, SaysHowChannelsDifferFromTheirDesign) {
  RunData run = full_run();
  EXPECT_THAT(describe_run(run), Not(HasSubstr("true response")));
  run.array_truth = {{Eigen::VectorXd::Constant(6, 0.9), Eigen::VectorXd::Constant(6, 0.1)}, 16};
  run.array_truth->response.gain(0) = 0;
  EXPECT_THAT(describe_run(run),
              AllOf(ContainsRegex("\nresponse +as designed\n"), ContainsRegex("\ntrue phase levels +16\n"),
                    ContainsRegex("\ntrue response +gain 0.900 .- 0.000, phase 5.73 deg rms, 1 of 6 dead\n")));
}
TEST(Report, ItsMethodsSectionSaysWhatWasSolvedWithTheLargestResidualOfEach) {
  RunData run = full_run();
  const auto solved = [](const char* stage, const char* solver, double residual) {
    return SolveRecord{
        .stage = stage, .scheme = "chief", .solver = solver, .precision = "double", .residual = residual};
  };
  run.solves = {solved("transfer", "LU", 1e-15), solved("pressure of focus", "LU", 2e-15), solved("focus", "LU", 3e-14),
                solved("resonance_check", "GMRES, matrix-free", 0.5), solved("evaluation", "GMRES, FFT", 7e-5)};
  EXPECT_THAT(run_report(run),
              AllOf(HasSubstr("boundary elements: the transfer matrix by scheme chief (LU, double precision, largest "
                              "relative residual 1.0e-15); the pressures of the methods by scheme chief (LU, double "
                              "precision, largest relative residual 3.0e-14); the evaluation by scheme chief (GMRES, "
                              "FFT, double precision, largest relative residual 7.0e-05). "),
                    Not(HasSubstr("5.0e-01")), HasSubstr("separate mesh of 80 triangular faces (mean edge")));
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
