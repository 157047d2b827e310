#include "host/image/flip.h"

#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/image/srgb.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// The paper's constants: exponents of the color and feature differences (sections 4.1.3 and 4.2.1), the point
// where large color differences are compressed (4.1.3), and the width of the feature detectors (4.2).
static const double color_exponent = 0.7, feature_exponent = 0.5; // q_c, q_f
static const double compressed_from = 0.4, compressed_to = 0.95;  // p_c, p_t
static const double feature_width_degrees = 0.082;                // w

// The contrast sensitivity of the eye as sums of Gaussians a sqrt(pi / b) exp(-pi^2 x^2 / b), with x in
// degrees (table 1), for luminance, red-green and blue-yellow.
static const struct {
    double a[2], b[2];
} sensitivity[3] = {
    {{1, 0}, {0.0047, 1}},
    {{1, 0}, {0.0053, 1}},
    {{34.1, 13.5}, {0.04, 0.025}},
};
static const double widest_sensitivity = 0.04;

// A color as three numbers of any of the spaces that follow.
typedef struct {
    double x, y, z;
} Tristimulus;

// Converts between linear RGB with sRGB's primaries (IEC 61966-2-1:1999) and XYZ with the white x 0.31271, y
// 0.32902 (D65, CIE 15:2004).
static const double xyz_from_rgb[3][3] = {{0.41238656, 0.35759149, 0.18045049},
                                          {0.21263682, 0.71518298, 0.0721802},
                                          {0.01933062, 0.11919716, 0.95037259}};
static const double rgb_from_xyz[3][3] = {{3.24100323, -1.53739897, -0.49861588},
                                          {-0.96922425, 1.87592998, 0.04155423},
                                          {0.05563942, -0.20401121, 1.05714898}};
static const Tristimulus white = {0.95042854, 1, 1.0889004};

static Tristimulus transform(const double matrix[3][3], Tristimulus v)
{
    return (Tristimulus){matrix[0][0] * v.x + matrix[0][1] * v.y + matrix[0][2] * v.z,
                         matrix[1][0] * v.x + matrix[1][1] * v.y + matrix[1][2] * v.z,
                         matrix[2][0] * v.x + matrix[2][1] * v.y + matrix[2][2] * v.z};
}

// Converts between linear RGB and YCxCz, a linear relative of L*a*b* (section 4.1.1).
static Tristimulus ycc_from_rgb(Tristimulus rgb)
{
    Tristimulus xyz = transform(xyz_from_rgb, rgb);
    Tristimulus ratio = {xyz.x / white.x, xyz.y / white.y, xyz.z / white.z};
    return (Tristimulus){116 * ratio.y - 16, 500 * (ratio.x - ratio.y), 200 * (ratio.y - ratio.z)};
}

static Tristimulus rgb_from_ycc(Tristimulus ycc)
{
    double y = (ycc.x + 16) / 116;
    return transform(rgb_from_xyz,
                     (Tristimulus){white.x * (y + ycc.y / 500), white.y * y, white.z * (y - ycc.z / 200)});
}

static double lab_root(double ratio)
{
    const double delta = 6.0 / 29;
    return ratio > delta * delta * delta ? cbrt(ratio) : ratio / (3 * delta * delta) + 4.0 / 29;
}

// Converts linear RGB to L*a*b* (CIE 15:2004), with colors fading in the dark (Hunt; section 4.1.3).
static Tristimulus hunt_lab(Tristimulus rgb)
{
    Tristimulus xyz = transform(xyz_from_rgb, rgb);
    double x = lab_root(xyz.x / white.x), y = lab_root(xyz.y / white.y), z = lab_root(xyz.z / white.z);
    double lightness = 116 * y - 16;
    return (Tristimulus){lightness, 0.01 * lightness * 500 * (x - y), 0.01 * lightness * 200 * (y - z)};
}

// Returns the distance HyAB (Abasi, Tehran, Fairchild 2020; section 4.1.3).
static double color_distance(Tristimulus p, Tristimulus q)
{
    return pow(fabs(p.x - q.x) + hypot(p.y - q.y, p.z - q.z), color_exponent);
}

// An image with one number per pixel.
typedef struct {
    uint32_t width, height;
    float *values;
} Channel;

static Channel channel_open(uint32_t width, uint32_t height)
{
    return (Channel){width, height, memory_allocate((size_t)width * height, sizeof(float))};
}

static void channel_close(Channel *channel)
{
    free(channel->values);
}
#define OwnedChannel __attribute__((cleanup(channel_close))) Channel

static float *channel_row(const Channel *channel, uint32_t y)
{
    return channel->values + (size_t)y * channel->width;
}

