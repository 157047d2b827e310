#include "host/api/version.h"

const char *glint_version(void)
{
    return GLINT_VERSION;
}

const char *glint_commit(void)
{
#ifdef GLINT_COMMIT
    return GLINT_COMMIT;
#else
    // git archive replaces this with the hash
    static const char commit[] = "$Format:%H$";
    return commit[0] == '$' ? "unknown" : commit;
#endif
}

const char *glint_compiler(void)
{
#ifdef __clang__
    return __VERSION__;
#else
    return "gcc " __VERSION__;
#endif
}
