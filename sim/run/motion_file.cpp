#include "sim/run/motion_file.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/hand/tracked_joints.h"
#include "sim/run/motion_summary.h"
#include "sim/run/patch_archive.h"
#include "sim/run/run_file.h"
#include "sim/run/target_archive.h"

namespace touchfield {

namespace {

/// Records whose first column has this name.
template <class Records>
void sized_like(const GroupReader& io, Records& records, const std::string& column) {
  Eigen::VectorXd values;
  io.list(column, values, "s");
  records.resize(static_cast<std::size_t>(values.size()));
}

/// The cost histories, which may differ in length, as rows that end in NaN.
void cost_parts(const GroupWriter& io, const std::vector<MotionFrame>& frames) {
  std::size_t longest = 0;
  std::vector<std::vector<double>> rows;
  for (const MotionFrame& frame : frames) {
    rows.push_back(frame.solution.cost_history);
    longest = std::max(longest, rows.back().size());
  }
  for (std::vector<double>& row : rows) {
    row.resize(longest, kNotComputed);
  }
  if (longest > 0) {
    io.rows("cost", rows, std::identity(), static_cast<Eigen::Index>(longest), "Pa2");
  }
}

void cost_parts(const GroupReader& io, std::vector<MotionFrame>& frames) {
  if (!io.has("cost")) {
    return;
  }
  const hdf5::Shape extent = io.shape("cost");
  if (extent.size() != 2) {
    io.fail("cost must be [frames, n]");
  }
  io.rows(
      "cost", frames, [](MotionFrame & frame) -> auto& { return frame.solution.cost_history; },
      static_cast<Eigen::Index>(extent[1]), "Pa2");
  for (MotionFrame& frame : frames) {
    std::vector<double>& costs = frame.solution.cost_history;
    const auto last = std::find_if_not(costs.rbegin(), costs.rend(), [](double cost) { return std::isnan(cost); });
    costs.erase(last.base(), costs.end());
  }
}

/// A dataset a stage; NaN in frames that were without it.
void stage_parts(const GroupWriter& io, const std::vector<MotionFrame>& frames) {
  for (const std::string& stage : stages_of(frames)) {
    std::vector<double> values;
    std::ranges::transform(frames, std::back_inserter(values),
                           [&](const MotionFrame& frame) { return stage_seconds(frame, stage); });
    io.list(stage, values, "s");
  }
}

void stage_parts(const GroupReader& io, std::vector<MotionFrame>& frames) {
  for (const std::string& stage : io.names()) {
    std::vector<double> values;
    io.list(stage, values, "s");
    require_size(io.place() + ": " + stage, static_cast<Eigen::Index>(values.size()),
                 static_cast<Eigen::Index>(frames.size()));
    for (std::size_t i = 0; i < frames.size(); ++i) {
      if (!std::isnan(values[i])) {
        frames[i].seconds.emplace_back(stage, values[i]);
      }
    }
  }
}

/// The joints of a hand tracker, a dataset each.
template <class Io, class Frames>
void joint_parts(const Io& io, Frames& frames) {
  const std::vector<std::string> names = tracked_joints();
  if constexpr (Io::kReads) {
    for (MotionFrame& frame : frames) {
      frame.joints.resize(names.size());
    }
  }
  for (std::size_t j = 0; j < names.size(); ++j) {
    io.rows(
        names[j], frames, [j](auto& frame) -> auto& { return frame.joints[j]; }, 3, "m");
  }
}

template <class Io, class Frames>
void frame_parts(const Io& io, Frames& frames, Eigen::Index channels) {
  if constexpr (Io::kReads) {
    sized_like(io, frames, "sampled");
  }
  io.column("sampled", frames, &MotionFrame::sampled, "s");
  io.column("started", frames, &MotionFrame::started, "s");
  io.column("late", frames, &MotionFrame::late, "s");
  io.column("shown", frames, &MotionFrame::shown, "s");
  io.column("pose_time", frames, &MotionFrame::pose_time, "s");
  io.column("silent", frames, &MotionFrame::silent, "1");
  io.later_column("lost", frames, &MotionFrame::lost, "1");
  io.later_column(
      "skin_off", frames, [](auto& frame) -> auto& { return frame.off.skin; }, "m");
  io.later_column(
      "patch_off", frames, [](auto& frame) -> auto& { return frame.off.patch; }, "m");
  io.later_column("target_off", frames, &MotionFrame::target_off, "m");
  io.column(
      "steps", frames, [](auto& frame) -> auto& { return frame.solution.iterations; }, "1");
  io.choice_column(
      "status", frames, [](auto& frame) -> auto& { return frame.solution.status; }, status_choices());
  io.rows(
      "phases", frames, [](auto& frame) -> auto& { return frame.solution.phases; }, channels, "rad");
  io.rows(
      "amplitudes", frames, [](auto& frame) -> auto& { return frame.solution.amplitudes; }, channels, "1");
  io.part("joints", !frames.empty() && !frames.front().joints.empty(),
          [&](const Io& part) { joint_parts(part, frames); });
  cost_parts(io, frames);
  io.part("seconds", !stages_of(frames).empty(), [&](const Io& part) { stage_parts(part, frames); });
}

template <class Io, class Scores>
void score_parts(const Io& io, Scores& scores) {
  if constexpr (Io::kReads) {
    sized_like(io, scores, "time");
  }
  io.column("time", scores, &MotionScore::time, "s");
  io.column("frame", scores, &MotionScore::frame, "1");
  io.column("age", scores, &MotionScore::age, "s");
  io.rows("displacement", scores, &MotionScore::displacement, 3, "m");
  for (const MetricField& field : metric_fields()) {
    io.later_column(
        field.name, scores, [value = field.value](auto& score) -> auto& { return score.metrics.*value; }, field.unit);
  }
}

/// Vertices of meshes as [T, V, 3], NaN where there is none; [1, V, 3] if all are the same.
void write_vertices(const GroupWriter& io, const std::string& name, std::vector<const TriangleMesh*> meshes,
                    Eigen::Index vertices) {
  const auto still = [&](const TriangleMesh* mesh) { return mesh && mesh->vertices() == meshes.front()->vertices(); };
  if (meshes.front() && std::ranges::all_of(meshes, still)) {
    meshes.resize(1);
  }
  Points all = Points::Constant(3, std::ssize(meshes) * vertices, kNotComputed);
  for (std::size_t i = 0; i < meshes.size(); ++i) {
    if (meshes[i]) {
      all.middleCols(static_cast<Eigen::Index>(i) * vertices, vertices) = meshes[i]->vertices();
    }
  }
  io.write_compact(name, all.data(), {meshes.size(), static_cast<std::uint64_t>(vertices), 3}, "m");
}

/// The meshes of so many instants, with the triangles of another; none where its vertices are NaN.
std::vector<std::optional<TriangleMesh>> read_vertices(const GroupReader& io, const std::string& name,
                                                       std::size_t instants, const TriangleMesh& like) {
  const Eigen::Index vertices = like.vertex_count();
  const hdf5::Shape extent = io.shape(name);
  const std::uint64_t stored = !extent.empty() && extent.front() == 1 ? 1 : instants;
  Points all(3, static_cast<Eigen::Index>(stored) * vertices);
  io.read(name, {stored, static_cast<std::uint64_t>(vertices), 3}, all.data());
  std::vector<std::optional<TriangleMesh>> meshes;
  for (std::size_t i = 0; i < instants; ++i) {
    const auto own = all.middleCols(stored == 1 ? 0 : static_cast<Eigen::Index>(i) * vertices, vertices);
    try {
      meshes.push_back(own.array().isNaN().all() ? std::nullopt : std::optional<TriangleMesh>({own, like.triangles()}));
    } catch (const InputError& error) {
      io.fail(name + ": " + error.what());
    }
  }
  return meshes;
}

/// The targets of all instants one behind another, and the count of each instant: -1 without a target.
void targets_parts(const GroupWriter& io, const std::vector<MotionInstant>& instants) {
  std::vector<int> faces;
  std::vector<int> boxes;
  Target all;
  for (const MotionInstant& instant : instants) {
    faces.push_back(instant.target ? static_cast<int>(instant.target->size()) : -1);
    boxes.push_back(instant.target ? static_cast<int>(instant.target->boxes.size()) : 0);
    if (const auto& target = instant.target) {
      const Eigen::Index before = all.size();
      all.faces.insert(all.faces.end(), target->faces.begin(), target->faces.end());
      all.box.insert(all.box.end(), target->box.begin(), target->box.end());
      all.boxes.insert(all.boxes.end(), target->boxes.begin(), target->boxes.end());
      all.amplitudes.conservativeResize(all.size());
      all.shares.conservativeResize(all.size());
      all.amplitudes.tail(all.size() - before) = target->amplitudes;
      all.shares.tail(all.size() - before) = target->shares;
    }
  }
  io.list("target_faces", faces, "1");
  io.list("target_boxes", boxes, "1");
  io.part("target", all.size() > 0, [&](const GroupWriter& part) { target_parts(part, all); });
}

void targets_parts(const GroupReader& io, std::vector<MotionInstant>& instants) {
  std::vector<int> faces;
  std::vector<int> boxes;
  Target all;
  io.list("target_faces", faces, "1");
  io.list("target_boxes", boxes, "1");
  io.part("target", true, [&](const GroupReader& part) { target_parts(part, all); });
  require_size(io.place() + ": target_faces", static_cast<Eigen::Index>(faces.size()),
               static_cast<Eigen::Index>(instants.size()));
  require_size(io.place() + ": target_boxes", static_cast<Eigen::Index>(boxes.size()),
               static_cast<Eigen::Index>(instants.size()));
  const auto size = static_cast<std::int64_t>(all.faces.size());
  std::int64_t face = 0;
  std::int64_t box = 0;
  for (std::size_t i = 0; i < instants.size(); ++i) {
    if (faces[i] < 0) {
      continue;
    }
    if (faces[i] > size - face || boxes[i] < 0 || boxes[i] > std::ssize(all.boxes) - box ||
        all.amplitudes.size() != size || all.shares.size() != size || std::ssize(all.box) != size) {
      io.fail("target_faces and target_boxes do not fit the lists of target");
    }
    Target& target = instants[i].target.emplace();
    target.faces.assign(all.faces.begin() + face, all.faces.begin() + face + faces[i]);
    target.box.assign(all.box.begin() + face, all.box.begin() + face + faces[i]);
    target.boxes.assign(all.boxes.begin() + box, all.boxes.begin() + box + boxes[i]);
    target.amplitudes = all.amplitudes.segment(face, faces[i]);
    target.shares = all.shares.segment(face, faces[i]);
    face += faces[i];
    box += boxes[i];
  }
}

/// Instants have the triangles of the meshes before them, so only vertices are stored.
void instants_parts(const GroupWriter& io, const Motion& motion) {
  io.column("time", motion.instants, &MotionInstant::time, "s");
  std::vector<const TriangleMesh*> meshes;
  std::vector<const TriangleMesh*> sensed;
  for (const MotionInstant& instant : motion.instants) {
    meshes.push_back(&instant.mesh);
    sensed.push_back(instant.sensed ? &*instant.sensed : nullptr);
  }
  write_vertices(io, "vertices", meshes, evaluated_mesh(motion).vertex_count());
  if (std::ranges::any_of(sensed, [](const TriangleMesh* mesh) { return mesh != nullptr; })) {
    write_vertices(io, "sensed", sensed, motion.mesh.vertex_count());
  }
  targets_parts(io, motion.instants);
  io.part("pressure", true, [&](const GroupWriter& part) {
    const auto faces = static_cast<std::uint64_t>(evaluated_mesh(motion).face_count());
    for (std::size_t m = 0; m < motion.methods.size(); ++m) {
      std::vector<Complex> values;
      for (const MotionInstant& instant : motion.instants) {
        const Eigen::VectorXcd& pressure = instant.pressure[m].second;
        values.insert(values.end(), pressure.data(), pressure.data() + pressure.size());
      }
      part.write_compact(motion.methods[m].name, values.data(), {motion.instants.size(), faces}, "Pa");
    }
  });
}

void instants_parts(const GroupReader& io, Motion& motion) {
  Eigen::VectorXd times;
  io.list("time", times, "s");
  const auto count = static_cast<std::size_t>(times.size());
  const TriangleMesh& evaluated = evaluated_mesh(motion);
  for (std::optional<TriangleMesh>& mesh : read_vertices(io, "vertices", count, evaluated)) {
    if (!mesh) {
      io.fail("vertices must be numbers");
    }
    motion.instants.push_back({.time = times(std::ssize(motion.instants)), .mesh = *std::move(mesh)});
  }
  if (io.has("sensed")) {
    auto sensed = read_vertices(io, "sensed", count, motion.mesh);
    for (std::size_t i = 0; i < count; ++i) {
      motion.instants[i].sensed = std::move(sensed[i]);
    }
  }
  targets_parts(io, motion.instants);
  io.part("pressure", true, [&](const GroupReader& part) {
    for (const MotionMethod& method : motion.methods) {
      Eigen::MatrixXcd values(evaluated.face_count(), times.size());
      part.read(method.name, {count, static_cast<std::uint64_t>(values.rows())}, values.data());
      for (std::size_t i = 0; i < count; ++i) {
        motion.instants[i].pressure.emplace_back(method.name, values.col(static_cast<Eigen::Index>(i)));
      }
    }
  });
}

/// All but what is said of the motion in the root itself, and its meshes.
template <class Io, class TheMotion>
void motion_parts(const Io& io, TheMotion& motion) {
  io.part("array", true, [&](const Io& part) { array_parts(part, motion.array); });
  io.part("methods", !motion.methods.empty(), [&](const Io& methods) {
    methods.parts(
        motion.methods, [](auto& method) -> auto& { return method.name; },
        [&](const Io& part, auto& method) {
          part.attribute("method", method.method);
          part.attribute("scheme", method.scheme);
          part.attribute("dropped", method.dropped);
          part.part("frames", true, [&](const Io& frames) { frame_parts(frames, method.frames, motion.array.size()); });
          part.part("scores", true, [&](const Io& scores) { score_parts(scores, method.scores); });
          part.part("watched", !method.watched.empty(), [&](const Io& watched) {
            if constexpr (Io::kReads) {
              for (const std::string& place : watched.names()) {
                method.watched.emplace_back(place, Eigen::VectorXd());
              }
            }
            for (auto& [place, pressure] : method.watched) {
              watched.list(place, pressure, "Pa");
            }
          });
        });
  });
  io.part("instants", !motion.instants.empty(), [&](const Io& part) { instants_parts(part, motion); });
  io.part("patch", motion.patch.has_value(), [&](const Io& part) { patch_parts(part, motion); });
  io.part("seconds", !motion.timings.empty(), [&](const Io& part) { part.stages("", motion.timings); });
  io.optional_texts("warnings", motion.warnings);
  io.optional_texts("notes", motion.notes);
  io.part("provenance", true, [&](const Io& part) { provenance_parts(part, motion.provenance); });
}

void write_motion(const GroupWriter& io, const Motion& motion) {
  format_parts(io, kMotionArchive);
  io.attribute("name", motion.name);
  io.attribute("complete", motion.complete ? 1 : 0);
  io.attribute("seconds", motion.seconds);
  io.attribute("radiation_per_square", motion.radiation_per_square);
  io.write_text("scene", motion.scene);
  io.part("mesh", true, [&](const GroupWriter& part) { mesh_parts(part, motion.mesh); });
  io.part("evaluation", motion.evaluation.has_value(), [&](const GroupWriter& evaluation) {
    evaluation.part("mesh", true, [&](const GroupWriter& part) { mesh_parts(part, *motion.evaluation); });
  });
  motion_parts(io, motion);
  extent_parts(io, motion);
}

Motion read_motion(const GroupReader& io) {
  require_groups(io);
  Motion motion{.name = io.text_attribute("name"),
                .scene = io.read_text("scene"),
                .seconds = io.number_attribute("seconds"),
                .mesh = read_mesh(GroupReader(io.open("mesh"))),
                .complete = io.integer_attribute("complete") != 0};
  if (io.has("evaluation")) {
    motion.evaluation = read_mesh(GroupReader(io.open("evaluation").open("mesh")));
  }
  io.later_attribute("radiation_per_square", motion.radiation_per_square);
  motion_parts(io, motion);
  extent_parts(io, motion);
  return motion;
}

void check_frame(const std::string& what, const MotionFrame& frame, Eigen::Index channels) {
  require_size(what + ": phases", frame.solution.phases.size(), channels);
  require_size(what + ": amplitudes", frame.solution.amplitudes.size(), channels);
  std::set<std::string> stages;
  for (const auto& [stage, seconds] : frame.seconds) {
    require_name(what + ": stage", stage, stages);
    require(seconds >= 0, "{}: stage '{}' = {} s must be >= 0", what, stage, seconds);
  }
}

bool same_triangles(const TriangleMesh& a, const TriangleMesh& b) {
  return a.vertex_count() == b.vertex_count() && a.face_count() == b.face_count() && a.triangles() == b.triangles();
}

void check_instant_of(const Motion& motion, const MotionInstant& instant, const std::string& what) {
  require(same_triangles(instant.mesh, evaluated_mesh(motion)),
          "{}: its triangles must be those of the evaluation mesh", what);
  require(!instant.sensed || same_triangles(*instant.sensed, motion.mesh),
          "{}: the triangles of sensed must be those of the solving mesh", what);
  require(std::ranges::equal(
              instant.pressure, motion.methods, {}, [](const auto& pressure) { return pressure.first; },
              [](const MotionMethod& method) { return method.name; }),
          "{}: it must have a pressure of every method, in their order", what);
  check_instant(instant);
}

}  // namespace

void check_motion(const Motion& motion) {
  check_array(motion.array);
  require_stages("motion", motion.timings);
  std::set<std::string> names;
  for (const MotionMethod& method : motion.methods) {
    require_name("method", method.name, names);
    const std::string what = "method " + method.name;
    for (std::size_t i = 0; i < method.frames.size(); ++i) {
      check_frame(fmt::format("{}: frame {}", what, i), method.frames[i], motion.array.size());
    }
    for (std::size_t i = 0; i < method.scores.size(); ++i) {
      if (const int frame = method.scores[i].frame; frame < -1 || frame >= static_cast<int>(method.frames.size())) {
        throw InputError(fmt::format("{}: score {}: frame {} must be in -1..{}", what, i, frame,
                                     static_cast<int>(method.frames.size()) - 1));
      }
    }
    require(method.dropped >= 0, "{}: dropped = {} must be >= 0", what, method.dropped);
    std::set<std::string> places;
    for (const auto& [place, pressure] : method.watched) {
      require_name(what + ": watched", place, places);
      require_size(fmt::format("{}: watched {}", what, place), pressure.size(),
                   static_cast<Eigen::Index>(method.scores.size()));
    }
  }
  for (std::size_t i = 0; i < motion.instants.size(); ++i) {
    check_instant_of(motion, motion.instants[i], fmt::format("instant {}", i));
  }
  if (motion.patch) {
    const auto frames = motion.methods.empty() ? 0 : std::ssize(motion.methods.front().frames);
    check_patch(*motion.patch, static_cast<Eigen::Index>(frames));
  }
}

void check_instant(const MotionInstant& instant) {
  if (instant.target) {
    check_target("target", *instant.target, instant.mesh.face_count());
  }
  for (const auto& [method, pressure] : instant.pressure) {
    require_size(fmt::format("method {}: pressure", method), pressure.size(), instant.mesh.face_count());
  }
}

std::string result_file_at(const std::string& path) {
  const std::filesystem::path folder = path;
  for (const char* name : {"run.h5", "motion.h5", "pattern.h5"}) {
    if (std::filesystem::exists(folder / name)) {
      return (folder / name).string();
    }
  }
  return run_file_at(path);
}

void write_motion_file(const std::string& path, const Motion& motion) {
  check_motion(motion);
  const hdf5::MemoryFile file(path);
  write_motion(GroupWriter(file.root()), motion);
  write_archive(path, file);
}

Motion read_motion_file(const std::string& path, const Warn& warn) {
  Motion motion = read_motion(GroupReader(read_archive(path, kMotionArchive, warn)));
  require_undamaged(path, [&] { check_motion(motion); });
  return motion;
}

}  // namespace touchfield
