// The balls that packets of rays through one point are held against first.
#pragma once

#include "host/render/flatten.h"

// Fills FLAT_BALLS and notes in the header how many each apex has, once it is settled what hangs in the
// hierarchy. None where they would be more than a million. `wide`: the kernel's precision is double.
void balls_lay(FlatScene *flat, bool wide);
