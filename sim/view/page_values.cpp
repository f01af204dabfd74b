#include "sim/view/page_values.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <numbers>
#include <utility>

#include <nlohmann/json.hpp>

#include "sim/field/target_parts.h"
#include "sim/pictures/canvas.h"
#include "sim/pictures/figures.h"
#include "sim/pictures/picture_parts.h"
#include "sim/pictures/skin_picture.h"

namespace touchfield {

namespace {

constexpr int kColours = 512;           // of a map
constexpr std::uint16_t kNone = 65535;  // NaN

template <class T>
std::string base64_of(const std::vector<T>& values) {
  return base64({reinterpret_cast<const char*>(values.data()), sizeof(T) * values.size()});
}

Json packed_points(const Points& points) { return packed(points.reshaped()); }

Json packed_faces(const Triangles& faces) {
  if (faces.size() == 0 || faces.maxCoeff() >= kNone) {
    const std::vector<std::uint32_t> wide(faces.data(), faces.data() + faces.size());
    return {{"type", "u32"}, {"data", base64_of(wide)}};
  }
  const std::vector<std::uint16_t> narrow(faces.data(), faces.data() + faces.size());
  return {{"type", "u16"}, {"data", base64_of(narrow)}};
}

/// before   the mesh before it; null: there is none
Json mesh_json(const TriangleMesh& mesh, const TriangleMesh* before) {
  const bool same = before != nullptr && mesh.triangles() == before->triangles();
  return {{"vertices", packed_points(mesh.vertices())}, {"faces", same ? Json() : packed_faces(mesh.triangles())}};
}

/// The phase in steps of 360/256 degrees.
std::string phases_of(const Eigen::VectorXcd& pressure) {
  std::vector<std::uint8_t> steps;
  std::ranges::transform(pressure, std::back_inserter(steps), [](const Complex& p) {
    return static_cast<std::uint8_t>(std::lround(std::arg(p) / (2.0 * std::numbers::pi) * 256.0) & 255);
  });
  return base64_of(steps);
}

/// |p| and its phase; of points that `none` marks there is no value.
Json pressure_json(const Eigen::VectorXcd& pressure, const std::vector<unsigned char>& none) {
  Eigen::VectorXd amplitude = pressure.cwiseAbs();
  for (std::size_t i = 0; i < none.size(); ++i) {
    if (none[i] != 0) {
      amplitude(static_cast<Eigen::Index>(i)) = kNotComputed;
    }
  }
  return {{"p", packed(amplitude)}, {"phase", phases_of(pressure)}};
}

/// The target cut out of the faces along its border: triangles one behind another, with a wanted |p| each.
Json wanted_json(const TriangleMesh& mesh, const Target& target) {
  std::vector<Vector3> corners;
  std::vector<double> values;
  const auto add = [&](const std::vector<Vector3>& polygon, double value) {
    for (std::size_t i = 1; i + 1 < polygon.size(); ++i) {
      corners.insert(corners.end(), {polygon[0], polygon[i], polygon[i + 1]});
      values.push_back(value);
    }
  };
  std::vector<TargetBox> cut;
  std::ranges::copy_if(target.boxes, std::back_inserter(cut),
                       [](const TargetBox& box) { return box.shape != TargetShape::kMask; });
  const std::vector<FacePart> parts = face_parts(mesh, cut);
  for (Eigen::Index k = 0; k < target.size(); ++k) {
    const Eigen::Index face = target.faces[static_cast<std::size_t>(k)];
    const auto own = std::ranges::equal_range(parts, face, {}, &FacePart::face);
    for (const FacePart& part : own) {
      add(part.corners, target.amplitudes(k));
    }
    if (own.empty()) {
      add({mesh.corner(face, 0), mesh.corner(face, 1), mesh.corner(face, 2)}, target.amplitudes(k));
    }
  }
  Points points(3, static_cast<Eigen::Index>(corners.size()));
  for (std::size_t i = 0; i < corners.size(); ++i) {
    points.col(static_cast<Eigen::Index>(i)) = corners[i];
  }
  return {{"corners", packed_points(points)},
          {"p", packed(Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size())))},
          {"most", target.amplitudes.maxCoeff()}};
}

