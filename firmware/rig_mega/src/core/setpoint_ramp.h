// The set-point on its way to the target: rate and acceleration are limited, and it brakes in time.
#pragma once

#include <math.h>

#include "tick.h"
#include "units.h"

namespace rig {

struct RampLimits {
  PressureRate rate;
  PressureRate change;  // of the rate, in one tick
};

class SetpointRamp {
 public:
  void start_from(Pressure value) {
    value_ = target_ = value;
    come_to_rest();
  }
  void set_target(Pressure target) {
    target_ = target;
    resting_ = false;
    if (near_target()) come_to_rest();
  }

  void tick(const RampLimits &limits) {
    const Pressure left = target_ - value_;
    const PressureRate fastest = clamp(braking(magnitude(left), limits.change), {}, limits.rate);
    const PressureRate wanted = left < Pressure{} ? -fastest : fastest;
    rate_ += clamp(wanted - rate_, -limits.change, limits.change);
    const Pressure step = rate_ * kTick;
    // a target that was moved nearer than it can brake for is not passed all the same
    const bool arrives = left < Pressure{} ? step <= left : step >= left;
    value_ += arrives ? left : step;
    if (near_target()) come_to_rest();
  }

  Pressure value() const { return value_; }
  PressureRate rate() const { return rate_; }
  bool resting() const { return resting_; }

 private:
  void come_to_rest() {
    value_ = target_;
    rate_ = {};
    resting_ = true;
  }

  bool near_target() const { return magnitude(target_ - value_) < kpa(1e-5f); }

  // As PlungerMotion brakes: v T + (v - c) T + ... = v^2 T/2c + v T/2 = d, c the change in a tick.
  static PressureRate braking(Pressure distance, PressureRate change) {
    const float half = 0.5f * change.value;
    const float reach = 2.0f * change.value * per_tick(distance).value;
    const PressureRate v = kpa_s(sqrtf(half * half + reach) - half);
    const PressureRate in_one_tick = per_tick(distance);
    return v < in_one_tick ? v : in_one_tick;
  }

  Pressure value_ = {};
  Pressure target_ = {};
  PressureRate rate_ = {};
  bool resting_ = true;
};

}  // namespace rig
