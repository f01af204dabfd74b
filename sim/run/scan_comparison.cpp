#include "sim/run/scan_comparison.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/clearance.h"
#include "sim/run/evaluate_methods.h"
#include "sim/run/text_table.h"

namespace touchfield {

namespace {

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

Run run_of_method(Run run, const std::string& method) {
  const auto found = std::ranges::find(run.methods, method, &MethodResult::name);
  require(found != run.methods.end(), "method {}: the run has no method of that name", method);
  run.methods = {MethodResult(*found)};
  return run;
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

/// throws   InputError if all of one of the two are 0
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
  if (!complex) {
    const auto without_mean = [](const Eigen::VectorXcd& p) {
      const Eigen::VectorXd size = p.cwiseAbs();
      return Eigen::VectorXd(size.array() - size.mean());
    };
    const Eigen::VectorXd left = without_mean(computed);
    const Eigen::VectorXd wanted_left = without_mean(measured);
    fit.about_means = left.dot(wanted_left) / (left.norm() * wanted_left.norm());
  }
  fit.relative = (complex ? (factor * computed - measured).norm()
                          : (factor.real() * computed.cwiseAbs() - measured.cwiseAbs()).norm()) /
                 wanted;
  return fit;
}

}  // namespace

ScanComparison compare_scan(const Run& run, const Wave& wave, const std::string& method,
                            const MeasuredPoints& measured) {
  const Eigen::VectorXcd reading = run_field(run_of_method(run, method), wave, measured.points).pressure;
  const TriangleMesh& mesh = evaluated_mesh(run);
  const std::vector<PointClearance> clearances = point_clearances(mesh, measured.points);
  ScanComparison comparison;
  for (Eigen::Index j = 0; j < measured.points.cols(); ++j) {
    const auto place = static_cast<std::size_t>(j);
    const Complex computed = reading(j);
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

std::vector<bool> clear_points(const Run& run, const Points& points) {
  const TriangleMesh& mesh = evaluated_mesh(run);
  std::vector<bool> clear;
  for (const PointClearance& clearance : point_clearances(mesh, points)) {
    clear.push_back(fault_of(mesh, clearance, 0.0).empty());
  }
  return clear;
}

Json scan_value(const ScanComparison& comparison, bool complex) {
  const ScanFit& fit = comparison.fit;
  const bool conjugate = comparison.conjugate_correlation > fit.correlation;
  return {
      {"complex", complex},
      {"used", comparison.used},
      {"measured_points", comparison.points.size()},
      {"scale", fit.scale},
      {"turn_rad", fit.turn},
      {"relative", fit.relative},
      {"largest_relative", comparison.largest_relative},
      {"largest_line", comparison.points[comparison.largest].line},
      {"correlation", fit.correlation},
      {"correlation_about_means", fit.about_means},
      {"conjugate_correlation", comparison.conjugate_correlation},
      {"note", conjugate ? "the conjugate of what was measured fits better: phases here follow exp(-i omega t)" : ""}};
}

Json scan_points(const ScanComparison& comparison, bool complex, bool only_left_out) {
  const auto value = [&](const Complex& p) { return complex ? Json::array({p.real(), p.imag()}) : Json(p.real()); };
  Json points = Json::array();
  for (const ScanPoint& point : comparison.points) {
    const bool counts = point.left_out.empty();
    const Vector3 at = point.at / kMillimetre;
    if (!counts || !only_left_out) {
      points.push_back(Json{{"line", point.line},
                            {"at_mm", std::vector<double>(at.begin(), at.end())},
                            {"measured", value(point.measured)},
                            {"computed", counts ? value(point.computed) : Json()},
                            {"difference", counts ? Json(point.difference) : Json()},
                            {"left_out", point.left_out}});
    }
  }
  return points;
}

void write_scan_csv(const std::string& path, const ScanComparison& comparison, bool complex) {
  Json rows = Json::array();
  for (const ScanPoint& point : comparison.points) {
    const bool counts = point.left_out.empty();
    Json row = {{"line", point.line},
                {"x_mm", point.at.x() / kMillimetre},
                {"y_mm", point.at.y() / kMillimetre},
                {"z_mm", point.at.z() / kMillimetre}};
    for (const auto& [name, value] :
         {std::pair{"measured", point.measured},
          std::pair{"computed", counts ? point.computed : Complex(kNotComputed, kNotComputed)}}) {
      row[name + std::string(complex ? "_re" : "")] = value.real();
      if (complex) {
        row[name + std::string("_im")] = value.imag();
      }
    }
    row.update({{"difference", counts ? point.difference : kNotComputed}, {"left_out", point.left_out}});
    rows.push_back(row);
  }
  write_text_file(path, csv_text(rows.front(), rows));
}

}  // namespace touchfield
