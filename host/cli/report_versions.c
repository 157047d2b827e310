#include "host/cli/report_versions.h"

#include "host/api/version.h"
#include "host/base/array.h"
#include <assimp/version.h>
#include <jansson.h>
#include <libfyaml.h>
#include <openexr_base.h>
#include <png.h>
#include <sodium.h>
#include <stdlib.h>
#include <string.h>
#include <sys/utsname.h>
#include <unistd.h>
#include <zlib.h>

// Appends a library's version.
static void version_append(Text *text, const char *name, const char *version)
{
    text_appendf(text, "%-20s %s\n", name, version ? version : "unknown");
}

static void libraries_append(Text *text)
{
    int major = 0, minor = 0, patch = 0;
    const char *extra;
    exr_get_library_version(&major, &minor, &patch, &extra);
    char *openexr = text_format("%d.%d.%d", major, minor, patch);
    char *assimp = text_format("%u.%u.%u", aiGetVersionMajor(), aiGetVersionMinor(), aiGetVersionPatch());
    version_append(text, "assimp", assimp);
    version_append(text, "jansson", jansson_version_str());
    version_append(text, "libfyaml", fy_library_version());
    version_append(text, "libpng", png_get_libpng_ver(NULL));
    version_append(text, "libsodium", sodium_version_string());
    version_append(text, "OpenEXR", openexr);
    version_append(text, "zlib", zlibVersion());
    free(openexr);
    free(assimp);
}

// Appends the name of the system's release from os-release(5).
static void release_append(Text *text)
{
    Text file = {0};
    MessageList ignored = {0};
    static const char key[] = "PRETTY_NAME=\"";
    const char *name = text_read_file(&file, "/etc/os-release", &ignored) ? strstr(text_c(&file), key) : NULL;
    if (name) {
        name += sizeof key - 1;
        text_appendf(text, "%-20s %.*s\n", "release", (int)strcspn(name, "\"\n"), name);
    }
    message_list_free(&ignored);
    text_free(&file);
}

// Appends the variables that change what OpenCL does. POCL_REMOTE0_PARAMETERS and the like have addresses.
static void variables_append(Text *text, const Scrubber *scrubber)
{
    static const char *const prefixes[] = {"CL_",     "CUDA_", "GALLIUM_", "GLINT_",  "GPU_",
                                           "HIP_",    "LP_",   "MESA_",    "NEO",     "OCL",
                                           "OPENCL_", "POCL_", "ROCR_",    "RUSTICL_"};
    for (char **variable = environ; *variable; variable++)
        for (size_t i = 0; i < COUNT_OF(prefixes); i++)
            if (strncmp(*variable, prefixes[i], strlen(prefixes[i])) == 0 && !strstr(*variable, "REMOTE")) {
                const Text line = {.items = *variable, .count = strlen(*variable)};
                Text scrubbed = scrub(scrubber, &line);
                text_appendf(text, "%s\n", text_c(&scrubbed));
                text_free(&scrubbed);
            }
}

Text report_versions(const Scrubber *scrubber)
{
    Text text = {0};
    struct utsname host = {0};
    uname(&host);
    version_append(&text, "glint", glint_version());
    version_append(&text, "commit", glint_commit());
    version_append(&text, "compiler", glint_compiler());
    libraries_append(&text);
    release_append(&text);
    version_append(&text, "kernel", host.sysname);
    version_append(&text, "kernel release", host.release);
    version_append(&text, "machine", host.machine);
    text_appendf(&text, "%-20s %ld\n\n", "processors", sysconf(_SC_NPROCESSORS_ONLN));
    variables_append(&text, scrubber);
    return text;
}
