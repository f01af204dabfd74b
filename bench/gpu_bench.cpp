// The card against the processor: pressures of a block of drives on hands of more and more faces, and of frames in
// which the index finger bends by a degree each, errors beside. With 0 FRAMES only the first pressures, then those of
// another body object, and their error against sums by pairs on the card at 1e-5 up to the given number of faces.
// Prints a table in CSV. usage: gpu_bench [MOST_FACES_OF_THE_PROCESSOR
// [[POSE/]EDGE_MM[@LENGTH_MM]:CHANNELS_X:CHANNELS_Y:COLUMNS:FRAMES:SCHEME ...]]
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include <omp.h>

#include "sim/core/units.h"
#include "sim/core/version.h"
#include "sim/gpu/gpu_library.h"
#include "sim/gpu/on_card.h"
#include "sim/hand/hand.h"
#include "sim/hand/hand_pose.h"
#include "sim/hand/skinned_hand.h"

namespace touchfield {
namespace {

double seconds_of(const auto& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

struct Case {
  std::string pose;
  double edge_mm, length_mm;  // of the hand's mesh, and of the hand if > 0
  int x, y, columns, frames;
  std::string scheme;
};

/// About 200 mm below the hand.
TransducerArray array_below(const TriangleMesh& mesh, int x, int y) {
  const Vector3 middle = mesh.centroids().rowwise().mean();
  ArrayLayout layout = grid_layout(x, y, kAutd3Pitch);
  layout = transformed(layout, Eigen::Matrix3d::Identity(), middle - Vector3(0, 0, 0.2));
  return make_array(layout, Directivity::t4010a1(), 1.0, kAutd3SourceStrength);
}

Eigen::MatrixXcd some_drives(Eigen::Index channels, int columns) {
  Eigen::MatrixXcd q(channels, columns);
  for (Eigen::Index i = 0; i < q.size(); ++i) {
    q(i) = std::polar(1.0, 0.1 * static_cast<double>((i * i + 7 * i) % 61));
  }
  return q;
}

void measure(const Case& c, Eigen::Index most_on_processor) {
  HandOptions options;
  options.pose = c.pose;
  options.edge = 1e-3 * c.edge_mm;
  if (c.length_mm > 0) {
    options.breadth *= 1e-3 * c.length_mm / options.length;
    options.length = 1e-3 * c.length_mm;
  }
  const TriangleMesh mesh = hand(options).mesh;
  const Wave wave(air(293.15), 40e3);
  const TransducerArray array = array_below(mesh, c.x, c.y);
  Scheme scheme = Scheme::kBurtonMillerPolished;
  for (const Scheme known : all_schemes()) {
    scheme = to_string(known) == c.scheme ? known : scheme;
  }
  const Eigen::MatrixXcd q = some_drives(array.size(), c.columns);
  SystemOptions by_grid;
  by_grid.grid_tolerance = mesh.face_count() >= kGridOnCard ? 1e-5 : 0.0;
  const ScatteringSystem with_grid(mesh, wave, scheme, by_grid);
  const ScatteringSystem system(mesh, wave, scheme);
  SolverOptions solver;
  solver.tolerance = 1e-4;
  std::unique_ptr<BodyOnCard> card;
  Solved first;
  const double set_up =
      seconds_of([&] { card = std::make_unique<BodyOnCard>(shared_gpu(0), with_grid, solver, true); });
  const double cold = seconds_of([&] { first = card->pressure(array, q); });
  const SolverKind kind = card->kind();
  const bool more = c.frames > 0;
  Solved second;
  const double again = seconds_of([&] {
    if (more) {
      second = card->pressure(array, q);
    } else {
      card = std::make_unique<BodyOnCard>(shared_gpu(0), with_grid, solver, true);
      second = card->pressure(array, q);
    }
  });
  // What a scene needs of all channels: drives that span them, their pressures on some faces, the few rows that stand
  // for the rest.
  std::vector<Eigen::Index> faces(100);
  for (std::size_t i = 0; i < faces.size(); ++i) {
    faces[i] = static_cast<Eigen::Index>(i) * mesh.face_count() / static_cast<Eigen::Index>(faces.size());
  }
  const Eigen::VectorXd weights = mesh.areas();
  const BodyOnCard::Wanted wanted{faces, &weights, 1e-4};
  double transfer = std::nan("");
  Eigen::Index drives = 0;
  for (int trial = 0; trial < 2 && more && c.columns > 8; ++trial) {
    BodyOnCard fresh(shared_gpu(0), with_grid, solver, true);
    const double took = seconds_of([&] { drives = fresh.spanned(array, 1e-4, wanted).drives; });
    transfer = trial == 0 ? took : std::min(transfer, took);
  }
  // Frames: from the pressures before, of which but for few faces nothing comes back.
  const auto skeleton = [&](double bent) {
    HandJoints joints;
    joints.index.pip = bent * kDegree;
    return posed_skeleton(hand_pose(options.pose, joints), options.length, options.breadth);
  };
  const SkinnedHand skin(mesh.vertices(), skeleton(0.0));
  TriangleMesh moved = mesh;
  std::vector<double> frames;
  BodyOnCard::Spanned last;
  const auto given = std::make_shared<const Eigen::MatrixXcd>(q);
  for (int frame = 0; more && frame <= c.frames; ++frame) {
    Points vertices = mesh.vertices();
    skin.pose(skeleton(frame), vertices);
    moved = TriangleMesh(vertices, mesh.triangles());
    frames.push_back(seconds_of([&] {
      card->move(moved);
      last = card->spanned(array, given, wanted);
    }));
  }
  double slowest = std::nan("");
  double frame = std::nan("");
  if (more) {
    std::sort(frames.begin(), frames.end());
    slowest = frames.back();  // it made the inverse
    frame = frames[frames.size() / 2];
  }
  double processor = std::nan("");
  double error = std::nan("");
  double frame_error = std::nan("");
  if (more && mesh.face_count() <= most_on_processor) {
    Eigen::MatrixXcd expected;
    processor = seconds_of([&] {
      const IncidentField field = system.incident(array, q);
      SolverOptions on_processor;
      on_processor.kind = c.columns > 8 ? SolverKind::kLu : SolverKind::kMatrixFree;
      on_processor.tolerance = 1e-6;
      expected = system.pressure(make_solver(system, on_processor)->solve(system.right_hand_side(field)).x, field);
    });
    error = (first.x - expected).norm() / expected.norm();
    const Eigen::MatrixXcd some = q.leftCols(std::min(c.columns, 8));
    const ScatteringSystem bent(moved, wave, scheme);
    const IncidentField field = bent.incident(array, some);
    SolverOptions exact;
    // A plain one may not converge.
    exact.kind = traits(scheme).burton_miller ? SolverKind::kMatrixFree : SolverKind::kLu;
    exact.tolerance = 1e-6;
    expected = bent.pressure(make_solver(bent, exact)->solve(bent.right_hand_side(field)).x, field)(faces, Eigen::all);
    frame_error = (card->spanned_pressure()(faces, Eigen::seqN(0, some.cols())) - expected).norm() / expected.norm();
  }
  if (!more && mesh.face_count() <= most_on_processor) {
    SolverOptions by_pairs;
    by_pairs.tolerance = 1e-5;
    card = nullptr;
    BodyOnCard reference(shared_gpu(0), system, by_pairs, false);
    Solved expected;
    processor = seconds_of([&] { expected = reference.pressure(array, q); });
    error = (second.x - expected.x).norm() / expected.x.norm();
  }
  std::printf("%s,%ld,%ld,%d,\"%s\",%.4f,%.4f,%.4f,%d,%.1e,%.3f,%.1e,%.4f,%.4f,%d,%.1e,%.4f,%ld,%.0f\n",
              c.scheme.c_str(), static_cast<long>(mesh.face_count()), static_cast<long>(array.size()), c.columns,
              to_string(kind).c_str(), set_up, cold, again, first.report.steps, first.report.residual, processor, error,
              frame, slowest, last.report.steps, frame_error, transfer, static_cast<long>(drives),
              static_cast<double>(shared_gpu(0)->most_taken()) / 1048576.0);
  std::fflush(stdout);
}

int run(int count, char** values) {
  const Eigen::Index most = count > 1 ? std::atol(values[1]) : 12'000;
  std::vector<Case> cases;
  for (int i = 2; i < count; ++i) {
    char scheme[64] = "";
    Case c{};
    const auto rest = [&](const char* from) {
      return std::sscanf(from, ":%d:%d:%d:%d:%63s", &c.x, &c.y, &c.columns, &c.frames, scheme) == 5 && c.frames >= 0;
    };
    char* end = nullptr;
    const char* slash = std::strchr(values[i], '/');
    c.pose = slash != nullptr ? std::string(static_cast<const char*>(values[i]), slash) : HandOptions().pose;
    c.edge_mm = std::strtod(slash != nullptr ? slash + 1 : values[i], &end);
    c.length_mm = *end == '@' ? std::strtod(end + 1, &end) : 0.0;
    if (!rest(end)) {
      std::fprintf(stderr,
                   "gpu_bench: %s: must be [POSE/]EDGE_MM[@LENGTH_MM]:X:Y:COLUMNS:FRAMES:SCHEME, FRAMES 0 at least\n",
                   values[i]);
      return 2;
    }
    c.scheme = scheme;
    cases.push_back(c);
  }
  if (gpu_library().cards == 0) {
    std::fprintf(stderr, "gpu_bench: %s\n", gpu_library().why_none.c_str());
    return 3;
  }
  const double start = seconds_of([] { shared_gpu(0); });
  std::printf(
      "# made by: bench/gpu_bench on one %s, CUDA %s, started in %.2f s, processor with %d threads; revision: %s\n",
      shared_gpu(0)->info().name.c_str(), shared_gpu(0)->info().toolkit.c_str(), start, omp_get_max_threads(),
      build_info().revision.c_str());
  std::printf(
      "scheme,faces,channels,right_hand_sides,solver,set_up_s,first_s,again_s,steps,residual,processor_s,error,"
      "frame_s,slowest_frame_s,frame_steps,frame_error,transfer_s,transfer_drives,card_mb\n");
  for (const Case& c : cases) {
    measure(c, most);
  }
  return 0;
}

}  // namespace
}  // namespace touchfield

int main(int count, char** values) { return touchfield::run(count, values); }