/// 5 mm, or 0.45 times the least distance between two transducers if that is less.
double transducer_radius(const TransducerArray& array) {
  constexpr double kMostRadius = 5e-3;  // [m]
  constexpr double kOfDistance = 0.45;
  double radius = kMostRadius;
  for (Eigen::Index n = 1; n < array.size(); ++n) {
    const Points between = array.positions.leftCols(n).colwise() - array.positions.col(n);
    radius = std::min(radius, kOfDistance * std::sqrt(between.colwise().squaredNorm().minCoeff()));
  }
  return radius;
}

Json array_json(const TransducerArray& array) {
  return {{"positions", packed_points(array.positions)},
          {"axes", packed_points(array.axes)},
          {"radius", transducer_radius(array)}};
}

Json vector_json(const Vector3& vector) { return {vector.x(), vector.y(), vector.z()}; }

Json field_json(const FieldResult& field, const std::vector<ViewMethod>& methods) {
  Json values = Json::array();
  for (const ViewMethod& method : methods) {
    const auto own = std::ranges::find(field.pressure, method.name, [](const auto& entry) { return entry.first; });
    values.push_back(own == field.pressure.end() ? Json() : pressure_json(own->second, field.inside));
  }
  return {{"name", field.grid.name},
          {"origin", vector_json(field.grid.origin)},
          {"spacing", vector_json(field.grid.spacing)},
          {"count", field.grid.count},
          {"methods", values}};
}

/// Of values from -1 to 1, then of phases from -180 to 180 degrees: red, green, blue.
std::string colour_maps() {
  std::vector<std::uint8_t> bytes;
  for (int i = 0; i < kColours; ++i) {
    std::ranges::copy(skin_colour(2.0 * (i + 0.5) / kColours - 1.0), std::back_inserter(bytes));
  }
  for (int i = 0; i < kColours; ++i) {
    for (int channel = 0; channel < 3; ++channel) {
      const double angle = 2.0 * std::numbers::pi * (static_cast<double>(i) / kColours - channel / 3.0);
      bytes.push_back(static_cast<std::uint8_t>(std::lround(150.0 + 85.0 * std::cos(angle))));
    }
  }
  return base64_of(bytes);
}

std::string quantity_key(std::size_t number) { return "own" + std::to_string(number); }

/// Of the page's own quantities; the ends of their colours are in SI units.
Json quantities_json(const ViewSkin& skin) {
  Json json = Json::array();
  for (std::size_t q = 0; q < skin.quantities.size(); ++q) {
    const ViewQuantity& own = skin.quantities[q];
    json.push_back({{"key", quantity_key(q)},
                    {"name", own.name},
                    {"unit", own.unit},
                    {"scale", own.factor},
                    {"top", skin_bar("", 0.0, own.values).top}});
  }
  return json;
}

Json curve_json(const ViewCurve& curve) {
  return {{"label", curve.label}, {"line", curve.line}, {"times", curve.times}, {"values", curve.values}};
}

}  // namespace

std::string base64(std::string_view bytes) {
  constexpr const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    unsigned three = 0;
    for (std::size_t k = i; k < i + 3; ++k) {
      three = three << 8U | (k < bytes.size() ? static_cast<unsigned char>(bytes[k]) : 0U);
    }
    for (std::size_t digit = 0; digit < 4; ++digit) {
      text += i + digit > bytes.size() ? '=' : kDigits[three >> (18U - 6U * digit) & 63U];
    }
  }
  return text;
}

Json packed(const Eigen::Ref<const Eigen::VectorXd>& values) {
  double low = 0.0;
  double high = 0.0;
  bool first = true;
  for (const double value : values) {
    if (!std::isnan(value)) {
      low = first ? value : std::min(low, value);
      high = first ? value : std::max(high, value);
      first = false;
    }
  }
  const double scale = high > low ? (kNone - 1) / (high - low) : 0.0;
  std::vector<std::uint16_t> steps;
  std::ranges::transform(values, std::back_inserter(steps), [&](double value) {
    return std::isnan(value) ? kNone : static_cast<std::uint16_t>(std::lround((value - low) * scale));
  });
  return {{"type", "packed"}, {"low", low}, {"high", high}, {"data", base64_of(steps)}};
}

