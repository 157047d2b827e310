// Writes the layers of a film as NPY files.
#pragma once

#include "host/image/image.h"
#include "host/render/film.h"

// Returns the header of an NPY file with the layer in the precision in which it was computed.
ImageHeader film_layer_header(const Film *film, Layer layer);
// Writes PREFIX.color.npy, PREFIX.t.npy and so on, each layer of the film in the precision in which it was
// computed. Without lights there is no PREFIX.shadow.npy. Returns false with a message if a file could not be
// written.
bool film_save(const Film *film, const char *prefix, MessageList *messages);
