#include "sim/motion/moving_model.h"

#include <cmath>
#include <cstdint>
#include <limits>
#include <unordered_set>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/random.h"
#include "sim/core/require.h"
#include "sim/core/rigid_motion.h"
#include "sim/model/stages.h"
#include "sim/run/methods.h"

namespace touchfield {

namespace {

constexpr double kCheckStep = 0.01;  // [s]: 2 mm at 200 mm/s

HandSkeleton skeleton_of(const HandShape& shape) {
  return posed_skeleton(hand_pose(shape.pose, shape.joints), shape.length, shape.breadth);
}

/// The hand of a body, if it is one whose joints the motion turns.
const HandShape* turning_hand(const Scene& scene, std::size_t body) {
  const auto* hand = std::get_if<HandShape>(&scene.bodies[body].shape);
  const bool turns = std::ranges::any_of(scene.motion->changes, [&](const MotionChange& change) {
    return change.path.find(".joints.") != std::string::npos &&
           (scene.bodies.size() == 1 || change.path.rfind(fmt::format("bodies[{}].", body), 0) == 0);
  });
  return turns ? hand : nullptr;
}

bool is_series(const BodySpec& body) {
  const auto* shape = std::get_if<MeshShape>(&body.shape);
  return shape != nullptr && shape->series;
}

std::optional<MeshSequence> sequence_of(const Scene& scene) {
  std::optional<MeshSequence> sequence;
  for (const BodySpec& body : scene.bodies) {
    if (!is_series(body)) {
      continue;
    }
    require(!sequence, "bodies: one of them at most can be given as meshes over time");
    sequence.emplace(std::get<MeshShape>(body.shape));
  }
  require(!sequence || scene.evaluation.kind != EvaluationSpec::Kind::kEdge,
          "evaluation.edge_mm: bodies given as meshes over time cannot be remeshed; take evaluation: {{split: 1}}");
  return sequence;
}

Vector3 mean_centre(const std::vector<TargetBox>& boxes) {
  Vector3 centre = Vector3::Zero();
  for (const TargetBox& box : boxes) {
    centre += box.centre / static_cast<double>(boxes.size());
  }
  return centre;
}

/// The times, kCheckStep apart, at which the numbers are where they were not before: in another thousandth of the range
/// that one of them goes through. All times where meshes move as well.
std::vector<double> places_in_time(const Trajectory& trajectory, double seconds, bool meshes_move) {
  constexpr double kCells = 1000;
  const auto steps = static_cast<int>(std::ceil(seconds / kCheckStep));
  const auto time_of = [&](int i) { return std::min(i * kCheckStep, seconds); };
  Eigen::VectorXd low = trajectory.state(0.0);
  Eigen::VectorXd high = low;
  for (int i = 0; i <= steps && !meshes_move; ++i) {
    const Eigen::VectorXd numbers = trajectory.state(time_of(i));
    low = low.cwiseMin(numbers);
    high = high.cwiseMax(numbers);
  }
  std::vector<double> times;
  std::unordered_set<std::uint64_t> known;
  for (int i = 0; i <= steps; ++i) {
    const Eigen::VectorXd numbers = trajectory.state(time_of(i));
    std::uint64_t cell = 0;
    for (Eigen::Index n = 0; n < numbers.size(); ++n) {
      const double range = high(n) - low(n);
      const double part = range > 0 ? std::floor(kCells * (numbers(n) - low(n)) / range) : 0.0;
      cell = mixed_bits(cell ^ static_cast<std::uint64_t>(part));
    }
    if (known.insert(cell).second || meshes_move) {
      times.push_back(time_of(i));
    }
  }
  return times;
}

/// "at 0.35 s: " before what is wrong there.
[[noreturn]] void fail_at(double seconds, const std::string& what) {
  throw InputError(fmt::format("motion: at {:.3f} s: {}", seconds, what));
}

/// The instants of a motion at which its target faces the array least and its skin is nearest to it.
class WorstViews {
 public:
  explicit WorstViews(const Model& first) : first_(first), facing_{array_view(first), 0.0}, nearest_(facing_) {}

  void look(const Model& model, double seconds) {
    const ArrayView view = array_view(model);
    if (view.worst && (!facing_.view.worst || view.worst->cosine < facing_.view.worst->cosine)) {
      facing_ = {view, seconds};
    }
    if (view.distance < nearest_.view.distance) {
      nearest_ = {view, seconds};
    }
  }

  Remarks remarks() const {
    Remarks remarks;
    const ArrayView begin = array_view(first_);
    if (const std::string warning = facing_warning(facing_.view); !warning.empty() && facing_warning(begin).empty()) {
      remarks.warnings.push_back(at(facing_, warning));
    }
    if (const std::string note = near_field_note(nearest_.view, first_);
        !note.empty() && near_field_note(begin, first_).empty()) {
      remarks.notes.push_back(at(nearest_, note));
    }
    return remarks;
  }

 private:
  struct Instant {
    ArrayView view;
    double seconds;
  };

