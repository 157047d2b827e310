// Applies the sRGB curve (IEC 61966-2-1:1999). The curve is monotonic, so comparisons with the thresholds
// between neighboring display values, which are computed once, yield exact display values.
#include "host/image/transfer.h"
#include "host/base/memory.h"
#include "host/image/srgb.h"

#include <math.h>
#include <pthread.h>
#include <string.h>

typedef struct {
    uint32_t maximum;
    unsigned shift;    // bits of a float below the bucket index
    uint32_t first;    // bucket of thresholds[1]
    float bucket_min;  // the least float in that bucket
    float *thresholds; // [k]: the least float that becomes k
    uint16_t *starts;  // [bucket - first]: the display value of the bucket's least float
} Curve;

// Computed once by the first thread that needs them, then constant.
static Curve curve_8, curve_16;

static uint32_t float_bits(float value)
{
    uint32_t bits;
    memcpy(&bits, &value, sizeof bits);
    return bits;
}

// Returns the least float at or above a threshold. No threshold lies within a relative 1e-12 of a float, so
// double precision suffices.
static float float_at_least(double value)
{
    float near = (float)value;
    return (double)near < value ? nextafterf(near, INFINITY) : near;
}

static void curve_prepare(Curve *curve, uint32_t maximum, unsigned bucket_bits)
{
    curve->maximum = maximum;
    curve->thresholds = memory_allocate(maximum + 2, sizeof *curve->thresholds);
    curve->thresholds[0] = -INFINITY;
    for (uint32_t k = 1; k <= maximum; k++)
        curve->thresholds[k] = float_at_least(srgb_decode((k - 0.5) / maximum));
    curve->thresholds[maximum + 1] = INFINITY;

    // A positive float's upper bits, which order floats, are its bucket: several per power of two.
    curve->shift = 23 - bucket_bits;
    curve->first = float_bits(curve->thresholds[1]) >> curve->shift;
    const uint32_t bucket_min_bits = curve->first << curve->shift;
    memcpy(&curve->bucket_min, &bucket_min_bits, sizeof curve->bucket_min);
    uint32_t end = float_bits(1.0F) >> curve->shift;
    curve->starts = memory_allocate(end - curve->first, sizeof *curve->starts);
    uint32_t display = 0;
    for (uint32_t bucket = curve->first; bucket < end; bucket++) {
        while (float_bits(curve->thresholds[display + 1]) <= bucket << curve->shift)
            display++;
        curve->starts[bucket - curve->first] = (uint16_t)display;
    }
}

static void curve_8_prepare(void)
{
    curve_prepare(&curve_8, 255, 10);
}

static void curve_16_prepare(void)
{
    curve_prepare(&curve_16, 65535, 12);
}

static const Curve *curve_of(unsigned bits)
{
    static pthread_once_t once_8 = PTHREAD_ONCE_INIT, once_16 = PTHREAD_ONCE_INIT;
    if (bits == 8) {
        pthread_once(&once_8, curve_8_prepare);
        return &curve_8;
    }
    pthread_once(&once_16, curve_16_prepare);
    return &curve_16;
}

static inline uint32_t curve_quantize(const Curve *curve, float value)
{
    if (!(value >= curve->thresholds[1])) // also NaN
        return 0;
    if (value >= 1.0F) return curve->maximum;
    uint32_t display = curve->starts[(float_bits(value) >> curve->shift) - curve->first];
    while (value >= curve->thresholds[display + 1])
        display++;
    return display;
}

// Rounds a linear value to a display value. 24 bits times 16 bits plus a half is exact in a double.
static inline uint32_t linear_quantize(float value, uint32_t maximum)
{
    if (!(value > 0.0F)) return 0;
    return value >= 1.0F ? maximum : (uint32_t)((double)value * maximum + 0.5);
}

uint32_t image_quantize(float value, Transfer transfer, unsigned bits)
{
    return transfer == TRANSFER_SRGB ? curve_quantize(curve_of(bits), value)
                                     : linear_quantize(value, bits == 8 ? 255 : 65535);
}

// Converts values to 8 bits. A bucket has at most one threshold, so that no branch depends on the value.
static void srgb_quantize_8(uint8_t *bytes, const float *values, size_t count)
{
    const Curve *curve = curve_of(8);
    const float largest = 0x1.fffffep-1F;
    for (size_t i = 0; i < count; i++) {
        float value = values[i] > curve->bucket_min ? values[i] : curve->bucket_min; // also NaN
        value = value < largest ? value : largest;
        const uint32_t display = curve->starts[(float_bits(value) >> curve->shift) - curve->first];
        bytes[i] = (uint8_t)(display + (value >= curve->thresholds[display + 1]));
    }
}

void transfer_quantize(uint8_t *bytes, const float *values, size_t count, Transfer transfer, unsigned bits)
{
    if (transfer == TRANSFER_SRGB && bits == 8) {
        srgb_quantize_8(bytes, values, count);
        return;
    }
    for (size_t i = 0; i < count; i++) {
        const uint32_t display = image_quantize(values[i], transfer, bits);
        if (bits == 16) *bytes++ = (uint8_t)(display >> 8);
        *bytes++ = (uint8_t)display;
    }
}
