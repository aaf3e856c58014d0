// The virtual bench put together; see plant.h for what the parameters mean.
//
// The fluid is in two nodes, syringe with tube and actuator. A step is symmetric (Strang, SIAM J.
// Numer. Anal. 5 (1968) 506): what flows to ambient and heat for half of it, half the plunger's
// way, tube and wall together for the whole of it, and the rest in reverse order.

#include "plant.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "actuator.h"
#include "drive.h"
#include "flow.h"
#include "fluid.h"
#include "sensors.h"

namespace {

constexpr double kLongestStep = 5e-3;

double lookup(const double *table, double low, double high, double x, double *slope = nullptr) {
  const double position = (x - low) / (high - low) * (PLANT_TABLE - 1);
  const double clamped = std::min(std::max(0.0, position), PLANT_TABLE - 1.000001);  // 0 for NaN
  const int index = static_cast<int>(clamped);
  const double weight = clamped - index, rise = table[index + 1] - table[index];
  if (slope) *slope = rise * (PLANT_TABLE - 1) / (high - low);
  return table[index] + weight * rise;
}

struct State {
  double time;
  Node syringe, actuator;
  double tube_flow;  // m3/s, to the actuator, at the mean of its ends' pressures
  Drive drive;
  Wall wall;
  Sensors sensors;
  Ledger ledger;
  double peak_pressure, valve_opened;
  int32_t valve_open;
  plant_fixture fixture;
  plant_faults faults;
};
static_assert(std::is_trivially_copyable<State>::value, "state is saved by copying");

}  // namespace

struct plant {
  plant_parameters par;
  plant_response response;
  State now;
  Shares shares;

  double shape(const double *table, double gauge) const {
    return lookup(table, response.table_low, response.table_high, gauge);
  }
  Felt actuator_volume(double gauge) const {
    Felt found;
    found.value = lookup(
        now.fixture == PLANT_BLOCKED ? response.volume_blocked : response.volume_free,
        response.table_low, response.table_high, gauge, &found.slope);
    return found;
  }
  double syringe_volume() const {
    return par.dead_volume + par.tube_volume + par.syringe_volume - now.drive.pushed_volume;
  }
  double gauge() const { return now.syringe.pressure(par) - par.ambient_pressure; }
  double actuator_gauge() const { return now.actuator.pressure(par) - par.ambient_pressure; }
  double deformation() const {
    return shape(response.deformation, now.fixture == PLANT_BLOCKED ? 0.0 : now.wall.shape);
  }
  double force() const {
    return now.fixture == PLANT_BLOCKED ? shape(response.blocked_force, now.wall.shape) : 0.0;
  }

  plant(const plant_parameters &p, const plant_response &r, uint64_t seed)
      : par(p), response(r), now{0, {}, {}, 0, {}, {}, Sensors(seed), {}, 0, 0, 1, PLANT_FREE, {}} {
    now.drive.motor_volume = now.drive.pushed_volume = par.start_volume;
    now.syringe = filling(par, syringe_volume());
    now.actuator = filling(par, actuator_volume(0).value);
    now.sensors.begin(par, force());
  }

  bool joined() const {
    return !now.faults.tube_off && !now.faults.tube_blocked && now.fixture != PLANT_PLUGGED;
  }

  void flow_from_open_ends(double h) {
    if (!now.faults.tube_off) return;
    const auto open_end = [&](double, double) { return par.tube_resistance; };
    bleed(par, now.syringe, h, now.ledger, open_end);
    bleed(par, now.actuator, h, now.ledger, open_end);
  }

  void flow_through_valve(double h, bool open) {
    if (!open) return;
    const double temperature = now.syringe.temperature(par);
    bleed(par, now.syringe, h, now.ledger, [&](double p, double gauge) {
      return valve_resistance(par, temperature, p, gauge);
    });
  }