  /// "name: at 0.35 s: what"
  static std::string at(const Instant& instant, const std::string& remark) {
    const std::size_t end = remark.find(": ") + 2;
    return fmt::format("{}at {:.2f} s: {}", remark.substr(0, end), instant.seconds, remark.substr(end));
  }

  const Model& first_;
  Instant facing_;
  Instant nearest_;
};

}  // namespace

MotionState MotionState::beyond(const MotionState& before, double share) const {
  MotionState state = *this;
  state.numbers += share * (numbers - before.numbers);
  if (vertices && before.vertices) {
    *state.vertices += share * (*vertices - *before.vertices);
  }
  if (skin && before.skin) {
    *state.skin += share * (*skin - *before.skin);
  }
  if (patches && before.patches) {
    *state.patches += share * (*patches - *before.patches);
  }
  return state;
}

MovingSkin::MovingSkin(const Scene& scene, const BodyPlan& plan, const TriangleMesh& mesh,
                       const std::vector<int>& owner)
    : triangles_(mesh.triangles()) {
  Eigen::Index begin = 0;
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    // Bodies lie one behind the other.
    const auto faces = std::equal_range(owner.begin(), owner.end(), static_cast<int>(b));
    Part part;
    part.begin = begin;
    part.triangles = triangles_.middleCols(faces.first - owner.begin(), faces.second - faces.first).array() -
                     static_cast<int>(begin);
    const Eigen::Index end = part.triangles.cols() > 0 ? begin + part.triangles.maxCoeff() + 1 : begin;
    part.own = plan.own_frame(scene, b)(Points(mesh.vertices().middleCols(begin, end - begin)));
    if (const HandShape* hand = turning_hand(scene, b); hand != nullptr && end > begin) {
      part.hand.emplace(part.own, skeleton_of(*hand), hand->side);
    }
    part.series = is_series(scene.bodies[b]);
    parts_.push_back(std::move(part));
    begin = end;
  }
}

std::optional<HandContact> MovingSkin::fold(const Posture& posture, std::size_t body) const {
  const Part& part = parts_[body];
  if (!part.hand) {
    return std::nullopt;
  }
  const HandSkeleton posed = skeleton_of(std::get<HandShape>(posture.bodies[body].shape));
  Points own = part.own;
  part.hand->pose(posed, part.triangles, own);
  return fold_of(*part.hand, posed, own, part.triangles);
}

TriangleMesh MovingSkin::at(const Posture& posture, const BodyPlan& plan, const MotionState& state) const {
  Points world(3, parts_.back().begin + parts_.back().own.cols());
  for (std::size_t b = 0; b < parts_.size(); ++b) {
    const Part& part = parts_[b];
    Points own = part.own;
    if (part.hand) {
      part.hand->pose(skeleton_of(std::get<HandShape>(posture.bodies[b].shape)), part.triangles, own);
    } else if (part.series) {
      own = *state.vertices;
    }
    const Placement& place = posture.bodies[b].place;
    const Eigen::Matrix3d turn = extrinsic_rotation(place.angles);
    world.middleCols(part.begin, own.cols()) =
        ((turn * (own.colwise() - plan.bodies[b].anchor)).colwise() + place.at).eval();
  }
  return {std::move(world), triangles_};
}

MovingModel::MovingModel(const Scene& scene, KeptBodies* kept, Progress* progress)
    : first_(build_model(scene, kept)),
      trajectory_(scene),
      sequence_(sequence_of(scene)),
      solving_(scene, first_.plan, first_.body.mesh, first_.fixed->owner) {
  require(!scene.sensing,
          "sensing: applies to a still only. For a motion put the same keys into motion.sensor.noise, which gives "
          "every sample noise of its own, and leave sensing out");
  require_fitting_phases(first_);
  if (first_.fixed->evaluation.kind == Evaluation::Kind::kEdge) {
    const EvaluationMesh evaluation = first_.fixed->evaluation.mesh(first_, kept);
    evaluating_.emplace(scene, first_.plan, evaluation.mesh, evaluation.owner);
  }
  if (!first_.beyond.empty()) {
    beyond_.emplace(scene, first_.plan, first_.beyond.mesh(), first_.beyond.owner);
  }
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    const HandShape* hand = turning_hand(scene, b);
    anchors_.emplace_back();
    if (hand != nullptr && !scene.bodies[b].place.landmark.empty()) {
      anchors_.back().emplace(Points(first_.plan.bodies[b].anchor), skeleton_of(*hand), hand->side);
    }
  }
  if (!first_.boxes.empty()) {
    patch_ = nearest_landmark(first_.body.mesh, "patch", mean_centre(first_.boxes));
  }
  Progress silent;
  check_motion(progress != nullptr ? *progress : silent);
}

Remarks moving_remarks(const MovingModel& moving) {
  Remarks remarks = played_remarks(moving.first());
  add(moving.on_the_way(), remarks);
  return remarks;
}

