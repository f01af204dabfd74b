#include "hardware/emission/emission.h"
#include "sim/acoustics/transducer_array.h"
#include "tests/support/testing.h"

namespace touchfield::emission_policy_test {

const LinkAbilities kGraded{{256, 256}, 50, {}, false};
const LinkAbilities kOnOff{{32, 2}, 89, {}, false};
constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

EmissionRequest with_level(std::optional<double> level, double most = 0.5) {
  EmissionRequest request;
  request.level = level;
  request.most_level = most;
  return request;
}

EmissionRequest with_seconds(std::optional<double> seconds, double most = 10, double rate = 1) {
  EmissionRequest request;
  request.seconds = seconds;
  request.most_seconds = most;
  request.rate = rate;
  return request;
}

void expect_level_refused(const EmissionRequest& request, const LinkAbilities& abilities, const char* says) {
  EXPECT_THAT([&] { permitted_level(request, abilities, "a device"); }, ThrowsMessage<InputError>(HasSubstr(says)));
}

void expect_seconds_refused(const EmissionRequest& request, std::size_t frames, const char* says) {
  EXPECT_THAT([&] { permitted_seconds(request, frames); }, ThrowsMessage<InputError>(HasSubstr(says)));
}

TEST(PermittedLevel, IsWhatIsAskedForUpToTheCap) {
  EXPECT_EQ(permitted_level(with_level(0.25), kGraded, ""), 0.25);
  EXPECT_EQ(permitted_level(with_level(0.5), kGraded, ""), 0.5);
  EXPECT_EQ(permitted_level(with_level(1.0, 1.0), kGraded, ""), 1.0);
  expect_level_refused(with_level(std::nextafter(0.5, 1.0)), kGraded, "--max-level raises the cap");
  expect_level_refused(with_level(0.9, 0.8), kGraded, "level = 0.9 must be <= 0.8");
}

TEST(PermittedLevel, DefaultNeverPassesTheCap) {
  EXPECT_EQ(permitted_level(with_level({}), kGraded, ""), kUsualLevel);
  EXPECT_EQ(permitted_level(with_level({}, 0.2), kGraded, ""), 0.2);
  EXPECT_EQ(permitted_level(with_level({}, 1.0), kGraded, ""), kUsualLevel);
}

TEST(PermittedLevel, OfADeviceThatIsOnOrOffIsOneAndTakesARaisedCap) {
  EXPECT_EQ(permitted_level(with_level({}, 1.0), kOnOff, ""), 1.0);
  EXPECT_EQ(permitted_level(with_level(1.0, 1.0), kOnOff, ""), 1.0);
  expect_level_refused(with_level({}), kOnOff, "a device has no other; --max-level raises the cap");
  expect_level_refused(with_level(0.5, 1.0), kOnOff, "a device drives its transducers fully or not at all");
}

TEST(PermittedLevel, RefusesWhatIsNoLevel) {
  for (const double level : {0.0, -0.1, 1.01, kNan, kInfinity}) {
    expect_level_refused(with_level(level, 1.0), kGraded, "must be > 0 and <= 1");
    expect_level_refused(with_level(0.1, level), kGraded, "--max-level");
  }
}

TEST(PermittedSeconds, DefaultIsASecondOrOnceThrough) {
  EXPECT_EQ(permitted_seconds(with_seconds({}), 1), kOneFrameSeconds);
  EXPECT_EQ(permitted_seconds(with_seconds({}, 10, 20), 50), 2.5);
  expect_seconds_refused(with_seconds({}, 10, 20), 201, "10.05 s of emission must be <= 10 s");
}

TEST(PermittedSeconds, IsWhatIsAskedForUpToTheCap) {
  EXPECT_EQ(permitted_seconds(with_seconds(10.0), 1), 10);
  EXPECT_EQ(permitted_seconds(with_seconds(60.0, 60.0), 1), 60);
  expect_seconds_refused(with_seconds(std::nextafter(10.0, 11.0)), 1, "--max-seconds raises the cap");
}

TEST(PermittedSeconds, RefusesWhatIsNoTime) {
  for (const double seconds : {0.0, -1.0, kNan, kInfinity}) {
    expect_seconds_refused(with_seconds(seconds), 1, "--seconds");
    expect_seconds_refused(with_seconds(1.0, seconds), 1, "--max-seconds");
  }
}

TEST(PermittedRate, IsAboveZeroAndWhatTheDeviceCarries) {
  EmissionRequest request;
  request.rate = 50;
  EXPECT_EQ(permitted_rate(request, kGraded, ""), 50);
  for (const double rate : {0.0, -1.0, 50.1, kNan, kInfinity}) {
    request.rate = rate;
    EXPECT_THAT([&] { permitted_rate(request, kGraded, "a device"); },
                ThrowsMessage<InputError>(HasSubstr("<= 50, the limit of a device")));
  }
}

/// A plan of one frame for a dry run of four transducers.
EmissionPlan dry_plan() {
  EmissionPlan plan;
  plan.array = grid_layout(2, 2, 0.01);
  plan.drives = [](const ArrayLayout& device) {
    const Eigen::Index n = device.positions.cols();
    return std::vector<Drive>{{Eigen::VectorXd::Zero(n), Eigen::VectorXd::Ones(n)}};
  };
  return plan;
}

TEST(Emission, ADryRunEmitsNothingEvenIfTold) {
  EmissionPlan plan = dry_plan();
  plan.emit = true;
  const EmissionReport report = emit(plan);
  EXPECT_TRUE(report.dry);
  EXPECT_FALSE(report.emitted);
  EXPECT_EQ(report.transducers, 4U);
  EXPECT_EQ(report.frames, 1U);
  EXPECT_EQ(report.level, kUsualLevel);
  EXPECT_EQ(report.seconds, kOneFrameSeconds);
}

TEST(Emission, ChecksThePolicyBeforeAnythingIsSent) {
  EmissionPlan plan = dry_plan();
  plan.request.level = 0.75;
  EXPECT_THAT([&] { emit(plan); }, ThrowsMessage<InputError>(HasSubstr("--max-level raises the cap")));
  plan = dry_plan();
  plan.request.seconds = 11;
  EXPECT_THAT([&] { emit(plan); }, ThrowsMessage<InputError>(HasSubstr("--max-seconds raises the cap")));
  plan = dry_plan();
  plan.request.rate = 1e9;
  EXPECT_THAT([&] { emit(plan); }, ThrowsMessage<InputError>(HasSubstr("frames per second")));
  plan = dry_plan();
  plan.must_match.push_back(make_array(grid_layout(3, 1, 0.01), Directivity::omni(), 1, 1));
  EXPECT_THAT([&] { emit(plan); }, ThrowsMessage<InputError>(HasSubstr("transducers")));
}

}  // namespace touchfield::emission_policy_test
