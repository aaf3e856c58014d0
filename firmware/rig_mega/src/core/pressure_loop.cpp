#include "pressure_loop.h"

#include "tick.h"

namespace rig {

namespace {

Pressure outside(Pressure error, Pressure deadband) {
  if (error > deadband) return error - deadband;
  if (error < -deadband) return error + deadband;
  return {};
}

constexpr float kRampShare = 0.8f;
// Below this the drive is faster than any set-point: a plunger may be pushed in further than there
// is gas if the parameters are wrong.
constexpr Volume kLeastGas = ml(1.0f);

// Plunger volume for a kPa: the gas by Boyle, and by the feed-forward what grows with it.
float ml_per_kpa(const Parameters &parameters, Pressure setpoint, Volume gas, float share) {
  return to_ml(gas) * share / to_kpa(parameters.ambient_pressure() + setpoint);
}

Flow flow_demand(const Parameters &parameters, const SetpointRamp &setpoint, Volume plunger) {
  if (setpoint.resting()) return {};
  const Volume gas = parameters.system_volume() - plunger;
  if (gas < Volume{}) return {};
  return ml_s(ml_per_kpa(parameters, setpoint.value(), gas, parameters.feed_forward()) *
              setpoint.rate().value);
}

}  // namespace

RampLimits ramp_limits(const Parameters &parameters, Pressure setpoint, Volume plunger) {
  const Volume gas = parameters.system_volume() - plunger;
  const float share = parameters.feed_forward() > 1.0f ? parameters.feed_forward() : 1.0f;
  const float kpa_per_ml =
      kRampShare / ml_per_kpa(parameters, setpoint, gas < kLeastGas ? kLeastGas : gas, share);
  const PressureRate followed = kpa_s(to_ml_s(parameters.max_flow()) * kpa_per_ml);
  const PressureRate wanted = parameters.setpoint_rate();
  const Flow change = parameters.max_flow_acceleration() * kTick;
  return {followed < wanted ? followed : wanted, kpa_s(to_ml_s(change) * kpa_per_ml)};
}

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
