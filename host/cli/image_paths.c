#include "host/cli/image_paths.h"

#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/options.h"
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

char *image_output_default_path(const char *scene_path)
{
    OWNED char *stem = file_stem(scene_path);
    return text_format("%s.png", stem);
}

bool image_output_is_stdout(const char *path)
{
    return strcmp(path, "-") == 0;
}

char *image_output_aov_path(const ImageOutputOptions *options, const char *name)
{
    const char *dot = strrchr(options->path, '.');
    return text_format("%.*s.%s.npy", (int)(dot - options->path), options->path, name);
}

// Returns the name of the image's file with this index, of which the first is the image and the others are
// its AOVs, or NULL past the last. The caller frees it.
static char *file_path(const ImageOutputOptions *options, size_t index)
{
    if (index == 0) return memory_copy_text(options->path);
    const bool is_one_file = image_format_of(options->path) == IMAGE_EXR;
    for (Layer layer = 0; layer < LAYER_COUNT && !is_one_file; layer++)
        if ((options->aovs >> layer & 1) && --index == 0)
            return image_output_aov_path(options, layer_names[layer]);
    return NULL;
}

bool image_output_overwrites_scene(const ImageOutputOptions *options, const Scene *scene,
                                   const char *scene_path)
{
    for (size_t i = 0; !image_output_is_stdout(options->path); i++) {
        OWNED char *path = file_path(options, i);
        if (!path) break;
        if (output_overwrites_scene(path, scene, scene_path)) return true;
    }
    return false;
}

bool image_output_exists(const ImageOutputOptions *options)
{
    ImageOutputOptions without_shadow = *options;
    without_shadow.aovs &= ~(unsigned)AOV_SHADOW;
    struct stat status;
    for (size_t i = 0;; i++) {
        OWNED char *path = file_path(&without_shadow, i);
        if (!path) return true;
        if (stat(path, &status) != 0 || !S_ISREG(status.st_mode)) return false;
    }
}
