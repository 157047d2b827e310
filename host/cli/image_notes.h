// Describes how an image was rendered in the notes of its file, which suffice to re-render it.
#pragma once

#include "host/cli/image_paths.h"
#include "host/cli/ranks.h"
#include "host/import/load.h"
#include "host/render/renderer.h"

// What an image is rendered from and with, for its notes.
typedef struct {
    const char *scene_path;
    const Scene *scene;
    const RenderSettings *settings;
    Renderer *const *renderers;
    size_t renderer_count;
    const Ranks *ranks; // render parts of the image; may be NULL
    const SceneOptions *scene_options;
} ImageOrigin;

enum { NOTE_COUNT_MAX = 30 };

typedef struct {
    ImageNote items[NOTE_COUNT_MAX + 1]; // up to the first without a key
    size_t count;
} ImageNotes;

// The key of the counts of re-rendered samples.
extern const char certified_key[];

// Returns the value of certified_key. The caller frees it.
char *counts_describe(const RerenderCounts *counts);
// Adds all notes of an image. `counts` is NULL if the counts are not known yet or the precision is not
// `certified`.
void image_notes_add_all(ImageNotes *notes, const ImageOrigin *origin, const ImageOutputOptions *options,
                         ImageFormat format, const RerenderCounts *counts);
void image_notes_free(ImageNotes *notes); // frees the values
