// What fills the bench: air, or a liquid with some air in it as bubbles and in solution.
//
// Air: p = n R T / V with its internal energy n cv T as a state of its own; what flows carries its
// enthalpy. A change of volume is adiabatic, p V^gamma constant, exactly; heat then flows to the
// wall, which has ambient temperature, with one time constant.
// Liquid: V = Vl (1 - (p - p0) / K) + n R T / p, isothermal, as the liquid holds the bubbles'
// temperature; Henry's law says how much air would be in solution, and it comes and goes with one
// time constant. (Merritt, Hydraulic Control Systems, 1967: effective bulk modulus.)
#pragma once

#include <algorithm>
#include <cmath>

#include "plant.h"

constexpr double kGasConstant = 8.314462618;
constexpr double kGamma = 1.4;

// Since power-on. Of the energies only air's are counted; that of a liquid is not modelled.
struct Ledger {
  double work;          // J done on the air by plunger and actuator
  double heat;          // J that it took up from the walls
  double enthalpy_out;  // J that it carried off to ambient
  double moles_out;     // mol
};

// Something that moves from one place to another; `energy` is its enthalpy.
struct Parcel {
  double air, energy, liquid, dissolved;
};

struct Node {
  double volume;     // m3
  double air;        // mol, free
  double energy;     // J, of the free air; not used with a liquid
  double liquid;     // m3 as at ambient pressure
  double dissolved;  // mol of air

  double pressure(const plant_parameters &par) const {
    if (!par.liquid) return (kGamma - 1) * energy / volume;
    // a p^2 + b p = c, in the form that does not cancel
    const double a = liquid / par.bulk_modulus;
    const double b = volume - liquid - a * par.ambient_pressure;
    const double c = air * kGasConstant * par.ambient_temperature;
    const double root = std::sqrt(b * b + 4 * a * c);
    return b > 0 ? 2 * c / (b + root) : (root - b) / (2 * a);
  }

  // -dp/dV at pressure `p` while nothing is exchanged, Pa/m3.
  double stiffness(const plant_parameters &par, double p) const {
    if (!par.liquid) return kGamma * p / volume;
    const double bubbles = air * kGasConstant * par.ambient_temperature / (p * p);
    return 1 / (liquid / par.bulk_modulus + bubbles);
  }

  double temperature(const plant_parameters &par) const {
    if (par.liquid || air <= 0) return par.ambient_temperature;
    return (kGamma - 1) * energy / (kGasConstant * air);
  }

  void compress(const plant_parameters &par, double new_volume, Ledger &ledger) {
    if (!par.liquid) {
      const double before = energy;
      energy *= std::pow(volume / new_volume, kGamma - 1);
      ledger.work += energy - before;
    }
    volume = new_volume;
  }

  // Takes out `share` of all that is here.
  Parcel draw(double share) {
    share = std::min(share, 0.5);
    const Parcel drawn{share * air, kGamma * share * energy, share * liquid, share * dissolved};
    add({-drawn.air, -drawn.energy, -drawn.liquid, -drawn.dissolved});
    return drawn;
  }

  void add(const Parcel &parcel) {
    air += parcel.air;
    energy += parcel.energy;
    liquid += parcel.liquid;
    dissolved += parcel.dissolved;
  }

  // `share` is how far temperature, or solution, comes towards equilibrium in the step.
  void settle(const plant_parameters &par, double share, Ledger &ledger) {
    if (!par.liquid) {
      const double at_wall = air * kGasConstant / (kGamma - 1) * par.ambient_temperature;
      const double heat = (at_wall - energy) * share;
      energy += heat;
      ledger.heat += heat;
    } else {
      const double soluble = par.solubility * liquid * pressure(par) /
                             (kGasConstant * par.ambient_temperature);
      const double moved = std::min((soluble - dissolved) * share, 0.5 * air);
      air -= moved;
      dissolved += moved;
    }
  }
};

// What lies in `volume` of the fluid at ambient pressure and temperature, saturated with air.
inline Node filling(const plant_parameters &par, double volume) {
  const double moles = par.ambient_pressure / (kGasConstant * par.ambient_temperature);
  if (!par.liquid) {
    return {volume, moles * volume, par.ambient_pressure * volume / (kGamma - 1), 0, 0};
  }
  const double liquid = volume * (1 - par.entrained_air);
  return {volume, moles * volume * par.entrained_air, 0, liquid, moles * par.solubility * liquid};
}

inline double density(const plant_parameters &par, double p) {
  if (par.liquid) return par.density;
  return p * par.molar_mass / (kGasConstant * par.ambient_temperature);
}
