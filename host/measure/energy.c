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

// An energy counter: a RAPL package or an NVIDIA board.
typedef struct {
    char *path;     // of the counter's file; NULL for the board
    uint64_t last;  // microjoules
    uint64_t range; // the counter restarts at 0 after this value; 0 if it never does
} EnergyCounter;

// The functions of NVML that are used, by the names and types of nvml.h. They return 0 for success.
typedef struct {
    void *library, *board;
    int (*total_energy)(void *board, unsigned long long *millijoules);
    int (*shutdown)(void);
} Nvml;

struct EnergyMeter {
    ARRAY_OF(EnergyCounter);
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

// Adds a counter. Returns false if it cannot be read.
static bool counter_add(EnergyMeter *meter, const char *path, uint64_t range)
{
    EnergyCounter counter = {.path = path ? memory_copy_text(path) : NULL, .range = range};
    const bool is_read = counter_read(meter, &counter, &counter.last);
    array_push(*meter, counter);
    return is_read;
}

// Adds the counters of all packages, which include their cores, but not the memory. Other zones are parts of
// packages, or the whole platform. Returns NULL, or why they cannot be read.
static const char *packages_add(EnergyMeter *meter)
{
    const char *why_not = "Linux shows no energy counter of the processors";
    glob_t zones;
    if (glob("/sys/class/powercap/intel-rapl:*", 0, NULL, &zones) != 0) return why_not;
    bool are_read = true;
    for (size_t i = 0; i < zones.gl_pathc; i++) {
        OWNED char *name_path = text_format("%s/name", zones.gl_pathv[i]);
        OWNED char *range_path = text_format("%s/max_energy_range_uj", zones.gl_pathv[i]);
        OWNED char *energy_path = text_format("%s/energy_uj", zones.gl_pathv[i]);
        char name[16];
        uint64_t range;
        FILE *file = fopen(name_path, "r");
        if (file && fgets(name, sizeof name, file) && strncmp(name, "package", strlen("package")) == 0)
            are_read = number_read(range_path, &range) && counter_add(meter, energy_path, range) && are_read;
        if (file) fclose(file);
    }
    globfree(&zones);
    if (!are_read) return "most systems allow only root to read the processors' energy counters";
    return meter->count > 0 ? NULL : why_not;
}

// Stores the library's function of this name. Returns false if there is none.
static bool function_find(void *library, const char *name, void *function)
{
    void *found = dlsym(library, name);
    memcpy(function, &found, sizeof found);
    return found != NULL;
}

// Adds the counter of the board at a place on the PCI bus. Returns NULL, or why it cannot be read.
static const char *board_add(EnergyMeter *meter, const char *pci)
{
    Nvml *nvml = &meter->nvml;
    int (*init)(void), (*find)(const char *pci, void **board);
    nvml->library = dlopen("libnvidia-ml.so.1", RTLD_NOW | RTLD_LOCAL);
    if (!nvml->library || !function_find(nvml->library, "nvmlInit_v2", &init) ||
        !function_find(nvml->library, "nvmlDeviceGetHandleByPciBusId_v2", &find) ||
        !function_find(nvml->library, "nvmlDeviceGetTotalEnergyConsumption", &nvml->total_energy) ||
        !function_find(nvml->library, "nvmlShutdown", &nvml->shutdown) || init() != 0) {
        nvml->shutdown = NULL;
        return "NVML, which measures NVIDIA boards, is not available";
    }
    const bool is_read = find(pci, &nvml->board) == 0 && counter_add(meter, NULL, 0);
    return is_read ? NULL : "NVML does not report this board's energy";
}

EnergyMeter *energy_open(const Device *device, const char **why_not)
{
    EnergyMeter *meter = memory_allocate_zeroed(1, sizeof *meter);
    if (device->pci[0] != '\0')
        *why_not = board_add(meter, device->pci);
    else if (device->type & CL_DEVICE_TYPE_CPU)
        *why_not = packages_add(meter);
    else
        *why_not = "glint reads the energy of NVIDIA boards and of CPUs only";
    if (!*why_not) return meter;
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
        const bool is_read = counter_read(meter, counter, &now);
        if (!is_read || (now < counter->last && counter->range == 0)) return meter->joules = NAN;
        const uint64_t used = now - counter->last + (now < counter->last ? counter->range : 0);
        meter->joules += 1e-6 * (double)used;
        counter->last = now;
    }
    return meter->joules;
}
