// The numbers a lab may set: their defaults, ranges, and how they are kept in non-volatile memory.
// Indices, names and units are those of rig.dbc.
#pragma once

#include <stddef.h>
#include <stdint.h>

#include "generated/rig.h"
#include "units.h"

namespace rig {

enum class ParameterResult : uint8_t {
  kAccepted = 0,
  kUnknownParameter = 1,
  kOutOfRange = 2,
  kWrongState = 3,
  kNotFinite = 4,
};

struct ParameterRule {
  float initial;
  float low;
  float high;
  bool live;  // may be written while the bench is under pressure or moving
};

bool is_finite(float value);

class Parameters {
 public:
  static constexpr uint8_t kCount = 22;
  // layout version, count, values, CRC-16
  static constexpr size_t kImageSize = 2 + 4 * kCount + 2;

  enum class Image : uint8_t { kLoaded, kBlank, kCorrupt };

  Parameters() { reset(); }

  static const ParameterRule &rule(uint8_t index);

  void reset();
  float get(uint8_t index) const { return values_[index]; }
  ParameterResult set(uint8_t index, float value, bool at_rest);

  // Erased memory gives the defaults; so does anything whose CRC, version or ranges are wrong.
  Image load(const uint8_t *image);
  void store(uint8_t *image) const;

  Pressure deadband() const {
    return kpa(get(RIG_PARAMETER_PARAMETER_INDEX_DEADBAND_KPA_CHOICE));
  }
  float proportional() const {
    return get(RIG_PARAMETER_PARAMETER_INDEX_PROPORTIONAL_ML_S_KPA_CHOICE);
  }
  float integral() const { return get(RIG_PARAMETER_PARAMETER_INDEX_INTEGRAL_ML_S2_KPA_CHOICE); }
  float feed_forward() const { return get(RIG_PARAMETER_PARAMETER_INDEX_FEED_FORWARD_CHOICE); }
  Flow max_flow() const { return ml_s(get(RIG_PARAMETER_PARAMETER_INDEX_MAX_FLOW_ML_S_CHOICE)); }
  FlowAcceleration max_flow_acceleration() const {
    return ml_s2(get(RIG_PARAMETER_PARAMETER_INDEX_MAX_FLOW_ACCELERATION_ML_S2_CHOICE));
  }
  PressureRate setpoint_rate() const {
    return kpa_s(get(RIG_PARAMETER_PARAMETER_INDEX_SETPOINT_RATE_KPA_S_CHOICE));
  }
  Volume syringe_volume() const {
    return ml(get(RIG_PARAMETER_PARAMETER_INDEX_SYRINGE_VOLUME_ML_CHOICE));
  }
  Volume volume_per_step() const {
    return ml(get(RIG_PARAMETER_PARAMETER_INDEX_VOLUME_PER_STEP_UL_CHOICE) * 1e-3f);
  }
  Volume system_volume() const {
    return ml(get(RIG_PARAMETER_PARAMETER_INDEX_SYSTEM_VOLUME_ML_CHOICE));
  }
  Pressure ambient_pressure() const {
    return kpa(get(RIG_PARAMETER_PARAMETER_INDEX_AMBIENT_PRESSURE_KPA_CHOICE));
  }
  float transducer_gain_kpa_v() const {
    return get(RIG_PARAMETER_PARAMETER_INDEX_TRANSDUCER_GAIN_KPA_V_CHOICE);
  }
  Voltage transducer_offset() const {
    return volts(get(RIG_PARAMETER_PARAMETER_INDEX_TRANSDUCER_OFFSET_V_CHOICE));
  }
  Voltage adc_reference() const {
    return volts(get(RIG_PARAMETER_PARAMETER_INDEX_ADC_REFERENCE_V_CHOICE));
  }
  Pressure pressure_limit() const {
    return kpa(get(RIG_PARAMETER_PARAMETER_INDEX_PRESSURE_LIMIT_KPA_CHOICE));
  }
  PressureRate pressure_rate_limit() const {
    return kpa_s(get(RIG_PARAMETER_PARAMETER_INDEX_PRESSURE_RATE_LIMIT_KPA_S_CHOICE));
  }
  Duration communication_timeout() const {
    return seconds(get(RIG_PARAMETER_PARAMETER_INDEX_COMMUNICATION_TIMEOUT_S_CHOICE));
  }
  Duration hx711_timeout() const {
    return seconds(get(RIG_PARAMETER_PARAMETER_INDEX_HX711_TIMEOUT_S_CHOICE));
  }
  Volume leak_volume() const {
    return ml(get(RIG_PARAMETER_PARAMETER_INDEX_LEAK_VOLUME_ML_CHOICE));
  }
  Duration stuck_time() const {
    return seconds(get(RIG_PARAMETER_PARAMETER_INDEX_STUCK_TIME_S_CHOICE));
  }
  Pressure zero_limit() const {
    return kpa(get(RIG_PARAMETER_PARAMETER_INDEX_ZERO_LIMIT_KPA_CHOICE));
  }
  Flow homing_flow() const {
    return ml_s(get(RIG_PARAMETER_PARAMETER_INDEX_HOMING_FLOW_ML_S_CHOICE));
  }

 private:
  float values_[kCount] = {};
};

static_assert(RIG_PARAMETER_PARAMETER_INDEX_HOMING_FLOW_ML_S_CHOICE == Parameters::kCount - 1,
              "the table must cover the schema");

}  // namespace rig
