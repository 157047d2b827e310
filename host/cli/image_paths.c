#include "host/cli/image_paths.h"

#include "host/base/file.h"
#include "host/base/text.h"
#include "host/cli/options.h"
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

char *image_output_default_path(const char *scene_path)
{
    const char *name = strcmp(scene_path, "-") == 0 ? "image" : file_base_name(scene_path);
    const char *dot = strrchr(name, '.');
    Text path = {0};
    text_append(&path, name, dot && dot > name ? (size_t)(dot - name) : strlen(name));
    text_appendf(&path, ".png");
    return path.items;
}

bool image_output_is_stdout(const char *path)
{
    return strcmp(path, "-") == 0;
}

bool image_output_path_known(const char *path)
{
    if (image_output_is_stdout(path) || image_format_of(path) != IMAGE_UNKNOWN) return true;
    fprintf(stderr, "glint: %s: the name must end in .png, .ppm, .exr or .npy\n", path);
    return false;
}

char *image_output_aov_path(const ImageOutputOptions *options, const char *name)
{
    const char *dot = strrchr(options->path, '.');
    return text_format("%.*s.%s.npy", (int)(dot - options->path), options->path, name);
}

// Returns whether `is_so` is true for every file of the image. Stops at the first that it is not true for.
static bool files_all(const ImageOutputOptions *options, bool (*is_so)(const char *path, void *context),
                      void *context)
{
    bool all = is_so(options->path, context);
    const bool is_one_file = image_format_of(options->path) == IMAGE_EXR;
    for (Layer layer = 0; layer < LAYER_COUNT && all && !is_one_file; layer++) {
        if (!(options->aovs >> layer & 1)) continue;
        char *path = image_output_aov_path(options, layer_names[layer]);
        all = is_so(path, context);
        free(path);
    }
    return all;
}

typedef struct {
    const Scene *scene;
    const char *path;
} SceneFile;

static bool file_keeps_scene(const char *path, void *context)
{
    const SceneFile *file = context;
    return !output_overwrites_scene(path, file->scene, file->path);
}

bool image_output_overwrites_scene(const ImageOutputOptions *options, const Scene *scene,
                                   const char *scene_path)
{
    return !image_output_is_stdout(options->path) &&
           !files_all(options, file_keeps_scene, &(SceneFile){scene, scene_path});
}

static bool file_exists(const char *path, void *unused)
{
    (void)unused;
    struct stat status;
    return stat(path, &status) == 0 && S_ISREG(status.st_mode);
}

bool image_output_exists(const ImageOutputOptions *options)
{
    return files_all(options, file_exists, NULL);
}
