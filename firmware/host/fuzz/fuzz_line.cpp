// Any bytes on the serial line: the parser and the link must take them, and what the board answers
// must be SLCAN.

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "host_link.h"
#include "slcan.h"

namespace {

void require(bool holds, const char *what) {
  if (holds) return;
  fprintf(stderr, "fuzz_line: broken: %s\n", what);
  abort();
}

void require_round_trip(const rig::CanFrame &frame) {
  uint8_t line[rig::slcan::kLongestFrame];
  const uint8_t length = rig::slcan::format(frame, false, 0, line);
  rig::slcan::Parser parser;
  rig::CanFrame again = {};
  rig::slcan::Kind kind = rig::slcan::Kind::kNothing;
  for (uint8_t i = 0; i < length; ++i) kind = parser.feed(line[i], again);
  require(kind == rig::slcan::Kind::kFrame, "a formatted frame is a frame");
  require(again.id == frame.id && again.length == frame.length, "id and length survive");
  require(memcmp(again.data, frame.data, frame.length) == 0, "data survive");
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t *bytes, size_t count) {
  rig::slcan::Parser parser;
  rig::HostLink link;
  size_t answers = 0, lines = 0;
  for (size_t i = 0; i < count; ++i) {
    rig::CanFrame frame = {};
    if (parser.feed(bytes[i], frame) == rig::slcan::Kind::kFrame) {
      require(frame.id <= 0x7FF && frame.length <= 8, "a frame is within the standard");
      require_round_trip(frame);
    }
    rig::CanFrame received = {};
    if (link.receive(bytes[i], received)) {
      require(received.length == 8 && received.data[0] == rig::frame_crc(received),
              "what is let through has eight bytes and the right CRC");
    }
    lines += bytes[i] == '\r';
    while (!link.transmit_queue().empty()) {
      const uint8_t answer = link.transmit_queue().pop();
      answers += answer == '\r' || answer == rig::slcan::kBell;
    }
  }
  require(answers <= 2 * lines, "an answer for a line");
  return 0;
}
