// An HX711 load-cell converter at its two wires (Avia Semiconductor datasheet).
// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdint.h>

#include "emulator.h"

namespace rig_emulator_parts {

// 24 clock pulses read a word, most significant bit first; 25, 26 or 27 in all choose what is
// converted next: channel A at gain 128, B at 32, A at 64. A clock that stays high puts the chip to
// sleep; awake again it starts with channel A at 128.
class Hx711Chip {
 public:
  // A conversion of channel A at gain 128 is complete.
  void converted(uint32_t word) {
    if (asleep_) return;
    if (settling_ > 0) {
      --settling_;
      return;
    }
    if (ready_) ++figures_.missed;
    word_ = scaled(word);
    choose_by_pulses();
    ready_ = settling_ == 0;
    pulses_ = 0;
    data_ = !ready_;
  }

  void clock_rises(uint64_t cycle) {
    rose_ = cycle;
    if (!ready_ && pulses_ == 0) return;
    ready_ = false;
    ++pulses_;
    data_ = pulses_ > kBits || (word_ >> (kBits - pulses_) & 1) != 0;
    if (pulses_ == kBits) ++figures_.words;
  }

  void clock_falls(uint64_t cycle) {
    const uint32_t high = static_cast<uint32_t>(cycle - rose_);
    if (high > figures_.longest_high) figures_.longest_high = high;
    if (asleep_) wake();
  }

  // The clock has been high for kSleepCycles.
  void sleep() {
    asleep_ = true;
    ready_ = false;
    data_ = true;
    ++figures_.power_downs;
  }

  bool awake() const { return !asleep_; }
  bool data_line() const { return data_; }
  const rig_hx711_figures &figures() const { return figures_; }

  static constexpr uint32_t kSleepCycles = 60 * 16;  // 60 us

 private:
  static constexpr uint8_t kBits = 24;
  static constexpr uint8_t kSettlingConversions = 4;
  enum class Input : uint8_t { kA128, kB32, kA64 };

  void wake() {
    asleep_ = false;
    pulses_ = 0;
    input_ = Input::kA128;
    settling_ = kSettlingConversions;
  }

  void choose_by_pulses() {
    if (pulses_ <= kBits) return;
    const Input chosen = pulses_ == 26 ? Input::kB32 : pulses_ == 27 ? Input::kA64 : Input::kA128;
    if (chosen == input_) return;
    if (chosen != Input::kA128) ++figures_.other_gains;
    input_ = chosen;
    settling_ = kSettlingConversions;
  }

  // Nothing is connected to channel B.
  uint32_t scaled(uint32_t word) const {
    if (input_ == Input::kA128) return word;
    if (input_ == Input::kB32) return 0;
    const int32_t counts = static_cast<int32_t>(word << 8) >> 8;
    return static_cast<uint32_t>(counts / 2) & 0xFFFFFFu;
  }

  bool asleep_ = false, ready_ = false, data_ = true;
  uint8_t settling_ = kSettlingConversions;  // from power-on
  uint8_t pulses_ = 0;
  Input input_ = Input::kA128;
  uint32_t word_ = 0;
  uint64_t rose_ = 0;
  rig_hx711_figures figures_ = {};
};

}  // namespace rig_emulator_parts
