// Builds and launches the kernels that read a scene on a device. Variants of a kernel differ in the
// definitions before their text and in compiler options.
#pragma once

#include "host/render/device_scene.h"
#include "host/render/pace.h"
#include "host/render/render_report.h"
#include "host/render/render_settings.h"

typedef enum {
    KERNEL_RENDER,
    KERNEL_AOV,
    KERNEL_PATH,
    KERNEL_COVERAGE,
    KERNEL_TRACE,
    KERNEL_CLOSEST,
    KERNEL_COUNT
} KernelType;

typedef struct {
    ProgramRequest request;
    Program program;   // has no kernel until it is first requested
    bool was_launched; // its binary is then complete (program_store)
} KernelSlot;

// Kernels whose text follows the same definitions.
typedef struct {
    Text prelude;
    Text out_of_line_prelude; // keeps functions out of line; empty if `prelude` does so
    const char *options;
    KernelSlot slots[KERNEL_COUNT];
} KernelVariant;

// Starts as zero except for the members before `variant`.
typedef struct {
    const DeviceScene *scene;
    const RenderSettings *settings;
    RenderReport *report; // receives builds and launches
    bool is_rerender;     // reports launches as "re-render", and no hash
    // The variant in use and the one before it. Near a shape a moving camera alternates between two variants.
    KernelVariant variant, other_variant;
    Pace paces[KERNEL_COUNT]; // for the variant in use
} Kernels;

// Chooses the variant with these definitions, and sets the scene's arguments. If one of the last two variants
// suits, reuses it with its kernels. Takes ownership of the texts.
void kernels_choose(Kernels *kernels, Text prelude, Text out_of_line_prelude, const char *options);
// Moves earlier kernels of the device to these, which must have none. The earlier have none afterwards.
void kernels_adopt(Kernels *kernels, Kernels *earlier);
void kernels_close(Kernels *kernels);
// Returns the composed text of a kernel in the variant in use. The caller frees it.
char *kernels_text(const Kernels *kernels, KernelType type);

// Returns the kernel with the scene's arguments set, and builds it when first requested. Returns NULL if the
// device failed.
cl_kernel kernels_get(Kernels *kernels, KernelType type);
// Launches a kernel as kernel_launch does and adds the time to the report. Returns the launch's seconds
// by its event if that is trusted, else by the host's clock.
double kernels_launch(Kernels *kernels, KernelType type, cl_uint dimensions, const size_t *first,
                      const size_t *items, const size_t *group);
