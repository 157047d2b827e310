// Samples areas, such as those of lights. Each of a pixel's samples gets a point of a low-discrepancy
// sequence, scrambled by the pixel, the area and the path. Points of the square are computed in integers, so
// that every device and precision has the same ones.
#ifndef SAMPLING_H
#define SAMPLING_H

#include "numerics/vector.h"

// 32 bits per lane.
typedef LANES_TYPE(uint) word;

// Identifies a ray's sample.
typedef struct {
    uint index; // the sample's index; SAMPLE_CENTER represents each area by its center
    word seed;  // identifies the pixel and the path
} Sample;

#define SAMPLE_CENTER 0xffffffffu

// The areas that are sampled: the lens, and each light by SAMPLED_LIGHTS + its index.
enum { SAMPLED_LENS, SAMPLED_LIGHTS };

// Coordinates from -1 to 1.
typedef struct {
    real x, y;
} SquarePoint;

// Mixes the bits so that each depends on all (Wellons, Hash function prospector, 2018, lowbias32).
static inline word word_mix(word a)
{
    a = (a ^ a >> 16) * (word)(0x7feb352du);
    a = (a ^ a >> 15) * (word)(0x846ca68bu);
    return a ^ a >> 16;
}

static inline word word_reverse(word a)
{
    a = (a >> 1 & (word)(0x55555555u)) | (a & (word)(0x55555555u)) << 1;
    a = (a >> 2 & (word)(0x33333333u)) | (a & (word)(0x33333333u)) << 2;
    a = (a >> 4 & (word)(0x0f0f0f0fu)) | (a & (word)(0x0f0f0f0fu)) << 4;
    a = (a >> 8 & (word)(0x00ff00ffu)) | (a & (word)(0x00ff00ffu)) << 8;
    return a >> 16 | a << 16;
}

// Flips each bit by a hash of the bits below it. On reversed bits this is Owen's nested scrambling (Laine,
// Karras, Stratified sampling for stochastic transparency, Computer Graphics Forum 30(4), 2011; constants of
// Burley, Practical hash-based Owen scrambling, JCGT 9(4), 2020, listing 2).
static inline word word_scramble(word a, word seed)
{
    a += seed;
    a ^= a * (word)(0x6c50b47cu);
    a ^= a * (word)(0xb82f1e52u);
    a ^= a * (word)(0xc7afe638u);
    return a ^ a * (word)(0x8d22f6e6u);
}

// Returns the reversed bits of the Sobol sequence's second coordinate. If the bits are the coefficients of a
// polynomial a(x) over GF(2), this is a(1 + x). Since (1 + x)^n = 1 + x^n if n is a power of two, the halves
// are composed in turn.
static inline word sobol_second(word a)
{
    a ^= a >> 16;
    a ^= a >> 8 & (word)(0x00ff00ffu);
    a ^= a >> 4 & (word)(0x0f0f0f0fu);
    a ^= a >> 2 & (word)(0x33333333u);
    return a ^ (a >> 1 & (word)(0x55555555u));
}

// Returns a number from -1 to 1, made of the 24 highest bits, exactly at every precision.
static inline real real_from_word(word a)
{
    return real_fma(LANES_CONVERT(REAL_BASE)(a >> 8), (real)(0x1p-23f), (real)(-1));
}

static inline Sample sample_of_pixels(integer x, integer y, uint index)
{
    word column = LANES_CONVERT(uint)(x), row = LANES_CONVERT(uint)(y);
    return (Sample){index, word_mix(column + word_mix(row + (word)(0x9e3779b9u)))};
}

// Returns the sample of a bounced ray.
static inline Sample sample_after_bounce(Sample sample, bool is_refracted)
{
    sample.seed = word_mix(sample.seed + (word)(is_refracted ? 0x85ebca6bu : 0xc2b2ae35u));
    return sample;
}

// Returns the sample's point of an area's square. Its coordinates are the first two of the Sobol sequence,
// scrambled and in a scrambled order (Burley, section 5). The 2^n samples of a pixel lie one in each of the
// 2^n equal rectangles of every shape whose sides are powers of two.
static inline SquarePoint sample_point(const Sample *sample, uint area)
{
    if (sample->index == SAMPLE_CENTER) return (SquarePoint){(real)(0), (real)(0)};
    word seed = word_mix(sample->seed ^ (word)(area * 0x9e3779b9u));
    word index = word_reverse(word_scramble(word_reverse((word)(sample->index)), seed));
    word x = word_reverse(word_scramble(index, word_mix(seed + (word)(1))));
    word y = word_reverse(word_scramble(sobol_second(index), word_mix(seed + (word)(2))));
    return (SquarePoint){real_from_word(x), real_from_word(y)};
}

// Maps the square onto the unit disc so that equal areas remain equal (Shirley, Chiu, A low distortion map
// between disk and square, Journal of Graphics Tools 2(3), 1997). The sine is a Taylor polynomial, off by at
// most 3e-8 up to a quarter of pi, as its coefficients are of 24 bits.
static inline SquarePoint disc_of_square(SquarePoint point)
{
    mask is_wide = fabs(point.x) > fabs(point.y);
    real radius = lanes_select(is_wide, point.x, point.y), across = lanes_select(is_wide, point.y, point.x);
    mask is_center = radius == 0;
    real turn = real_divide(across, lanes_select(is_center, (real)(1), radius)), squared = turn * turn;
    real series = real_fma(squared, (real)(0x1.507834p-22f), (real)(-0x1.32d2ccp-15f));
    series = real_fma(squared, series, (real)(0x1.466bc6p-9f));
    series = real_fma(squared, series, (real)(-0x1.4abbcep-4f));
    real sine = turn * real_fma(squared, series, (real)(0x1.921fb6p-1f));
    real cosine = real_sqrt(real_fma(-sine, sine, (real)(1)));
    real along = radius * cosine;
    across = radius * sine;
    return (SquarePoint){lanes_select(is_wide, along, across), lanes_select(is_wide, across, along)};
}

// Maps the square onto the triangle (0, 0), (1, 0), (0, 1) so that equal areas remain equal (Heitz, A
// low-distortion map between triangle and square, 2019), and returns the point relative to (1/4, 1/4), which
// the square's center becomes.
static inline SquarePoint triangle_of_square(SquarePoint point)
{
    mask is_above = point.y > point.x;
    real low = 0.25f * lanes_select(is_above, point.x, point.y);
    real high = 0.5f * lanes_select(is_above, point.y, point.x) - low;
    return (SquarePoint){lanes_select(is_above, low, high), lanes_select(is_above, high, low)};
}

#endif
