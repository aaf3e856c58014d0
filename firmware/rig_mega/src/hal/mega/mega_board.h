// The Mega as the core's board: pins in, pins out, sleep in between.
#pragma once

namespace rig {
namespace mega {

void begin();

// One turn of the main loop; returns when the next tick is due.
void step();

}  // namespace mega
}  // namespace rig
