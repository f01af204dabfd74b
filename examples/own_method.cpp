// A phase method of one's own beside the built-in ones: the transfer matrix H of a scene's skin goes into a few lines
// of Eigen, and the phases that come out are solved for, evaluated and tabled as those of every other method of the
// scene.
//
//   own_method scenes/capsule.yaml
#include <cstdio>
#include <exception>

#include <Eigen/Cholesky>

#include <touchfield/sim/core/program_start.h>
#include <touchfield/sim/field/metrics.h>
#include <touchfield/sim/run/run_file.h>
#include <touchfield/sim/run/run_text.h>
#include <touchfield/sim/run/solve_model.h>
#include <touchfield/sim/run/transfer.h>
#include <touchfield/sim/scene/scene_reader.h>

namespace {

/// Drives q of amplitude 1 that lower sum_j A_j (|u_j| - p'_j)^2, u = H q, over the whole skin: Gauss-Newton steps of
/// the phases with a constant damping.
Eigen::VectorXcd own_drives(const Eigen::MatrixXcd& h, const Eigen::ArrayXd& wanted, const Eigen::ArrayXd& areas) {
  const std::complex<double> i(0, 1);
  Eigen::ArrayXcd q = (h.adjoint() * (areas * wanted).matrix()).array();  // the field sent back from the target
  q /= q.abs();
  for (int step = 0; step < 30; ++step) {
    const Eigen::ArrayXcd u = (h * q.matrix()).array();
    const Eigen::VectorXd misfit = areas.sqrt() * (u.abs() - wanted);
    const Eigen::VectorXcd rows = areas.sqrt() * u.conjugate() / u.abs();
    const Eigen::MatrixXd jacobian = (rows.asDiagonal() * h * (i * q).matrix().asDiagonal()).real();
    Eigen::MatrixXd normal = jacobian.transpose() * jacobian;
    normal.diagonal().array() += 0.01 * normal.diagonal().maxCoeff();
    q *= (-i * normal.llt().solve(jacobian.transpose() * misfit).array()).exp();
  }
  return q;
}

void compare(const char* path) {
  const touchfield::Scene scene = touchfield::read_scene(path, {"target.pressure_pa=500"});  // a level to work for
  touchfield::Model model = touchfield::build_model(scene);
  const touchfield::TriangleMesh& skin = model.body.mesh;
  const touchfield::Target target = touchfield::build_target(model);

  const Eigen::MatrixXcd h =
      touchfield::transfer_matrix(skin, model.fixed->wave, model.fixed->array, scene.solve.scheme);
  Eigen::ArrayXd wanted = Eigen::ArrayXd::Zero(h.rows());
  wanted(target.faces) = target.shares.cwiseProduct(target.amplitudes);  // a face on the border counts by its share
  const Eigen::VectorXcd q = own_drives(h, wanted, skin.areas());
  const touchfield::Metrics direct = touchfield::metrics_of(skin, model.fixed->wave, model.boxes, target, h * q);
  std::printf("%td faces, %td channels; own, by H: relative_error %.6f\n", h.rows(), h.cols(), direct.relative_error);

  touchfield::MethodSpec own;
  own.kind = &touchfield::phase_method("fixed");
  own.name = "own";
  for (const std::complex<double>& drive : q) {
    own.phases.push_back(std::arg(drive));
  }
  const auto fixed = std::make_shared<touchfield::FixedModel>(*model.fixed);
  fixed->scene.solve.methods.push_back(own);
  model.fixed = fixed;
  const touchfield::Run run = touchfield::solve_model(model);
  std::fputs(touchfield::methods_table(run).c_str(), stdout);
  std::printf("own, by the run: relative_error %.6f\n", run.methods.back().metrics.relative_error);
}

}  // namespace

int main(int argc, char** argv) {
  touchfield::restart_with_better_settings(argv);  // kernels that fit the processor, threads that let others work
  if (argc != 2) {
    std::fprintf(stderr, "usage: own_method SCENE\n");
    return 2;
  }
  try {
    compare(argv[1]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "own_method: %s\n", error.what());
    return 1;
  }
}
