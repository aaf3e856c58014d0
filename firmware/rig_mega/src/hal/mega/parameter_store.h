// Parameters in EEPROM, written a byte at a time so that nothing waits for it.
#pragma once

#include <stdint.h>

namespace rig {
namespace mega {

class ParameterStore {
 public:
  // The image to fill; then `begin_write`.
  uint8_t *image() { return image_; }
  void read();
  void begin_write() { next_ = 0; }
  bool writing() const;
  // Writes one byte if the memory is ready and something is left.
  void step();

 private:
  static constexpr uint16_t kSize = 92;
  uint8_t image_[kSize] = {};
  uint16_t next_ = kSize;
};

}  // namespace mega
}  // namespace rig
