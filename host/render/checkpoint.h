// The finished bands of an image in a file, so that a render that ends early goes on where it was. Records
// are appended, each with its hash, and synced; what a crash, a power failure or a full disk left of the last
// ones is cut off when the file is opened again.
//
// A checkpoint belongs to one image: its key is a text with a line "NAME: VALUE" for each thing that the bits
// depend on, the scene last: a refusal names the first line that differs.
#pragma once

#include "host/base/message.h"
#include "host/render/film.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Checkpoint Checkpoint;

// Opens the file or creates it. `film` describes all rows of the image: bands that do not fit it are
// rejected. NULL with an error message: the file is another image's, not a checkpoint, damaged, in use by
// another process, or cannot be read or written; it is then as it was.
Checkpoint *checkpoint_open(const char *path, const char *key, const FilmHeader *film, MessageList *messages);
// The rows of each band that the file has, in no order.
const BandRows *checkpoint_bands(const Checkpoint *checkpoint, size_t *count);
// Adds a band; any thread may. False: it cannot be written; checkpoint_close says why.
bool checkpoint_append(Checkpoint *checkpoint, const Film *band);
// Reads the band that starts at a row; film_free frees it. False: it cannot be read, as there.
bool checkpoint_read(Checkpoint *checkpoint, uint32_t first_row, Film *band);
// Adds an error message if a band could not be written or read. Removes the file where the image
// `is_complete`, with a warning where it cannot.
void checkpoint_close(Checkpoint *checkpoint, bool is_complete, MessageList *messages);
