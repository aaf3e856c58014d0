#include "adc.h"

#include <avr/interrupt.h>
#include <avr/io.h>

#include "pins.h"

namespace rig {
namespace mega {

namespace {

// 125 kHz: 104 us a conversion, the fastest at full accuracy
constexpr uint8_t kConvert = _BV(ADEN) | _BV(ADIE) | _BV(ADPS2) | _BV(ADPS1) | _BV(ADPS0) | _BV(ADSC);

volatile uint16_t running_sum;  // 19 conversions of 10 bits fit
volatile uint8_t running_count;

}  // namespace

void adc_begin() {
  DIDR0 = _BV(kPressureChannel);            // no digital input on the pin
  // cppcheck-suppress badBitmaskCheck ; the channel happens to be 0
  ADMUX = _BV(REFS0) | kPressureChannel;    // reference AVCC
  ADCSRB = 0;
  ADCSRA = kConvert;
}

void adc_collect(uint32_t &sum, uint8_t &count) {
  sum = running_sum;
  count = running_count;
  running_sum = 0;
  running_count = 0;
}

ISR(ADC_vect) {
  running_sum = static_cast<uint16_t>(running_sum + ADC);
  running_count = static_cast<uint8_t>(running_count + 1);
  ADCSRA = kConvert;
}

}  // namespace mega
}  // namespace rig
