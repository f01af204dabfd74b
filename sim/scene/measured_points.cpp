#include "sim/scene/measured_points.h"

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/scene/number_table.h"

namespace touchfield {

namespace {

constexpr std::size_t kMostPoints = 1'000'000;  // a robot scans what nobody would type
constexpr std::size_t kMostBytes = std::size_t{64} << 20U;

}  // namespace

MeasuredPoints read_measured_points(const std::string& path) {
  using schema::Unit;
  const Unit millimetres = Unit::power_of_ten(-3);
  const Unit plain = Unit::power_of_ten(0);
  const schema::TableForm form = {.known = {{"x_mm", millimetres, {}, true},
                                            {"y_mm", millimetres, {}, true},
                                            {"z_mm", millimetres, {}, true},
                                            {"p_pa", plain, schema::at_least(0)},
                                            {"p_re", plain},
                                            {"p_im", plain}},
                                  .rows = "points",
                                  .most = kMostPoints};
  schema::Reading reading(path, {});
  const schema::Node nowhere;
  const schema::Input in(nowhere, "", reading);
  schema::FileReport report(in, path, kMostBytes);
  const auto table = schema::read_number_table(report, form);
  const bool complex = table && table->has("p_re");
  if (table && (complex == table->has("p_pa") || complex != table->has("p_im"))) {
    report.add("the header must name p_pa, or p_re and p_im");
  }
  if (report.failed()) {
    throw InputError(reading.message());
  }
  const auto column = [&](const char* name) {
    const std::vector<double>& values = table->columns.at(name);
    return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  };
  MeasuredPoints measured;
  measured.lines = table->lines;
  measured.complex = complex;
  measured.points.resize(3, static_cast<Eigen::Index>(table->rows()));
  measured.points.row(0) = column("x_mm").transpose();
  measured.points.row(1) = column("y_mm").transpose();
  measured.points.row(2) = column("z_mm").transpose();
  measured.pressure = (complex ? column("p_re") : column("p_pa")).cast<Complex>();
  if (complex) {
    measured.pressure += Complex(0, 1) * column("p_im");
  }
  return measured;
}

}  // namespace touchfield
