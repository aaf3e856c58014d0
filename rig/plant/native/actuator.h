// The actuator's wall: what pressure makes of its shape, and when.
//
// The shape is told by the pressure that would bring it about in the quasi-static tables; on the
// way there the actuator's pressure p passes
//   play operators (hysteresis: Prandtl and Ishlinskii),
//   Mullins softening: on the way back and up again to the highest pressure M ever, the wall takes
//     less pressure than its virgin response w, p = w eta, eta = 1 - d erf((1 - (w/M)^2) / beta)
//     (Ogden and Roxburgh, Proc. R. Soc. A 455 (1999) 2861, with w^2 for the energy and its highest
//     for their constant m; that d comes with load cycles N as 1 - exp(-N / N0) is ours),
//   ageing: (1 + a log10(1 + N)) as much shape after N cycles,
//   creep: a Prony series of shares g and times tau; at a held shape the same terms are the
//     relaxation of stress, with times (1 - g) tau for one term,
//   mass and damping:  inertia s'' + lag s' + s = crept pressure.
#pragma once

#include <algorithm>
#include <cmath>

#include "fluid.h"

// The shares by which everything with a time constant comes nearer its end in half a step.
struct Shares {
  double h = 0, settle, creep[PLANT_CREEPS];

  void prepare(const plant_parameters &par, double step) {
    if (step == h) return;
    h = step;
    const auto share = [&](double time) { return -std::expm1(-0.5 * h / time); };
    settle = share(par.liquid ? par.dissolution_time : par.heat_exchange_time);
    for (int i = 0; i < PLANT_CREEPS; ++i) creep[i] = share(par.creep_time[i]);
  }
};

// A function of the actuator's pressure with its slope.
struct Felt {
  double value, slope;
};

struct Wall {
  double shape, rate;  // Pa, Pa/s
  double load;         // Pa, what the creep tends to
  double play[PLANT_PLAYS];
  double creep[PLANT_CREEPS];
  double peak;  // Pa, the highest virgin pressure ever felt
  double path;  // Pa, the ups and downs so far, those within the first play's radius left out

  double cycles(const plant_parameters &par) const { return path / (2 * par.full_pressure); }

  // What drives the shape on, and how much more of it comes with pressure.
  Felt pull(const plant_parameters &par, double gauge) const {
    Felt drive = felt(par, gauge);
    double kept = 1, crept = 0;
    for (int i = 0; i < PLANT_CREEPS; ++i) {
      kept -= par.creep_share[i];
      crept += par.creep_share[i] * creep[i];
    }
    return {kept * drive.value + crept - shape, kept * drive.slope};
  }

  // What stays of the pressure at the end of a step; the creep of half of it, of the other half
  // at its beginning.
  void remember(const plant_parameters &par, const Shares &shares, double gauge) {
    const double before = play[0];
    double played = (1 - par.play_share) * gauge;
    for (int i = 0; i < PLANT_PLAYS; ++i) {
      const double r = par.play_radius[i];
      play[i] = std::min(std::max(play[i], gauge - r), gauge + r);
      played += par.play_share / PLANT_PLAYS * play[i];
    }
    path += std::fabs(play[0] - before);
    peak = std::max(peak, played);
    load = felt(par, gauge).value;
    relax(shares);
  }

  void relax(const Shares &shares) {
    for (int i = 0; i < PLANT_CREEPS; ++i) creep[i] += (load - creep[i]) * shares.creep[i];
  }

  // How much less pressure the wall takes at the virgin pressure `w`.
  double softness(const plant_parameters &par, double w) const {
    if (par.mullins_share <= 0 || peak <= 0 || w >= peak) return 0;
    return depth(par) * std::erf(left(par, w));
  }

 private:
  double left(const plant_parameters &par, double w) const {
    const double x = std::max(w, 0.0) / peak;
    return (1 - x * x) / par.mullins_width;
  }

  double depth(const plant_parameters &par) const {
    if (par.mullins_cycles <= 0) return par.mullins_share;
    return -par.mullins_share * std::expm1(-cycles(par) / par.mullins_cycles);
  }

  double aged(const plant_parameters &par) const {
    return par.ageing > 0 ? 1 + par.ageing * std::log10(1 + cycles(par)) : 1;
  }

  Felt felt(const plant_parameters &par, double gauge) const {
    Felt played{(1 - par.play_share) * gauge, 1 - par.play_share};
    for (int i = 0; i < PLANT_PLAYS; ++i) {
      const double r = par.play_radius[i], weight = par.play_share / PLANT_PLAYS;
      const double moved = std::min(std::max(play[i], gauge - r), gauge + r);
      played.value += weight * moved;
      if (moved != play[i]) played.slope += weight;
    }
    Felt result = virgin(par, played.value);
    const double factor = aged(par);
    result.value *= factor;
    result.slope *= factor * played.slope;
    return result;
  }

  // The virgin pressure w of p = w eta(w).
  Felt virgin(const plant_parameters &par, double p) const {
    if (par.mullins_share <= 0 || peak <= 0 || p >= peak) return {p, 1};
    const double d = depth(par);
    double w = p / (1 - softness(par, p)), slope = 1;
    for (int i = 0; i < 20; ++i) {
      const double x = left(par, w);
      const double eta = 1 - d * std::erf(x);
      const double rise = w > 0 ? d * M_2_SQRTPI * std::exp(-x * x) * 2 * w /
                                      (par.mullins_width * peak * peak)
                                : 0;
      slope = 1 / (eta + w * rise);
      const double change = (p - w * eta) * slope;
      w += change;
      if (std::fabs(change) < 1e-12 * peak) break;
    }
    return {w, slope};
  }
};
