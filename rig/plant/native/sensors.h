// What the board's inputs show of the bench: pressure transducer with converter, and load cell with
// HX711. Their zeros wander; their curves are a little bowed.
#pragma once

#include <algorithm>
#include <cmath>

#include "plant.h"
#include "random.h"

constexpr double kTick = 1e-3;
constexpr int kConversionsPerTick = 9;  // 104 us each on a Mega
constexpr double kDriftPeriod = 0.1;    // s between two steps of the zeros' drift

// How much less than `value` a sensor with a bow shows: a parabola through 0 and `span`.
inline double bow_at(double value, double bow, double span) {
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

struct Sensors {
  Random random;
  Random drift_random;  // of its own, so that drift leaves the noise as it is
  double held_voltage;
  double runaway;  // Pa that the transducer reads too much, by a fault
  double cell_creep, next_word_time;
  double cell_load;  // N, of masses placed on the load cell
  Drift transducer_zero, cell_zero;
  double next_drift_time;

  explicit Sensors(uint64_t seed)
      : random(seed), drift_random(seed ^ 0x5DEECE66Du), held_voltage(0), runaway(0),
        cell_creep(0), next_word_time(0), cell_load(0), transducer_zero{}, cell_zero{},
        next_drift_time(kDriftPeriod) {}

  void begin(const plant_parameters &par, double force) {
    held_voltage = par.transducer_voltage_at_zero;
    next_word_time = par.load_cell_period * (0.5 + 0.5 * random.uniform());
    cell_creep = force;
    transducer_zero.begin(drift_random, par.transducer_drift);
    cell_zero.begin(drift_random, par.load_cell_drift);
  }

  void wander(const plant_parameters &par, double time) {
    if (time < next_drift_time) return;
    next_drift_time += kDriftPeriod;
    transducer_zero.step(drift_random, par.transducer_drift, par.drift_time);
    cell_zero.step(drift_random, par.load_cell_drift, par.drift_time);
  }

  void read_transducer(const plant_parameters &par, const plant_faults &faults, double gauge,
                       rig_pins_in &in) {
    runaway += faults.drift_rate * kTick;
    const double sign = faults.sensor_reversed ? -1.0 : 1.0;
    const double felt = gauge - bow_at(gauge, par.transducer_bow, par.transducer_span) +
                        transducer_zero.value + runaway;
    double volts = par.transducer_voltage_at_zero + sign * felt / par.transducer_gain;
    if (faults.sensor_stuck) volts = held_voltage;
    held_voltage = volts;
    volts += faults.spike_voltage;
    if (faults.sensor_open) volts = 0.02;
    if (faults.sensor_short) volts = par.adc_reference;
    in.adc_count = kConversionsPerTick;
    for (int i = 0; i < kConversionsPerTick; ++i) {
      const double noise = faults.sensor_stuck ? 0 : par.transducer_noise * random.normal();
      const double level = (volts + noise) / par.adc_reference * par.adc_levels;
      in.adc[i] = static_cast<uint16_t>(
          std::min(std::max(std::floor(level), 0.0), par.adc_levels - 1));
    }
  }

  void read_load_cell(const plant_parameters &par, const plant_faults &faults, double time,
                      double force, rig_pins_in &in) {
    const double load = force + cell_load;
    cell_creep += (load - cell_creep) * (1.0 - std::exp(-kTick / par.load_cell_creep_time));
    in.hx711_ready = 0;
    if (time < next_word_time) return;
    next_word_time += par.load_cell_period;
    if (faults.hx711_silent) return;
    const double shown = load - bow_at(load, par.load_cell_bow, par.load_cell_span) +
                         par.load_cell_creep_share * cell_creep + cell_zero.value;
    const double sign = faults.load_cell_reversed ? -1.0 : 1.0;
    const double counts = par.load_cell_zero_counts + sign * shown * par.counts_per_newton +
                          par.load_cell_noise_counts * random.normal();
    int32_t word = static_cast<int32_t>(std::lround(counts));
    word = std::min(std::max(word, -0x800000), 0x7FFFFF);
    uint32_t bits = static_cast<uint32_t>(word) & 0xFFFFFFu;
    if (random.uniform() < std::max(par.bad_word_probability, faults.bad_words)) {
      bits = (bits << 1 | 1u) & 0xFFFFFFu;  // one clock too many: the word arrives shifted
    }
    if (faults.hx711_stuck) bits = faults.hx711_word & 0xFFFFFFu;
    in.hx711_word = bits;
    in.hx711_ready = 1;
  }

  static uint8_t shown(bool pressed, int32_t fault) {
    if (fault == PLANT_SWITCH_LIVE) return pressed;
    return fault == PLANT_SWITCH_STUCK_CLOSED;
  }
};
