#include "homing.h"

namespace rig {

namespace {

constexpr float kSlowShare = 0.25f;      // of the homing flow
constexpr Volume kNear = ml(0.3f);       // from here on slowly
constexpr Volume kClearance = ml(0.2f);  // beyond where the switch released
constexpr Volume kReach = ml(3.0f);      // a switch further off than this is not there

Homing::Progress found(PlungerMotion &motion) {
  motion.stop_at_once();
  motion.set_home();
  motion.seek_home(false);
  return Homing::Progress::kFound;
}

}  // namespace

void Homing::search(PlungerMotion &motion, const Parameters &parameters) {
  motion.forget_home();
  enter(Phase::kFast, motion, parameters);
}

void Homing::go_back(PlungerMotion &motion, const Parameters &parameters) {
  enter(motion.homed() ? Phase::kReturn : Phase::kFast, motion, parameters);
}

void Homing::enter(Phase phase, PlungerMotion &motion, const Parameters &parameters) {
  phase_ = phase;
  phase_start_ = motion.position();
  released_ = false;
  motion.seek_home(true);
  const Flow fast = parameters.homing_flow();
  switch (phase) {
    case Phase::kReturn: motion.move_to(kNear, parameters.max_flow()); break;
    case Phase::kFast: motion.set_velocity(-fast); break;
    case Phase::kBackOff: motion.set_velocity(fast * kSlowShare); break;
    case Phase::kSlow: motion.set_velocity(-(fast * kSlowShare)); break;
  }
}

Homing::Progress Homing::tick(PlungerMotion &motion, const Parameters &parameters,
                              bool home_switch) {
  const Progress progress = search_switch(motion, parameters, home_switch);
  if (progress == Progress::kFailed) {
    motion.stop_at_once();
    motion.forget_home();
    motion.seek_home(false);
  }
  return progress;
}

Homing::Progress Homing::search_switch(PlungerMotion &motion, const Parameters &parameters,
                                       bool home_switch) {
  const Volume moved = travelled(motion);
  switch (phase_) {
    case Phase::kReturn:
      if (home_switch) return found(motion);
      if (motion.arrived() || motion.position() <= kNear) enter(Phase::kSlow, motion, parameters);
      return Progress::kWorking;
    case Phase::kFast:
      if (home_switch) {
        motion.stop_at_once();
        enter(Phase::kBackOff, motion, parameters);
        return Progress::kWorking;
      }
      return moved > parameters.syringe_volume() * 1.1f + kReach ? Progress::kFailed
                                                                 : Progress::kWorking;
    case Phase::kBackOff:
      if (!home_switch && !released_) {
        released_ = true;
        released_at_ = motion.position();
      }
      if (released_ && motion.position() - released_at_ > kClearance) {
        enter(Phase::kSlow, motion, parameters);
        return Progress::kWorking;
      }
      return moved > kReach ? Progress::kFailed : Progress::kWorking;
    case Phase::kSlow: break;
  }
  if (home_switch) return found(motion);
  return moved > kReach ? Progress::kFailed : Progress::kWorking;
}

}  // namespace rig