// A separable filter with the weights of the neighbors -radius..radius in each direction.
enum { RADIUS_MAX = 15 };
typedef struct {
    int radius;
    float weights[2 * RADIUS_MAX + 1];
} Filter;

// Filters horizontally. Repeats the border pixels outside the image.
static void filter_across(const Filter *filter, const Channel *in, Channel *out)
{
    size_t width = in->width, radius = (size_t)filter->radius;
    OWNED float *padded = memory_allocate(width + 2 * radius, sizeof *padded);
    for (uint32_t y = 0; y < in->height; y++) {
        const float *row = channel_row(in, y);
        memcpy(padded + radius, row, width * sizeof *row);
        for (size_t i = 0; i < radius; i++) {
            padded[i] = row[0];
            padded[radius + width + i] = row[width - 1];
        }
        float *result = channel_row(out, y);
        memset(result, 0, width * sizeof *result);
        for (size_t tap = 0; tap <= 2 * radius; tap++)
            for (size_t x = 0; x < width; x++)
                result[x] += filter->weights[tap] * padded[x + tap];
    }
}

static void filter_down(const Filter *filter, const Channel *in, Channel *out)
{
    for (uint32_t y = 0; y < in->height; y++) {
        float *result = channel_row(out, y);
        memset(result, 0, in->width * sizeof *result);
        for (int tap = -filter->radius; tap <= filter->radius; tap++) {
            int64_t at = (int64_t)y + tap;
            int64_t clamped = at < 0 ? 0 : at >= in->height ? in->height - 1 : at;
            const float *row = channel_row(in, (uint32_t)clamped);
            for (uint32_t x = 0; x < in->width; x++)
                result[x] += filter->weights[tap + filter->radius] * row[x];
        }
    }
}

static Channel channel_filter(const Channel *in, const Filter *across, const Filter *down)
{
    OwnedChannel between = channel_open(in->width, in->height);
    filter_across(across, in, &between);
    Channel out = channel_open(in->width, in->height);
    filter_down(down, &between, &out);
    return out;
}

// Returns a filter with weights shape(x, deviation) for the pixels x around, scaled so that the positive
// weights sum to 1 and the negative ones to -1.
static Filter filter_make(double (*shape)(double x, double deviation), double deviation, int radius)
{
    if (radius > RADIUS_MAX) fault("a filter of FLIP is too wide: %d", radius);
    double weights[2 * RADIUS_MAX + 1] = {0}, positive = 0, negative = 0;
    for (int x = -radius; x <= radius; x++) {
        double weight = shape(x, deviation);
        weights[x + radius] = weight;
        *(weight > 0 ? &positive : &negative) += fabs(weight);
    }
    Filter filter = {.radius = radius};
    for (int i = 0; i <= 2 * radius; i++)
        filter.weights[i] = (float)(weights[i] / (weights[i] > 0 ? positive : negative));
    return filter;
}

static double gaussian(double x, double deviation)
{
    return exp(-x * x / (2 * deviation * deviation));
}

static double gaussian_derivative(double x, double deviation)
{
    return -x * gaussian(x, deviation);
}

static double gaussian_second_derivative(double x, double deviation)
{
    return (x * x / (deviation * deviation) - 1) * gaussian(x, deviation);
}

// Returns the standard deviation of exp(-pi^2 x^2 / b) in pixels.
static double sensitivity_deviation(double b)
{
    return sqrt(b / (2 * M_PI * M_PI)) * FLIP_PIXELS_PER_DEGREE;
}

// Blurs one channel of YCxCz to what the eye resolves (section 4.1.2). Each Gaussian is a product of a
// horizontal and a vertical one. The weights of a sum of Gaussians are proportional to their volumes.
static void channel_blur(Channel *channel, int component)
{
    int radius = (int)ceil(3 * sensitivity_deviation(widest_sensitivity));
    Channel parts[2] = {0};
    double volumes[2] = {0};
    for (int i = 0; i < 2; i++) {
        double a = sensitivity[component].a[i], b = sensitivity[component].b[i];
        if (a == 0) continue;
        double deviation = sensitivity_deviation(b), length = 0;
        for (int x = -radius; x <= radius; x++)
            length += gaussian(x, deviation);
        volumes[i] = a * sqrt(M_PI / b) * length * length;
        Filter filter = filter_make(gaussian, deviation, radius);
        parts[i] = channel_filter(channel, &filter, &filter);
    }
    double volume = volumes[0] + volumes[1];
    for (size_t i = 0; i < (size_t)channel->width * channel->height; i++) {
        double sum = volumes[0] * (double)parts[0].values[i];
        if (volumes[1] > 0) sum += volumes[1] * (double)parts[1].values[i];
        channel->values[i] = (float)(sum / volume);
    }
    channel_close(&parts[0]);
    channel_close(&parts[1]);
}

