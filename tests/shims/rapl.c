// Preloaded by tests: RAPL has a counter of one package of the processors, which grows by a joule between two
// reads and wraps after one and a half, and one of the platform.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char zone[] = "/sys/class/powercap/intel-rapl:";

FILE *fopen(const char *path, const char *mode)
{
    static unsigned long microjoules;
    static char text[32];
    if (strncmp(path, zone, strlen(zone)) != 0)
        return ((__typeof__(&fopen))dlsym(RTLD_NEXT, "fopen"))(path, mode);
    if (strstr(path, "/name")) strcpy(text, path[strlen(zone)] == '0' ? "package-0" : "psys");
    if (strstr(path, "/max_energy_range_uj")) strcpy(text, "1500000");
    if (strstr(path, "/energy_uj")) sprintf(text, "%lu", (microjoules += 1000000) % 1500000);
    return fmemopen(text, strlen(text), "r");
}

int glob(const char *pattern, int flags, int (*failed)(const char *, int), glob_t *found)
{
    if (strncmp(pattern, zone, strlen(zone)) != 0)
        return ((__typeof__(&glob))dlsym(RTLD_NEXT, "glob"))(pattern, flags, failed, found);
    *found = (glob_t){.gl_pathc = 2, .gl_pathv = calloc(3, sizeof(char *))};
    for (int i = 0; i < 2; i++)
        asprintf(&found->gl_pathv[i], "%s%d", zone, i);
    return 0;
}

// The names where a system's libraries ask for 64-bit offsets.
FILE *fopen64(const char *path, const char *mode) __attribute__((alias("fopen")));
int glob64(const char *pattern, int flags, int (*failed)(const char *, int), glob64_t *found)
    __attribute__((alias("glob")));
