// The instructions of an image, decoded.
// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdint.h>

#include "machine.h"

namespace rig_emulator_parts {

// In memory, the registers of the devices lie between those of the processor and the rest; where
// they end is a matter of libsimavr.
constexpr uint32_t kDevicesBegin = 32, kDevicesEnd = 311, kMemoryBegins = 312;

#define RIG_CODE(name) k_##name,
enum Code : uint8_t {
  kUndecoded,
  kOther,  // for libsimavr
  RIG_OPERATIONS(RIG_CODE)
  RIG_CONDITIONS(RIG_CODE)
  kJump, kCall, kRet, kReti,
  kSei, kCli, kSleep,
  kReadDevice, kWriteDevice, kSetBit, kClearBit, kIfPinClear, kIfPinSet,
};
#undef RIG_CODE
constexpr uint8_t kFirstOperation = kOther + 1, kFirstCondition = k_if_carry;

struct Instruction {
  uint8_t code;
  uint8_t d, r;           // registers, bit numbers
  uint8_t words, cycles;
  uint8_t extra;          // cycles more if a condition is true
  uint32_t k;             // constant, address, displacement; where a jump leads, in words
};

struct Image {
  const uint8_t *flash;
  uint32_t words;
  uint32_t memory_ends;   // the last address
  // of the registers of devices, those that are nothing but memory to who reads or writes them
  bool plain_reads[kDevicesEnd], plain_writes[kDevicesEnd];

  uint32_t opcode(uint32_t word) const {
    if (word >= words) return 0xFFFF;  // as erased flash
    return flash[2 * word] | static_cast<uint32_t>(flash[2 * word + 1]) << 8;
  }
};

Instruction decode(const Image &image, uint32_t word);

}  // namespace rig_emulator_parts
