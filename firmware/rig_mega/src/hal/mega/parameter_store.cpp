#include "parameter_store.h"

#include <avr/eeprom.h>

#include "../../core/parameters.h"

namespace rig {
namespace mega {

namespace {

// Not the first byte: it is the one a brown-out during a write hits.
constexpr uint16_t kAddress = 16;

uint8_t *cell(uint16_t i) { return reinterpret_cast<uint8_t *>(kAddress + i); }

}  // namespace

void ParameterStore::read() {
  static_assert(kSize == Parameters::kImageSize, "the store holds one image");
  eeprom_read_block(image_, cell(0), kSize);
}

bool ParameterStore::writing() const { return next_ < kSize; }

void ParameterStore::step() {
  if (!writing() || !eeprom_is_ready()) return;
  eeprom_update_byte(cell(next_), image_[next_]);
  ++next_;
}

}  // namespace mega
}  // namespace rig
