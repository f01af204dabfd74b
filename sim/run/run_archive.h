#pragma once

#include <algorithm>
#include <cstdint>
#include <functional>
#include <iterator>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sim/core/errors.h"
#include "sim/run/archive_file.h"
#include "sim/run/hdf5_file.h"
#include "sim/run/run_data.h"

/// Two classes of one interface: attributes by name and value, datasets by name, values and unit. The content of a
/// group of a file is thus stated once for writing and reading.
namespace touchfield {

/// A text that stands for a value, and the value.
template <class Value>
using Choices = std::vector<std::pair<std::string, Value>>;

using StageSeconds = std::vector<std::pair<std::string, double>>;

/// What a member pointer or a function makes of a record: a reference to a value of this type.
template <class Record, class Access>
using PartOf = std::remove_cvref_t<std::invoke_result_t<const Access&, Record&>>;

/// What a number of a record is stored as.
template <class Value>
using StoredNumber = std::conditional_t<std::is_same_v<Value, double>, double, std::int64_t>;

/// Shape of values on a grid, z slowest.
inline hdf5::Shape grid_shape(const FieldGrid& grid) {
  return {static_cast<std::uint64_t>(grid.count[2]), static_cast<std::uint64_t>(grid.count[1]),
          static_cast<std::uint64_t>(grid.count[0])};
}

class GroupWriter : public hdf5::Group {
 public:
  static constexpr bool kReads = false;

  explicit GroupWriter(hdf5::Group group) : Group(std::move(group)) {}

  template <class Value>
  void attribute(const std::string& name, const Value& value) const {
    set_attribute(name, value);
  }
  /// One that may be missing: of older files, or a list that is empty.
  template <class Value>
  void later_attribute(const std::string& name, const Value& value) const {
    if constexpr (std::is_same_v<Value, std::vector<std::string>>) {
      if (value.empty()) {
        return;
      }
    }
    set_attribute(name, value);
  }
  template <class Value>
  void choice(const std::string& name, const Value& value, const Choices<Value>& choices) const {
    set_attribute(name, std::ranges::find(choices, value, &Choices<Value>::value_type::second)->first);
  }
  /// How long stages took, an attribute each, and their order.
  void stages(const std::string& prefix, const StageSeconds& seconds) const {
    std::vector<std::string> names;
    for (const auto& [stage, value] : seconds) {
      names.push_back(stage);
      if (!has_attribute(prefix + stage)) {  // a metric of that name says the same: check_run
        set_attribute(prefix + stage, value);
      }
    }
    later_attribute("stages", names);
  }

