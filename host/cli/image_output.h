// Writes the files of one image: the image, and an .npy for each requested AOV. An EXR holds its AOVs as
// layers.
#pragma once

#include "host/cli/image_notes.h"

typedef struct ImageOutput ImageOutput;

// Opens the output. The first band opens its files, whose notes name the devices of all renderers.
ImageOutput *image_output_open(const ImageOutputOptions *options, const ImageOrigin *origin);
// Encodes a copy of the band while the caller continues, unless options.synchronous. The messages belong to
// the output until it is committed or abandoned. Returns false if this band or an earlier one could not be
// written.
bool image_output_write(ImageOutput *output, const Film *band, MessageList *messages);
// Returns the total bytes of all files before compression, or 0 until they are open.
double image_output_bytes(const ImageOutput *output);
// Returns the counts of all bands so far at `certified`.
RerenderCounts image_output_rerenders(const ImageOutput *output);
// Moves all files into place and frees the output. Returns false with a message if a file could not be moved;
// the files before it are then in place.
// Sets *seconds to the time spent on encoding and writing, even if other work ran at the same time.
bool image_output_commit(ImageOutput *output, MessageList *messages, double *seconds);
void image_output_abandon(ImageOutput *output);
