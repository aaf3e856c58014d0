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
    resting_ = true;
  }
  void set_target(Pressure target) {
    target_ = target;
    resting_ = near_target();
  }

  void tick(PressureRate limit) {
    const Pressure step = clamp(target_ - value_, -(limit * kTick), limit * kTick);
    rate_ = per_tick(step);
    value_ += step;
    resting_ = near_target();
    if (resting_) value_ = target_;
  }

  Pressure value() const { return value_; }
  PressureRate rate() const { return rate_; }
  bool resting() const { return resting_; }

 private:
  bool near_target() const { return magnitude(target_ - value_) < kpa(1e-5f); }

  Pressure value_ = {};
  Pressure target_ = {};
  PressureRate rate_ = {};
  bool resting_ = true;
};

}  // namespace rig
