// The virtual bench; see plant.h for what the parameters mean.
//
// Gas: two nodes, syringe with tube and actuator, joined by a laminar resistance. Each node holds
// moles n and temperature T; p = n R T / V. Its temperature follows the adiabatic change of volume
// and moles, relaxing to ambient:  dT = (gamma - 1) T (dn/n - dV/V) + (Ta - T) dt / tau.
// Actuator: gauge pressure passes play operators (hysteresis, Prandtl-Ishlinskii) and one Prony
// term (creep); the result drives the quasi-static response tables.

#include "plant.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <type_traits>

#include "random.h"

namespace {

constexpr double kStep = 1e-3;
constexpr double kGasConstant = 8.314462618;
constexpr double kGamma = 1.4;
constexpr int kConversionsPerStep = 9;  // 104 us each on a Mega
constexpr double kDriftPeriod = 0.1;    // s between two steps of the zeros' drift

double lookup(const double *table, double low, double high, double x) {
  const double position = (x - low) / (high - low) * (PLANT_TABLE - 1);
  const double clamped = std::min(std::max(position, 0.0), PLANT_TABLE - 1.000001);
  const int index = static_cast<int>(clamped);
  const double weight = clamped - index;
  return table[index] + weight * (table[index + 1] - table[index]);
}

// How much less than `value` a sensor with a bow shows: a parabola through 0 and `span`.
double bow_at(double value, double bow, double span) {
  const double x = value / span;
  return bow * 4 * x * (1 - x);
}

// A zero that wanders as an Ornstein-Uhlenbeck process, stationary from the start: two values far
// apart in time differ with the standard deviation `change`.
struct Drift {
  double value;

  void begin(Random &random, double change) { value = change * std::sqrt(0.5) * random.normal(); }
  void step(Random &random, double change, double correlation_time) {
    const double kept = std::exp(-kDriftPeriod / correlation_time);
    value = kept * value + change * std::sqrt(0.5 * (1 - kept * kept)) * random.normal();
  }
};

struct Gas {
  double moles, temperature, volume;

  double pressure() const { return moles * kGasConstant * temperature / volume; }

  void change(double new_moles, double new_volume, double ambient_temperature, double relaxation) {
    const double compression =
        (new_moles - moles) / moles - (new_volume - volume) / volume;
    temperature += (kGamma - 1) * temperature * compression;
    temperature += (ambient_temperature - temperature) * relaxation;
    moles = new_moles;
    volume = new_volume;
  }
};

struct State {
  double time;
  Random random;
  Gas syringe, actuator;
  double motor_volume, pushed_volume;  // where the motor is, where the plunger is (backlash)
  double play[PLANT_PLAYS];
  double creep, shape_pressure;  // gauge pressures in Pa
  double held_voltage;
  double cell_creep, next_word_time;
  double cell_load;       // N, of masses placed on the load cell
  Random drift_random;    // of its own, so that drift leaves the noise as it is
  Drift transducer_zero, cell_zero;
  double next_drift_time;
  double drift;  // Pa that the transducer reads too much
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

  double shape(const double *table, double gauge) const {
    return lookup(table, response.table_low, response.table_high, gauge);
  }
  double actuator_volume(double gauge) const {
    return shape(now.fixture == PLANT_BLOCKED ? response.volume_blocked : response.volume_free,
                 gauge);
  }
  double syringe_volume() const {
    return par.dead_volume + par.tube_volume + par.syringe_volume - now.pushed_volume;
  }
  double gauge() const { return now.syringe.pressure() - par.ambient_pressure; }
  double actuator_gauge() const { return now.actuator.pressure() - par.ambient_pressure; }
  double angle() const {
    return shape(response.angle, now.fixture == PLANT_BLOCKED ? 0.0 : now.shape_pressure);
  }
  double force() const {
    return now.fixture == PLANT_BLOCKED ? shape(response.blocked_force, now.shape_pressure) : 0.0;
  }

  plant(const plant_parameters &p, const plant_response &r, uint64_t seed)
      : par(p), response(r), now{0, Random(seed), {}, {}, 0, 0, {}, 0, 0, 0, 0, 0, 0,
                                Random(seed ^ 0x5DEECE66Du), {}, {}, kDriftPeriod,
                                0, 0, 0, 1, PLANT_FREE, {}} {
    now.motor_volume = now.pushed_volume = par.start_volume;
    now.syringe = at_ambient(syringe_volume());
    now.actuator = at_ambient(actuator_volume(0));
    now.held_voltage = par.transducer_voltage_at_zero;
    now.next_word_time = par.load_cell_period * (0.5 + 0.5 * now.random.uniform());
    now.cell_creep = force();
    now.transducer_zero.begin(now.drift_random, par.transducer_drift);
    now.cell_zero.begin(now.drift_random, par.load_cell_drift);
  }

