// A ring of bytes that takes a message whole or not at all.
#pragma once

#include <stddef.h>
#include <stdint.h>

namespace rig {

template <uint16_t Capacity>
class ByteQueue {
  static_assert(Capacity != 0 && (Capacity & (Capacity - 1)) == 0, "a power of two wraps cheaply");

 public:
  uint16_t size() const { return static_cast<uint16_t>(head_ - tail_); }
  bool empty() const { return head_ == tail_; }

  // False, and nothing queued, if there is no room for all of it.
  bool push(const uint8_t *bytes, uint16_t count) {
    if (count > Capacity - size()) return false;
    for (uint16_t i = 0; i < count; ++i) ring_[head_++ & kMask] = bytes[i];
    return true;
  }

  // The queue must not be empty.
  uint8_t pop() { return ring_[tail_++ & kMask]; }

 private:
  static constexpr uint16_t kMask = Capacity - 1;
  uint8_t ring_[Capacity] = {};
  uint16_t head_ = 0;
  uint16_t tail_ = 0;
};

}  // namespace rig
