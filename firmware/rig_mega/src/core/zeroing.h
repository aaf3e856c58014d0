// The mean transducer voltage over a second, the new zero of pressure.
#pragma once

#include <stdint.h>

#include "tick.h"
#include "units.h"

namespace rig {

class Zeroing {
 public:
  void begin() {
    ticks_ = 0;
    sum_ = {};
    active_ = true;
  }
  void abandon() { active_ = false; }
  bool active() const { return active_; }

  // True in the tick that completes the mean.
  bool tick(Voltage voltage) {
    if (!active_) return false;
    sum_ += voltage;
    if (++ticks_ < kTicks) return false;
    active_ = false;
    return true;
  }
  Voltage mean() const { return sum_ * (1.0f / kTicks); }

 private:
  static constexpr uint16_t kTicks = ticks_of_ms(1000);

  Voltage sum_ = {};
  uint16_t ticks_ = 0;
  bool active_ = false;
};

}  // namespace rig
