// See processor.h; instructions, flags and cycles after the AVR Instruction Set Manual (Microchip
// DS40002198).
// SPDX-License-Identifier: GPL-3.0-or-later

#include "processor.h"

extern "C" {
#include <simavr/sim_avr.h>

// exported, though declared in no header that is installed
avr_flashaddr_t avr_run_one(avr_t *avr);
}

namespace rig_emulator_parts {

namespace {

// Below this address of memory are the registers and those of the devices.
constexpr uint32_t kMemoryBegins = MAX_IOs + 32;
constexpr uint8_t kStatusPort = 0x3F, kStackLowPort = 0x3D, kStackHighPort = 0x3E;
constexpr avr_cycle_count_t kWithoutTimer = 1000;  // libsimavr's default

enum Code : uint8_t {
  kUndecoded,
  kOther,  // for libsimavr
  kNop, kMovw, kMov, kLdi,
  kAdd, kAdc, kSub, kSbc, kAnd, kOr, kEor, kCp, kCpc,
  kSubi, kSbci, kAndi, kOri, kCpi, kAdiw, kSbiw,
  kMul, kMuls, kMulsu,
  kCom, kNeg, kSwap, kInc, kDec, kAsr, kLsr, kRor,
  kSetFlag, kClearFlag, kBst, kBld,
  kLoad, kLoadInc, kLoadDec, kStore, kStoreInc, kStoreDec, kLds, kSts,
  kLpm, kLpmInc, kPush, kPop, kIn, kOut,
  kJump, kRjmp, kCall, kRcall, kRet, kIfSet, kIfClear, kCpse, kSbrc, kSbrs,
};

// Pointer registers.
constexpr uint8_t kX = 26, kY = 28, kZ = 30;

}  // namespace

Processor::Processor(avr_t *avr) : avr_(avr), program_((avr->flashend + 1) / 2) {}

uint32_t Processor::opcode(uint32_t word) const {
  return avr_->flash[2 * word] | static_cast<uint32_t>(avr_->flash[2 * word + 1]) << 8;
}

// LDS, STS, JMP and CALL take two words.
bool Processor::is_long(uint32_t word) const {
  const uint32_t o = opcode(word);
  return (o & 0xFC0F) == 0x9000 || (o & 0xFE0C) == 0x940C;
}

void Processor::decode(uint32_t word) {
  const uint32_t o = opcode(word);
  const uint8_t d5 = o >> 4 & 31, r5 = static_cast<uint8_t>((o & 15) | (o >> 5 & 16));
  const uint8_t d4 = static_cast<uint8_t>(16 + (o >> 4 & 15));
  const uint8_t k8 = static_cast<uint8_t>((o & 15) | (o >> 4 & 0xF0));
  const int32_t relative = static_cast<int32_t>(o << 20) >> 20;
  Instruction &i = program_[word];
  i = {kOther, d5, r5, 0, 0};
  const auto is = [&](Code code) { i.code = code; };
  const auto with_constant = [&](Code code) { i = {code, d4, k8, 0, 0}; };
  switch (o >> 12) {
    case 0x0:
      if (o == 0) is(kNop);
      else if ((o & 0x0F00) == 0x0100)
        i = {kMovw, static_cast<uint8_t>((o >> 4 & 15) * 2), static_cast<uint8_t>((o & 15) * 2), 0, 0};
      else if ((o & 0x0F00) == 0x0200)
        i = {kMuls, d4, static_cast<uint8_t>(16 + (o & 15)), 0, 0};
      else if ((o & 0x0F88) == 0x0300)
        i = {kMulsu, static_cast<uint8_t>(16 + (o >> 4 & 7)), static_cast<uint8_t>(16 + (o & 7)), 0, 0};
      else if ((o & 0x0C00) == 0x0400) is(kCpc);
      else if ((o & 0x0C00) == 0x0800) is(kSbc);
      else if ((o & 0x0C00) == 0x0C00) is(kAdd);
      break;
    case 0x1: {
      const Code codes[] = {kCpse, kCp, kSub, kAdc};
      is(codes[o >> 10 & 3]);
      break;
    }
    case 0x2: {
      const Code codes[] = {kAnd, kEor, kOr, kMov};
      is(codes[o >> 10 & 3]);
      break;
    }
    case 0x3: with_constant(kCpi); break;
    case 0x4: with_constant(kSbci); break;
    case 0x5: with_constant(kSubi); break;
    case 0x6: with_constant(kOri); break;
    case 0x7: with_constant(kAndi); break;
    case 0x8:
    case 0xA: {
      i.r = o & 8 ? kY : kZ;
      i.k = static_cast<int32_t>((o & 7) | (o >> 7 & 0x18) | (o >> 8 & 0x20));
      is(o & 0x200 ? kStore : kLoad);
      break;
    }
    case 0x9:
      if ((o & 0xFC00) == 0x9000) {
        const bool store = o & 0x200;
        const auto through = [&](uint8_t pointer, Code load, Code put) {
          i.r = pointer;
          is(store ? put : load);
        };
        switch (o & 15) {
          case 0x0:
            i.k = static_cast<int32_t>(opcode(word + 1));
            is(store ? kSts : kLds);
            break;
          case 0x1: through(kZ, kLoadInc, kStoreInc); break;
          case 0x2: through(kZ, kLoadDec, kStoreDec); break;
          case 0x4: if (!store) is(kLpm); break;
          case 0x5: if (!store) is(kLpmInc); break;
          case 0x9: through(kY, kLoadInc, kStoreInc); break;
          case 0xA: through(kY, kLoadDec, kStoreDec); break;
          case 0xC: through(kX, kLoad, kStore); break;
          case 0xD: through(kX, kLoadInc, kStoreInc); break;
          case 0xE: through(kX, kLoadDec, kStoreDec); break;
          case 0xF: is(store ? kPush : kPop); break;
          default: break;
        }
      } else if ((o & 0xFF0F) == 0x9408) {
        i.d = o >> 4 & 7;
        const bool clears = o & 0x80;
        if (clears) is(kClearFlag);
        else if (i.d != S_I) is(kSetFlag);
      } else if (o == 0x9508) {
        is(kRet);
      } else if ((o & 0xFE00) == 0x9400) {
        switch (o & 15) {
          case 0x0: is(kCom); break;
          case 0x1: is(kNeg); break;
          case 0x2: is(kSwap); break;
          case 0x3: is(kInc); break;
          case 0x5: is(kAsr); break;
          case 0x6: is(kLsr); break;
          case 0x7: is(kRor); break;
          case 0xA: is(kDec); break;
          case 0xC: case 0xD: case 0xE: case 0xF:
            i.k = static_cast<int32_t>(opcode(word + 1) | (o & 1) << 16 | (o & 0x1F0) << 13);
            is(o & 2 ? kCall : kJump);
            break;
          default: break;
        }
      } else if ((o & 0xFE00) == 0x9600) {
        const uint8_t pair = static_cast<uint8_t>(24 + (o >> 3 & 6));
        const uint8_t k6 = static_cast<uint8_t>((o & 15) | (o >> 2 & 0x30));
        i = {o & 0x100 ? kSbiw : kAdiw, pair, k6, 0, 0};
      } else if ((o & 0xFC00) == 0x9C00) {
        is(kMul);
      }
      break;
    case 0xB: {
      const uint8_t port = static_cast<uint8_t>((o & 15) | (o >> 5 & 0x30));
      const bool out = o & 0x800;
      i.r = port;
      if (port == kStatusPort || port == kStackLowPort || port == kStackHighPort) {
        is(out ? kOut : kIn);
      }
      break;
    }
    case 0xC: i.k = relative; is(kRjmp); break;
    case 0xD: i.k = relative; is(kRcall); break;
    case 0xE: with_constant(kLdi); break;
    case 0xF:
      if ((o & 0x0800) == 0) {
        i.r = o & 7;
        i.k = static_cast<int32_t>(o << 22) >> 25;
        is(o & 0x400 ? kIfClear : kIfSet);
      } else if ((o & 8) == 0) {
        i.r = o & 7;
        const Code codes[] = {kBld, kBst, kSbrc, kSbrs};
        is(codes[o >> 9 & 3]);
      }
      break;
    default: break;
  }
}

// The next address of flash in bytes, as libsimavr's avr_run_one returns it.
uint32_t Processor::execute() {
  avr_t *const avr = avr_;
  uint8_t *const data = avr->data;
  uint8_t *const flag = avr->sreg;
  Instruction *const program = program_.data();  // bytes written to memory cannot move it
  const uint32_t memory_ends = avr->ramend;
  uint32_t pc = avr->pc / 2;
  // Cycles until a timer is due. At least one instruction is run, and no more than one with an
  // interrupt about to begin.
  int64_t left = avr->interrupt_state != 0 ? 1 : static_cast<int64_t>(avr->run_cycle_count);
  int64_t left_at_cycle = left;  // when avr->cycle was last written

  const auto pair = [&](uint8_t r) { return static_cast<uint32_t>(data[r] | data[r + 1] << 8); };
  const auto set_pair = [&](uint8_t r, uint32_t value) {
    data[r] = static_cast<uint8_t>(value);
    data[r + 1] = static_cast<uint8_t>(value >> 8);
  };
  const auto in_memory = [&](uint32_t address) {
    return address >= kMemoryBegins && address <= memory_ends;
  };
  const auto note = [&](uint8_t result) {  // N and Z, and S from them and V
    flag[S_N] = result >> 7;
    flag[S_Z] = result == 0;
    flag[S_S] = flag[S_N] ^ flag[S_V];
  };
  const auto add = [&](uint32_t a, uint32_t b, uint32_t carry) {
    const uint32_t sum = a + b + carry;
    flag[S_H] = ((a & 15) + (b & 15) + carry) >> 4;
    flag[S_C] = static_cast<uint8_t>(sum >> 8);
    flag[S_V] = ((a ^ sum) & (b ^ sum)) >> 7 & 1;
    note(static_cast<uint8_t>(sum));
    return static_cast<uint8_t>(sum);
  };
  const auto subtract = [&](uint32_t a, uint32_t b, uint32_t borrow) {
    const uint32_t rest = a - b - borrow;
    flag[S_H] = ((a & 15) - (b & 15) - borrow) >> 31;
    flag[S_C] = rest >> 31;
    flag[S_V] = ((a ^ b) & (a ^ rest)) >> 7 & 1;
    note(static_cast<uint8_t>(rest));
    return static_cast<uint8_t>(rest);
  };
  const auto subtract_further = [&](uint32_t a, uint32_t b) {
    const uint8_t zero_before = flag[S_Z];
    const uint8_t rest = subtract(a, b, flag[S_C]);
    flag[S_Z] &= zero_before;
    return rest;
  };
  const auto logic = [&](uint8_t result) {
    flag[S_V] = 0;
    note(result);
    return result;
  };
  const auto shifted = [&](uint8_t before, uint8_t after) {
    flag[S_C] = before & 1;
    flag[S_V] = (after >> 7) ^ flag[S_C];
    note(after);
    return after;
  };
  const auto product = [&](uint32_t value) {
    set_pair(0, value);
    flag[S_C] = value >> 15 & 1;
    flag[S_Z] = (value & 0xFFFF) == 0;
  };
  const auto push = [&](uint8_t value) {
    const uint32_t stack = pair(R_SPL);
    data[stack] = value;
    set_pair(R_SPL, stack - 1);
  };
  const auto push_address = [&](uint32_t address) {
    push(static_cast<uint8_t>(address));
    push(static_cast<uint8_t>(address >> 8));
    push(static_cast<uint8_t>(address >> 16));
  };
  const auto pop = [&] {
    const uint32_t stack = pair(R_SPL) + 1;
    set_pair(R_SPL, stack);
    return data[stack];
  };
  const auto skip = [&] {
    const uint32_t words = is_long(pc) ? 2 : 1;
    pc += words;
    left -= words;
  };

  for (;;) {
    const uint32_t here = pc;
    const Instruction i = program[here];
    const uint8_t d = i.d, r = i.r;
    bool handed_over = false;
    ++pc;
    --left;
    switch (i.code) {
      case kUndecoded:
        decode(here);
        pc = here;
        ++left;
        continue;
      case kNop: break;
      case kMov: data[d] = data[r]; break;
      case kMovw: set_pair(d, pair(r)); break;
      case kLdi: data[d] = r; break;
      case kAdd: data[d] = add(data[d], data[r], 0); break;
      case kAdc: data[d] = add(data[d], data[r], flag[S_C]); break;
      case kSub: data[d] = subtract(data[d], data[r], 0); break;
      case kSubi: data[d] = subtract(data[d], r, 0); break;
      case kSbc: data[d] = subtract_further(data[d], data[r]); break;
      case kSbci: data[d] = subtract_further(data[d], r); break;
      case kCp: subtract(data[d], data[r], 0); break;
      case kCpi: subtract(data[d], r, 0); break;
      case kCpc: subtract_further(data[d], data[r]); break;
      case kAnd: data[d] = logic(data[d] & data[r]); break;
      case kAndi: data[d] = logic(data[d] & r); break;
      case kOr: data[d] = logic(data[d] | data[r]); break;
      case kOri: data[d] = logic(data[d] | r); break;
      case kEor: data[d] = logic(data[d] ^ data[r]); break;
      case kAdiw: {
        const uint32_t before = pair(d), after = (before + r) & 0xFFFF;
        set_pair(d, after);
        flag[S_V] = (~before & after) >> 15 & 1;
        flag[S_C] = (before & ~after) >> 15 & 1;
        flag[S_N] = after >> 15;
        flag[S_Z] = after == 0;
        flag[S_S] = flag[S_N] ^ flag[S_V];
        --left;
        break;
      }
      case kSbiw: {
        const uint32_t before = pair(d), after = (before - r) & 0xFFFF;
        set_pair(d, after);
        flag[S_V] = (before & ~after) >> 15 & 1;
        flag[S_C] = (~before & after) >> 15 & 1;
        flag[S_N] = after >> 15;
        flag[S_Z] = after == 0;
        flag[S_S] = flag[S_N] ^ flag[S_V];
        --left;
        break;
      }
      case kMul:
        product(static_cast<uint32_t>(data[d]) * data[r]);
        --left;
        break;
      case kMuls:
        product(static_cast<uint32_t>(static_cast<int8_t>(data[d]) * static_cast<int8_t>(data[r])));
        --left;
        break;
      case kMulsu:
        product(static_cast<uint32_t>(static_cast<int8_t>(data[d]) * data[r]));
        --left;
        break;
      case kCom:
        data[d] = logic(static_cast<uint8_t>(~data[d]));
        flag[S_C] = 1;
        break;
      case kNeg: data[d] = subtract(0, data[d], 0); break;
      case kSwap: data[d] = static_cast<uint8_t>(data[d] >> 4 | data[d] << 4); break;
      case kInc:
        ++data[d];
        flag[S_V] = data[d] == 0x80;
        note(data[d]);
        break;
      case kDec:
        --data[d];
        flag[S_V] = data[d] == 0x7F;
        note(data[d]);
        break;
      case kLsr: data[d] = shifted(data[d], data[d] >> 1); break;
      case kAsr: data[d] = shifted(data[d], static_cast<uint8_t>(data[d] >> 1 | (data[d] & 0x80))); break;
      case kRor:
        data[d] = shifted(data[d], static_cast<uint8_t>(data[d] >> 1 | flag[S_C] << 7));
        break;
      case kSetFlag: flag[d] = 1; break;
      case kClearFlag:
        if ((handed_over = d == S_I && avr->interrupt_state != 0)) break;
        flag[d] = 0;
        break;
      case kBst: flag[S_T] = data[d] >> r & 1; break;
      case kBld: data[d] = static_cast<uint8_t>((data[d] & ~(1 << r)) | flag[S_T] << r); break;
      case kLoad: {
        const uint32_t address = pair(r) + static_cast<uint32_t>(i.k);
        if ((handed_over = !in_memory(address))) break;
        data[d] = data[address];
        --left;
        break;
      }
      case kLoadInc: {
        const uint32_t address = pair(r);
        if ((handed_over = !in_memory(address))) break;
        set_pair(r, address + 1);
        data[d] = data[address];
        --left;
        break;
      }
      case kLoadDec: {
        const uint32_t address = (pair(r) - 1) & 0xFFFF;
        if ((handed_over = !in_memory(address))) break;
        set_pair(r, address);
        data[d] = data[address];
        --left;
        break;
      }
      case kLds:
        if ((handed_over = !in_memory(static_cast<uint32_t>(i.k)))) break;
        data[d] = data[i.k];
        ++pc;
        --left;
        break;
      case kStore: {
        const uint32_t address = pair(r) + static_cast<uint32_t>(i.k);
        if ((handed_over = !in_memory(address))) break;
        data[address] = data[d];
        --left;
        break;
      }
      case kStoreInc: {
        const uint32_t address = pair(r);
        if ((handed_over = !in_memory(address))) break;
        data[address] = data[d];
        set_pair(r, address + 1);
        --left;
        break;
      }
      case kStoreDec: {
        const uint32_t address = (pair(r) - 1) & 0xFFFF;
        if ((handed_over = !in_memory(address))) break;
        data[address] = data[d];
        set_pair(r, address);
        --left;
        break;
      }
      case kSts:
        if ((handed_over = !in_memory(static_cast<uint32_t>(i.k)))) break;
        data[i.k] = data[d];
        ++pc;
        --left;
        break;
      case kLpm:
        data[d] = avr->flash[pair(kZ)];
        left -= 2;
        break;
      case kLpmInc: {
        const uint32_t address = pair(kZ);
        data[d] = avr->flash[address];
        set_pair(kZ, address + 1);
        left -= 2;
        break;
      }
      case kPush:
        if ((handed_over = !in_memory(pair(R_SPL)))) break;
        push(data[d]);
        --left;
        break;
      case kPop:
        if ((handed_over = !in_memory(pair(R_SPL) + 1))) break;
        data[d] = pop();
        --left;
        break;
      case kIn:
        if (r == kStatusPort) {
          uint8_t status = 0;
          for (int bit = 0; bit < 8; ++bit) status |= static_cast<uint8_t>((flag[bit] != 0) << bit);
          data[R_SREG] = status;
        }
        data[d] = data[r + 32];
        break;
      case kOut:
        if (r == kStatusPort) {
          // interrupts switched on take their time: libsimavr's business
          if ((handed_over = (data[d] >> S_I) != flag[S_I])) break;
          for (int bit = 0; bit < 8; ++bit) flag[bit] = data[d] >> bit & 1;
        }
        data[r + 32] = data[d];
        break;
      case kJump:
        pc = static_cast<uint32_t>(i.k);
        left -= 2;
        break;
      case kRjmp:
        pc += static_cast<uint32_t>(i.k);
        --left;
        break;
      case kCall:
        if ((handed_over = !in_memory(pair(R_SPL) - 2))) break;
        push_address(pc + 1);
        pc = static_cast<uint32_t>(i.k);
        left -= 4;
        break;
      case kRcall:
        if ((handed_over = !in_memory(pair(R_SPL) - 2))) break;
        push_address(pc);
        pc += static_cast<uint32_t>(i.k);
        left -= 3;
        break;
      case kRet: {
        if ((handed_over = !in_memory(pair(R_SPL) + 3))) break;
        const uint32_t high = pop(), middle = pop();
        pc = high << 16 | middle << 8 | pop();
        left -= 4;
        break;
      }
      case kIfSet:
        if (flag[r]) {
          pc += static_cast<uint32_t>(i.k);
          --left;
        }
        break;
      case kIfClear:
        if (!flag[r]) {
          pc += static_cast<uint32_t>(i.k);
          --left;
        }
        break;
      case kCpse:
        if (data[d] == data[r]) skip();
        break;
      case kSbrc:
        if ((data[d] >> r & 1) == 0) skip();
        break;
      case kSbrs:
        if ((data[d] >> r & 1) != 0) skip();
        break;
      default: handed_over = true; break;
    }
    if (!handed_over) {
      if (left > 0) continue;
      avr->cycle += static_cast<avr_cycle_count_t>(left_at_cycle - left);
      return 2 * pc;
    }
    ++left;  // nothing was done yet
    avr->cycle += static_cast<avr_cycle_count_t>(left_at_cycle - left);
    avr->pc = 2 * here;
    avr->run_cycle_count = 1;  // no more than one instruction
    pc = avr_run_one(avr) / 2;
    const avr_cycle_timer_slot_t *next = avr->cycle_timers.timer;
    left = next == nullptr ? static_cast<int64_t>(kWithoutTimer)
                           : static_cast<int64_t>(next->when - avr->cycle);
    if (left <= 0 || avr->state != cpu_Running || avr->interrupt_state != 0) return 2 * pc;
    left_at_cycle = left;
  }
}

void Processor::run() {
  avr_flashaddr_t next = avr_->pc;
  if (avr_->state == cpu_Running) next = execute();
  const avr_cycle_count_t rest = avr_cycle_timer_process(avr_);
  avr_->pc = next;
  if (avr_->state == cpu_Sleeping) {
    if (!avr_->sreg[S_I]) {
      avr_->state = cpu_Done;  // nothing could wake it
      return;
    }
    avr_->sleep(avr_, rest);
    avr_->cycle += 1 + rest;  // the sleep function takes the one off again
  }
  if (avr_->state == cpu_Running || avr_->state == cpu_Sleeping) avr_service_interrupts(avr_);
}

}  // namespace rig_emulator_parts