  template <class List>
  void list(const std::string& name, const List& values, const char* unit) const {
    write(name, values.data(), {static_cast<std::uint64_t>(values.size())}, unit);
  }
  /// One that is left out where it is empty.
  template <class List>
  void optional_list(const std::string& name, const List& values, const char* unit) const {
    if (values.size() != 0) {
      list(name, values, unit);
    }
  }
  /// 3 x n as [n, 3].
  template <class Columns>
  void columns(const std::string& name, const Columns& values, const char* unit) const {
    write(name, values.data(), {static_cast<std::uint64_t>(values.cols()), 3}, unit);
  }
  /// n x columns as [n, columns].
  void matrix(const std::string& name, const Eigen::MatrixXcd& values, Eigen::Index /*columns*/,
              const char* unit) const {
    const Eigen::MatrixXcd by_rows = values.transpose();
    write(name, by_rows.data(), {static_cast<std::uint64_t>(values.rows()), static_cast<std::uint64_t>(values.cols())},
          unit);
  }
  template <class Values>
  void on_grid(const std::string& name, const Values& values, const FieldGrid& grid, const char* unit) const {
    write(name, values.data(), grid_shape(grid), unit);
  }
  template <class Values>
  void three(const std::string& name, const Values& values, const char* unit) const {
    write(name, values.data(), {3}, unit);
  }
  void optional_texts(const std::string& name, const std::vector<std::string>& texts) const {
    if (!texts.empty()) {
      write_texts(name, texts);
    }
  }
  /// A part of every record, which `access` gives, as one dataset.
  template <class Record, class Access>
  void column(const std::string& name, const std::vector<Record>& records, const Access& access,
              const char* unit) const {
    using Value = PartOf<const Record, Access>;
    if constexpr (std::is_same_v<Value, std::string>) {
      std::vector<std::string> values;
      std::ranges::transform(records, std::back_inserter(values), access);
      write_texts(name, values);
    } else {
      std::vector<StoredNumber<Value>> values;
      std::ranges::transform(records, std::back_inserter(values), access);
      list(name, values, unit);
    }
  }
  template <class Record, class Access>
  void later_column(const std::string& name, const std::vector<Record>& records, const Access& access,
                    const char* unit) const {
    column(name, records, access, unit);
  }
  template <class Record, class Access, class Value>
  void choice_column(const std::string& name, const std::vector<Record>& records, const Access& access,
                     const Choices<Value>& choices) const {
    std::vector<std::string> texts;
    for (const Record& record : records) {
      texts.push_back(
          std::ranges::find(choices, std::invoke(access, record), &Choices<Value>::value_type::second)->first);
    }
    write_texts(name, texts);
  }
  /// A list of every record as [n, columns].
  template <class Record, class Access>
  void rows(const std::string& name, const std::vector<Record>& records, const Access& access, Eigen::Index columns,
            const char* unit) const {
    std::vector<double> values;
    for (const Record& record : records) {
      const auto& row = std::invoke(access, record);
      values.insert(values.end(), row.data(), row.data() + columns);
    }
    write(name, values.data(), {records.size(), static_cast<std::uint64_t>(columns)}, unit);
  }

  /// A group within, if there is something to put into it.
  template <class Fill>
  void part(const std::string& name, bool there, const Fill& fill) const {
    if (there) {
      fill(GroupWriter(create(name)));
    }
  }
  /// A group for every one of a list, called name_of(one).
  template <class List, class Name, class Fill>
  void parts(const List& list, const Name& name_of, const Fill& fill) const {
    for (const auto& one : list) {
      fill(GroupWriter(create(name_of(one))), one);
    }
  }
};

class GroupReader : public hdf5::Content {
 public:
  static constexpr bool kReads = true;

  explicit GroupReader(hdf5::Content group) : Content(std::move(group)) {}

  [[noreturn]] void fail(const std::string& what) const { throw InputError(place() + ": " + what); }

  void attribute(const std::string& name, std::string& value) const { value = text_attribute(name); }
  void attribute(const std::string& name, double& value) const { value = number_attribute(name); }
  void attribute(const std::string& name, int& value) const { value = integer_attribute(name); }
  void attribute(const std::string& name, std::vector<std::string>& value) const { value = texts_attribute(name); }
  template <class Value>
  void later_attribute(const std::string& name, Value& value) const {
    if (has_attribute(name)) {
      attribute(name, value);
    }
  }
  template <class Value>
  void choice(const std::string& name, Value& value, const Choices<Value>& choices) const {
    value = chosen(name, text_attribute(name), choices);
  }
  void stages(const std::string& prefix, StageSeconds& seconds) const {
    std::vector<std::string> names;
    later_attribute("stages", names);
    for (const std::string& stage : names) {
      seconds.emplace_back(stage, number_attribute(prefix + stage));
    }
  }

