// Writes the files of one image: the image, and an .npy for each requested AOV. An EXR holds its AOVs as
// layers.
#pragma once

#include "host/cli/ranks.h"
#include "host/image/image.h"
#include "host/measure/pilot.h"
#include "host/opencl/device.h"
#include "host/render/renderer.h"

typedef struct {
    const char *path; // "-": standard output
    ImageFormat stdout_format;
    unsigned aovs; // AOV_COLOR means the linear values
    Transfer transfer;
    unsigned bits;
    double exposure; // in stops
    Tone tone;
    bool dither;
    const Pilot *pilot; // chose the precision, or NULL
    bool prints_names;  // prints the files' names once they are written
    bool synchronous;   // encodes a band before the next one is rendered, so that times do not overlap
} ImageOutputOptions;

extern const char *const tone_names[TONE_COUNT];

typedef struct ImageOutput ImageOutput;

// Returns the scene's name with .png, or image.png for standard input, in the current folder. The caller
// frees it.
char *image_output_default_path(const char *scene_path);
// Returns whether the path is "-", standard output.
bool image_output_is_stdout(const char *path);
// Returns whether the path is "-" or its ending is known; if not, prints the known endings.
bool image_output_path_known(const char *path);
// Returns whether the format holds linear floats, which are not for display.
bool image_output_holds_floats(ImageFormat format);
// Returns true with a message if one of the files is a file that the scene was read from.
bool image_output_overwrites_scene(const ImageOutputOptions *options, const Scene *scene,
                                   const char *scene_path);

// Returns whether all of its files exist.
bool image_output_exists(const ImageOutputOptions *options);

// Opens the output. Its files are opened with the first band, and their notes name the devices of all
// renderers. `ranks`, which render parts of the image, may be NULL.
ImageOutput *image_output_open(const ImageOutputOptions *options, const char *scene_path, const Scene *scene,
                               const RenderSettings *settings, Renderer *const *renderers,
                               size_t renderer_count, const Ranks *ranks);
// Encodes a copy of the band while the caller continues, unless options.synchronous. The messages belong to
// the output until it is committed or abandoned. Returns false if this band or an earlier one could not be
// written.
bool image_output_write(ImageOutput *output, const Film *band, MessageList *messages);
// Returns the total bytes of all files before compression, or 0 until they are open.
double image_output_bytes(const ImageOutput *output);
// Returns the counts of all bands so far at `certified`.
RepeatCounts image_output_repeats(const ImageOutput *output);
// Puts all files in place and frees the output. Returns false with a message if a file could not be put in
// place. Sets *seconds to the time spent on encoding and writing, even if other work ran at the same time.
bool image_output_commit(ImageOutput *output, MessageList *messages, double *seconds);
void image_output_abandon(ImageOutput *output);

// Writes PREFIX.color.npy, PREFIX.t.npy and so on, each layer of the film in the precision it was computed
// in. Without lights there is no PREFIX.shadow.npy. Returns false with a message if a file could not be
// written.
bool film_save(const Film *film, const char *prefix, MessageList *messages);
