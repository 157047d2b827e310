// The pixels of a launch, the work-items that render them, and the parts into which the launch is divided.
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
} LaunchRange;

// Returns the range of a band's rows.
LaunchRange launch_range_of_rows(const Pass *pass, BandRows rows);
// Returns the range of a list's first `count` pixels.
LaunchRange launch_range_of_list(const Pass *pass, uint32_t count);
// Steps through a range in parts that consist of whole work-groups: several rows of groups, or a part of one
// row. Each part has at most `pixels_max` pixels, or one group if that has more. `part` is all zeros before
// the first step. Returns false after the last part.
bool launch_range_next(LaunchRange *part, const LaunchRange *whole, uint64_t pixels_max);
uint64_t launch_range_pixels(const LaunchRange *range);
// Returns how many 32-bit words hold one bit for each pixel of the range's work-items.
size_t launch_range_flag_words(const LaunchRange *range);