  void wander() {
    if (now.time < now.next_drift_time) return;
    now.next_drift_time += kDriftPeriod;
    now.transducer_zero.step(now.drift_random, par.transducer_drift, par.drift_time);
    now.cell_zero.step(now.drift_random, par.load_cell_drift, par.drift_time);
  }

  Gas at_ambient(double volume) const {
    return {par.ambient_pressure * volume / (kGasConstant * par.ambient_temperature),
            par.ambient_temperature, volume};
  }

  void move_plunger(const rig_pins_out &out) {
    if (!out.motor_enabled) return;
    now.motor_volume += (1.0 - now.faults.lost_steps) * out.steps * par.volume_per_step;
    // hard stops: beyond them the stepper loses steps
    now.motor_volume =
        std::min(std::max(now.motor_volume, -par.backlash_volume), par.syringe_volume);
    // the nut pushes at the motor's position and pulls one backlash later
    now.pushed_volume = std::max(now.pushed_volume, now.motor_volume);
    now.pushed_volume = std::min(now.pushed_volume, now.motor_volume + par.backlash_volume);
    now.pushed_volume = std::min(std::max(now.pushed_volume, 0.0), par.syringe_volume);
  }

  // Moles that pass a resistance from pressure `high` to `low` in one step; never more than what
  // levels the pressures, so that a wide-open valve stays stable at any step.
  static double flow_moles(const Gas &from, double pressure_difference, double resistance,
                           double levelling_volume) {
    const double rate = 1.0 / (resistance * levelling_volume) * from.pressure();
    const double share = 1.0 - std::exp(-rate * kStep);
    return share * pressure_difference * levelling_volume / (kGasConstant * from.temperature);
  }

  void exchange_gas(const rig_pins_out &out) {
    const double series = now.syringe.volume * now.actuator.volume /
                          (now.syringe.volume + now.actuator.volume);
    const double relaxation = 1.0 - std::exp(-kStep / par.heat_exchange_time);
    const bool joined =
        !now.faults.tube_off && !now.faults.tube_blocked && now.fixture != PLANT_PLUGGED;
    double out_of_syringe = 0, into_actuator = 0;
    if (joined) {
      out_of_syringe = into_actuator =
          flow_moles(now.syringe, now.syringe.pressure() - now.actuator.pressure(),
                     par.tube_resistance, series);
    } else if (now.faults.tube_off) {
      out_of_syringe = flow_moles(now.syringe, gauge(), par.tube_resistance, now.syringe.volume);
      into_actuator = -flow_moles(now.actuator, actuator_gauge(), par.tube_resistance,
                                  now.actuator.volume);
    }
    if (out.valve_open) {
      out_of_syringe += flow_moles(now.syringe, gauge(), par.valve_resistance, now.syringe.volume);
    }
    const double leak_volume_rate =
        (par.leak_conductance + now.faults.leak_conductance) * actuator_gauge();
    // a burst empties no further than to ambient
    const double excess =
        actuator_gauge() * now.actuator.volume / (kGasConstant * now.actuator.temperature);
    const double wanted = leak_volume_rate * kStep * par.ambient_pressure /
                          (kGasConstant * par.ambient_temperature);
    const double leaked =
        excess >= 0 ? std::min(wanted, 0.5 * excess) : std::max(wanted, 0.5 * excess);
    now.syringe.change(now.syringe.moles - out_of_syringe, syringe_volume(),
                       par.ambient_temperature, relaxation);
    now.actuator.change(now.actuator.moles + into_actuator - leaked,
                        actuator_volume(now.shape_pressure), par.ambient_temperature, relaxation);
  }

  void deform() {
    double played = 0;
    for (int i = 0; i < PLANT_PLAYS; ++i) {
      const double r = par.play_radius[i];
      now.play[i] =
          std::min(std::max(now.play[i], actuator_gauge() - r), actuator_gauge() + r);
      played += now.play[i] / PLANT_PLAYS;
    }
    const double drive = (1 - par.play_share) * actuator_gauge() + par.play_share * played;
    now.creep += (drive - now.creep) * (1.0 - std::exp(-kStep / par.creep_time));
    const double crept = (1 - par.creep_share) * drive + par.creep_share * now.creep;
    now.shape_pressure +=
        (crept - now.shape_pressure) * (1.0 - std::exp(-kStep / par.response_time));
  }