Json skin_json(const ViewSkin& skin, const TriangleMesh* before, const TriangleMesh* sensed_before) {
  Json json = mesh_json(skin.mesh, before);
  json["time"] = skin.time;
  if (skin.sensed) {
    json["sensed"] = mesh_json(*skin.sensed, sensed_before);
  }
  if (skin.target && skin.target->size() > 0) {
    json["outline"] = packed_points(target_outline(skin.mesh, *skin.target));
    json["wanted"] = wanted_json(skin.mesh, *skin.target);
  } else if (skin.border.cols() > 0) {
    json["outline"] = packed_points(skin.border);
  }
  json["methods"] = Json::array();
  for (std::size_t m = 0; m < skin.pressure.size(); ++m) {
    Json values = skin.pressure[m].size() == 0 ? Json() : pressure_json(skin.pressure[m], {});
    if (!values.is_null() && m < skin.radiation.size() && skin.radiation[m].size() != 0) {
      values["radiation"] = packed(skin.radiation[m]);
    }
    json["methods"].push_back(std::move(values));
  }
  for (std::size_t q = 0; q < skin.quantities.size(); ++q) {
    for (std::size_t m = 0; m < skin.quantities[q].values.size(); ++m) {
      json["methods"][m][quantity_key(q)] = packed(skin.quantities[q].values[m]);
    }
  }
  return json;
}

Json tops_json(const std::vector<ViewSkin>& skins, double radiation_per_square) {
  double wanted = 0.0;
  std::vector<Eigen::VectorXd> amplitudes;
  std::vector<Eigen::VectorXd> radiations;
  for (const ViewSkin& skin : skins) {
    wanted = std::max(wanted, skin.target && skin.target->size() > 0 ? skin.target->amplitudes.maxCoeff() : 0.0);
    std::ranges::transform(skin.pressure, std::back_inserter(amplitudes), [](const auto& p) { return p.cwiseAbs(); });
    std::ranges::copy(skin.radiation, std::back_inserter(radiations));
  }
  Json tops = {{"pressure", skin_bar("", wanted, amplitudes).top}};
  if (!std::isnan(radiation_per_square)) {
    tops["radiation"] = skin_bar("", radiation_per_square * wanted * wanted, radiations).top;
  }
  return tops;
}

Json page_json(const ViewData& data, const std::string& live) {
  const bool has_array = data.array.kind == TransducerArray::Kind::kTransducers && data.array.size() > 0;
  Json json = {{"title", data.title},
               {"live", live.empty() ? Json() : Json(live)},
               {"maps", colour_maps()},
               {"tops", tops_json(data.skins, data.radiation_per_square)},
               {"array", has_array ? array_json(data.array) : Json()},
               {"methods", Json::array()},
               {"skins", Json::array()},
               {"fields", Json::array()},
               {"curves", Json::array()}};
  if (!std::isnan(data.radiation_per_square)) {
    json["radiation_per_square"] = data.radiation_per_square;
  }
  if (!data.skins.empty() && !data.skins.front().quantities.empty()) {
    json["quantities"] = quantities_json(data.skins.front());
  }
  for (const ViewMethod& method : data.methods) {
    json["methods"].push_back(Json{{"name", method.name}, {"caption", method.caption}});
  }
  const TriangleMesh* mesh = nullptr;
  const TriangleMesh* sensed = nullptr;
  for (const ViewSkin& skin : data.skins) {
    json["skins"].push_back(skin_json(skin, mesh, sensed));
    mesh = &skin.mesh;
    sensed = skin.sensed ? &*skin.sensed : sensed;
  }
  const Vector3 middle =
      data.skins.empty() ? Vector3::Zero() : Vector3(data.skins.front().mesh.centroids().rowwise().mean());
  json["facing"] = vector_json(facing(data.array, middle));
  for (const FieldResult& field : data.fields) {
    if (is_plane(field.grid)) {
      json["fields"].push_back(field_json(field, data.methods));
    }
  }
  std::ranges::transform(data.curves, std::back_inserter(json["curves"]), curve_json);
  return json;
}

}  // namespace touchfield
