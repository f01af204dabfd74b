#include "sim/gpu/field_on_card.h"

#include "sim/gpu/card_errors.h"
#include "sim/gpu/card_input.h"

namespace touchfield {

FarField far_field_on_card(Gpu& gpu, double far_distance, const TriangleMesh& mesh, const TransducerArray& array,
                           const Wave& wave, const Points& points, const Eigen::MatrixXcd& surface,
                           const Eigen::MatrixXcd& drive) {
  FarField far{Eigen::MatrixXcd(points.cols(), surface.cols()), Eigen::VectorXd(points.cols()),
               std::vector<int>(static_cast<std::size_t>(points.cols()))};
  const Eigen::VectorXcd response = factors(array.response);
  GpuField field;
  field.points = points.data();
  field.count = static_cast<int>(points.cols());
  field.surface = surface.data();
  field.drives = drive.data();
  field.columns = static_cast<int>(surface.cols());
  field.far_distance = far_distance;
  field.pressure = far.pressure.data();
  field.winding = far.winding.data();
  field.near = far.near.data();
  on_card([&] { gpu.field(card_surface(mesh, wave), card_sources(array, response), field); });
  return far;
}

}  // namespace touchfield
