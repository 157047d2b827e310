// Simulates RAPL for the tests that preload it. A package of the processors has a counter that grows by a
// joule from one read to the next and wraps after one and a half. Its cores and the platform have others,
// which grow by more.
#define _GNU_SOURCE
#include <dlfcn.h>
#include <glob.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char folder[] = "/sys/class/powercap/";
static const struct {
    const char *path, *name;
    unsigned long step, range; // microjoules
} zones[] = {
    {"/sys/class/powercap/intel-rapl:0", "package-0", 1000000, 1500000},
    {"/sys/class/powercap/intel-rapl:0:0", "core", 3000000, 1000000000},
    {"/sys/class/powercap/intel-rapl:1", "psys", 7000000, 1000000000},
};
enum { ZONE_COUNT = sizeof zones / sizeof *zones };

FILE *fopen(const char *path, const char *mode)
{
    static unsigned long counters[ZONE_COUNT];
    if (strncmp(path, folder, strlen(folder)) != 0)
        return ((__typeof__(&fopen))dlsym(RTLD_NEXT, "fopen"))(path, mode);
    char text[32] = "";
    const char *file = strrchr(path, '/');
    for (int i = 0; i < ZONE_COUNT; i++) {
        if (strlen(zones[i].path) != (size_t)(file - path) ||
            strncmp(path, zones[i].path, strlen(zones[i].path)) != 0)
            continue;
        if (strcmp(file, "/name") == 0) strcpy(text, zones[i].name);
        if (strcmp(file, "/max_energy_range_uj") == 0) sprintf(text, "%lu", zones[i].range);
        if (strcmp(file, "/energy_uj") == 0)
            sprintf(text, "%lu", counters[i] = (counters[i] + zones[i].step) % zones[i].range);
    }
    FILE *stream = tmpfile();
    fprintf(stream, "%s\n", text);
    rewind(stream);
    return stream;
}

int glob(const char *pattern, int flags, int (*failed)(const char *, int), glob_t *found)
{
    if (strncmp(pattern, folder, strlen(folder)) != 0)
        return ((__typeof__(&glob))dlsym(RTLD_NEXT, "glob"))(pattern, flags, failed, found);
    *found = (glob_t){.gl_pathc = ZONE_COUNT, .gl_pathv = calloc(ZONE_COUNT + 1, sizeof(char *))};
    for (int i = 0; i < ZONE_COUNT; i++)
        found->gl_pathv[i] = strdup(zones[i].path);
    return 0;
}

// The names that a system's libraries call if they ask for 64-bit offsets.
FILE *fopen64(const char *path, const char *mode) __attribute__((alias("fopen")));
int glob64(const char *pattern, int flags, int (*failed)(const char *, int), glob64_t *found)
    __attribute__((alias("glob")));
