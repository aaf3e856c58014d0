// The rig on an Arduino Mega 2560. Everything else is in src/: core is the application, hal/mega
// the board. Pins, faults and parameters are in firmware/README.md.
#include "src/hal/mega/mega_board.h"

void setup() { rig::mega::begin(); }

void loop() { rig::mega::step(); }
