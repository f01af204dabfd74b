#include "sim/assess/scan_comparison.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/place_text.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/mesh/query/clearance.h"
#include "sim/solve/run_field.h"
#include "sim/store/run_file.h"
#include "sim/store/text_table.h"

namespace touchfield {

namespace {

double longest_edge(const TriangleMesh& mesh, Eigen::Index face) {
  double longest = 0.0;
  for (int c = 0; c < 3; ++c) {
    longest = std::max(longest, (mesh.corner(face, c) - mesh.corner(face, (c + 1) % 3)).norm());
  }
  return longest;
}

/// Why a point does not count; empty if it does.
std::string fault_of(const TriangleMesh& mesh, const PointClearance& clearance, const Complex& computed) {
  if (clearance.inside) {
    return "inside the body";
  }
  const double edge = longest_edge(mesh, clearance.face);
  if (clearance.distance < edge) {
    return fmt::format("{:.2f} mm from the skin, nearer than the edge of {:.2f} mm there",
                       clearance.distance / kMillimetre, edge / kMillimetre);
  }
  return std::isfinite(std::abs(computed)) ? "" : "on a transducer";
}

Eigen::VectorXcd picked(const std::vector<ScanPoint>& points, Complex ScanPoint::*value) {
  Eigen::VectorXcd values(static_cast<Eigen::Index>(points.size()));
  Eigen::Index used = 0;
  for (const ScanPoint& point : points) {
    if (point.left_out.empty()) {
      values(used++) = point.*value;
    }
  }
  return values.head(used);
}

/// Scales what was computed and finds where it differs most.
void apply_fit(ScanComparison& comparison, bool complex) {
  const Complex factor = std::polar(comparison.fit.scale, complex ? comparison.fit.turn : 0.0);
  double loudest = 0.0;
  double largest = -1.0;
  for (std::size_t i = 0; i < comparison.points.size(); ++i) {
    ScanPoint& point = comparison.points[i];
    if (!point.left_out.empty()) {
      continue;
    }
    point.computed *= factor;
    point.difference = std::abs(point.computed - point.measured);
    loudest = std::max(loudest, std::abs(point.measured));
    if (point.difference > largest) {
      largest = point.difference;
      comparison.largest = i;
    }
  }
  comparison.largest_relative = largest / loudest;
}

}  // namespace

ScanFit fit_scan(const Eigen::VectorXcd& computed, const Eigen::VectorXcd& measured, bool complex) {
  const double length = computed.norm();
  const double wanted = measured.norm();
  if (!(length > 0) || !(wanted > 0)) {
    throw InputError(fmt::format("the {} pressure is 0 at every point, there is nothing to fit",
                                 length > 0 ? "measured" : "computed"));
  }
  const Complex product = complex ? computed.dot(measured) : Complex(computed.cwiseAbs().dot(measured.cwiseAbs()));
  ScanFit fit;
  fit.scale = std::abs(product) / (length * length);
  fit.turn = complex ? std::arg(product) : kNotComputed;
  fit.correlation = std::abs(product) / (length * wanted);
  const Complex factor = product / (length * length);
  fit.relative = (complex ? (factor * computed - measured).norm()
                          : (factor.real() * computed.cwiseAbs() - measured.cwiseAbs()).norm()) /
                 wanted;
  return fit;
}

ScanComparison compare_scan(Run run, const Wave& wave, const std::string& method, const MeasuredPoints& measured) {
  const auto found = std::ranges::find(run.methods, method, &MethodResult::name);
  require(found != run.methods.end(), "method {}: the run has no method of that name", method);
  run.methods = {MethodResult(*found)};
  const FieldValues field = run_field(run, wave, measured.points);
  const TriangleMesh& mesh = field_mesh(run);
  const std::vector<PointClearance> clearances = point_clearances(mesh, measured.points);
  ScanComparison comparison;
  for (Eigen::Index j = 0; j < measured.points.cols(); ++j) {
    const auto place = static_cast<std::size_t>(j);
    const Complex computed = field.pressure(j, 0);
    comparison.points.push_back({measured.lines[place], measured.points.col(j), measured.pressure(j),
                                 measured.complex ? computed : Complex(std::abs(computed)), 0.0,
                                 fault_of(mesh, clearances[place], computed)});
    comparison.used += comparison.points.back().left_out.empty() ? 1U : 0U;
  }
  if (comparison.used < 2) {
    throw InputError(fmt::format("{} of {} measured points can be compared, there must be two; the first is {}",
                                 comparison.used, comparison.points.size(), comparison.points.front().left_out));
  }
  const Eigen::VectorXcd computed = picked(comparison.points, &ScanPoint::computed);
  const Eigen::VectorXcd wanted = picked(comparison.points, &ScanPoint::measured);
  comparison.fit = fit_scan(computed, wanted, measured.complex);
  if (measured.complex) {
    comparison.conjugate_correlation = fit_scan(computed, wanted.conjugate(), true).correlation;
  }
  apply_fit(comparison, measured.complex);
  return comparison;
}

std::string describe_scan(const ScanComparison& comparison, bool complex) {
  constexpr std::size_t kNamed = 20;
  const ScanFit& fit = comparison.fit;
  const ScanPoint& worst = comparison.points[comparison.largest];
  const std::size_t left_out = comparison.points.size() - comparison.used;
  std::string text = fmt::format("{:<12} {} of {}, {}\n", "points", comparison.used, comparison.points.size(),
                                 complex ? "complex" : "magnitudes");
  text += fmt::format("{:<12} {:.6g}, measured over computed\n", "scale", fit.scale);
  if (complex) {
    text += fmt::format("{:<12} {:.6g} deg, measured ahead of computed\n", "turn", fit.turn * 180 / std::numbers::pi);
  }
  text += fmt::format("{:<12} {:.3g} % (L2)\n", "difference", 100 * fit.relative);
  text += fmt::format("{:<12} {:.3g} % of the largest measured, at {}, line {}\n", "largest",
                      100 * comparison.largest_relative, place_text(worst.at, 1), worst.line);
  text += fmt::format("{:<12} {:.6g}\n", "correlation", fit.correlation);
  if (comparison.conjugate_correlation > fit.correlation) {
    text += fmt::format(
        "{:<12} the conjugate of what was measured fits better, correlation {:.6g}: phases here follow "
        "exp(-i omega t)\n",
        "note", comparison.conjugate_correlation);
  }
  std::size_t named = 0;
  for (const ScanPoint& point : comparison.points) {
    if (!point.left_out.empty() && named++ < kNamed) {
      text += fmt::format("{:<12} line {}, {}: {}\n", "left out", point.line, place_text(point.at, 1), point.left_out);
    }
  }
  return left_out <= kNamed ? text : text + fmt::format("{:<12} and {} more\n", "left out", left_out - kNamed);
}

void write_scan_csv(const std::string& path, const ScanComparison& comparison, bool complex) {
  const std::vector<std::string> values =
      complex ? std::vector<std::string>{"measured_re", "measured_im", "computed_re", "computed_im"}
              : std::vector<std::string>{"measured", "computed"};
  std::vector<std::string> header = {"line", "x_mm", "y_mm", "z_mm"};
  header.insert(header.end(), values.begin(), values.end());
  header.insert(header.end(), {"difference", "left_out"});
  std::string text = csv_line(header);
  for (const ScanPoint& point : comparison.points) {
    const bool counts = point.left_out.empty();
    const Complex computed = counts ? point.computed : Complex(kNotComputed, kNotComputed);
    std::vector<std::string> row = {fmt::to_string(point.line)};
    for (const double metres : point.at) {
      row.push_back(csv_number(metres / kMillimetre));
    }
    for (const Complex& value : {point.measured, computed}) {
      row.push_back(csv_number(value.real()));
      if (complex) {
        row.push_back(csv_number(value.imag()));
      }
    }
    row.push_back(csv_number(counts ? point.difference : kNotComputed));
    row.push_back(point.left_out);
    text += csv_line(row);
  }
  write_text_file(path, text);
}

}  // namespace touchfield
