// The set-point on its way to the target, at a limited rate.
#pragma once

#include "tick.h"
#include "units.h"

namespace rig {

class SetpointRamp {
 public:
  void start_from(Pressure value) {
    value_ = target_ = value;
    rate_ = {};
  }
  void set_target(Pressure target) { target_ = target; }

  void tick(PressureRate limit) {
    const Pressure step = clamp(target_ - value_, -(limit * kTick), limit * kTick);
    rate_ = per_tick(step);
    value_ += step;
    if (resting()) value_ = target_;
  }

  Pressure value() const { return value_; }
  PressureRate rate() const { return rate_; }
  bool resting() const { return magnitude(target_ - value_) < kpa(1e-5f); }

 private:
  Pressure value_ = {};
  Pressure target_ = {};
  PressureRate rate_ = {};
};

}  // namespace rig
