// Why the board started, and the watchdog that makes the bench safe and restarts the board when the
// main loop hangs.
#pragma once

#include "../../core/rig_core.h"

namespace rig {
namespace mega {

ResetCause reset_cause();
void watchdog_begin();

}  // namespace mega
}  // namespace rig
