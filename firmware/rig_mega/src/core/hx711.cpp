#include "hx711.h"

namespace rig {

namespace {

constexpr uint32_t kMask = 0xFFFFFF;
constexpr uint32_t kHighest = 0x7FFFFF;
constexpr uint32_t kLowest = 0x800000;

bool apart(int32_t a, int32_t b, int32_t limit) {
  const int32_t difference = a - b;
  return difference > limit || difference < -limit;
}

}  // namespace

int32_t hx711_counts(uint32_t word) {
  word &= kMask;
  return static_cast<int32_t>(word) - (word >= kLowest ? static_cast<int32_t>(1) << 24 : 0);
}

void Hx711::forget() {
  have_good_ = have_doubted_ = false;
  bad_in_a_row_ = 0;
}

// All ones or all zeros is what a broken or sleeping data line reads as; near zero it may be true.
bool Hx711::is_dead_line(uint32_t word) const {
  return (word == kMask || word == 0) && have_good_ && apart(good_, 0, kNearZero);
}

// A lost clock edge shifts the word by one and a one follows: twice the true value plus one, and
// twice the noise of both words, which must not hide it.
bool Hx711::is_shifted(int32_t counts) const {
  if (!have_good_ || (counts & 1) == 0 || !apart(good_, 0, 2 * kNearZero)) return false;
  const int32_t tolerance = kNearZero + (good_ < 0 ? -good_ : good_) / 16;
  return !apart(counts, 2 * good_ + 1, tolerance);
}

LoadCellStatus Hx711::accept(uint32_t word) {
  word &= kMask;
  counts_ = hx711_counts(word);
  if (word == kHighest || word == kLowest) return LoadCellStatus::kSaturated;
  bool bad = is_dead_line(word) || is_shifted(counts_);
  if (!bad && have_good_ && apart(counts_, good_, kJump)) {
    bad = !have_doubted_ || apart(counts_, doubted_, kJump);
    doubted_ = counts_;
    have_doubted_ = true;
  }
  if (bad) {
    if (bad_in_a_row_ < kBadWordsToDesync) ++bad_in_a_row_;
    return LoadCellStatus::kDesync;
  }
  good_ = counts_;
  have_good_ = true;
  have_doubted_ = false;
  bad_in_a_row_ = 0;
  return LoadCellStatus::kOk;
}

}  // namespace rig
