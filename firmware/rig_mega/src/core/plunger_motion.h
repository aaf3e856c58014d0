// The plunger: acceleration-limited motion between the ends of its travel, as steps.
//
// Position counts the volume pushed in from home. With known home, motion brakes early enough to
// stop at the ends of travel.
#pragma once

#include <stdint.h>

#include "parameters.h"
#include "step_schedule.h"
#include "units.h"

namespace rig {

class PlungerMotion {
 public:
  void configure(const Parameters &parameters);

  void set_velocity(Flow velocity);              // follow a velocity
  void move_to(Volume target, Flow speed);       // go there and stop (trapezoidal)
  void stop() { set_velocity({}); }              // brake within the acceleration limit
  void stop_at_once();                           // give up steps still owed

  // Here is home; the ends of travel hold from now on.
  void set_home();
  void forget_home() { homed_ = false; }
  // While seeking home the outer end of travel is where the switch says.
  void seek_home(bool seeking) { seeking_home_ = seeking; }
  bool homed() const { return homed_; }

  // Advances one tick; returns the steps to give in the next.
  StepSchedule tick();

  Volume position() const { return position_; }
  Flow velocity() const { return velocity_; }
  bool moving() const { return magnitude(velocity_) > Flow{}; }
  // At rest at the target of move_to.
  bool arrived() const;
  // +1 or -1 while the end of travel holds the plunger back from moving in or out, else 0.
  int8_t blocked() const { return blocked_; }

 private:
  void update_position();
  Flow braking(Volume distance) const;
  Flow wanted() const;
  Flow within_travel(Flow wanted);

  enum class Mode : uint8_t { kVelocity, kPosition };

  Mode mode_ = Mode::kVelocity;
  bool homed_ = false;
  bool seeking_home_ = false;
  int8_t blocked_ = 0;
  Flow velocity_ = {};
  Flow target_velocity_ = {};
  Volume target_ = {};
  Flow speed_ = {};

  int32_t steps_ = 0;    // whole steps given since home
  float fraction_ = 0;   // part of a step owed, -1 to 1
  Volume position_ = {};

  Volume per_step_ = ml(1e-3f);
  float tick_steps_per_flow_ = 2;  // steps in a tick at 1 mL/s
  Volume travel_ = {};
  Volume stopping_ = {};  // from full speed
  Flow max_flow_ = {};
  FlowAcceleration acceleration_ = {};
  Flow change_ = {};      // of velocity in one tick, at most
};

}  // namespace rig
