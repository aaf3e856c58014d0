// A bench of one gas node for the firmware's own tests; rig.plant has the real one.
//
// Gas: p = n T / V in units of ambient; T follows the adiabatic change of volume and relaxes to
// the wall's. The transducer sees the pressure behind a first-order tube lag.

#include <algorithm>
#include <cmath>
#include <random>

#include "rig_host_test.h"

namespace {

constexpr double kStep = 1e-3;
constexpr double kGamma = 1.4;
constexpr double kAdcCounts = 1024.0;
constexpr double kReference = 5.0;
constexpr double kGain = 10.0;    // kPa/V
constexpr double kOffset = 0.5;   // V
constexpr int kSettlingMs = 300;  // of the HX711 after a restart, beyond one conversion
constexpr double kSwelling = 0.05;  // s, of the actuator after the pressure

rig_test_bench_state defaults() {
  rig_test_bench_state s = {};
  s.step_ul = 0.34994;
  s.syringe_ml = 60;
  s.system_ml = 80;
  s.ambient_kpa = 101.325;
  s.backlash_ml = 0.0112;
  s.tube_lag_s = 0.02;
  s.heat_exchange_s = 0.3;
  s.valve_ml_s_kpa = 40;
  s.compliance_ml_kpa = 0.1;
  s.noise_lsb = 0.8;
  s.adc_per_ms = 9;
  s.load_cell_period_ms = 100;
  s.load_cell_counts = 40000;
  return s;
}

}  // namespace

struct rig_test_bench {
  rig_test_bench_state s = defaults();
  double motor_ml = 0;
  double moles = 0;        // kPa mL per unit of temperature
  double temperature = 1;  // relative to the wall
  double volume = 0;
  double swell_ml = 0;
  double frozen_volts = kOffset;
  int word_in_ms = 0;
  bool was_powered = true;
  std::mt19937 random;
  std::normal_distribution<double> normal;

  explicit rig_test_bench(uint32_t seed) : random(seed) { place(5.0); }

  void place(double plunger_ml) {
    motor_ml = s.plunger_ml = plunger_ml;
    swell_ml = 0;
    volume = gas_volume();
    moles = s.ambient_kpa * volume;
    temperature = 1;
    s.pressure_kpa = s.shown_kpa = 0;
  }

  double gas_volume() const { return s.system_ml - s.plunger_ml + swell_ml; }

  void move(const rig_pins_out &out) {
    s.steps += out.steps;
    s.max_steps_per_ms = std::max(s.max_steps_per_ms, std::abs(out.steps));
    s.valve_open = out.valve_open;
    s.motor_enabled = out.motor_enabled;
    if (!out.motor_enabled || s.motor_stalled) return;
    motor_ml += out.steps * s.step_ul * 1e-3;
    motor_ml = std::min(std::max(motor_ml, -s.backlash_ml), s.syringe_ml);
    s.plunger_ml = std::min(std::max(s.plunger_ml, motor_ml), motor_ml + s.backlash_ml);
    s.plunger_ml = std::min(std::max(s.plunger_ml, 0.0), s.syringe_ml);
  }

  void breathe(bool valve_open) {
    swell_ml += (s.compliance_ml_kpa * s.pressure_kpa - swell_ml) * (1 - std::exp(-kStep / kSwelling));
    const double new_volume = gas_volume();
    const double conductance = s.leak_ml_s_kpa + (valve_open ? s.valve_ml_s_kpa : 0.0);
    const double rate = conductance * (s.ambient_kpa + s.pressure_kpa) / new_volume;
    const double share = 1 - std::exp(-rate * kStep);  // never past ambient
    const double lost = share * s.pressure_kpa * new_volume / temperature;
    const double new_moles = moles - lost;
    const double compression = (new_moles - moles) / moles - (new_volume - volume) / volume;
    temperature += (kGamma - 1) * temperature * compression;
    temperature += (1 - temperature) * (1 - std::exp(-kStep / s.heat_exchange_s));
    moles = new_moles;
    volume = new_volume;
    s.pressure_kpa = moles * temperature / volume - s.ambient_kpa;
    s.shown_kpa += (s.pressure_kpa - s.shown_kpa) * (1 - std::exp(-kStep / s.tube_lag_s));
  }

