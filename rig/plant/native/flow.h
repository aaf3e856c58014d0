// What flows through tube, valve and leak.
//
// Tube: a lump of fluid of one velocity. Friction by Hagen and Poiseuille up to Re = 2300, by
// Blasius, f = 0.3164 Re^(-1/4), from 4000, and between them f on a straight line in logarithms;
// ends, bends and fittings cost `minor_loss` times the dynamic pressure. (Idelchik, Handbook of
// Hydraulic Resistance.) Flow is counted at the mean of the two ends' pressures, with which
// Poiseuille's law holds for a gas, too: n' = (p1^2 - p2^2) / (2 R T resistance).
// Valve: ISO 6358, sonic conductance C and critical pressure ratio b; a liquid sees the area that
// has the same C. Leak: proportional to gauge pressure.
#pragma once

#include <cmath>

#include "coupling.h"
#include "fluid.h"

constexpr double kLaminar = 2300, kTurbulent = 4000;  // Reynolds numbers
constexpr double kReferencePressure = 100e3;          // ISO 8778
constexpr double kReferenceTemperature = 293.15;
constexpr double kNearlyOne = 0.999;  // pressure ratio from which the valve's flow is laminar
constexpr double kChoked = 0.6847;     // sqrt(gamma) (2 / (gamma + 1))^((gamma + 1) / 2 (gamma - 1))
constexpr double kLiquidLaminar = 50;  // Pa; the same for a liquid

// How many times as large as laminar friction, and the power of the Reynolds number with which that
// grows there.
struct Excess {
  double factor, exponent;
};

inline Excess turbulent_excess(double reynolds) {
  static const double low = 64 / kLaminar;
  static const double high = 0.3164 * std::pow(kTurbulent, -0.25);
  static const double slope = std::log(high / low) / std::log(kTurbulent / kLaminar);
  if (reynolds <= kLaminar) return {1, 0};
  if (reynolds < kTurbulent) return {std::pow(reynolds / kLaminar, slope + 1), slope + 1};
  return {0.3164 / 64 * std::pow(reynolds, 0.75), 0.75};
}

// What friction costs in Pa at a flow through the tube, and more for more flow in Pa s/m3.
struct Friction {
  double loss, slope;
};

inline Friction tube_friction(const plant_parameters &par, double flow, double rho) {
  const double speed = std::fabs(flow) / par.tube_area;
  const double reynolds = rho * speed * par.tube_diameter / par.viscosity;
  const Excess wall = par.turbulence ? turbulent_excess(reynolds) : Excess{1, 0};
  const double minor = par.minor_loss * rho * speed / (2 * par.tube_area);
  return {(par.tube_resistance * wall.factor + minor) * flow,
          par.tube_resistance * wall.factor * (1 + wall.exponent) + 2 * minor};
}

// A path to ambient; `resistance(p, gauge)` in Pa s per m3 of the node's fluid at pressure p.
template <typename Resistance>
void bleed(const plant_parameters &par, Node &node, double h, Ledger &ledger,
           Resistance resistance) {
  const double p = node.pressure(par), gauge = p - par.ambient_pressure;
  double halfway = gauge, flow = 0;
  for (int i = 0; i < 2; ++i) {  // as things are in the beginning, then in the middle of the step
    const double between = par.ambient_pressure + halfway;
    const double r = resistance(between, halfway);
    const double spring = h * node.stiffness(par, between);
    flow = gauge / (r + implicitness(spring, r) * spring);
    halfway = gauge - 0.5 * spring * flow;
  }
  const double volume = flow * h * (par.liquid ? 1 : (par.ambient_pressure + halfway) / p);
  Parcel out;
  if (volume > 0) {
    out = node.draw(volume / node.volume);
  } else {
    Node ambient = filling(par, -volume * (par.liquid ? 1 : p / par.ambient_pressure));
    out = {-ambient.air, -kGamma * ambient.energy, -ambient.liquid, -ambient.dissolved};
    node.add({-out.air, -out.energy, -out.liquid, -out.dissolved});
  }
  ledger.enthalpy_out += out.energy;
  ledger.moles_out += out.air + out.dissolved;
}

// ISO 6358: n' = C p1 phi(p2 / p1) sqrt(T0 / T1) p0 / (R T0), as a resistance.
inline double valve_resistance(const plant_parameters &par, double temperature, double p,
                               double gauge) {
  if (par.liquid) {
    // the area through which air at its speed of sound has this conductance
    const double area =
        par.valve_conductance * kReferencePressure /
        (kChoked * std::sqrt(kGasConstant * kReferenceTemperature / par.molar_mass));
    const double push = std::max(std::fabs(gauge), kLiquidLaminar);
    return std::sqrt(0.5 * par.density * push) / area;
  }
  const double high = std::max(p, par.ambient_pressure);
  const double ratio = std::min(p, par.ambient_pressure) / high;
  const double warmth = gauge > 0 ? temperature : par.ambient_temperature;
  const auto phi = [&](double r) {
    const double x = (r - par.valve_critical_ratio) / (1 - par.valve_critical_ratio);
    return x > 0 ? std::sqrt(1 - x * x) : 1.0;
  };
  const double drop_over_phi =
      ratio < kNearlyOne ? (1 - ratio) / phi(ratio) : (1 - kNearlyOne) / phi(kNearlyOne);
  const double per_mole = p / (kGasConstant * warmth);  // of the node's volume
  return drop_over_phi * per_mole * kGasConstant * kReferenceTemperature /
         (par.valve_conductance * kReferencePressure *
          std::sqrt(kReferenceTemperature / warmth));
}
