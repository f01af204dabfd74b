#include "hardware/links/autd3_link.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <netdb.h>
#include <sys/socket.h>
#include <thread>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"

namespace touchfield {

namespace {

constexpr double kCycle = 1e-3;               // [s] between two messages, and between two looks for an answer
constexpr double kLibrarysOwn = -1;           // patience as the library has it
constexpr double kMostFramesPerSecond = 500;  // a frame and its answer: two cycles of 1 ms
// Within kLinkPatience whatever is silent. Long enough that a busy machine is not taken for one.
constexpr double kAnswerPatience = 0.09;  // [s] for an answer of the server of `remote`
constexpr double kFramePatience = 0.09;   // [s] until the units must have said that they took a frame

void require_rotation(const Eigen::Matrix3d& rotation, std::size_t unit) {
  const double off = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (!(off < 1e-9 && rotation.determinant() > 0)) {
    throw InputError(fmt::format(
        "autd3-legacy: unit {}: its matrix is not a rotation: R R^T is {:.3g} off the identity, det R = {:.3g}", unit,
        off, rotation.determinant()));
  }
}

void require_valid(const Autd3Options& options) {
  if (options.mode != "audit" && options.mode != "nop" && options.mode != "remote" && options.mode != "twincat") {
    throw InputError(
        fmt::format("autd3-legacy: mode = \"{}\" must be one of audit, nop, remote, twincat", options.mode));
  }
  if (options.mode == "remote" && (options.port < 1 || options.port > 65535)) {
    throw InputError(fmt::format("autd3-legacy: port = {} must be from 1 to 65535", options.port));
  }
  if (options.mode == "remote" && options.host.empty()) {
    throw InputError("autd3-legacy: remote needs a host");
  }
  if (options.mode != "audit" && options.break_after >= 0) {
    throw InputError(fmt::format("autd3-legacy: only the link audit breaks on purpose, not {}", options.mode));
  }
  // The library counts units with 16 bits.
  if (options.units.empty() || options.units.size() > std::numeric_limits<std::uint16_t>::max()) {
    throw InputError(fmt::format("autd3-legacy: {} units; there must be 1 to {}", options.units.size(),
                                 std::numeric_limits<std::uint16_t>::max()));
  }
  for (std::size_t unit = 0; unit < options.units.size(); ++unit) {
    if (!options.units[unit].position.allFinite()) {
      throw InputError(fmt::format("autd3-legacy: unit {}: its position is not finite", unit));
    }
    require_rotation(options.units[unit].rotation, unit);
  }
}

autd3::Point point_of(const Vector3& position) {
  const Eigen::Vector3f p = (position / kMillimetre).cast<float>();
  return {p.x(), p.y(), p.z()};
}

autd3::Quaternion quaternion_of(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaternionf q = Eigen::Quaterniond(rotation).normalized().cast<float>();
  return {q.w(), q.x(), q.y(), q.z()};
}

Vector3 vector_of(const autd3::Point& point) { return {point.x, point.y, point.z}; }

// Numeric addresses "IP:PORT" of a host: the library takes no names.
std::vector<std::string> addresses_of(const std::string& host, int port) {
  addrinfo wanted{};
  wanted.ai_family = AF_UNSPEC;
  wanted.ai_socktype = SOCK_STREAM;
  addrinfo* found = nullptr;
  const int failed = getaddrinfo(host.c_str(), std::to_string(port).c_str(), &wanted, &found);
  if (failed != 0) {
    throw DeviceError(fmt::format("autd3-legacy: remote: no address of {}: {}", host, gai_strerror(failed)));
  }
  std::vector<std::string> addresses;
  for (const addrinfo* at = found; at != nullptr; at = at->ai_next) {
    std::array<char, NI_MAXHOST> text{};
    if (getnameinfo(at->ai_addr, at->ai_addrlen, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST) == 0) {
      const std::string ip = text.data();
      addresses.push_back(at->ai_family == AF_INET6 ? fmt::format("[{}]:{}", ip, port)
                                                    : fmt::format("{}:{}", ip, port));
    }
  }
  freeaddrinfo(found);
  return addresses;
}

// A message a millisecond, the units' own cycle.
autd3::SenderOption sender_option(double patience) {
  return {autd3_duration(kCycle), autd3_duration(kCycle), autd3_duration(patience)};
}

struct FrameInUnits {
  const DriveFrame* frame;
  std::size_t per_unit;
};

void drive_of(const void* context, const autd3::Geometry* /*geometry*/, std::uint16_t device, std::uint8_t transducer,
              autd3::Drive* drive) {
  const auto* units = static_cast<const FrameInUnits*>(context);
  const std::size_t n = device * units->per_unit + transducer;
  *drive = {units->frame->phase[n], units->frame->intensity[n]};
}

}  // namespace

Autd3Link::Autd3Link(Autd3Options options)
    : options_((require_valid(options), std::move(options))),
      library_(options_.library),
      layout_(autd3_layout(options_.units)) {}

Autd3Link::~Autd3Link() { close(); }

std::string Autd3Link::describe() const {
  const std::string way = options_.mode == "remote"  ? fmt::format("remote, {} port {}", options_.host, options_.port)
                          : options_.mode == "audit" ? "audit, the vendor's emulator"
                          : options_.mode == "nop"   ? "nop, which sends nothing"
                                                     : options_.mode;
  return fmt::format("autd3-legacy: {} unit{}, firmware {}, link {}", options_.units.size(),
                     options_.units.size() == 1 ? "" : "s", library_.firmware(), way);
}

LinkAbilities Autd3Link::abilities() const {
  LinkAbilities can = autd3_abilities(kMostFramesPerSecond);
  can.reads_back = options_.mode == "audit";
  return can;
}

template <class T>
T Autd3Link::value_or_lost(const autd3::Result<T>& result, std::string_view what) {
  try {
    return library_.value_of(result, fmt::format("{}: the link {} is lost", what, options_.mode));
  } catch (const DeviceError&) {
    lost_ = true;
    throw;
  }
}

autd3::Controller* Autd3Link::opened(autd3::Link* link) const {
  std::vector<autd3::Point> positions;
  std::vector<autd3::Quaternion> rotations;
  for (const UnitPlacement& unit : options_.units) {
    positions.push_back(point_of(unit.position));
    rotations.push_back(quaternion_of(unit.rotation));
  }
  // The units' clocks are put in step here, which takes as long as the library allows it.
  return library_.value_of(
      library_.call().open(positions.data(), rotations.data(), static_cast<std::uint16_t>(positions.size()), link,
                           sender_option(kLibrarysOwn)),
      "cannot open the link " + options_.mode);
}

autd3::Controller* Autd3Link::opened_remote() const {
  std::string refusals;
  for (const std::string& address : addresses_of(options_.host, options_.port)) {
    try {
      return opened(library_.remote_link(address, kAnswerPatience));
    } catch (const DeviceError& error) {
      refusals += fmt::format("{}{} ({})", refusals.empty() ? "" : "; ", error.what(), address);
    }
  }
  throw DeviceError(refusals);
}

void Autd3Link::open() {
  if (controller_ != nullptr) {
    throw DeviceError("autd3-legacy: the link is open already");
  }
  lost_ = false;
  frames_sent_ = 0;
  controller_ = options_.mode == "remote"    ? opened_remote()
                : options_.mode == "twincat" ? opened(library_.twincat_link())
                : options_.mode == "audit"   ? opened(library_.call().audit_link())
                                             : opened(library_.call().nop_link());
  library_.call().set_default(controller_, sender_option(kFramePatience));
  sender_ = library_.call().sender(controller_, sender_option(kFramePatience));
  try {
    check_layout();
    send_datagram(library_.call().silencer_datagram({kAutd3IntensitySteps, kAutd3PhaseSteps, true}), "smoothing");
  } catch (const DeviceError&) {
    close();
    throw;
  }
}

ArrayLayout Autd3Link::library_layout() const {
  require_open();
  const autd3::Calls& call = library_.call();
  autd3::Geometry* geometry = call.geometry(controller_);
  std::vector<ArrayLayout> units;
  for (std::uint32_t u = 0; u < call.device_count(geometry); ++u) {
    autd3::Device* device = call.device(geometry, static_cast<std::uint16_t>(u));
    const auto n = static_cast<Eigen::Index>(call.transducer_count(device));
    ArrayLayout unit{Points(3, n), vector_of(call.axis(device)).normalized().replicate(1, n), Eigen::VectorXi::Zero(n),
                     Eigen::VectorXi::LinSpaced(n, 0, static_cast<int>(n) - 1)};
    for (Eigen::Index i = 0; i < n; ++i) {
      unit.positions.col(i) =
          kMillimetre * vector_of(call.position(call.transducer(device, static_cast<std::uint8_t>(i))));
    }
    units.push_back(std::move(unit));
  }
  return joined(units);
}

void Autd3Link::check_layout() const {
  const ArrayLayout theirs = library_layout();
  if (theirs.positions.cols() != layout_.positions.cols() || theirs.device != layout_.device ||
      theirs.channel != layout_.channel) {
    throw DeviceError(fmt::format("autd3-legacy: the library has {} transducers in other units than the {} expected",
                                  theirs.positions.cols(), layout_.positions.cols()));
  }
  Eigen::Index worst = 0;
  const double miss = (theirs.positions - layout_.positions).colwise().norm().maxCoeff(&worst);
  if (!(miss <= kAutd3PositionTolerance)) {
    throw DeviceError(fmt::format(
        "autd3-legacy: the library puts transducer {} of unit {} {:.3g} m from its place; {:g} m is the most it may be",
        layout_.channel(worst), layout_.device(worst), miss, kAutd3PositionTolerance));
  }
}

void Autd3Link::set_modulation(const Modulation& modulation) {
  require_live();
  const std::vector<std::uint8_t> samples = autd3_samples(modulation, describe());
  const autd3::Calls& call = library_.call();
  send_datagram(
      call.modulation_datagram(call.custom_modulation(samples.data(), static_cast<std::uint16_t>(samples.size()),
                                                      call.sampling_of_divider(kAutd3ModulationDivider))),
      "modulation");
}

void Autd3Link::send(const DriveFrame& frame) {
  require_live();
  require_fits(frame, abilities(), static_cast<std::size_t>(layout_.positions.cols()), describe());
  if (frames_sent_ == options_.break_after) {
    break_down();
  }
  const autd3::Calls& call = library_.call();
  // The library asks for the drives while it sends, so not after this call.
  const FrameInUnits units{&frame, frame.size() / options_.units.size()};
  send_datagram(call.gain_datagram(call.custom_gain(drive_of, &units, call.geometry(controller_))),
                fmt::format("frame {}", frames_sent_));
  ++frames_sent_;
}

void Autd3Link::check() {
  require_live();
  const autd3::Calls& call = library_.call();
  call.delete_fpga_states(value_or_lost(call.fpga_states(controller_), "while a frame is held"));
}

void Autd3Link::quiet() {
  require_open();
  send_datagram(library_.call().gain_datagram(library_.call().null_gain()), "the quiet frame");
}

void Autd3Link::close() noexcept {
  if (controller_ == nullptr) {
    return;
  }
  const auto close_controller = [library = library_, controller = std::exchange(controller_, nullptr)]() noexcept {
    try {
      library.value_of(library.call().close(controller), "close");
    } catch (const std::exception&) {  // NOLINT(bugprone-empty-catch): fetched, so that the library frees it
    }
  };
  if (!lost_) {
    close_controller();
    return;
  }
  // The library sends some messages more, and waits for an answer to each: nobody else has to wait for that.
  try {
    std::thread(close_controller).detach();
  } catch (const std::exception&) {
    close_controller();
  }
}

void Autd3Link::send_datagram(autd3::Datagram* datagram, std::string_view what) {
  constexpr std::uint8_t kDone = 0;
  const autd3::Calls& call = library_.call();
  if (value_or_lost(call.send(sender_, datagram), what) != kDone) {
    lost_ = true;
    throw DeviceError(
        fmt::format("autd3-legacy: {}: the link {} is lost: the units did not confirm it", what, options_.mode));
  }
}

void Autd3Link::require_live() const {
  require_open();
  if (lost_) {
    throw DeviceError("autd3-legacy: the link was lost before; nothing is sent until it is opened again");
  }
}

void Autd3Link::require_open() const {
  if (controller_ == nullptr) {
    throw DeviceError("autd3-legacy: the link is not open");
  }
}

autd3::Link* Autd3Link::open_audit() const {
  require_open();
  if (options_.mode != "audit") {
    throw InputError(fmt::format("autd3-legacy: the link {} cannot be inspected, only audit can", options_.mode));
  }
  return library_.call().link_of(controller_);
}

std::optional<DriveFrame> Autd3Link::read_back() {
  if (options_.mode != "audit") {
    return std::nullopt;
  }
  DriveFrame all;
  for (std::size_t unit = 0; unit < options_.units.size(); ++unit) {
    const DriveFrame drives = audit(unit).drives;
    all.phase.insert(all.phase.end(), drives.phase.begin(), drives.phase.end());
    all.intensity.insert(all.intensity.end(), drives.intensity.begin(), drives.intensity.end());
  }
  return all;
}

std::optional<std::vector<std::uint8_t>> Autd3Link::read_back_modulation() {
  if (options_.mode != "audit") {
    return std::nullopt;
  }
  const std::vector<std::uint8_t> samples = audit(0).modulation;
  for (std::size_t unit = 1; unit < options_.units.size(); ++unit) {
    if (audit(unit).modulation != samples) {
      throw DeviceError(fmt::format("autd3-legacy: units 0 and {} hold different modulations", unit));
    }
  }
  return samples;
}

Autd3UnitState Autd3Link::audit(std::size_t unit) const {
  autd3::Link* link = open_audit();
  if (unit >= options_.units.size()) {
    throw InputError(
        fmt::format("autd3-legacy: unit {} does not exist, the number of units is {}", unit, options_.units.size()));
  }
  const auto device = static_cast<std::uint16_t>(unit);
  const autd3::Calls& call = library_.call();

  std::vector<autd3::Drive> drives(call.audit_transducer_count(link, device));
  call.audit_drives(link, call.audit_gain_segment(link, device), device, 0, drives.data());
  Autd3UnitState state;
  for (const autd3::Drive& drive : drives) {
    state.drives.phase.push_back(drive.phase);
    state.drives.intensity.push_back(drive.intensity);
  }

  const std::uint8_t segment = call.audit_modulation_segment(link, device);
  state.modulation.resize(call.audit_modulation_count(link, segment, device));
  call.audit_modulation(link, segment, device, state.modulation.data());
  state.modulation_divider = call.audit_modulation_divider(link, segment, device);
  state.phase_steps = call.audit_phase_steps(link, device);
  state.intensity_steps = call.audit_intensity_steps(link, device);
  state.fixed_steps = call.audit_fixed_steps(link, device);
  return state;
}

void Autd3Link::break_down() { library_.call().audit_break(open_audit()); }

}  // namespace touchfield