  void convert(rig_pins_in &in) {
    double live = kOffset + (s.shown_kpa + s.offset_kpa) / kGain;
    double noise = s.noise_lsb;
    if (s.sensor == 3) {
      live = frozen_volts;
      noise = 0;
    }
    frozen_volts = live;
    if (s.sensor == 1) live = 0.02;
    if (s.sensor == 2) live = kReference;
    in.adc_count = static_cast<uint8_t>(s.sensor == 4 ? 0 : s.adc_per_ms);
    for (int i = 0; i < in.adc_count; ++i) {
      const double level = std::floor(live / kReference * kAdcCounts + noise * normal(random));
      in.adc[i] = static_cast<uint16_t>(std::min(std::max(level, 0.0), kAdcCounts - 1));
    }
  }

  void weigh(const rig_pins_out &out, rig_pins_in &in) {
    if (!out.hx711_powered) {
      if (was_powered) ++s.hx711_restarts;
      s.hx711_asleep = s.hx711_shifted = 0;
      word_in_ms = -kSettlingMs;
    }
    was_powered = out.hx711_powered != 0;
    if (s.hx711_line_low) {
      in.hx711_word = 0;
      in.hx711_ready = 1;
      return;
    }
    if (s.load_cell_period_ms == 0 || s.hx711_asleep || ++word_in_ms < s.load_cell_period_ms) return;
    word_in_ms = 0;
    double counts = std::round(s.load_cell_counts + 50 * normal(random));
    if (s.hx711_shifted) counts = 2 * counts + 1;
    in.hx711_word = s.hx711_stuck_word ? s.hx711_stuck_word
                                       : static_cast<uint32_t>(static_cast<int32_t>(counts)) & 0xFFFFFFu;
    in.hx711_ready = 1;
  }

  void step(const rig_pins_out &out, rig_pins_in &in) {
    s.time_s += kStep;
    move(out);
    breathe(out.valve_open != 0);
    convert(in);
    weigh(out, in);
    const double half_step = 0.5e-3 * s.step_ul;
    in.home_switch = s.home_switch_stuck || (!s.home_switch_broken && s.plunger_ml <= half_step);
    in.end_switch = s.plunger_ml >= s.syringe_ml - half_step;
    in.emergency_stop = s.emergency_stop != 0;
  }
};

rig_test_bench *rig_test_bench_new(uint32_t seed) { return new rig_test_bench(seed); }

void rig_test_bench_free(rig_test_bench *bench) { delete bench; }

rig_test_bench_state *rig_test_bench_access(rig_test_bench *bench) { return &bench->s; }

void rig_test_bench_place(rig_test_bench *bench, double plunger_ml) { bench->place(plunger_ml); }

void rig_test_bench_step(void *bench, const rig_pins_out *out, rig_pins_in *in) {
  static_cast<rig_test_bench *>(bench)->step(*out, *in);
}

void rig_test_bench_idle(void *, const rig_pins_out *, rig_pins_in *in) {
  in->adc_count = 9;
  for (int i = 0; i < 9; ++i) in->adc[i] = 102;
  in->home_switch = 1;
}

void rig_test_run(rig_host *host, rig_test_bench *bench, uint32_t milliseconds, double *mean_kpa,
                  double *least_kpa, double *greatest_kpa) {
  double sum = 0, least = bench->s.pressure_kpa, greatest = least;
  for (uint32_t i = 0; i < milliseconds; ++i) {
    rig_host_run(host, rig_test_bench_step, bench, 1, 0);
    sum += bench->s.pressure_kpa;
    least = std::min(least, bench->s.pressure_kpa);
    greatest = std::max(greatest, bench->s.pressure_kpa);
  }
  *mean_kpa = sum / milliseconds;
  *least_kpa = least;
  *greatest_kpa = greatest;
}
