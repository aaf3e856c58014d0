// Stepper, lead screw and plunger.
//
// Motor: follows every pulse while the torque it needs is within the pull-out torque of its speed,
// T = T0 / sqrt(1 + (f / fc)^2), the current that the winding's inductance lets through (Acarnley,
// Stepping Motors, 4th ed., on high-speed operation). Otherwise it stalls until the pulses are slow enough to
// start it, and comes back into step a whole number of electrical cycles (four full steps) late.
// Plunger: the nut pushes and pulls it through rod and play (backlash); its seal sticks up to the
// breakaway force and slides with Coulomb and viscous friction, without mass.
#pragma once

#include <algorithm>
#include <cmath>

#include "plant.h"

struct Drive {
  double motor_volume;   // where the nut is, as volume pushed in
  double pushed_volume;  // where the seal is
  double missed;         // pulses that the motor did not follow
  int32_t stalled;
  int32_t sliding;  // +1 in, -1 out

  // Where the end of the rod is that the nut takes along; the limit switches see it.
  double carriage(const plant_parameters &par) const {
    return std::min(std::max(pushed_volume, motor_volume), motor_volume + par.backlash_volume);
  }

  // `pulses` in a time of `h`; `gauge` pressure pushes the plunger out.
  void turn(const plant_parameters &par, double pulses, double gauge, double h) {
    if (pulses == 0) return;
    if (par.holding_torque > 0 && !follows(par, pulses, gauge, h)) {
      stalled = 1;
      missed += pulses;
      return;
    }
    if (stalled) {
      stalled = 0;
      const double cycle = par.pulses_per_cycle;
      const double lost = cycle * std::round(missed / cycle);
      pulses += missed - lost;
      missed = lost;
    }
    motor_volume += pulses * par.volume_per_step;
    // hard stops: beyond them the stepper loses steps
    motor_volume = std::min(std::max(motor_volume, -par.backlash_volume), par.syringe_volume);
  }

  // The seal, after the nut went `way` (m3) evenly in a time of `h`.
  void follow(const plant_parameters &par, double way, double gauge, double h) {
    const double pull = gauge * par.plunger_area;
    double goal = held(par, pull, grip(par, sliding > 0), grip(par, sliding < 0));
    if (goal == pushed_volume) {
      sliding = 0;
      return;
    }
    sliding = goal > pushed_volume ? 1 : -1;
    goal = held(par, pull, grip(par, sliding > 0), grip(par, sliding < 0));
    const double lag = par.viscous_friction * par.rod_compliance;
    double left = 0;  // x' = (goal(t) - x) / lag, with a goal that moves with the nut
    if (lag > 0) {
      const double trail = way / h * lag;
      left = trail + (goal - way - pushed_volume - trail) * std::exp(-h / lag);
      left = sliding * std::min(std::max(sliding * left, 0.0), sliding * (goal - pushed_volume));
    }
    const double done = goal - left - pushed_volume;
    pushed_volume += done;
    if (std::fabs(done) < kRest * par.volume_per_step) sliding = 0;
    pushed_volume = std::min(std::max(pushed_volume, 0.0), par.syringe_volume);
  }

 private:
  static constexpr double kRest = 1e-3;  // pulses a step, below which the seal sticks
  static constexpr double kGrip = 1e9;   // N, more than any pressure

  bool follows(const plant_parameters &par, double pulses, double gauge, double h) const {
    const double rate = std::fabs(pulses) / h;
    if (stalled && rate > par.start_rate) return false;
    const double way = pulses > 0 ? 1 : -1;
    const double speed = rate * par.volume_per_step / par.plunger_area;
    const double force = way * gauge * par.plunger_area + par.sliding_force +
                         par.viscous_friction * speed;
    const double slowness = rate / par.corner_rate;
    const double available = par.holding_torque / std::sqrt(1 + slowness * slowness);
    return std::fabs(force) * par.torque_per_force <= available;
  }

  // Where the seal stands if the rod pushes it with `force`; for none, anywhere in the play.
  double seat(const plant_parameters &par, double force) const {
    const double squeezed = par.plunger_area * par.rod_compliance * force;
    return motor_volume - squeezed + (force < 0 ? par.backlash_volume : 0.0);
  }

  // Friction in one direction, N.
  static double grip(const plant_parameters &par, bool slides) {
    if (par.breakaway_force <= 0) return kGrip;
    return slides ? par.sliding_force : par.breakaway_force;
  }

  // The nearest place at which friction holds the seal against `pull`.
  double held(const plant_parameters &par, double pull, double inwards, double outwards) const {
    return std::min(std::max(pushed_volume, seat(par, pull + inwards)),
                    seat(par, pull - outwards));
  }
};
