#include "hardware/guard/guard_message.h"

#include <cstring>

#include "sim/core/errors.h"

namespace touchfield {

namespace {

enum class ModulationKind : std::uint32_t { kStatic, kSine, kSamples };

struct ModulationWriter {
  GuardMessage& message;

  void operator()(const StaticModulation&) const { message.put(static_cast<std::uint32_t>(ModulationKind::kStatic)); }
  void operator()(const SineModulation& sine) const {
    message.put(static_cast<std::uint32_t>(ModulationKind::kSine)).put(sine.frequency).put(sine.depth);
  }
  void operator()(const SampledModulation& samples) const {
    message.put(static_cast<std::uint32_t>(ModulationKind::kSamples)).put(samples.samples).put(samples.rate);
  }
};

}  // namespace

void GuardMessage::put_raw(const void* data, std::size_t size) {
  const auto* first = static_cast<const std::uint8_t*>(data);
  bytes_.insert(bytes_.end(), first, first + size);
}

void GuardMessage::take_raw(void* data, std::size_t size) {
  if (size > bytes_.size() - at_) {
    throw IoError("link guard: a message ends early");
  }
  if (size > 0) {
    std::memcpy(data, bytes_.data() + at_, size);
  }
  at_ += size;
}

GuardMessage& GuardMessage::put(std::uint32_t value) {
  put_raw(&value, sizeof value);
  return *this;
}

GuardMessage& GuardMessage::put(double value) {
  put_raw(&value, sizeof value);
  return *this;
}

GuardMessage& GuardMessage::put(const std::string& text) {
  put(static_cast<std::uint32_t>(text.size()));
  put_raw(text.data(), text.size());
  return *this;
}

GuardMessage& GuardMessage::put(const std::vector<std::uint8_t>& data) {
  put(static_cast<std::uint32_t>(data.size()));
  put_raw(data.data(), data.size());
  return *this;
}

GuardMessage& GuardMessage::put(const DriveFrame& frame) { return put(frame.phase).put(frame.intensity); }

GuardMessage& GuardMessage::put(const Modulation& modulation) {
  std::visit(ModulationWriter{*this}, modulation);
  return *this;
}

GuardMessage& GuardMessage::put(const ArrayLayout& layout) {
  put(static_cast<std::uint32_t>(layout.positions.cols()));
  put_raw(layout.positions.data(), static_cast<std::size_t>(layout.positions.size()) * sizeof(double));
  put_raw(layout.axes.data(), static_cast<std::size_t>(layout.axes.size()) * sizeof(double));
  put_raw(layout.device.data(), static_cast<std::size_t>(layout.device.size()) * sizeof(int));
  put_raw(layout.channel.data(), static_cast<std::size_t>(layout.channel.size()) * sizeof(int));
  return *this;
}

GuardMessage& GuardMessage::put(const LinkAbilities& abilities) {
  put(static_cast<std::uint32_t>(abilities.steps.phase_levels));
  put(static_cast<std::uint32_t>(abilities.steps.intensity_levels));
  put(abilities.most_frames_per_second);
  put(abilities.modulation.rate);
  put(static_cast<std::uint32_t>(abilities.modulation.most_samples));
  put(static_cast<std::uint32_t>(abilities.modulation.own_frequencies.size()));
  for (const double frequency : abilities.modulation.own_frequencies) {
    put(frequency);
  }
  return put(static_cast<std::uint32_t>(abilities.reads_back));
}

GuardMessage& GuardMessage::put(const LinkSettings& settings) {
  return put(settings.address)
      .put(settings.library)
      .put(settings.array)
      .put(static_cast<std::uint32_t>(settings.frames))
      .put(static_cast<std::uint32_t>(settings.replace));
}

GuardMessage& GuardMessage::append(const GuardMessage& other) {
  put_raw(other.bytes_.data(), other.bytes_.size());
  return *this;
}

std::uint32_t GuardMessage::take_number() {
  std::uint32_t value = 0;
  take_raw(&value, sizeof value);
  return value;
}

double GuardMessage::take_real() {
  double value = 0;
  take_raw(&value, sizeof value);
  return value;
}

std::string GuardMessage::take_text() {
  const std::vector<std::uint8_t> data = take_data();
  return {data.begin(), data.end()};
}

std::vector<std::uint8_t> GuardMessage::take_data() {
  const std::size_t size = take_number();
  if (size > bytes_.size() - at_) {
    throw IoError("link guard: a message ends early");
  }
  std::vector<std::uint8_t> data(size);
  take_raw(data.data(), size);
  return data;
}

DriveFrame GuardMessage::take_frame() {
  DriveFrame frame;
  frame.phase = take_data();
  frame.intensity = take_data();
  return frame;
}

Modulation GuardMessage::take_modulation() {
  switch (static_cast<ModulationKind>(take_number())) {
    case ModulationKind::kStatic:
      return StaticModulation{};
    case ModulationKind::kSine: {
      const double frequency = take_real();
      return SineModulation{frequency, take_real()};
    }
    case ModulationKind::kSamples: {
      std::vector<std::uint8_t> samples = take_data();
      return SampledModulation{std::move(samples), take_real()};
    }
  }
  throw IoError("link guard: an unknown modulation");
}

ArrayLayout GuardMessage::take_layout() {
  const auto n = static_cast<Eigen::Index>(take_number());
  constexpr std::size_t kBytesEach = 6 * sizeof(double) + 2 * sizeof(int);
  if (static_cast<std::size_t>(n) * kBytesEach > bytes_.size() - at_) {
    throw IoError("link guard: a message ends early");
  }
  ArrayLayout layout{Points(3, n), Points(3, n), Eigen::VectorXi(n), Eigen::VectorXi(n)};
  take_raw(layout.positions.data(), static_cast<std::size_t>(layout.positions.size()) * sizeof(double));
  take_raw(layout.axes.data(), static_cast<std::size_t>(layout.axes.size()) * sizeof(double));
  take_raw(layout.device.data(), static_cast<std::size_t>(n) * sizeof(int));
  take_raw(layout.channel.data(), static_cast<std::size_t>(n) * sizeof(int));
  return layout;
}

LinkAbilities GuardMessage::take_abilities() {
  LinkAbilities abilities;
  abilities.steps.phase_levels = static_cast<int>(take_number());
  abilities.steps.intensity_levels = static_cast<int>(take_number());
  abilities.most_frames_per_second = take_real();
  abilities.modulation.rate = take_real();
  abilities.modulation.most_samples = take_number();
  for (std::uint32_t left = take_number(); left > 0; --left) {
    abilities.modulation.own_frequencies.push_back(take_real());
  }
  abilities.reads_back = take_number() != 0;
  return abilities;
}

LinkSettings GuardMessage::take_settings() {
  LinkSettings settings;
  settings.address = take_text();
  settings.library = take_text();
  settings.array = take_layout();
  settings.frames = take_number();
  settings.replace = take_number() != 0;
  return settings;
}

}  // namespace touchfield
