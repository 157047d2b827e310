// Converts the values of bands to those that the files of an image hold.
#pragma once

#include "host/render/film.h"
#include "host/scene/vector.h"

// Memory that bands reuse.
typedef struct {
    void *items;
    size_t capacity;
} BandScratch;

// The functions below return the band's values, or copies in this memory that are valid until the next band.
typedef struct {
    Vector3 eye; // the origin of the band's positions
    BandScratch narrowed[LAYER_COUNT], positions, foreground;
} BandValues;

// Returns memory of at least `size` bytes.
void *band_scratch_reserve(BandScratch *scratch, size_t size);
// Returns a layer's values as NPY files have them, with positions in the world.
const void *band_layer_values(BandValues *values, const Film *band, Layer layer);
// Returns a layer's values as other formats have them, in 32 bits.
const void *band_layer_narrowed(BandValues *values, const Film *band, Layer layer);
// Returns the colors without the background. They are those of the covered part of the pixel or, if
// `is_premultiplied`, are multiplied by that part.
const float *band_foreground(BandValues *values, const Film *band, bool is_premultiplied);
void band_values_free(BandValues *values);
