// A leak: the set-point rests, yet the plunger keeps pushing beyond where it settled.
#pragma once

#include <stdint.h>

#include "faults.h"
#include "tick.h"
#include "units.h"

namespace rig {

class LeakMonitor {
 public:
  void reset() { rested_ticks_ = 0; }

  Finding tick(bool setpoint_rests, Volume plunger, Volume limit) {
    if (!setpoint_rests) {
      rested_ticks_ = 0;
      return kNoFinding;
    }
    if (rested_ticks_ < kSettlingTicks) {
      ++rested_ticks_;
      settled_ = plunger;
      return kNoFinding;
    }
    // after an overshoot the plunger first comes back
    if (plunger < settled_) settled_ = plunger;
    const Volume pushed = plunger - settled_;
    if (pushed > limit) return {Fault::kLeak, to_ml(pushed)};
    return kNoFinding;
  }

 private:
  static constexpr uint16_t kSettlingTicks = ticks_of_ms(2000);

  uint16_t rested_ticks_ = 0;
  Volume settled_ = {};
};

}  // namespace rig
