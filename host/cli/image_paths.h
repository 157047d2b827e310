// The outputs of one image and their file names.
#pragma once

#include "host/image/image.h"
#include "host/measure/pilot.h"
#include "host/scene/scene.h"

typedef struct {
    const char *path; // "-" means standard output
    ImageFormat stdout_format;
    unsigned aovs; // AOV_COLOR means the linear values
    Transfer transfer;
    unsigned bits;
    double exposure; // in stops
    Tone tone;
    bool dither;
    bool alpha;         // the background of a PNG or EXR is transparent
    const Pilot *pilot; // the pilot that chose the precision, or NULL
    bool prints_names;  // prints the files' names once they are written
    bool synchronous;   // encodes a band before the next one is rendered, so that times do not overlap
} ImageOutputOptions;

// Returns the AOVs to render, which are those that are written and those that alpha needs.
static inline unsigned image_output_aovs(const ImageOutputOptions *options)
{
    return options->aovs | (options->alpha ? AOVS_OF_SAMPLES : 0U);
}

// Returns the scene's name with .png, or image.png for standard input, in the current folder. The caller
// frees it.
char *image_output_default_path(const char *scene_path);
// Returns whether the path is "-", standard output.
bool image_output_is_stdout(const char *path);
// Returns the name of an AOV's file: image.png becomes image.NAME.npy. The caller frees it.
char *image_output_aov_path(const ImageOutputOptions *options, const char *name);
// Returns true with a message if one of the files is a file that the scene was read from.
bool image_output_overwrites_scene(const ImageOutputOptions *options, const Scene *scene,
                                   const char *scene_path);
// Returns whether all files of the output exist, except that of the shadows, which a scene without lights
// does not have.
bool image_output_exists(const ImageOutputOptions *options);
