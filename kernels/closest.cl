// Finds the closest hits of explicit rays.
#define TRACES_BOUNCES 0
#define TRACE_KERNEL   closest
#include "trace.h"