  void read_transducer(rig_pins_in &in) {
    now.drift += now.faults.drift_rate * kStep;
    const double sign = now.faults.sensor_reversed ? -1.0 : 1.0;
    const double felt = gauge() - bow_at(gauge(), par.transducer_bow, par.transducer_span) +
                        now.transducer_zero.value + now.drift;
    double volts = par.transducer_voltage_at_zero + sign * felt / par.transducer_gain;
    if (now.faults.sensor_stuck) volts = now.held_voltage;
    now.held_voltage = volts;
    volts += now.faults.spike_voltage;
    if (now.faults.sensor_open) volts = 0.02;
    if (now.faults.sensor_short) volts = par.adc_reference;
    in.adc_count = kConversionsPerStep;
    for (int i = 0; i < kConversionsPerStep; ++i) {
      const double noise = now.faults.sensor_stuck ? 0 : par.transducer_noise * now.random.normal();
      const double level = (volts + noise) / par.adc_reference * par.adc_levels;
      in.adc[i] = static_cast<uint16_t>(
          std::min(std::max(std::floor(level), 0.0), par.adc_levels - 1));
    }
  }

  void read_load_cell(rig_pins_in &in) {
    const double load = force() + now.cell_load;
    now.cell_creep += (load - now.cell_creep) * (1.0 - std::exp(-kStep / par.load_cell_creep_time));
    in.hx711_ready = 0;
    if (now.time < now.next_word_time) return;
    now.next_word_time += par.load_cell_period;
    if (now.faults.hx711_silent) return;
    const double shown = load - bow_at(load, par.load_cell_bow, par.load_cell_span) +
                         par.load_cell_creep_share * now.cell_creep + now.cell_zero.value;
    const double sign = now.faults.load_cell_reversed ? -1.0 : 1.0;
    const double counts = par.load_cell_zero_counts + sign * shown * par.counts_per_newton +
                          par.load_cell_noise_counts * now.random.normal();
    int32_t word = static_cast<int32_t>(std::lround(counts));
    word = std::min(std::max(word, -0x800000), 0x7FFFFF);
    uint32_t bits = static_cast<uint32_t>(word) & 0xFFFFFFu;
    if (now.random.uniform() < std::max(par.bad_word_probability, now.faults.bad_words)) {
      bits = (bits << 1 | 1u) & 0xFFFFFFu;  // one clock too many: the word arrives shifted
    }
    if (now.faults.hx711_stuck) bits = now.faults.hx711_word & 0xFFFFFFu;
    in.hx711_word = bits;
    in.hx711_ready = 1;
  }

  static uint8_t shown(bool pressed, int32_t fault) {
    if (fault == PLANT_SWITCH_LIVE) return pressed;
    return fault == PLANT_SWITCH_STUCK_CLOSED;
  }

  void keep_score(const rig_pins_out &out) {
    now.peak_pressure = std::max({now.peak_pressure, gauge(), actuator_gauge()});
    if (out.valve_open && !now.valve_open) now.valve_opened = now.time;
    now.valve_open = out.valve_open != 0;
  }

  void step(const rig_pins_out &out, rig_pins_in &in) {
    now.time += kStep;
    move_plunger(out);
    exchange_gas(out);
    deform();
    keep_score(out);
    wander();
    read_transducer(in);
    read_load_cell(in);
    const double half_step = 0.5 * par.volume_per_step;
    in.home_switch = shown(now.pushed_volume <= half_step, now.faults.home_switch);
    in.end_switch =
        shown(now.pushed_volume >= par.syringe_volume - half_step, now.faults.end_switch);
    in.emergency_stop = now.faults.emergency_stop != 0;
  }
};

plant *plant_new(const plant_parameters *parameters, const plant_response *response,
                 uint64_t seed) {
  return new plant(*parameters, *response, seed);
}

void plant_free(plant *p) { delete p; }

void plant_do_step(void *p, const rig_pins_out *out, rig_pins_in *in) {
  static_cast<plant *>(p)->step(*out, *in);
}

void plant_run(plant *p, const rig_pins_out *out, rig_pins_in *in, size_t n) {
  for (size_t i = 0; i < n; ++i) p->step(*out, *in);
}

void plant_set_fixture(plant *p, plant_fixture fixture) { p->now.fixture = fixture; }

void plant_set_cell_load(plant *p, double force) { p->now.cell_load = force; }

void plant_set_faults(plant *p, const plant_faults *faults) { p->now.faults = *faults; }

void plant_get_truth(const plant *p, plant_truth *truth) {
  truth->time = p->now.time;
  truth->gauge_pressure = p->gauge();
  truth->angle = p->angle();
  truth->force = p->force();
  truth->actuator_volume = p->now.actuator.volume;
  truth->pushed_volume = p->now.pushed_volume;
  truth->gas_moles = p->now.syringe.moles + p->now.actuator.moles;
  truth->temperature = p->now.syringe.temperature;
  truth->actuator_pressure = p->actuator_gauge();
  truth->peak_pressure = p->now.peak_pressure;
  truth->valve_opened = p->now.valve_opened;
  truth->valve_open = p->now.valve_open;
}

size_t plant_state_size(void) { return sizeof(State); }

void plant_save(const plant *p, void *state) { std::memcpy(state, &p->now, sizeof(State)); }

void plant_restore(plant *p, const void *state) { std::memcpy(&p->now, state, sizeof(State)); }
