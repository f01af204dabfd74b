#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
// Everywhere the same, or one file would convert what another takes for a class.
#include <algorithm>
#include <functional>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sim/core/json.h"
#include "sim/core/types.h"

/// Matrices of the library as arrays of NumPy's and back. What is n points as columns here, 3 x n, is n x 3 there: the
/// same bytes.
namespace touchfield::python {

namespace nb = nanobind;

/// Arguments that functions read by themselves, and results, by what the stub says of them.
template <std::size_t size>
struct Words {
  char text[size];
  constexpr Words(const char (&given)[size]) { std::copy_n(given, size, text); }  // NOLINT: written as a text
};
inline bool any_object(PyObject* /*value*/) { return true; }
template <Words words>
struct Said : nb::object {
  NB_OBJECT(Said, nb::object, words.text, any_object)
  Said(const nb::object& value) : nb::object(value) {}  // NOLINT: any object is one
};
using ArrayLike = Said<"numpy.typing.ArrayLike">;
using DrivesLike = Said<"numpy.typing.ArrayLike | Solution">;
using PathLike = Said<"str | os.PathLike">;
using SceneLike = Said<"str | os.PathLike | dict">;
using Changes = Said<"dict[str, typing.Any]">;
using Callback = Said<"typing.Callable[[str, float], object] | bool">;
using Values = Said<"dict[str, typing.Any]">;
using Rows = Said<"list[dict[str, typing.Any]]">;
using Numbers = Said<"dict[str, float]">;
using NumbersByName = Said<"dict[str, dict[str, float]]">;
using TextByName = Said<"dict[str, str]">;
using RealArray = Said<"numpy.typing.NDArray[numpy.float64]">;
using ComplexArray = Said<"numpy.typing.NDArray[numpy.complex128]">;
using RealArrays = Said<"dict[str, numpy.typing.NDArray[numpy.float64]]">;
using ComplexArrays = Said<"dict[str, numpy.typing.NDArray[numpy.complex128]]">;

/// Of classes that Python makes: so they take the __init__ that _exports.py sets, whose errors name the argument.
inline const PyType_Slot kOpenInit[] = {
    {Py_tp_init, reinterpret_cast<void*>(+[](PyObject*, PyObject*, PyObject*) { return 0; })}, {0, nullptr}};

/// Shapes as NumPy sees them: one row a point or a face, a list, a matrix by columns.
template <typename Scalar>
using Rows3 = nb::ndarray<nb::numpy, Scalar, nb::shape<-1, 3>, nb::c_contig>;
template <typename Scalar>
using List = nb::ndarray<nb::numpy, Scalar, nb::shape<-1>>;
template <typename Scalar>
using Table = nb::ndarray<nb::numpy, Scalar, nb::shape<-1, -1>, nb::f_contig>;

/// Arrays that look at memory which `owner` keeps: read-only of constant elements.
template <typename Element>
Rows3<Element> rows(Element* data, Eigen::Index count, nb::handle owner) {
  return {data, {static_cast<std::size_t>(count), 3}, owner};
}
template <typename Element>
List<Element> list(Element* data, Eigen::Index count, nb::handle owner) {
  return {data, {static_cast<std::size_t>(count)}, owner};
}
template <typename Element>
Table<Element> table(Element* data, Eigen::Index height, Eigen::Index width, nb::handle owner) {
  return {data, {static_cast<std::size_t>(height), static_cast<std::size_t>(width)}, owner, {1, height}};
}

template <typename Scalar>
Rows3<const Scalar> view(const Eigen::Matrix<Scalar, 3, Eigen::Dynamic>& values, nb::handle owner) {
  return rows(values.data(), values.cols(), owner);
}
template <typename Scalar>
List<const Scalar> view(const Eigen::Matrix<Scalar, Eigen::Dynamic, 1>& values, nb::handle owner) {
  return list(values.data(), values.size(), owner);
}
template <typename Scalar>
Table<const Scalar> view(const Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>& values, nb::handle owner) {
  return table(values.data(), values.rows(), values.cols(), owner);
}
template <typename Scalar>
List<const Scalar> view(const std::vector<Scalar>& values, nb::handle owner) {
  return list(values.data(), static_cast<Eigen::Index>(values.size()), owner);
}

/// The transpose, which is the same bytes.
template <typename Matrix>
auto turned(const Matrix& values, nb::handle owner) {
  using Turned = nb::ndarray<nb::numpy, const typename Matrix::Scalar, nb::shape<-1, -1>, nb::c_contig>;
  return Turned(values.data(), {std::size_t(values.cols()), std::size_t(values.rows())}, owner);
}

/// A property: a view of a part, a member of what `Held` points to.
template <typename Held, typename Part>
auto part_of(Part part) {
  return [part](nb::handle_t<Held> self) { return view(std::invoke(part, *nb::cast<const Held&>(self)), self); };
}

/// An array that keeps its values itself, for the caller to change as he likes.
template <typename Held>
auto owned(Held values) {
  using Scalar = typename Held::value_type;
  using Kept = std::conditional_t<std::is_same_v<Scalar, Complex>, ComplexArray,
                                  std::conditional_t<std::is_same_v<Scalar, double>, RealArray, nb::object>>;
  auto* kept = new Held(std::move(values));
  const nb::capsule owner(kept, [](void* pointer) noexcept { delete static_cast<Held*>(pointer); });
  if constexpr (requires { kept->cols(); }) {
    if constexpr (Held::ColsAtCompileTime == 1) {
      return Kept(nb::cast(list(kept->data(), kept->size(), owner)));
    } else if constexpr (Held::RowsAtCompileTime == 3) {
      return Kept(nb::cast(rows(kept->data(), kept->cols(), owner)));
    } else {
      return Kept(nb::cast(table(kept->data(), kept->rows(), kept->cols(), owner)));
    }
  } else {
    return Kept(nb::cast(list(kept->data(), static_cast<Eigen::Index>(kept->size()), owner)));
  }
}

/// Matrices of what Python hands over: any array or nesting of lists that NumPy takes for one of these numbers, of any
/// order in memory. Whole numbers and single precision become double, reals complex; anything else is refused. Where
/// complex values are asked for, a solution stands for its drives.
///
/// what     the argument in messages, e.g. "transfer: faces"
/// throws   nanobind's type_error on other than numbers; InputError on another shape or a value that is not finite
Eigen::MatrixXcd complex_table(nb::handle value, const std::string& what);
Eigen::VectorXcd complex_list(nb::handle value, const std::string& what);
Eigen::VectorXd real_list(nb::handle value, const std::string& what);
Vector3 three_numbers(nb::handle value, const std::string& what);
Points point_rows(nb::handle value, const std::string& what);
Eigen::Matrix3Xi triangle_rows(nb::handle value, const std::string& what);

/// Drives of one solution, N, or of several, N x S, a column each; or values of which there is one of something else.
/// throws   also InputError unless there are `count`
Eigen::MatrixXcd drive_columns(nb::handle value, const std::string& what, Eigen::Index count,
                               const char* of = "per channel");
bool is_one_drive(nb::handle value);

/// Numbers of things of which there are `count`.
/// throws   also InputError on a number that is not 0 to count - 1
std::vector<Eigen::Index> index_list(nb::handle value, const std::string& what, Eigen::Index count);

/// An object as a dict, an array as a list; null is None. In a text U+FFFD stands for a byte that is not UTF-8.
nb::object object_of(const Json& value);

/// throws   InputError that names the argument unless it has as many values
void require_count(const std::string& what, Eigen::Index size, Eigen::Index wanted, const std::string& of);

}  // namespace touchfield::python