  template <class List>
  void list(const std::string& name, List& values, const char* /*unit*/) const {
    const hdf5::Shape extent = shape(name);
    if (extent.size() != 1) {
      fail(name + " must be a list");
    }
    values.resize(static_cast<Eigen::Index>(extent[0]));
    read(name, extent, values.data());
  }
  template <class List>
  void optional_list(const std::string& name, List& values, const char* unit) const {
    if (has(name)) {
      list(name, values, unit);
    }
  }
  template <class Columns>
  void columns(const std::string& name, Columns& values, const char* /*unit*/) const {
    const hdf5::Shape extent = shape(name);
    if (extent.size() != 2 || extent[1] != 3) {
      fail(name + " must be [n, 3]");
    }
    values.resize(3, static_cast<Eigen::Index>(extent[0]));
    read(name, extent, values.data());
  }
  void matrix(const std::string& name, Eigen::MatrixXcd& values, Eigen::Index columns, const char* /*unit*/) const {
    const hdf5::Shape extent = shape(name);
    if (extent.size() != 2 || extent[1] != static_cast<std::uint64_t>(columns)) {
      fail(name + " must be [n, " + std::to_string(columns) + "]");
    }
    Eigen::MatrixXcd by_rows(columns, static_cast<Eigen::Index>(extent[0]));
    read(name, extent, by_rows.data());
    values = by_rows.transpose();
  }
  template <class Values>
  void on_grid(const std::string& name, Values& values, const FieldGrid& grid, const char* /*unit*/) const {
    if (shape(name) != grid_shape(grid)) {
      fail(name + " does not fit the count of the grid");
    }
    values.resize(grid.size());
    read(name, grid_shape(grid), values.data());
  }
  template <class Values>
  void three(const std::string& name, Values& values, const char* /*unit*/) const {
    read(name, {3}, values.data());
  }
  void optional_texts(const std::string& name, std::vector<std::string>& texts) const {
    if (has(name)) {
      texts = read_texts(name);
    }
  }
  template <class Record, class Access>
  void column(const std::string& name, std::vector<Record>& records, const Access& access, const char* /*unit*/) const {
    using Value = PartOf<Record, Access>;
    const std::size_t n = records.size();
    if constexpr (std::is_same_v<Value, std::string>) {
      const std::vector<std::string> values = texts(name, n);
      for (std::size_t i = 0; i < n; ++i) {
        std::invoke(access, records[i]) = values[i];
      }
    } else {
      std::vector<StoredNumber<Value>> values(n);
      read(name, {n}, values.data());
      for (std::size_t i = 0; i < n; ++i) {
        Value& value = std::invoke(access, records[i]);
        value = static_cast<Value>(values[i]);
        if (!std::is_same_v<Value, double> && static_cast<StoredNumber<Value>>(value) != values[i]) {
          fail(name + "[" + std::to_string(i) + "] = " + std::to_string(values[i]) + " is out of range");
        }
      }
    }
  }
  template <class Record, class Access>
  void later_column(const std::string& name, std::vector<Record>& records, const Access& access,
                    const char* unit) const {
    if (has(name)) {
      column(name, records, access, unit);
    }
  }
  template <class Record, class Access, class Value>
  void choice_column(const std::string& name, std::vector<Record>& records, const Access& access,
                     const Choices<Value>& choices) const {
    const std::vector<std::string> values = texts(name, records.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
      std::invoke(access, records[i]) = chosen(name, values[i], choices);
    }
  }
  template <class Record, class Access>
  void rows(const std::string& name, std::vector<Record>& records, const Access& access, Eigen::Index columns,
            const char* /*unit*/) const {
    const auto width = static_cast<std::size_t>(columns);
    std::vector<double> values(records.size() * width);
    read(name, {records.size(), width}, values.data());
    for (std::size_t i = 0; i < records.size(); ++i) {
      auto& row = std::invoke(access, records[i]);
      row.resize(columns);
      std::copy_n(values.data() + i * width, width, row.data());
    }
  }

  template <class Fill>
  void part(const std::string& name, bool /*there*/, const Fill& fill) const {
    if (has(name)) {
      fill(GroupReader(open(name)));
    }
  }
  template <class List, class Name, class Fill>
  void parts(List& list, const Name& name_of, const Fill& fill) const {
    for (const std::string& name : names()) {
      name_of(list.emplace_back()) = name;
      fill(GroupReader(open(name)), list.back());
    }
  }

