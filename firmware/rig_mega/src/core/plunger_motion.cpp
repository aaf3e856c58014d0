#include "plunger_motion.h"

#include <math.h>

#include "tick.h"

namespace rig {

namespace {

// What the step interrupt of the Mega can give, whatever the parameters say.
constexpr float kMaxStepsPerTick = 48;  // 24 kHz

}  // namespace

void PlungerMotion::configure(const Parameters &parameters) {
  const Volume per_step = parameters.volume_per_step();
  if (per_step < per_step_ || per_step > per_step_) homed_ = false;
  per_step_ = per_step;
  tick_steps_per_flow_ = to_seconds(kTick) / to_ml(per_step);
  travel_ = parameters.syringe_volume();
  acceleration_ = parameters.max_flow_acceleration();
  change_ = acceleration_ * kTick;
  const Flow fastest = per_tick(per_step * kMaxStepsPerTick);
  max_flow_ = parameters.max_flow() < fastest ? parameters.max_flow() : fastest;
  const float time_to_stop = max_flow_.value / acceleration_.value;
  stopping_ = max_flow_ * (seconds(0.5f * time_to_stop) + kTick);
  update_position();
}

void PlungerMotion::set_velocity(Flow velocity) {
  mode_ = Mode::kVelocity;
  target_velocity_ = velocity;
}

void PlungerMotion::move_to(Volume target, Flow speed) {
  mode_ = Mode::kPosition;
  target_ = target;
  speed_ = speed;
}

void PlungerMotion::stop_at_once() {
  set_velocity({});
  velocity_ = {};
}

void PlungerMotion::set_home() {
  steps_ = 0;
  fraction_ = 0;
  homed_ = true;
  update_position();
}

void PlungerMotion::update_position() {
  position_ = per_step_ * (static_cast<float>(steps_) + fraction_);
}

bool PlungerMotion::arrived() const {
  return !moving() && magnitude(target_ - position()) <= per_step_;
}

// The speed from which the plunger can still stop within `distance`, in steps of one tick:
// v T + (v - a T) T + ... = v^2/2a + v T/2 = d.
Flow PlungerMotion::braking(Volume distance) const {
  if (distance <= Volume{}) return {};
  if (distance >= stopping_) return max_flow_;
  const float a = acceleration_.value;
  const float half = 0.5f * a * to_seconds(kTick);
  const float v = sqrtf(half * half + 2.0f * a * to_ml(distance)) - half;
  const Flow in_one_tick = per_tick(distance);
  return ml_s(v) < in_one_tick ? ml_s(v) : in_one_tick;
}

Flow PlungerMotion::wanted() const {
  if (mode_ == Mode::kVelocity) return clamp(target_velocity_, -max_flow_, max_flow_);
  const Volume left = target_ - position();
  if (magnitude(left) <= per_step_ * 0.5f) return {};
  const Flow fastest = clamp(speed_, Flow{}, max_flow_);
  const Flow speed = clamp(braking(magnitude(left)), Flow{}, fastest);
  return left < Volume{} ? -speed : speed;
}

Flow PlungerMotion::within_travel(Flow wanted) {
  blocked_ = 0;
  if (!homed_) return wanted;
  const Volume here = position();
  if (wanted >= Flow{}) {
    const Flow inward = braking(travel_ - here);
    if (wanted <= inward) return wanted;
    if (travel_ - here <= per_step_) blocked_ = 1;
    return inward;
  }
  if (seeking_home_) return wanted;
  const Flow outward = -braking(here);
  if (wanted >= outward) return wanted;
  if (here <= per_step_) blocked_ = -1;
  return outward;
}

StepSchedule PlungerMotion::tick() {
  const Flow goal = within_travel(wanted());
  velocity_ += clamp(goal - velocity_, -change_, change_);
  if (!moving()) return kNoSteps;
  const float travel = to_ml_s(velocity_) * tick_steps_per_flow_;
  const bool inward = velocity_ > Flow{};
  const float phase = inward ? fraction_ : -fraction_;
  const float end = fraction_ + travel;
  const int32_t whole = static_cast<int32_t>(end);  // towards zero
  fraction_ = end - static_cast<float>(whole);
  steps_ += whole;
  update_position();
  if (whole == 0) return kNoSteps;
  const uint16_t count = static_cast<uint16_t>(inward ? whole : -whole);
  return schedule_steps(inward, count, phase, inward ? travel : -travel);
}

}  // namespace rig
