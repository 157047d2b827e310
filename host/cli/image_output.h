// The files of one image: the image itself, and a .npy for each requested AOV. An EXR holds its AOVs as
// layers.
#pragma once

#include "host/cli/ranks.h"
#include "host/image/image.h"
#include "host/measure/pilot.h"
#include "host/opencl/device.h"
#include "host/render/renderer.h"

typedef struct {
    const char *path;
    unsigned aovs; // color: the linear values
    Transfer transfer;
    unsigned bits;
    const Pilot *pilot; // that chose the precision, or NULL
    bool prints_names;  // of the files, once they are written
    bool synchronous;   // a band is encoded before the next one is rendered: neither takes the other's time
} ImageOutputOptions;

typedef struct ImageOutput ImageOutput;

// The scene's name with .png, in this folder; caller frees.
char *image_output_default_path(const char *scene_path);
bool image_output_path_known(const char *path); // false: the endings there are were printed
// True, with a message, if one of the files is one that the scene was read from.
bool image_output_overwrites_scene(const ImageOutputOptions *options, const Scene *scene,
                                   const char *scene_path);

// Files are opened with the first band. Their notes name the devices of all renderers.
// `ranks`, which render as well, may be NULL.
ImageOutput *image_output_open(const ImageOutputOptions *options, const char *scene_path, const Scene *scene,
                               const RenderSettings *settings, Renderer *const *renderers,
                               size_t renderer_count, const Ranks *ranks);
// Encodes a copy of the band while the caller goes on, unless options.synchronous; the messages belong to the
// output until it is committed or abandoned. False: this band could not be written, or an earlier one.
bool image_output_write(ImageOutput *output, const Film *band, MessageList *messages);
// Returns how many bytes all files have before compression; 0 until they are open.
double image_output_bytes(const ImageOutput *output);
// At `certified`, of all bands so far.
RepeatCounts image_output_repeats(const ImageOutput *output);
// Puts all files in place; frees the output. False with a message if one could not be. *seconds: spent on
// encoding and writing, beside other work or not.
bool image_output_commit(ImageOutput *output, MessageList *messages, double *seconds);
void image_output_abandon(ImageOutput *output);

// Writes PREFIX.color.npy, PREFIX.t.npy and so on, each layer of the film in the precision it was computed
// in; without lights no PREFIX.shadow.npy. False with a message if one could not be written.
bool film_save(const Film *film, const char *prefix, MessageList *messages);
