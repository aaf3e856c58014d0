// Judges the 24-bit words of an HX711 load-cell amplifier (Avia Semiconductor datasheet).
#pragma once

#include <stdint.h>

namespace rig {

enum class LoadCellStatus : uint8_t {
  kOk = 0,
  kSaturated = 1,
  kDesync = 2,
  kTimeout = 3,
  kRestarted = 4,
};

// Two's complement of 24 bits to a number.
int32_t hx711_counts(uint32_t word);

class Hx711 {
 public:
  // Takes a conversion; returns whether it can be trusted.
  LoadCellStatus accept(uint32_t word);

  int32_t counts() const { return counts_; }

  uint8_t bad_in_a_row() const { return bad_in_a_row_; }
  // Too many bad words in a row to be chance, even after a restart.
  bool desynchronised() const { return bad_in_a_row_ >= kBadWordsToDesync; }

  // Begins a new judgement (after a fault was cleared).
  void forget();

 private:
  // Above this difference between words 0.1 s apart, about 30 g on a 2 kg cell, a word is doubted
  // until the next one confirms it.
  static constexpr int32_t kJump = 65536;
  static constexpr int32_t kNearZero = 256;
  static constexpr uint8_t kBadWordsToDesync = 10;

  bool is_dead_line(uint32_t word) const;
  bool is_shifted(int32_t counts) const;

  int32_t counts_ = 0;
  int32_t good_ = 0;     // last trusted counts
  int32_t doubted_ = 0;  // last counts that jumped
  bool have_good_ = false;
  bool have_doubted_ = false;
  uint8_t bad_in_a_row_ = 0;
};

}  // namespace rig
