#include "parameters.h"

#include <string.h>

#include "crc.h"

namespace rig {

namespace {

constexpr uint8_t kLayoutVersion = 1;
constexpr uint8_t kErased = 0xFF;
constexpr bool kLive = true;
constexpr bool kAtRest = false;

// In the order of the schema. The syringe is 26.7 mm wide, the screw's lead 2 mm, 3200 microsteps
// a revolution: pi/4 * 26.7^2 * 2/3200 = 0.34994 uL a step.
constexpr ParameterRule kRules[] = {
    {4.0f, 0.01f, 100.0f, kLive},          // proportional_ml_s_kpa
    {3.0f, 0.0f, 200.0f, kLive},           // integral_ml_s2_kpa
    {1.0f, 0.0f, 2.0f, kLive},             // feed_forward
    {0.008f, 0.0f, 1.0f, kLive},           // deadband_kpa
    {6.0f, 0.05f, 30.0f, kLive},           // max_flow_ml_s
    {40.0f, 1.0f, 1000.0f, kLive},         // max_flow_acceleration_ml_s2
    {2.0f, 0.01f, 100.0f, kLive},          // setpoint_rate_kpa_s
    {60.0f, 1.0f, 64.0f, kAtRest},         // syringe_volume_ml
    {0.34994f, 0.005f, 10.0f, kAtRest},    // volume_per_step_ul
    {70.0f, 1.0f, 2000.0f, kLive},         // system_volume_ml
    {101.325f, 50.0f, 120.0f, kLive},      // ambient_pressure_kpa
    {10.0f, 0.5f, 200.0f, kAtRest},        // transducer_gain_kpa_v
    {0.5f, 0.0f, 4.0f, kAtRest},           // transducer_offset_v
    {5.0f, 1.0f, 6.0f, kAtRest},           // adc_reference_v
    {15.0f, 0.5f, 54.0f, kAtRest},         // pressure_limit_kpa
    {100.0f, 1.0f, 10000.0f, kLive},       // pressure_rate_limit_kpa_s
    {1.0f, 0.25f, 60.0f, kLive},           // communication_timeout_s
    {1.0f, 0.05f, 60.0f, kLive},           // hx711_timeout_s
    {3.0f, 0.1f, 64.0f, kLive},            // leak_volume_ml
    {0.2f, 0.05f, 60.0f, kLive},           // stuck_time_s
    {2.0f, 0.0f, 10.0f, kAtRest},          // zero_limit_kpa
    {2.0f, 0.05f, 10.0f, kAtRest},         // homing_flow_ml_s
};
static_assert(sizeof(kRules) / sizeof(kRules[0]) == Parameters::kCount, "one rule each");

ParameterResult judge(uint8_t index, float value) {
  if (!is_finite(value)) return ParameterResult::kNotFinite;
  const ParameterRule &rule = kRules[index];
  if (value < rule.low || value > rule.high) return ParameterResult::kOutOfRange;
  return ParameterResult::kAccepted;
}

}  // namespace

bool is_finite(float value) {
  uint32_t bits;
  memcpy(&bits, &value, sizeof bits);
  return (bits & 0x7F800000u) != 0x7F800000u;
}

const ParameterRule &Parameters::rule(uint8_t index) { return kRules[index]; }

void Parameters::reset() {
  for (uint8_t i = 0; i < kCount; ++i) values_[i] = kRules[i].initial;
}

ParameterResult Parameters::set(uint8_t index, float value, bool at_rest) {
  if (index >= kCount) return ParameterResult::kUnknownParameter;
  const ParameterResult result = judge(index, value);
  if (result != ParameterResult::kAccepted) return result;
  if (!at_rest && !kRules[index].live) return ParameterResult::kWrongState;
  values_[index] = value;
  return ParameterResult::kAccepted;
}

Parameters::Image Parameters::load(const uint8_t *image) {
  reset();
  bool blank = true;
  for (size_t i = 0; i < kImageSize; ++i) blank = blank && image[i] == kErased;
  if (blank) return Image::kBlank;
  const uint16_t stored =
      static_cast<uint16_t>(image[kImageSize - 2] | image[kImageSize - 1] << 8);
  if (crc16_ccitt_false(image, kImageSize - 2) != stored || image[0] != kLayoutVersion ||
      image[1] != kCount) {
    return Image::kCorrupt;
  }
  // little-endian on every machine this runs on: AVR, x86, ARM
  memcpy(values_, image + 2, sizeof values_);
  for (uint8_t i = 0; i < kCount; ++i) {
    if (judge(i, values_[i]) != ParameterResult::kAccepted) {
      reset();
      return Image::kCorrupt;
    }
  }
  return Image::kLoaded;
}

void Parameters::store(uint8_t *image) const {
  image[0] = kLayoutVersion;
  image[1] = kCount;
  memcpy(image + 2, values_, sizeof values_);
  const uint16_t crc = crc16_ccitt_false(image, kImageSize - 2);
  image[kImageSize - 2] = static_cast<uint8_t>(crc & 0xFF);
  image[kImageSize - 1] = static_cast<uint8_t>(crc >> 8);
}

}  // namespace rig
