// A stepper driver at its three wires, which counts steps and watches its timing limits.
// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdint.h>

#include "emulator.h"

namespace rig_emulator_parts {

// Limits of a DRV8825 (Texas Instruments datasheet, timing requirements): step high and low 1.9 us
// at least, direction steady 650 ns before and after the rising edge. Shorter pulses still count:
// another driver might take them; the figures tell.
class StepperDriver {
 public:
  void step_rises(uint64_t cycle) {
    note(since(fell_, cycle), kLeastPause, figures_.least_pause, figures_.short_pauses);
    note(since(turned_, cycle), kLeastSetup, figures_.least_setup, figures_.early_pulses);
    rose_ = cycle;
    if (off_) {
      ++figures_.without_current;
      return;
    }
    ++figures_.pulses;
    moved_ += inward_ ? 1 : -1;
  }

  void step_falls(uint64_t cycle) {
    note(since(rose_, cycle), kLeastPulse, figures_.least_pulse, figures_.short_pulses);
    fell_ = cycle;
  }

  void turn(bool inward, uint64_t cycle) {
    note(since(rose_, cycle), kLeastHold, figures_.least_hold, figures_.late_turns);
    inward_ = inward;
    turned_ = cycle;
  }

  void switch_off(bool off) { off_ = off; }

  bool enabled() const { return !off_; }

  // Signed steps since the last call.
  int32_t take_steps() {
    const int32_t steps = moved_;
    moved_ = 0;
    return steps;
  }

  const rig_stepper_figures &figures() const { return figures_; }

 private:
  static constexpr uint64_t kNever = UINT64_MAX;
  static constexpr uint32_t kLeastPulse = 31, kLeastPause = 31;  // 1.9 us
  static constexpr uint32_t kLeastSetup = 11, kLeastHold = 11;   // 650 ns

  static uint32_t since(uint64_t then, uint64_t now) {
    const bool long_ago = then == kNever || now - then > UINT32_MAX;
    return long_ago ? UINT32_MAX : static_cast<uint32_t>(now - then);
  }

  static void note(uint32_t interval, uint32_t limit, uint32_t &least, uint64_t &violations) {
    if (interval < least) least = interval;
    if (interval < limit) ++violations;
  }

  bool inward_ = false;
  bool off_ = true;
  int32_t moved_ = 0;
  uint64_t rose_ = kNever, fell_ = kNever, turned_ = kNever;
  rig_stepper_figures figures_ = {0, 0, 0, 0, 0, 0, UINT32_MAX, UINT32_MAX, UINT32_MAX, UINT32_MAX};
};

}  // namespace rig_emulator_parts