MotionState MovingModel::state(double seconds) const {
  MotionState state{trajectory_.state(seconds)};
  if (sequence_) {
    state.vertices = sequence_->state(seconds);
  }
  return state;
}

BodyPlan MovingModel::plan_at(const Posture& posture) const {
  BodyPlan plan = first_.plan;
  for (std::size_t b = 0; b < anchors_.size(); ++b) {
    if (anchors_[b]) {
      Points anchor(plan.bodies[b].anchor);
      anchors_[b]->pose(skeleton_of(std::get<HandShape>(posture.bodies[b].shape)), anchor);
      plan.bodies[b].anchor = anchor.col(0);
    }
  }
  return plan;
}

Model MovingModel::at(const MotionState& state) const {
  Posture posture = first_.posture;
  trajectory_.apply(state.numbers, posture);
  BodyPlan plan = plan_at(posture);
  const RigidMotion own_frame = plan.own_frame(posture, 0);
  TriangleMesh mesh =
      state.skin ? TriangleMesh(*state.skin, first_.body.mesh.triangles()) : solving_.at(posture, plan, state);
  Model model{first_.fixed,
              std::move(posture),
              std::move(plan),
              own_frame,
              {std::move(mesh), first_.body.landmarks},
              first_.beyond,
              {}};
  if (beyond_) {
    model.beyond.corners = state.patches ? *state.patches : beyond_->at(model.posture, model.plan, state).vertices();
  }
  if (model.posture.target) {
    const bool on_skin = model.fixed->scene.motion->target == MotionSpec::Target::kOnSkin;
    constexpr double kAny = std::numeric_limits<double>::infinity();  // the skin may move away from a place
    model.boxes = build_boxes(*model.posture.target, on_skin ? model : first_, kAny);
  }
  return model;
}

std::optional<TriangleMesh> MovingModel::evaluation_mesh(const Model& model, const MotionState& state) const {
  const Evaluation& evaluation = model.fixed->evaluation;
  if (evaluation.kind == Evaluation::Kind::kNone) {
    return std::nullopt;
  }
  return evaluating_ ? evaluating_->at(model.posture, model.plan, state) : evaluation.mesh(model).mesh;
}

Vector3 MovingModel::patch(const Model& model) const {
  if (model.fixed->scene.motion->target == MotionSpec::Target::kInWorld) {
    return position(model.body.mesh, patch_);
  }
  return mean_centre(model.boxes);
}

void MovingModel::check_motion(Progress& progress) {
  const Scene& scene = first_.fixed->scene;
  WorstViews views(first_);
  std::vector<std::optional<HandContacts>> contacts(scene.bodies.size());
  for (std::size_t b = 0; b < scene.bodies.size(); ++b) {
    if (const HandShape* hand = turning_hand(scene, b)) {
      contacts[b].emplace(skeleton_of(*hand), hand->side);
    }
  }
  const std::vector<double> times = places_in_time(trajectory_, scene.motion->seconds, sequence_.has_value());
  std::vector<std::pair<std::string, double>> taken;
  timed(progress, taken, "", fmt::format("check {:g} s of motion at {} times", scene.motion->seconds, times.size()),
        [&] {
          for (std::size_t i = 0; i < times.size(); ++i) {
            views.look(checked_at(times[i], contacts), times[i]);
            progress.advance((static_cast<double>(i) + 1) / static_cast<double>(times.size()));
          }
        });
  on_the_way_ = views.remarks();
}

Model MovingModel::checked_at(double seconds, const std::vector<std::optional<HandContacts>>& contacts) const {
  Model model = at(state(seconds));
  for (std::size_t b = 0; b < contacts.size(); ++b) {
    if (!contacts[b]) {
      continue;
    }
    auto contact = contacts[b]->at(skeleton_of(std::get<HandShape>(model.posture.bodies[b].shape)));
    contact = contact ? contact : solving_.fold(model.posture, b);
    if (contact) {
      fail_at(seconds, contact_text(*contact) + "; triangles that are the same for all poses cannot follow that");
    }
  }
  try {
    require_clear(model);
  } catch (const InputError& error) {
    fail_at(seconds, error.what());
  }
  return model;
}

namespace {

MovingSkin whole_skin_of(const Model& first, KeptBodies* kept) {
  const Scene& scene = first.fixed->scene;
  const bool series = std::ranges::any_of(scene.bodies, is_series);
  EdgeSpec edge;
  edge.far = WholeSkin::kFar;
  edge.within = WholeSkin::kWithin;
  if (scene.target) {
    edge.near_target = WholeSkin::kNearTarget;
  }
  const PlacedBodies whole = build_bodies(scene, first.plan, {series ? nullptr : &edge}, Extent::kWhole, kept);
  return {scene, first.plan, whole.body.mesh, whole.owner};
}

}  // namespace

WholeSkin::WholeSkin(const Model& first, KeptBodies* kept) : skin_(whole_skin_of(first, kept)) {}

}  // namespace touchfield
