// The pixels of a launch: which work-items render them, and the parts into which the launch is divided.
#pragma once

#include "host/render/film.h"
#include "host/render/pass.h"

// The size of a work-item's or a work-group's tile in pixels.
typedef struct {
    uint32_t width, height;
} TileShape;
TileShape group_shape(const Pass *pass);

typedef struct {
    cl_uint4 band; // x, y, width and height; in a list, 0, 0, its length and 1
    TileShape item;
    size_t first[2], items[2], group[2];
} Place;

// Returns the place of a band's rows.
Place band_place(const Pass *pass, BandRows rows);
// Returns the place of a list's first `count` pixels.
Place list_place(const Pass *pass, uint32_t count);
// Steps through a place in parts that consist of whole work-groups: several rows of groups, or a part of one
// row. Each part has at most `pixels_max` pixels, or one group if that has more. `part` is all zeros before
// the first step. Returns false after the last part.
bool place_next(Place *part, const Place *whole, uint64_t pixels_max);
uint64_t place_pixels(const Place *place);
// Returns how many 32-bit words hold one bit for each pixel of the place's work-items.
size_t place_flag_words(const Place *place);
