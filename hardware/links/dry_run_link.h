#pragma once

#include "hardware/array_link.h"

namespace touchfield {

struct DryRunFiles {
  std::string file;        // empty: nothing is written
  std::size_t frames = 1;  // more than one go to NAME-0001.ENDING, NAME-0002.ENDING, ...
  bool replace = false;    // files that are there

  /// The file of a frame from 0.
  std::string of(std::size_t frame) const;
};

/// Everything but a device: writes each frame to a text file of phases [rad], one line per transducer in the run's
/// order. A scene's method `fixed` reads this file back as its phases_file. The steps stand beside the phases as
/// comments.
class DryRunLink final : public ArrayLink {
 public:
  /// array          whose shape it takes
  /// phase_levels   2..256
  DryRunLink(ArrayLayout array, int phase_levels, DryRunFiles files);

  std::string describe() const override;
  const ArrayLayout& layout() const override { return array_; }
  LinkAbilities abilities() const override;
  /// throws   InputError if one of its files is there and may not be replaced
  void open() override;
  void set_modulation(const Modulation& modulation) override;
  /// Its file appears whole or not at all.
  /// throws   IoError if it cannot be written
  void send(const DriveFrame& frame) override;
  void silence() override {}
  void close() noexcept override {}

 private:
  ArrayLayout array_;
  int phase_levels_;
  DryRunFiles files_;
  std::size_t written_ = 0;
};

}  // namespace touchfield
