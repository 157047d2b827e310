#include "host/cli/version.h"

const char *glint_version(void)
{
    return GLINT_VERSION;
}

const char *glint_commit(void)
{
    return GLINT_COMMIT;
}

const char *glint_compiler(void)
{
#ifdef __clang__
    return __VERSION__;
#else
    return "gcc " __VERSION__;
#endif
}
