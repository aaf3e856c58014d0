// See instruction.h; the AVR Instruction Set Manual (Microchip DS40002198) has the opcodes.
// SPDX-License-Identifier: GPL-3.0-or-later

#include "instruction.h"

namespace rig_emulator_parts {

namespace {

constexpr uint8_t kX = 26, kY = 28, kZ = 30;  // pointers
constexpr uint32_t kStatus = 0x5F;

// LDS, STS, JMP and CALL take two words.
uint32_t length(uint32_t opcode) {
  return (opcode & 0xFC0F) == 0x9000 || (opcode & 0xFE0C) == 0x940C ? 2 : 1;
}

}  // namespace

Instruction decode(const Image &image, uint32_t word) {
  const uint32_t o = image.opcode(word);
  const uint8_t d5 = o >> 4 & 31, r5 = static_cast<uint8_t>((o & 15) | (o >> 5 & 16));
  const uint8_t d4 = static_cast<uint8_t>(16 + (o >> 4 & 15));
  const uint32_t k8 = (o & 15) | (o >> 4 & 0xF0);
  const uint32_t relative = word + 1 + static_cast<uint32_t>(static_cast<int32_t>(o << 20) >> 20);
  const uint8_t skipped = static_cast<uint8_t>(length(image.opcode(word + 1)));
  const auto one = [&](Code code, uint8_t d, uint8_t r, uint32_t k = 0, uint8_t cycles = 1) {
    return Instruction{code, d, r, 1, cycles, 0, k};
  };
  const auto skip = [&](Code code, uint8_t d, uint8_t r) {
    return Instruction{code, d, r, 1, 1, skipped, word + 1 + skipped};
  };
  const auto device = [&](bool write, uint32_t address) {
    if (write) return image.plain_writes[address] ? k_sts : kWriteDevice;
    return image.plain_reads[address] ? k_lds : kReadDevice;
  };
  const Instruction other = one(kOther, 0, 0);
  switch (o >> 12) {
    case 0x0:
      if (o == 0) return one(k_nop, 0, 0);
      if ((o & 0x0F00) == 0x0100) {
        return one(k_movw, static_cast<uint8_t>((o >> 4 & 15) * 2),
                   static_cast<uint8_t>((o & 15) * 2));
      }
      if ((o & 0x0F00) == 0x0200) return one(k_muls, d4, static_cast<uint8_t>(16 + (o & 15)), 0, 2);
      if ((o & 0x0F88) == 0x0300) {
        return one(k_mulsu, static_cast<uint8_t>(16 + (o >> 4 & 7)),
                   static_cast<uint8_t>(16 + (o & 7)), 0, 2);
      }
      if ((o & 0x0C00) == 0x0400) return one(k_cpc, d5, r5);
      if ((o & 0x0C00) == 0x0800) return one(k_sbc, d5, r5);
      if ((o & 0x0C00) == 0x0C00) return one(k_add, d5, r5);
      return other;
    case 0x1: {
      if ((o & 0x0C00) == 0) return skip(k_if_same, d5, r5);
      const Code codes[] = {kOther, k_cp, k_sub, k_adc};
      return one(codes[o >> 10 & 3], d5, r5);
    }
    case 0x2: {
      const Code codes[] = {k_and_, k_eor, k_or_, k_mov};
      return one(codes[o >> 10 & 3], d5, r5);
    }
    case 0x3: return one(k_cpi, d4, 0, k8);
    case 0x4: return one(k_sbci, d4, 0, k8);
    case 0x5: return one(k_subi, d4, 0, k8);
    case 0x6: return one(k_ori, d4, 0, k8);
    case 0x7: return one(k_andi, d4, 0, k8);
    case 0x8:
    case 0xA:
      return one(o & 0x200 ? k_store : k_load, d5, o & 8 ? kY : kZ,
                 (o & 7) | (o >> 7 & 0x18) | (o >> 8 & 0x20), 2);
    case 0x9: break;  // below
    case 0xB: {
      const uint32_t address = kDevicesBegin + ((o & 15) | (o >> 5 & 0x30));
      const bool out = o & 0x800;
      if (address == kStatus) return one(out ? k_write_status : k_read_status, d5, 0);
      return one(device(out, address), d5, 0, address);
    }
    case 0xC: return one(kJump, 0, 0, relative, 2);
    case 0xD: return one(kCall, 0, 0, relative, 4);
    case 0xE: return one(k_ldi, d4, 0, k8);
    default: {
      const uint8_t bit = o & 7;
      if ((o & 0x0800) == 0) {
        const Code set[] = {k_if_carry, k_if_zero, k_if_negative, kOther,
                            k_if_less,  kOther,    k_if_transfer, kOther};
        const Code clear[] = {k_if_no_carry, k_if_not_zero, k_if_positive,    kOther,
                              k_if_not_less, kOther,        k_if_no_transfer, kOther};
        const uint32_t by = static_cast<uint32_t>(static_cast<int32_t>(o << 22) >> 25);
        return Instruction{(o & 0x400 ? clear : set)[bit], 0, 0, 1, 1, 1, word + 1 + by};
      }
      if (o & 8) return other;
      if (o & 0x400) return skip(o & 0x200 ? k_if_bit_set : k_if_bit_clear, d5, bit);
      return one(o & 0x200 ? k_bst : k_bld, d5, bit);
    }
  }
  if ((o & 0xFC00) == 0x9000) {
    const bool store = o & 0x200;
    const auto memory = [&](Code load, Code keep, uint8_t pointer) {
      return one(store ? keep : load, d5, pointer, 0, 2);
    };
    switch (o & 15) {
      case 0x0: {
        const uint32_t k = image.opcode(word + 1);
        if (k >= kMemoryBegins && k <= image.memory_ends) {
          return {store ? k_sts : k_lds, d5, 0, 2, 2, 0, k};
        }
        if (k < kDevicesBegin || k >= kDevicesEnd || k == kStatus) return other;
        return {device(store, k), d5, 0, 2, 2, 0, k};
      }
      case 0x1: return memory(k_load_inc, k_store_inc, kZ);
      case 0x2: return memory(k_load_dec, k_store_dec, kZ);
      case 0x9: return memory(k_load_inc, k_store_inc, kY);
      case 0xA: return memory(k_load_dec, k_store_dec, kY);
      case 0xC: return memory(k_load, k_store, kX);
      case 0xD: return memory(k_load_inc, k_store_inc, kX);
      case 0xE: return memory(k_load_dec, k_store_dec, kX);
      case 0xF: return memory(k_pop, k_push, 0);
      default: return other;
    }
  }
  if (o == 0x9408) return one(k_sec, 0, 0);
  if (o == 0x9488) return one(k_clc, 0, 0);
  if (o == 0x9468) return one(k_set, 0, 0);
  if (o == 0x94E8) return one(k_clt, 0, 0);
  if (o == 0x9478) return one(kSei, 0, 0);
  if (o == 0x94F8) return one(kCli, 0, 0);
  if (o == 0x9588) return one(kSleep, 0, 0);
  if (o == 0x9508) return one(kRet, 0, 0, 0, 5);
  if (o == 0x9518) return one(kReti, 0, 0, 0, 5);
  if ((o & 0xFE00) == 0x9400) {
    switch (o & 15) {
      case 0x0: return one(k_com, d5, 0);
      case 0x1: return one(k_neg, d5, 0);
      case 0x2: return one(k_swap, d5, 0);
      case 0x3: return one(k_inc, d5, 0);
      case 0x5: return one(k_asr, d5, 0);
      case 0x6: return one(k_lsr, d5, 0);
      case 0x7: return one(k_ror, d5, 0);
      case 0xA: return one(k_dec, d5, 0);
      case 0xC: case 0xD: case 0xE: case 0xF: {
        const uint32_t target = image.opcode(word + 1) | (o & 1) << 16 | (o & 0x1F0) << 13;
        if (o & 2) return {kCall, 0, 0, 2, 5, 0, target};
        return {kJump, 0, 0, 2, 3, 0, target};
      }
      default: return other;
    }
  }
  if ((o & 0xFE00) == 0x9600) {
    const uint8_t pair = static_cast<uint8_t>(24 + (o >> 3 & 6));
    return one(o & 0x100 ? k_sbiw : k_adiw, pair, 0, (o & 15) | (o >> 2 & 0x30), 2);
  }
  if ((o & 0xFC00) == 0x9800) {
    const uint8_t port = static_cast<uint8_t>(kDevicesBegin + (o >> 3 & 31));
    const uint8_t bit = static_cast<uint8_t>(1 << (o & 7));
    if (o & 0x100) return skip(o & 0x200 ? kIfPinSet : kIfPinClear, port, bit);
    return one(o & 0x200 ? kSetBit : kClearBit, port, bit, 0, 2);
  }
  if ((o & 0xFC00) == 0x9C00) return one(k_mul, d5, r5, 0, 2);
  return other;
}

}  // namespace rig_emulator_parts
