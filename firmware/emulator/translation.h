// An image as C++: every instruction that machine.h knows becomes a call with constant operands, so
// that a compiler drops the flags that nobody asks for, and jumps are jumps.
// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include <stdint.h>

#include <string>

#include "instruction.h"

namespace rig_emulator_parts {

// A source that, compiled, exports `rig_blocks`, one for each word of flash or null,
// `rig_block_count` and `rig_digest`.
std::string translation(const Image &image);

// FNV-1a of the whole flash: whether a translation is of this image.
uint64_t digest_of(const Image &image);

}  // namespace rig_emulator_parts
