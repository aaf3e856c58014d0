// PI pressure controller that commands plunger flow.
//
//   q = kp e + I + ff V/(p_amb + p) dr/dt,   I' = ki e
//
// e is the error outside the deadband. The feed-forward is the isothermal flow demand of a gas
// volume V. The integral stands still while the set-point moves (what it would learn there is the
// error of the feed-forward, and it would overshoot by it) and while the plunger cannot follow.
// The set-point moves only as the plunger can follow: it would run on otherwise, and overshoot.
#pragma once

#include "parameters.h"
#include "setpoint_ramp.h"
#include "units.h"

namespace rig {

// What the set-point may ask of a plunger there: most of its flow and acceleration, the rest is the
// feedback's.
RampLimits ramp_limits(const Parameters &parameters, Pressure setpoint, Volume plunger);

class PressureLoop {
 public:
  void reset();

  // `blocked` is +1 or -1 while the plunger cannot move further in or out, else 0.
  Flow tick(const Parameters &parameters, const SetpointRamp &setpoint, Pressure measured,
            Volume plunger, int8_t blocked);

  Flow integral() const { return integral_; }
  bool saturated() const { return saturated_; }

 private:
  Flow integral_ = {};
  bool saturated_ = false;
};

}  // namespace rig
