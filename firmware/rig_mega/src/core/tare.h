// The load cell's zero: the mean of a number of trusted words.
#pragma once

#include <stdint.h>

namespace rig {

class Tare {
 public:
  static constexpr uint8_t kWords = 20;

  void begin() {
    left_ = kWords;
    sum_ = 0;
    done_ = false;
  }

  void add(int32_t counts) {
    if (left_ == 0) return;
    sum_ += counts;  // 20 words of 24 bits fit into 32
    if (--left_ == 0) {
      const int32_t half = sum_ < 0 ? -(kWords / 2) : kWords / 2;
      zero_ = (sum_ + half) / kWords;
      done_ = true;
    }
  }

  bool done() const { return done_; }
  int32_t zero() const { return zero_; }

 private:
  int32_t sum_ = 0;
  int32_t zero_ = 0;
  uint8_t left_ = 0;
  bool done_ = false;
};

}  // namespace rig