 private:
  template <class Value>
  Value chosen(const std::string& name, const std::string& text, const Choices<Value>& choices) const {
    const auto found = std::ranges::find(choices, text, &Choices<Value>::value_type::first);
    if (found == choices.end()) {
      fail("unknown " + name + " '" + text + "'");
    }
    return found->second;
  }
  std::vector<std::string> texts(const std::string& name, std::size_t n) const {
    std::vector<std::string> values = read_texts(name);
    if (values.size() != n) {
      fail(name + " has " + std::to_string(values.size()) + " texts, must have " + std::to_string(n));
    }
    return values;
  }
};

template <class Io, class TheProvenance>
void provenance_parts(const Io& io, TheProvenance& provenance) {
  for (const ProvenanceField& field : provenance_fields()) {
    io.later_attribute(field.name, provenance.*field.value);
  }
  io.later_attribute("threads", provenance.threads);
}

// What run.h5 and motion.h5 both hold. Io is GroupWriter or GroupReader, and what is written or read a const or a
// plain reference.

inline void format_parts(const GroupWriter& io, const ArchiveFormat& format) {
  io.attribute("format", format.name());
  io.attribute("format_version", format.version);
}

/// throws   InputError if there is no mesh or no array
inline void require_groups(const GroupReader& io) {
  for (const char* group : {"mesh", "array"}) {
    if (!io.has(group)) {
      io.fail(std::string("holds no group ") + group);
    }
  }
}

inline Choices<SkinExtent> extent_choices() {
  return {{to_string(SkinExtent::kWhole), SkinExtent::kWhole}, {to_string(SkinExtent::kPart), SkinExtent::kPart}};
}

/// Result: a Run or a Motion.
template <class Io, class Result>
void extent_parts(const Io& io, Result& result) {
  io.choice("solved_skin", result.solved_skin, extent_choices());
}

inline Choices<PhaseStatus> status_choices() {
  Choices<PhaseStatus> choices;
  for (const PhaseStatus status :
       {PhaseStatus::kConverged, PhaseStatus::kIterationLimit, PhaseStatus::kStalled, PhaseStatus::kDirect}) {
    choices.emplace_back(to_string(status), status);
  }
  return choices;
}

inline void mesh_parts(const GroupWriter& io, const TriangleMesh& mesh) {
  io.columns("vertices", mesh.vertices(), "m");
  io.columns("triangles", mesh.triangles(), "1");
  io.list("area", mesh.areas(), "m2");
}

inline TriangleMesh read_mesh(const GroupReader& io) {
  Points vertices;
  Triangles triangles;
  io.columns("vertices", vertices, "m");
  io.columns("triangles", triangles, "1");
  try {
    return {std::move(vertices), std::move(triangles)};
  } catch (const InputError& error) {
    io.fail(error.what());
  }
}

inline void directivity_parts(const GroupWriter& io, const Directivity& directivity) {
  io.attribute("directivity", directivity_name(directivity.kind()));
  if (directivity.kind() == Directivity::Kind::kPiston) {
    io.attribute("directivity_ka", directivity.ka());
  }
}

inline void directivity_parts(const GroupReader& io, Directivity& directivity) {
  std::string name;
  io.attribute("directivity", name);
  if (name == directivity_name(Directivity::Kind::kOmni)) {
    directivity = Directivity::omni();
  } else if (name == directivity_name(Directivity::Kind::kT4010a1)) {
    directivity = Directivity::t4010a1();
  } else if (name == directivity_name(Directivity::Kind::kPiston)) {
    double ka = 0.0;
    io.attribute("directivity_ka", ka);
    if (!(ka > 0)) {
      io.fail("directivity_ka = " + std::to_string(ka) + " must be > 0");
    }
    directivity = Directivity::piston(ka, 1.0);
  } else {
    io.fail("unknown directivity '" + name + "'");
  }
}

template <class Io, class Response>
void response_parts(const Io& io, Response& response) {
  io.optional_list("gain", response.gain, "1");
  io.optional_list("phase", response.phase, "rad");
}

template <class Io, class Array>
void array_parts(const Io& io, Array& array) {
  io.choice("kind", array.kind,
            {{"transducers", TransducerArray::Kind::kTransducers}, {"plane_wave", TransducerArray::Kind::kPlaneWave}});
  directivity_parts(io, array.directivity);
  io.columns("position", array.positions, "m");
  io.columns("axis", array.axes, "1");
  io.list("amplitude", array.amplitudes, array.kind == TransducerArray::Kind::kPlaneWave ? "Pa" : "Pa m");
  io.list("device", array.device, "1");
  io.list("channel", array.channel, "1");
  response_parts(io, array.response);
}

}  // namespace touchfield
