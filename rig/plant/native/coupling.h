// One step of the tube's flow q and the wall's shape s, which share the pressure pa of the actuator:
//
//   inertance q' = ps - pa - resistance q        ps' = -ks q
//   inertia s'' + lag s' = drive(pa) - s         pa' = ka q - kw growth s'
//
// The theta method on both at once, since a liquid couples them stiffly. Each equation has its own
// theta: 1/2 (second order) while the step resolves its motion; beyond that it is just so implicit
// that the motion comes to its end without overshoot, as the exact solution does. Inertias,
// resistance and lag may be nought.
#pragma once

// The share of a step, at its end, by which something with this spring rate and resistance to
// motion (both times the step or per step alike) is treated implicitly.
inline double implicitness(double spring, double resistance) {
  return spring > 2 * resistance ? 1 - resistance / spring : 0.5;
}

struct Coupling {
  bool joined;  // else the tube lets nothing through
  double inertance, resistance, push, syringe_stiffness, actuator_stiffness;
  double inertia, lag, pull, slope, wall_stiffness, growth;
};

struct Rates {
  double flow, shape;
};

// A rate at the end of a step: something without mass has no memory of its rate before.
inline double end(double mass, double before, double mean, double theta) {
  return mass > 0 ? before + (mean - before) / theta : mean;
}

struct Motion {
  Rates mean, end;  // over the step and at its end
};

inline Motion step(const Coupling &c, const Rates &now, double h) {
  const double wall_spring = 1 + c.slope * c.wall_stiffness * c.growth;
  const double tube_spring = c.syringe_stiffness + c.actuator_stiffness;
  const double wall_theta = implicitness(h * wall_spring, c.lag + c.inertia / h);
  const double tube_theta = implicitness(h * tube_spring, c.resistance + c.inertance / h);
  const double to_wall_end = wall_theta * h, to_tube_end = tube_theta * h;
  const double tube = c.inertance / to_tube_end + c.resistance + to_tube_end * tube_spring;
  const double wall = c.inertia / to_wall_end + c.lag + to_wall_end * wall_spring;
  const double on_tube = to_tube_end * c.wall_stiffness * c.growth;
  const double on_wall = to_wall_end * c.slope * c.actuator_stiffness;
  const double tube_force = c.inertance / to_tube_end * now.flow + c.push;
  const double wall_force = c.inertia / to_wall_end * now.shape + c.pull;
  Motion motion{{0, wall_force / wall}, {0, 0}};
  if (c.joined) {
    const double determinant = tube * wall - on_tube * on_wall;
    motion.mean.flow = (tube_force * wall + on_tube * wall_force) / determinant;
    motion.mean.shape = (tube * wall_force + on_wall * tube_force) / determinant;
    motion.end.flow = end(c.inertance, now.flow, motion.mean.flow, tube_theta);
  }
  motion.end.shape = end(c.inertia, now.shape, motion.mean.shape, wall_theta);
  return motion;
}