  void leak(double h) {
    const double conductance = par.leak_conductance + now.faults.leak_conductance;
    if (conductance <= 0) return;
    // stated at ambient conditions, at which gas takes up more room than inside
    bleed(par, now.actuator, h, now.ledger, [&](double p, double) {
      return (par.liquid ? 1 : p / par.ambient_pressure) / conductance;
    });
  }

  void settle() {
    now.syringe.settle(par, shares.settle, now.ledger);
    now.actuator.settle(par, shares.settle, now.ledger);
  }

  void move_plunger(double pulses, bool enabled, double h) {
    const double pressure = gauge();
    const double nut = now.drive.motor_volume;
    now.drive.turn(par, enabled ? (1.0 - now.faults.lost_steps) * pulses : 0, pressure, h);
    now.drive.follow(par, now.drive.motor_volume - nut, pressure, h);
  }

  // Tube and wall with the plunger where it is, but for what hangs on how fast it flows.
  Coupling coupled(double ps, double pa) const {
    const Felt pull = now.wall.pull(par, pa - par.ambient_pressure);
    Coupling c{};
    c.joined = joined();
    c.syringe_stiffness = now.syringe.stiffness(par, ps);
    c.actuator_stiffness = c.wall_stiffness = now.actuator.stiffness(par, pa);
    c.inertia = par.shape_inertia;
    c.lag = par.response_time;
    c.pull = pull.value;
    c.slope = pull.slope;
    c.growth = actuator_volume(now.wall.shape).slope;
    return c;
  }

  void deform_and_flow(double h) {
    const double ps = now.syringe.pressure(par), pa = now.actuator.pressure(par);
    Coupling c = coupled(ps, pa);
    double mean = 0.5 * (ps + pa);
    Motion motion{{now.tube_flow, now.wall.rate}, {}};
    for (int i = 0; i < 2; ++i) {  // as things are in the beginning, then in the middle of the step
      if (!par.liquid) {
        c.syringe_stiffness = now.syringe.stiffness(par, mean);
        c.actuator_stiffness = now.actuator.stiffness(par, mean);
      }
      const double flow = motion.mean.flow, rho = density(par, mean);
      const Friction friction = tube_friction(par, flow, rho);
      c.inertance = rho * par.tube_length_over_area;
      c.resistance = friction.slope;
      c.push = ps - pa + friction.slope * flow - friction.loss;
      motion = step(c, {now.tube_flow, now.wall.rate}, h);
      const double filled = c.actuator_stiffness - c.syringe_stiffness;
      mean = 0.5 * (ps + pa) + 0.25 * h * (filled * motion.mean.flow -
                                           c.wall_stiffness * c.growth * motion.mean.shape);
    }
    now.tube_flow = motion.end.flow;
    now.wall.rate = motion.end.shape;
    now.wall.shape += 0.5 * h * motion.mean.shape;
    now.actuator.compress(par, actuator_volume(now.wall.shape).value, now.ledger);
    const bool forth = motion.mean.flow > 0;
    Node &from = forth ? now.syringe : now.actuator, &to = forth ? now.actuator : now.syringe;
    const double expanded = par.liquid ? 1 : mean / from.pressure(par);
    to.add(from.draw(std::fabs(motion.mean.flow) * h * expanded / from.volume));
    now.wall.shape += 0.5 * h * motion.mean.shape;
    now.actuator.compress(par, actuator_volume(now.wall.shape).value, now.ledger);
  }

  void advance(double pulses, double h, const rig_pins_out &out) {
    shares.prepare(par, h);
    const double half = 0.5 * h;
    flow_from_open_ends(half);
    flow_through_valve(half, out.valve_open);
    leak(half);
    settle();
    const double before = syringe_volume();
    move_plunger(pulses, out.motor_enabled, h);
    now.syringe.compress(par, 0.5 * (before + syringe_volume()), now.ledger);
    now.wall.relax(shares);
    deform_and_flow(h);
    now.wall.remember(par, shares, actuator_gauge());
    now.syringe.compress(par, syringe_volume(), now.ledger);
    settle();
    leak(half);
    flow_through_valve(half, out.valve_open);
    flow_from_open_ends(half);
    now.time += h;
    now.peak_pressure = std::max({now.peak_pressure, gauge(), actuator_gauge()});
  }

