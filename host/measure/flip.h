// FLIP: how much people see the difference of two images that are shown in turn, for each pixel.
// Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild: "FLIP: A Difference Evaluator for
// Alternating Images", Proceedings of the ACM on Computer Graphics and Interactive Techniques 3(2), 2020.
#pragma once

#include <stdint.h>

// Of a screen 0.7 m wide with 3840 pixels, seen from 0.7 m: the paper's example.
#define FLIP_PIXELS_PER_DEGREE 67

// Both images: 3 sRGB display values per pixel, each within 0..1. Fills `map` with a value within 0..1 for
// each pixel: 0 where no difference is seen.
void flip_map(const float *reference, const float *test, uint32_t width, uint32_t height, float *map);

// Of one pixel, if both images were of one color each: 0..1.
double flip_of_colors(const float reference[3], const float test[3]);
