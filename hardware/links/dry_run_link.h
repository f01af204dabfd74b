#pragma once

#include "hardware/array_link.h"

namespace touchfield {

/// Everything but a device: writes each frame to a text file of phases [rad], one transducer a line in the run's order,
/// that a scene's method `fixed` reads back as its phases_file; the steps stand beside them as comments.
class DryRunLink final : public ArrayLink {
 public:
  /// array          whose shape it takes
  /// file           empty: writes nothing
  /// phase_levels   2..256
  /// sequence       the frames go to NAME-0001.ENDING, NAME-0002.ENDING, ...
  DryRunLink(ArrayLayout array, std::string file, int phase_levels, bool sequence);

  std::string describe() const override;
  const ArrayLayout& layout() const override { return array_; }
  LinkAbilities abilities() const override;
  void open() override {}
  void set_modulation(const Modulation& modulation) override;
  /// throws   IoError if the file cannot be written
  void send(const DriveFrame& frame) override;
  std::optional<DriveFrame> read_back() override { return last_; }
  std::optional<std::vector<std::uint8_t>> read_back_modulation() override { return modulation_; }
  void quiet() override {}
  void close() noexcept override {}

 private:
  std::string next_file();

  ArrayLayout array_;
  std::string file_;
  int phase_levels_;
  bool sequence_;
  int written_ = 0;
  DriveFrame last_;
  std::vector<std::uint8_t> modulation_;
};

}  // namespace touchfield
