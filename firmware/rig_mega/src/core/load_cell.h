// The load cell: trusted words, tare, and how long ago the last one came.
#pragma once

#include <stdint.h>

#include "faults.h"
#include "hx711.h"
#include "tare.h"
#include "tick.h"
#include "units.h"

namespace rig {

class LoadCell {
 public:
  LoadCellStatus accept(uint32_t word) {
    connected_ = true;
    silent_ticks_ = 0;
    ++sample_;
    const LoadCellStatus status = hx711_.accept(word);
    if (status == LoadCellStatus::kOk) tare_.add(hx711_.counts());
    return status;
  }

  // A load cell that never spoke is not there; one that falls silent is a fault.
  Finding tick(Duration timeout) {
    if (hx711_.desynchronised()) {
      return {Fault::kHx711Desync, static_cast<float>(hx711_.counts())};
    }
    if (!connected_) return kNoFinding;
    ++silent_ticks_;
    if (!silent(timeout)) return kNoFinding;
    return {Fault::kHx711Timeout, to_seconds(duration_of(silent_ticks_))};
  }

  bool silent(Duration timeout) const { return connected_ && duration_of(silent_ticks_) > timeout; }

  void begin_tare() { tare_.begin(); }
  void abandon_tare() { tare_.abandon(); }
  bool tared() const { return tare_.done(); }

  // Begins a new judgement after a fault.
  void forgive() {
    hx711_.forget();
    silent_ticks_ = 0;
  }

  int32_t net_counts() const { return hx711_.counts() - tare_.zero(); }
  uint16_t sample() const { return sample_; }

 private:
  Hx711 hx711_;
  Tare tare_;
  uint32_t silent_ticks_ = 0;
  uint16_t sample_ = 0;
  bool connected_ = false;
};

}  // namespace rig
