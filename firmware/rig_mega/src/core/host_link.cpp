#include "host_link.h"

#include <string.h>

#include "count.h"
#include "generated/rig.h"
#include "tick.h"

namespace rig {

namespace {

constexpr uint16_t kStampPeriodMs = 60000;

constexpr uint16_t kReceived[] = {RIG_HOST_HEARTBEAT_FRAME_ID, RIG_COMMAND_FRAME_ID,
                                  RIG_PARAMETER_REQUEST_FRAME_ID, RIG_IDENTITY_REQUEST_FRAME_ID};
constexpr uint16_t kSent[] = {RIG_HEARTBEAT_FRAME_ID, RIG_PRESSURE_FRAME_ID,
                              RIG_CONTROLLER_FRAME_ID, RIG_LOAD_CELL_FRAME_ID,
                              RIG_FAULT_FRAME_ID, RIG_PARAMETER_FRAME_ID,
                              RIG_IDENTITY_FRAME_ID};

template <uint8_t Count>
uint8_t index_of(uint16_t id, const uint16_t (&ids)[Count]) {
  uint8_t i = 0;
  while (i < Count && ids[i] != id) ++i;
  return i;
}

}  // namespace

void HostLink::tick() {
  stamp_ms_ = static_cast<uint16_t>(stamp_ms_ + kTickMs);
  if (stamp_ms_ >= kStampPeriodMs) stamp_ms_ = static_cast<uint16_t>(stamp_ms_ - kStampPeriodMs);
}

bool HostLink::take_opened() {
  const bool opened = opened_;
  opened_ = false;
  return opened;
}

bool HostLink::receive(uint8_t byte, CanFrame &frame) {
  switch (parser_.feed(byte, frame)) {
    case slcan::Kind::kNothing: return false;
    case slcan::Kind::kBad:
      increment(counters_.bad_lines);
      reply("\a");
      return false;
    case slcan::Kind::kOpen: open_ = opened_ = true; break;
    case slcan::Kind::kClose: close(); break;
    case slcan::Kind::kTimestampsOff: stamped_ = false; break;
    case slcan::Kind::kTimestampsOn: stamped_ = true; break;
    case slcan::Kind::kVersion: reply("V1013"); break;
    case slcan::Kind::kSerialNumber: reply("NR1G0"); break;
    case slcan::Kind::kStatus: reply("F00"); break;
    case slcan::Kind::kBitRate:
    case slcan::Kind::kOtherFrame: break;
    case slcan::Kind::kFrame:
      reply(open_ ? "\r" : "\a");
      return open_ && accept(frame);
  }
  reply("\r");
  return false;
}

bool HostLink::accept(const CanFrame &frame) {
  const uint8_t i = index_of(frame.id, kReceived);
  if (i == kReceivedIds) {
    increment(counters_.unknown);
    return false;
  }
  switch (checks_[i].judge(frame)) {
    case Reception::kFresh: return true;
    case Reception::kCorrupt: increment(counters_.corrupt); return false;
    case Reception::kRepeated: break;
  }
  increment(counters_.repeated);
  return false;
}

void HostLink::send(CanFrame frame) {
  if (!open_) return;
  const uint8_t i = index_of(frame.id, kSent);
  protect(frame, alive_[i]);
  uint8_t line[slcan::kLongestFrame];
  const uint8_t length = slcan::format(frame, stamped_, stamp_ms_, line);
  // the counter advances even if the line is full: the host sees the gap
  alive_[i] = static_cast<uint8_t>(alive_[i] + 1 < kAliveCount ? alive_[i] + 1 : 0);
  if (!transmit_.push(line, length)) increment(counters_.not_sent);
}

void HostLink::reply(const char *text) {
  transmit_.push(reinterpret_cast<const uint8_t *>(text), static_cast<uint16_t>(strlen(text)));
}

// The next host starts its own counting.
void HostLink::close() {
  open_ = false;
  for (AliveCheck &check : checks_) check.forget();
}

}  // namespace rig
