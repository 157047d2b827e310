#include "host/cli/version.h"

const char *glint_version(void)
{
    return GLINT_VERSION;
}
