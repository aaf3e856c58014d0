// The conversation with the host: SLCAN lines in and out, end-to-end protection both ways.
#pragma once

#include <stdint.h>

#include "byte_queue.h"
#include "can_frame.h"
#include "e2e.h"
#include "slcan.h"

namespace rig {

struct LinkCounters {
  uint16_t corrupt;      // frames with a wrong CRC, length or alive counter
  uint16_t repeated;     // frames whose alive counter stood still
  uint16_t unknown;      // frames of an id that is not for us
  uint16_t bad_lines;    // lines that are no SLCAN
  uint16_t not_sent;     // our frames that found the queue full
};

class HostLink {
 public:
  static constexpr uint16_t kQueueSize = 512;
  using TransmitQueue = ByteQueue<kQueueSize>;

  // Takes a byte from the line; true if it completed a trustworthy frame for us.
  bool receive(uint8_t byte, CanFrame &frame);

  // Protects and queues a frame of ours; silently nothing while the channel is closed.
  void send(CanFrame frame);

  void tick();

  // True once after the channel was opened: somebody new listens.
  bool take_opened();

  TransmitQueue &transmit_queue() { return transmit_; }
  const LinkCounters &counters() const { return counters_; }

 private:
  bool accept(const CanFrame &frame);
  void reply(const char *text);
  void close();

  static constexpr uint8_t kReceivedIds = 4;
  static constexpr uint8_t kSentIds = 7;

  slcan::Parser parser_;
  TransmitQueue transmit_;
  AliveCheck checks_[kReceivedIds];
  uint8_t alive_[kSentIds] = {};
  LinkCounters counters_ = {};
  uint16_t stamp_ms_ = 0;
  bool open_ = false;
  bool opened_ = false;  // and nobody took note yet
  bool stamped_ = false;
};

}  // namespace rig
