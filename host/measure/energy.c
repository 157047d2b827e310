#include "host/measure/energy.h"

#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include <dlfcn.h>
#include <glob.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

// A package of RAPL's, or the board.
typedef struct {
    char *path;     // of the counter's file; NULL for the board
    uint64_t last;  // microjoules
    uint64_t range; // after which the counter starts at 0
} EnergyCounter;

// The functions of NVML that are used, by the names and types of nvml.h. They return 0 for success.
typedef struct {
    void *library, *board;
    int (*total_energy)(void *board, unsigned long long *millijoules);
    int (*shutdown)(void);
} Nvml;

struct EnergyMeter {
    EnergyCounter *items;
    size_t count, capacity;
    double joules;
    Nvml nvml;
};

static bool number_read(const char *path, uint64_t *number)
{
    char text[32] = "", *end = text;
    FILE *file = fopen(path, "r");
    if (file && fgets(text, sizeof text, file)) *number = strtoull(text, &end, 10);
    if (file) fclose(file);
    return end > text;
}

static bool counter_read(const EnergyMeter *meter, const EnergyCounter *counter, uint64_t *microjoules)
{
    if (counter->path) return number_read(counter->path, microjoules);
    unsigned long long millijoules;
    if (meter->nvml.total_energy(meter->nvml.board, &millijoules) != 0) return false;
    *microjoules = 1000 * millijoules;
    return true;
}

// Adds a counter if it can be read, and takes ownership of the path.
static void counter_add(EnergyMeter *meter, char *path, uint64_t range)
{
    EnergyCounter counter = {.path = path, .range = range};
    if (counter_read(meter, &counter, &counter.last))
        array_push(*meter, counter);
    else
        free(path);
}

// Adds the counters of packages, which include those of their cores and memory. That of the platform, "psys",
// would count packages twice.
static void packages_add(EnergyMeter *meter)
{
    glob_t zones;
    if (glob("/sys/class/powercap/intel-rapl:*", 0, NULL, &zones) != 0) return;
    for (size_t i = 0; i < zones.gl_pathc; i++) {
        char *name_path = text_format("%s/name", zones.gl_pathv[i]),
             *range_path = text_format("%s/max_energy_range_uj", zones.gl_pathv[i]);
        char name[16];
        uint64_t range;
        FILE *file = fopen(name_path, "r");
        if (file && fgets(name, sizeof name, file) && strncmp(name, "package", strlen("package")) == 0 &&
            number_read(range_path, &range))
            counter_add(meter, text_format("%s/energy_uj", zones.gl_pathv[i]), range);
        if (file) fclose(file);
        free(range_path);
        free(name_path);
    }
    globfree(&zones);
}

// Stores a function of the library. Returns whether there is one of this name.
static bool function_find(void *library, const char *name, void *function)
{
    void *found = dlsym(library, name);
    memcpy(function, &found, sizeof found);
    return found != NULL;
}

static void board_add(EnergyMeter *meter, const char *pci)
{
    Nvml *nvml = &meter->nvml;
    int (*init)(void), (*find)(const char *pci, void **board);
    nvml->library = dlopen("libnvidia-ml.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!nvml->library || !function_find(nvml->library, "nvmlInit_v2", &init) ||
        !function_find(nvml->library, "nvmlDeviceGetHandleByPciBusId_v2", &find) ||
        !function_find(nvml->library, "nvmlDeviceGetTotalEnergyConsumption", &nvml->total_energy) ||
        !function_find(nvml->library, "nvmlShutdown", &nvml->shutdown) || init() != 0) {
        nvml->shutdown = NULL;
        return;
    }
    if (find(pci, &nvml->board) == 0) counter_add(meter, NULL, UINT64_MAX);
}

EnergyMeter *energy_open(const Device *device, const char **why_not)
{
    EnergyMeter *meter = memory_allocate_zeroed(1, sizeof *meter);
    if (device->pci[0] != '\0')
        board_add(meter, device->pci);
    else if (device->type & CL_DEVICE_TYPE_CPU)
        packages_add(meter);
    if (meter->count > 0) return meter;
    *why_not = device->pci[0] != '\0' ? "NVML does not read this board's energy"
                                      : "no energy counter of RAPL can be read";
    energy_close(meter);
    return NULL;
}

void energy_close(EnergyMeter *meter)
{
    if (!meter) return;
    for (size_t i = 0; i < meter->count; i++)
        free(meter->items[i].path);
    if (meter->nvml.shutdown) meter->nvml.shutdown();
    if (meter->nvml.library) dlclose(meter->nvml.library);
    free(meter->items);
    free(meter);
}

const char *energy_source(const EnergyMeter *meter)
{
    return meter->items[0].path ? "RAPL" : "NVML";
}

double energy_joules(EnergyMeter *meter)
{
    for (size_t i = 0; i < meter->count; i++) {
        EnergyCounter *counter = &meter->items[i];
        uint64_t now;
        if (!counter_read(meter, counter, &now)) return NAN;
        const uint64_t used =
            now >= counter->last ? now - counter->last : now + counter->range - counter->last;
        meter->joules += 1e-6 * (double)used;
        counter->last = now;
    }
    return meter->joules;
}
