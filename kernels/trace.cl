// Traces explicit rays and the bounces at their hits.
#define TRACES_BOUNCES 1
#define TRACE_KERNEL   trace
#include "trace.h"
