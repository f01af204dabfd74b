#include "python/src/arrays.h"

#include <cmath>
#include <limits>
#include <string_view>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"

namespace touchfield::python {

namespace {

template <typename Scalar>
struct Kind;
template <>
struct Kind<Complex> {
  static constexpr const char* kType = "complex128";
  static constexpr std::string_view kTaken = "iufc";
  static constexpr const char* kWanted = "real or complex numbers";
};
template <>
struct Kind<double> {
  static constexpr const char* kType = "float64";
  static constexpr std::string_view kTaken = "iuf";
  static constexpr const char* kWanted = "real numbers";
};
template <>
struct Kind<std::int64_t> {
  static constexpr const char* kType = "int64";
  static constexpr std::string_view kTaken = "iu";
  static constexpr const char* kWanted = "whole numbers";
};

bool finite(double value) { return std::isfinite(value); }
bool finite(Complex value) { return std::isfinite(value.real()) && std::isfinite(value.imag()); }
bool finite(std::int64_t /*value*/) { return true; }

std::string text_of(double value) { return fmt::format("{}", value); }
std::string text_of(Complex value) { return fmt::format("{}{:+}j", value.real(), value.imag()); }
std::string text_of(std::int64_t value) { return fmt::format("{}", value); }

/// Drives of a solution; anything else as it is.
template <typename Scalar>
nb::object given(nb::handle value) {
  const bool solution = std::is_same_v<Scalar, Complex> && nb::hasattr(value, "drives");
  return solution ? nb::object(value.attr("drives")) : nb::borrow(value);
}

/// columns   0: a list; else of a table, -1: any number
/// shape     in messages, e.g. "(n, 3)"
template <typename Scalar>
Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> matrix_of(nb::handle value, const std::string& what,
                                                                Eigen::Index columns, const char* shape) {
  const nb::module_ numpy = nb::module_::import_("numpy");
  nb::object array;
  try {
    array = numpy.attr("asarray")(given<Scalar>(value));
  } catch (const nb::python_error& error) {  // rows of different lengths, an object that refuses
    throw InputError(fmt::format("{} is not an array: {}", what, error.what()));
  }
  const auto kind = nb::cast<std::string>(array.attr("dtype").attr("kind"));
  const auto sizes = nb::cast<std::vector<std::size_t>>(nb::object(nb::list(array.attr("shape"))));
  const bool empty = nb::cast<std::size_t>(array.attr("size")) == 0;  // which NumPy takes for reals
  if (!empty && Kind<Scalar>::kTaken.find(kind) == std::string_view::npos) {
    const nb::object type = array.attr("dtype");
    const std::string shown = value.is_none() ? "None"
                              : kind == "U"   ? "str"
                                              : nb::cast<std::string>(nb::str(nb::handle(type)));
    throw nb::type_error(fmt::format("{} must hold {}, not {}", what, Kind<Scalar>::kWanted, shown).c_str());
  }
  const std::size_t dimensions = columns == 0 ? 1 : 2;
  if (sizes.size() != dimensions || (columns > 0 && sizes[1] != static_cast<std::size_t>(columns))) {
    throw InputError(fmt::format("{} must have shape {}, not ({}{})", what, shape, fmt::join(sizes, ", "),
                                 sizes.size() == 1 ? "," : ""));
  }
  array = numpy.attr("asarray")(array, nb::arg("dtype") = Kind<Scalar>::kType, nb::arg("order") = "F");
  const auto data = nb::cast<nb::ndarray<const Scalar, nb::f_contig, nb::device::cpu>>(array);
  const Eigen::Map<const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>> values(
      data.data(), static_cast<Eigen::Index>(sizes[0]), columns == 0 ? 1 : static_cast<Eigen::Index>(sizes[1]));
  for (Eigen::Index j = 0; j < values.cols(); ++j) {
    for (Eigen::Index i = 0; i < values.rows(); ++i) {
      if (!finite(values(i, j))) {
        throw InputError(fmt::format("{}[{}] = {} must be finite", what,
                                     columns == 0 ? fmt::format("{}", i) : fmt::format("{}, {}", i, j),
                                     text_of(values(i, j))));
      }
    }
  }
  return values;
}

}  // namespace

Eigen::MatrixXcd complex_table(nb::handle value, const std::string& what) {
  return matrix_of<Complex>(value, what, -1, "(rows, columns)");
}

Eigen::VectorXcd complex_list(nb::handle value, const std::string& what) {
  return matrix_of<Complex>(value, what, 0, "(n,)");
}

Eigen::VectorXd real_list(nb::handle value, const std::string& what) {
  return matrix_of<double>(value, what, 0, "(n,)");
}

Vector3 three_numbers(nb::handle value, const std::string& what) {
  const Eigen::VectorXd numbers = matrix_of<double>(value, what, 0, "(3,)");
  require_count(what, numbers.size(), 3, "per axis");
  return numbers;
}

Points point_rows(nb::handle value, const std::string& what) {
  return matrix_of<double>(value, what, 3, "(n, 3)").transpose();
}

Eigen::Matrix3Xi triangle_rows(nb::handle value, const std::string& what) {
  const auto rows = matrix_of<std::int64_t>(value, what, 3, "(n, 3)");
  if (rows.size() > 0 && (rows.minCoeff() < 0 || rows.maxCoeff() > std::numeric_limits<int>::max())) {
    throw InputError(fmt::format("{} must hold numbers of vertices, not {}", what,
                                 rows.minCoeff() < 0 ? rows.minCoeff() : rows.maxCoeff()));
  }
  return rows.transpose().cast<int>();
}

bool is_one_drive(nb::handle value) {
  return nb::cast<int>(nb::module_::import_("numpy").attr("ndim")(given<Complex>(value))) < 2;
}

Eigen::MatrixXcd drive_columns(nb::handle value, const std::string& what, Eigen::Index count, const char* of) {
  Eigen::MatrixXcd drives =
      is_one_drive(value) ? Eigen::MatrixXcd(complex_list(value, what)) : complex_table(value, what);
  require_count(what, drives.rows(), count, of);
  return drives;
}

std::vector<Eigen::Index> index_list(nb::handle value, const std::string& what, Eigen::Index count) {
  const auto list = matrix_of<std::int64_t>(value, what, 0, "(n,)");
  for (Eigen::Index i = 0; i < list.size(); ++i) {
    if (list(i) < 0 || list(i) >= count) {
      throw InputError(fmt::format("{}[{}] = {} must be 0 to {}", what, i, list(i), count - 1));
    }
  }
  return {list.data(), list.data() + list.size()};
}

void require_count(const std::string& what, Eigen::Index size, Eigen::Index wanted, const std::string& of) {
  if (size != wanted) {
    throw InputError(fmt::format("{} has {} values and must have {}, one {}", what, size, wanted, of));
  }
}

nb::object object_of(const Json& value) {
  const auto text_of = [](const std::string& text) {
    return nb::steal(PyUnicode_DecodeUTF8(text.data(), static_cast<Py_ssize_t>(text.size()), "replace"));
  };
  if (value.is_object()) {
    nb::dict entries;
    for (const auto& [name, part] : value.items()) {
      entries[text_of(name)] = object_of(part);
    }
    return entries;
  }
  if (value.is_array()) {
    nb::list items;
    for (const Json& item : value) {
      items.append(object_of(item));
    }
    return items;
  }
  return value.is_boolean()          ? nb::cast(value.get<bool>())
         : value.is_number_integer() ? nb::cast(value.get<std::int64_t>())
         : value.is_number_float()   ? nb::cast(value.get<double>())
         : value.is_string()         ? text_of(value.get_ref<const std::string&>())
                                     : nb::none();
}

}  // namespace touchfield::python
