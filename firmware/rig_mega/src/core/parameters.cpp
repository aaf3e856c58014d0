#include "parameters.h"

#include <string.h>

#include "crc.h"
#include "generated/parameter_rules.h"

namespace rig {

namespace {

constexpr uint8_t kLayoutVersion = 1;
constexpr uint8_t kErased = 0xFF;

static_assert(sizeof(kParameterRules) / sizeof(kParameterRules[0]) == Parameters::kCount,
              "one rule each");

ParameterResult judge(uint8_t index, float value) {
  if (!is_finite(value)) return ParameterResult::kNotFinite;
  const ParameterRule &rule = kParameterRules[index];
  if (value < rule.low || value > rule.high) return ParameterResult::kOutOfRange;
  return ParameterResult::kAccepted;
}

}  // namespace

bool is_finite(float value) {
  uint32_t bits = 0;
  memcpy(&bits, &value, sizeof bits);
  return (bits & 0x7F800000u) != 0x7F800000u;
}

const ParameterRule &Parameters::rule(uint8_t index) { return kParameterRules[index]; }

void Parameters::reset() {
  for (uint8_t i = 0; i < kCount; ++i) values_[i] = kParameterRules[i].initial;
}

ParameterResult Parameters::set(uint8_t index, float value, bool at_rest) {
  if (index >= kCount) return ParameterResult::kUnknownParameter;
  const ParameterResult result = judge(index, value);
  if (result != ParameterResult::kAccepted) return result;
  if (!at_rest && !kParameterRules[index].live) return ParameterResult::kWrongState;
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
