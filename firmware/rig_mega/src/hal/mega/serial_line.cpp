#include "serial_line.h"

#include <avr/interrupt.h>
#include <avr/io.h>

namespace rig {
namespace mega {

namespace {

// One writer and one reader each, and indices of one byte: no lock is needed.
constexpr uint8_t kMask = 127;
volatile uint8_t received[kMask + 1];
volatile uint8_t received_head, received_tail;
volatile uint8_t sending[kMask + 1];
volatile uint8_t sending_head, sending_tail;

constexpr uint16_t kDivider = F_CPU / 8 / 115200 - 1;  // double speed

}  // namespace

void serial_begin() {
  UCSR0A = _BV(U2X0);
  UBRR0 = kDivider;
  UCSR0C = _BV(UCSZ01) | _BV(UCSZ00);  // 8N1
  UCSR0B = _BV(RXEN0) | _BV(TXEN0) | _BV(RXCIE0);
}

bool serial_read(uint8_t &byte) {
  const uint8_t tail = received_tail;
  if (tail == received_head) return false;
  byte = received[tail];
  received_tail = static_cast<uint8_t>((tail + 1) & kMask);
  return true;
}

bool serial_can_write() {
  return static_cast<uint8_t>((sending_head + 1) & kMask) != sending_tail;
}

void serial_write(uint8_t byte) {
  const uint8_t head = sending_head;
  sending[head] = byte;
  sending_head = static_cast<uint8_t>((head + 1) & kMask);
  UCSR0B |= _BV(UDRIE0);
}

ISR(USART0_RX_vect) {
  const uint8_t byte = UDR0;
  const uint8_t next = static_cast<uint8_t>((received_head + 1) & kMask);
  if (next == received_tail) return;  // the CRC of the frame will tell
  received[received_head] = byte;
  received_head = next;
}

ISR(USART0_UDRE_vect) {
  const uint8_t tail = sending_tail;
  if (tail == sending_head) {
    UCSR0B &= static_cast<uint8_t>(~_BV(UDRIE0));
    return;
  }
  UDR0 = sending[tail];
  sending_tail = static_cast<uint8_t>((tail + 1) & kMask);
}

}  // namespace mega
}  // namespace rig
