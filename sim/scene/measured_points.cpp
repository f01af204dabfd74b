#include "sim/scene/measured_points.h"

#include "sim/core/require.h"
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
  const schema::NumberTable table = schema::read_number_table(
      path, {.known = {{.name = "x_mm", .unit = millimetres, .required = true, .length = true},
                       {.name = "y_mm", .unit = millimetres, .required = true, .length = true},
                       {.name = "z_mm", .unit = millimetres, .required = true, .length = true},
                       {.name = "p_pa", .unit = plain, .range = schema::at_least(0)},
                       {.name = "p_re", .unit = plain},
                       {.name = "p_im", .unit = plain}},
             .rows = "points",
             .most = kMostPoints,
             .most_bytes = kMostBytes});
  const bool complex = table.has("p_re");
  require(complex != table.has("p_pa") && complex == table.has("p_im"),
          "{}: the header must name p_pa, or p_re and p_im", path);
  const auto column = [&](const char* name) {
    const std::vector<double>& values = table.columns.at(name);
    return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  };
  MeasuredPoints measured;
  measured.lines = table.lines;
  measured.complex = complex;
  measured.points.resize(3, static_cast<Eigen::Index>(table.rows()));
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
