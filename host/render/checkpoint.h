// Keeps the finished bands of an image in a file, so that a render that ends early can be resumed. Records
// are appended, each with its hash, and synced at most once a second, so that a power failure loses little
// more than the last second. After a crash, a power failure or a full disk, the next process that opens
// the file cuts off the first record that is not whole and all that follow it, with a warning.
//
// A checkpoint belongs to one image. Its key is a text with a line "NAME: VALUE" for each thing that the
// image's bits depend on, the scene last, so that a refusal can name the first line that differs.
#pragma once

#include "host/base/message.h"
#include "host/render/film.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Checkpoint Checkpoint;

// Opens the file or creates it. `film` describes all rows of the image; bands that do not fit it are
// rejected. Returns NULL with an error message, and leaves the file unchanged, if the file belongs to another
// image, is not a checkpoint, is damaged before its first record, is used by another process, or cannot be
// read or written.
Checkpoint *checkpoint_open(const char *path, const char *key, const FilmHeader *film, MessageList *messages);
// Returns the rows of each band in the file, in no particular order.
const BandRows *checkpoint_bands(const Checkpoint *checkpoint, size_t *count);
// Appends a band. Any thread may call this. Returns false if the band cannot be written; checkpoint_close
// then adds the message.
bool checkpoint_append(Checkpoint *checkpoint, const Film *band);
// Reads the band that starts at a row, of which there must be one; film_free frees it. Returns false if the
// band cannot be read; checkpoint_close then adds the message.
bool checkpoint_read(Checkpoint *checkpoint, uint32_t first_row, Film *band);
// Closes the file. Adds an error message if a band could not be written or read. If the image `is_complete`,
// removes the file, or adds a warning if that fails.
void checkpoint_close(Checkpoint *checkpoint, bool is_complete, MessageList *messages);
