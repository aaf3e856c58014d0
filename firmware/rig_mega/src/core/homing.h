// Finds the home switch: fast, back off, slowly again; or, with known home, returns to it.
#pragma once

#include <stdint.h>

#include "parameters.h"
#include "plunger_motion.h"
#include "units.h"

namespace rig {

class Homing {
 public:
  enum class Progress : uint8_t { kWorking, kFound, kFailed };

  // Home is searched from anywhere; what was known of it is forgotten.
  void search(PlungerMotion &motion, const Parameters &parameters);

  // Back to home at full speed, then slowly onto the switch. Searches if home is unknown.
  void go_back(PlungerMotion &motion, const Parameters &parameters);

  Progress tick(PlungerMotion &motion, const Parameters &parameters, bool home_switch);

  // How far the present phase has moved; after a failure, how far without result.
  Volume travelled(const PlungerMotion &motion) const {
    return magnitude(motion.position() - phase_start_);
  }

 private:
  enum class Phase : uint8_t { kReturn, kFast, kBackOff, kSlow };

  void enter(Phase phase, PlungerMotion &motion, const Parameters &parameters);
  Progress search_switch(PlungerMotion &motion, const Parameters &parameters, bool home_switch);

  Phase phase_ = Phase::kFast;
  Volume phase_start_ = {};
  Volume released_at_ = {};
  bool released_ = false;
};

}  // namespace rig