  void tick(const rig_pins_out &out, rig_pins_in &in) {
    if (out.valve_open && !now.valve_open) now.valve_opened = now.time + kTick;
    now.valve_open = out.valve_open != 0;
    for (int i = 0; i < par.substeps; ++i) {
      advance(static_cast<double>(out.steps) / par.substeps, kTick / par.substeps, out);
    }
    now.sensors.wander(par, now.time);
    now.sensors.read_transducer(par, now.faults, gauge(), in);
    now.sensors.read_load_cell(par, now.faults, now.time, force(), in);
    const double half_step = 0.5 * par.volume_per_step, carriage = now.drive.carriage(par);
    in.home_switch = Sensors::shown(carriage <= half_step, now.faults.home_switch);
    in.end_switch =
        Sensors::shown(carriage >= par.syringe_volume - half_step, now.faults.end_switch);
    in.emergency_stop = now.faults.emergency_stop != 0;
  }
};

plant *plant_new(const plant_parameters *parameters, const plant_response *response,
                 uint64_t seed) {
  return new plant(*parameters, *response, seed);
}

void plant_free(plant *p) { delete p; }

void plant_tick(void *p, const rig_pins_out *out, rig_pins_in *in) {
  static_cast<plant *>(p)->tick(*out, *in);
}

int plant_do_step(plant *p, double t, double h, double pulses, const rig_pins_out *out) {
  if (!(std::fabs(t - p->now.time) < 1e-9) || !(h > 0) || h > kLongestStep) return 0;
  p->advance(pulses, h, *out);
  return 1;
}

void plant_run(plant *p, const rig_pins_out *out, rig_pins_in *in, size_t n) {
  for (size_t i = 0; i < n; ++i) p->tick(*out, *in);
}

void plant_set_fixture(plant *p, plant_fixture fixture) { p->now.fixture = fixture; }

void plant_set_cell_load(plant *p, double force) { p->now.sensors.cell_load = force; }

void plant_set_faults(plant *p, const plant_faults *faults) { p->now.faults = *faults; }

void plant_get_truth(const plant *p, plant_truth *truth) {
  const State &now = p->now;
  truth->time = now.time;
  truth->gauge_pressure = p->gauge();
  truth->deformation = p->deformation();
  truth->force = p->force();
  truth->actuator_volume = now.actuator.volume;
  truth->pushed_volume = now.drive.pushed_volume;
  truth->gas_moles =
      now.syringe.air + now.actuator.air + now.syringe.dissolved + now.actuator.dissolved;
  truth->temperature = now.syringe.temperature(p->par);
  truth->actuator_pressure = p->actuator_gauge();
  truth->peak_pressure = now.peak_pressure;
  truth->valve_opened = now.valve_opened;
  truth->valve_open = now.valve_open;
  truth->tube_flow = now.tube_flow;
  truth->shape_pressure = now.wall.shape;
  truth->load_cycles = now.wall.cycles(p->par);
  truth->missed_pulses = now.drive.missed;
  truth->dissolved_moles = now.syringe.dissolved + now.actuator.dissolved;
  truth->liquid_volume = now.syringe.liquid + now.actuator.liquid;
  truth->energy = now.syringe.energy + now.actuator.energy;
  truth->work = now.ledger.work;
  truth->heat = now.ledger.heat;
  truth->enthalpy_out = now.ledger.enthalpy_out;
  truth->moles_out = now.ledger.moles_out;
}

size_t plant_state_size(void) { return sizeof(State); }

void plant_save(const plant *p, void *state) { std::memcpy(state, &p->now, sizeof(State)); }

void plant_restore(plant *p, const void *state) { std::memcpy(&p->now, state, sizeof(State)); }
