#include "pressure_loop.h"

#include "tick.h"

namespace rig {

namespace {

Pressure outside(Pressure error, Pressure deadband) {
  if (error > deadband) return error - deadband;
  if (error < -deadband) return error + deadband;
  return {};
}

Flow flow_demand(const Parameters &parameters, const SetpointRamp &setpoint, Volume plunger) {
  if (setpoint.resting()) return {};
  const Volume gas = parameters.system_volume() - plunger;
  if (gas < Volume{}) return {};
  const Pressure absolute = parameters.ambient_pressure() + setpoint.value();
  const float compression_per_s = setpoint.rate().value / to_kpa(absolute);
  return ml_s(to_ml(gas) * parameters.feed_forward() * compression_per_s);
}

}  // namespace

void PressureLoop::reset() {
  integral_ = {};
  saturated_ = false;
}

Flow PressureLoop::tick(const Parameters &parameters, const SetpointRamp &setpoint,
                        Pressure measured, Volume plunger, int8_t blocked) {
  const Flow limit = parameters.max_flow();
  const float error = to_kpa(outside(setpoint.value() - measured, parameters.deadband()));
  const Flow wanted = ml_s(parameters.proportional() * error) + integral_ +
                      flow_demand(parameters, setpoint, plunger);
  const Flow given = clamp(wanted, -limit, limit);
  const bool limited_in = wanted > limit || blocked > 0;
  const bool limited_out = wanted < -limit || blocked < 0;
  saturated_ = limited_in || limited_out;
  const bool deepens = (limited_in && error > 0) || (limited_out && error < 0);
  if (setpoint.resting() && !deepens) {
    const Flow step = ml_s(parameters.integral() * error * to_seconds(kTick));
    integral_ = clamp(integral_ + step, -limit, limit);
  }
  return given;
}

}  // namespace rig
