// The generated C as C++, so that one compiler and one set of flags build the extension.
#include "generated/rig.c"
