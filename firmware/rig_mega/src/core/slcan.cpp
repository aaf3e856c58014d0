#include "slcan.h"

namespace rig {
namespace slcan {

namespace {

constexpr uint8_t kNoDigit = 0xFF;

uint8_t digit(uint8_t c) {
  if (c >= '0' && c <= '9') return static_cast<uint8_t>(c - '0');
  if (c >= 'A' && c <= 'F') return static_cast<uint8_t>(c - 'A' + 10);
  if (c >= 'a' && c <= 'f') return static_cast<uint8_t>(c - 'a' + 10);
  return kNoDigit;
}

uint8_t hexadecimal(uint8_t value) {
  return static_cast<uint8_t>(value < 10 ? '0' + value : 'A' + value - 10);
}

bool all_digits(const uint8_t *text, uint8_t count) {
  for (uint8_t i = 0; i < count; ++i) {
    if (digit(text[i]) == kNoDigit) return false;
  }
  return true;
}

Kind parse_frame(const uint8_t *line, uint8_t length, bool extended, bool remote,
                 CanFrame &frame) {
  const uint8_t header = extended ? 10 : 5;
  if (length < header || !all_digits(line + 1, static_cast<uint8_t>(length - 1))) return Kind::kBad;
  const uint8_t count = digit(line[header - 1]);
  if (count > 8 || length != header + (remote ? 0 : 2 * count)) return Kind::kBad;
  if (extended || remote) return Kind::kOtherFrame;
  const uint16_t id =
      static_cast<uint16_t>(digit(line[1]) << 8 | digit(line[2]) << 4 | digit(line[3]));
  if (id > 0x7FF) return Kind::kBad;
  frame.id = id;
  frame.length = count;
  const uint8_t *text = line + header;
  for (uint8_t i = 0; i < count; ++i, text += 2) {
    frame.data[i] = static_cast<uint8_t>(digit(text[0]) << 4 | digit(text[1]));
  }
  for (uint8_t i = count; i < 8; ++i) frame.data[i] = 0;
  return Kind::kFrame;
}

}  // namespace

Kind Parser::feed(uint8_t byte, CanFrame &frame) {
  if (byte != '\r') {
    // line feeds are no part of the protocol, but terminals send them
    if (byte == '\n') return Kind::kNothing;
    if (length_ < kLongestLine) {
      line_[length_++] = byte;
    } else {
      too_long_ = true;
    }
    return Kind::kNothing;
  }
  const Kind kind = too_long_ ? Kind::kBad : parse(frame);
  length_ = 0;
  too_long_ = false;
  return kind;
}

Kind Parser::parse(CanFrame &frame) const {
  if (length_ == 0) return Kind::kNothing;
  switch (line_[0]) {
    case 't': return parse_frame(line_, length_, false, false, frame);
    case 'T': return parse_frame(line_, length_, true, false, frame);
    case 'r': return parse_frame(line_, length_, false, true, frame);
    case 'R': return parse_frame(line_, length_, true, true, frame);
    case 'S': return length_ == 2 && line_[1] >= '0' && line_[1] <= '8' ? Kind::kBitRate : Kind::kBad;
    case 'Z':
      if (length_ != 2) return Kind::kBad;
      if (line_[1] == '0') return Kind::kTimestampsOff;
      return line_[1] == '1' ? Kind::kTimestampsOn : Kind::kBad;
    default: break;
  }
  if (length_ != 1) return Kind::kBad;
  switch (line_[0]) {
    case 'O': return Kind::kOpen;
    case 'C': return Kind::kClose;
    case 'V': return Kind::kVersion;
    case 'N': return Kind::kSerialNumber;
    case 'F': return Kind::kStatus;
    default: return Kind::kBad;
  }
}

uint8_t format(const CanFrame &frame, bool stamped, uint16_t stamp_ms, uint8_t *out) {
  uint8_t *p = out;
  *p++ = 't';
  *p++ = hexadecimal(static_cast<uint8_t>(frame.id >> 8 & 0x7));
  *p++ = hexadecimal(static_cast<uint8_t>(frame.id >> 4 & 0xF));
  *p++ = hexadecimal(static_cast<uint8_t>(frame.id & 0xF));
  *p++ = hexadecimal(frame.length);
  for (uint8_t i = 0; i < frame.length; ++i) {
    *p++ = hexadecimal(static_cast<uint8_t>(frame.data[i] >> 4));
    *p++ = hexadecimal(static_cast<uint8_t>(frame.data[i] & 0xF));
  }
  if (stamped) {
    for (int8_t shift = 12; shift >= 0; shift = static_cast<int8_t>(shift - 4)) {
      *p++ = hexadecimal(static_cast<uint8_t>(stamp_ms >> shift & 0xF));
    }
  }
  *p++ = '\r';
  return static_cast<uint8_t>(p - out);
}

}  // namespace slcan
}  // namespace rig
