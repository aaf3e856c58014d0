// True only after a condition held for a number of ticks in a row.
#pragma once

#include <stdint.h>

namespace rig {

template <uint8_t Ticks>
class Debounce {
 public:
  bool operator()(bool condition) {
    if (!condition) {
      held_ = 0;
    } else if (held_ < Ticks) {
      ++held_;
    }
    return held_ == Ticks;
  }
  void reset() { held_ = 0; }

 private:
  uint8_t held_ = 0;
};

}  // namespace rig
