// Describes how an image was rendered in the notes of its file, which suffice to re-render it.
#pragma once

#include "host/cli/image_paths.h"
#include "host/cli/ranks.h"
#include "host/render/renderer.h"

// What an image is rendered from and with, for its notes.
typedef struct {
    const char *scene_path;
    const Scene *scene;
    const RenderSettings *settings;
    Renderer *const *renderers;
    size_t renderer_count;
    const Ranks *ranks; // render parts of the image; may be NULL
} ImageOrigin;

enum { NOTE_COUNT_MAX = 26 };

// Keys and values, each of which ends with a NUL, and their offsets in the text.
typedef struct {
    Text text;
    size_t starts[NOTE_COUNT_MAX][2];
    size_t count;
} ImageNotes;

// The key of the counts of re-rendered samples.
extern const char certified_key[];

// Appends the value of certified_key.
void counts_describe(Text *text, const RerenderCounts *counts);
// Adds all notes of an image. `counts` is NULL if the counts are not known yet or the precision is not
// `certified`. The caller frees the text.
void image_notes_add_all(ImageNotes *notes, const ImageOrigin *origin, const ImageOutputOptions *options,
                         ImageFormat format, const RerenderCounts *counts);
// Fills the list, which ends with an empty note and points into the notes.
void image_notes_list(const ImageNotes *notes, ImageNote list[NOTE_COUNT_MAX + 1]);
