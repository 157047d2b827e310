// FLIP estimates for each pixel how clearly people see the difference of two images that alternate.
//
// Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: "FLIP: A Difference Evaluator for
// Alternating Images", Proceedings of the ACM on Computer Graphics and Interactive Techniques 3(2), 2020.
#pragma once

#include <stdint.h>

// The paper's example: a screen that is 0.7 m wide, has 3840 pixels across and is seen from 0.7 m.
#define FLIP_PIXELS_PER_DEGREE 67

// Fills `map` with a value within 0..1 per pixel, 0 where no difference is visible. Both images have 3 sRGB
// display values per pixel, each within 0..1.
void flip_map(const float *reference, const float *test, uint32_t width, uint32_t height, float *map);

// Returns the value, within 0..1, of each pixel if both images had one color each.
double flip_of_colors(const float reference[3], const float test[3]);