// Returns how strong an edge (if `shape` is the derivative of a Gaussian) or a point (if it is the second
// derivative) is at each pixel of the luminance (section 4.2).
static Channel feature_strength(const Channel *gray, double (*shape)(double x, double deviation))
{
    double deviation = 0.5 * feature_width_degrees * FLIP_PIXELS_PER_DEGREE;
    int radius = (int)ceil(3 * deviation);
    Filter detector = filter_make(shape, deviation, radius),
           smooth = filter_make(gaussian, deviation, radius);
    Channel across = channel_filter(gray, &detector, &smooth);
    OwnedChannel down = channel_filter(gray, &smooth, &detector);
    for (size_t i = 0; i < (size_t)gray->width * gray->height; i++)
        across.values[i] = hypotf(across.values[i], down.values[i]);
    return across;
}

static Tristimulus ycc_from_display(const float color[3])
{
    return ycc_from_rgb((Tristimulus){srgb_decode((double)color[0]), srgb_decode((double)color[1]),
                                      srgb_decode((double)color[2])});
}

// An image as the eye perceives it.
typedef struct {
    Channel ycc[3]; // blurred
    Channel edges, points;
} Seen;

static Seen seen_open(const float *image, uint32_t width, uint32_t height)
{
    Seen seen;
    OwnedChannel gray = channel_open(width, height);
    for (int i = 0; i < 3; i++)
        seen.ycc[i] = channel_open(width, height);
    for (size_t i = 0; i < (size_t)width * height; i++) {
        Tristimulus ycc = ycc_from_display(image + 3 * i);
        seen.ycc[0].values[i] = (float)ycc.x;
        seen.ycc[1].values[i] = (float)ycc.y;
        seen.ycc[2].values[i] = (float)ycc.z;
        gray.values[i] = (float)((ycc.x + 16) / 116);
    }
    seen.edges = feature_strength(&gray, gaussian_derivative);
    seen.points = feature_strength(&gray, gaussian_second_derivative);
    for (int i = 0; i < 3; i++)
        channel_blur(&seen.ycc[i], i);
    return seen;
}

static void seen_close(Seen *seen)
{
    for (int i = 0; i < 3; i++)
        channel_close(&seen->ycc[i]);
    channel_close(&seen->edges);
    channel_close(&seen->points);
}
#define OwnedSeen __attribute__((cleanup(seen_close))) Seen

static double clipped(double value)
{
    return fmax(0, fmin(value, 1));
}

static Tristimulus seen_color(Tristimulus ycc)
{
    Tristimulus rgb = rgb_from_ycc(ycc);
    return hunt_lab((Tristimulus){clipped(rgb.x), clipped(rgb.y), clipped(rgb.z)});
}

static Tristimulus seen_color_at(const Seen *seen, size_t i)
{
    return seen_color((Tristimulus){(double)seen->ycc[0].values[i], (double)seen->ycc[1].values[i],
                                    (double)seen->ycc[2].values[i]});
}

// Compresses a distance to 0..1. The part up to compressed_to holds the smaller distances, and the remainder
// those up to the largest.
static double compressed(double distance, double largest)
{
    double knee = compressed_from * largest;
    if (distance < knee) return distance / knee * compressed_to;
    return compressed_to + (distance - knee) / (largest - knee) * (1 - compressed_to);
}

// Returns the largest distance of two perceived colors, that of green and blue (section 4.1.3).
static double largest_distance(void)
{
    return color_distance(hunt_lab((Tristimulus){0, 1, 0}), hunt_lab((Tristimulus){0, 0, 1}));
}

double flip_of_colors(const float reference[3], const float test[3])
{
    return compressed(
        color_distance(seen_color(ycc_from_display(reference)), seen_color(ycc_from_display(test))),
        largest_distance());
}

void flip_map(const float *reference, const float *test, uint32_t width, uint32_t height, float *map)
{
    OwnedSeen seen = seen_open(reference, width, height), other = seen_open(test, width, height);
    const double largest = largest_distance();
    for (size_t i = 0; i < (size_t)width * height; i++) {
        double color = compressed(color_distance(seen_color_at(&seen, i), seen_color_at(&other, i)), largest);
        double edge = fabs((double)seen.edges.values[i] - (double)other.edges.values[i]);
        double point = fabs((double)seen.points.values[i] - (double)other.points.values[i]);
        double feature = pow(fmax(edge, point) / sqrt(2), feature_exponent);
        map[i] = (float)pow(color, 1 - fmin(feature, 1)); // section 4.3
    }
}
