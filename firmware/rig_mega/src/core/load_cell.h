// The load cell: trusted words, tare, how long ago the last one came, and when its HX711 should be
// switched off and on again.
#pragma once

#include <stdint.h>

#include "faults.h"
#include "hx711.h"
#include "parameters.h"
#include "tare.h"
#include "tick.h"
#include "units.h"

namespace rig {

class LoadCell {
 public:
  void configure(const Parameters &parameters) {
    timeout_ticks_ = ticks_of(parameters.hx711_timeout());
  }

  LoadCellStatus accept(uint32_t word) {
    const bool credible = due();
    since_read_ticks_ = 0;
    if (!credible) return LoadCellStatus::kDesync;
    connected_ = true;
    restarted_ = false;
    silent_ticks_ = quiet_ticks_ = 0;
    ++sample_;
    const LoadCellStatus status = hx711_.accept(word);
    if (status == LoadCellStatus::kOk) tare_.add(hx711_.counts());
    if (hx711_.bad_in_a_row() == kBadWordsToRestart) restart();
    return status;
  }

  // Whether the HX711 can have a word again: it converts 10 or 80 times a second. A line that is
  // stuck low offers one in every tick, and none of them counts.
  bool due() const { return since_read_ticks_ >= kFastestTicks; }

  // A load cell that never spoke is not there; one that falls silent is restarted, and if that does
  // not help, a fault.
  Finding tick() {
    powered_ = !restart_asked_;
    restart_asked_ = false;
    if (since_read_ticks_ < kFastestTicks) ++since_read_ticks_;
    if (hx711_.desynchronised()) {
      return {Fault::kHx711Desync, static_cast<float>(hx711_.counts())};
    }
    if (!connected_) return kNoFinding;
    ++silent_ticks_;
    if (++quiet_ticks_ > (restarted_ ? kSettlingTicks : timeout_ticks_ / 2)) restart();
    if (!silent()) return kNoFinding;
    return {Fault::kHx711Timeout, to_seconds(duration_of(silent_ticks_))};
  }

  // False for the one tick in which the chip is switched off; it needs 60 us.
  bool powered() const { return powered_; }

  bool silent() const { return connected_ && silent_ticks_ > timeout_ticks_; }

  void begin_tare() { tare_.begin(); }
  bool tared() const { return tare_.done(); }

  // Begins a new judgement after a fault.
  void forgive() {
    hx711_.forget();
    silent_ticks_ = 0;
  }

  int32_t net_counts() const { return hx711_.counts() - tare_.zero(); }
  uint16_t sample() const { return sample_; }

 private:
  // 80 conversions a second are 12.5 ms apart; the oscillator may be fast, the main loop late.
  static constexpr uint8_t kFastestTicks = ticks_of_ms(6);
  // The datasheet's settling time at 10 conversions a second is 400 ms.
  static constexpr uint32_t kSettlingTicks = ticks_of_ms(600);
  static constexpr uint8_t kBadWordsToRestart = 4;

  void restart() {
    restart_asked_ = restarted_ = true;
    quiet_ticks_ = 0;
  }

  Hx711 hx711_;
  Tare tare_;
  uint32_t timeout_ticks_ = 0;
  uint32_t silent_ticks_ = 0;  // since the last word
  uint32_t quiet_ticks_ = 0;   // since the last word or restart
  uint16_t sample_ = 0;
  uint8_t since_read_ticks_ = kFastestTicks;
  bool connected_ = false;
  bool restarted_ = false;  // since the last word
  bool restart_asked_ = false;
  bool powered_ = true;
};

}  // namespace rig
