// Generated from rig.dbc by firmware/generate.py; do not edit.
#pragma once

#include <stdint.h>

namespace rig {

constexpr uint8_t kProtocolVersion = 1;
constexpr uint16_t kSchemaCrc = 0xC5E2;

}  // namespace rig
