// A sky that is a light is divided into cells of nearly equal light, each a range of latitudes and
// longitudes. A pixel's samples, which lie evenly in a square, then lie evenly in the sky's light: importance
// sampling by the inverse of a distribution of rows and of one in each row (Pharr, Jakob, Humphreys,
// Physically based rendering, 2016, section 14.2.4), tabulated. Within a cell all directions are equally
// likely, and kernels weigh the sky's color there by the cell's solid angle, so that no light is lost or
// moved by the division.
#include "host/scene/sky.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/image/srgb.h"
#include "host/scene/portable.h"

#include <stdlib.h>

// The rows of blended colors as an image, which has a column per cell.
enum { BLENDED_ROWS = 256 };

// A sky whose cells have less light counts as black, before their reciprocal exceeds a float.
static const double faint_light = 1e-30;

// The sky as an image of all directions, laid out as sky.texture's.
typedef struct {
    const Scene *scene;
    const Image *image; // NULL: blended colors
    uint32_t width, height;
} SkyImage;

static SkyImage sky_image(const Scene *scene)
{
    if (scene->sky.texture == 0) return (SkyImage){scene, NULL, SKY_CELL_COLUMNS, BLENDED_ROWS};
    const Image *image = &scene->textures.items[scene->sky.texture - 1].image;
    return (SkyImage){scene, image, image->width, image->height};
}

// A part of a row of the image.
typedef struct {
    uint32_t y;
    double solid_angle;     // of a texel's part
    double highest, lowest; // sines of latitudes
} SkyRow;

static double sine_at(const SkyImage *sky, double y)
{
    return portable_cosine(y * M_PI / sky->height);
}

// Returns the part of row y between the heights `top` and `bottom`, in rows from the image's top.
static SkyRow sky_row(const SkyImage *sky, uint32_t y, double top, double bottom)
{
    SkyRow row = {.y = y, .highest = sine_at(sky, top), .lowest = sine_at(sky, bottom)};
    row.solid_angle = 2 * M_PI * (row.highest - row.lowest) / sky->width;
    return row;
}

// Returns the color of blended colors at the sine of a latitude.
static Color blended_color(const Scene *scene, double sine)
{
    const Color pole = sine > 0 ? scene->sky.zenith : scene->sky.nadir;
    return vector_add(vector_scale(scene->background, 1 - fabs(sine)), vector_scale(pole, fabs(sine)));
}

static Color sky_texel(const Image *image, uint32_t x, uint32_t y)
{
    float color[3];
    image_light(image, (size_t)y * image->width + x, image->display, color);
    return (Color){(double)color[0], (double)color[1], (double)color[2]};
}

Color sky_mean(const Scene *scene)
{
    const SkyImage sky = sky_image(scene);
    Color sum = {0};
    for (uint32_t y = 0; y < sky.height; y++) {
        const SkyRow row = sky_row(&sky, y, y, y + 1.0);
        for (uint32_t x = 0; x < sky.width; x++)
            sum = vector_add(sum, vector_scale(sky_texel(sky.image, x, y), row.solid_angle));
    }
    return vector_scale(sum, scene->sky.intensity / (4 * M_PI));
}

// Returns the largest channel in a part of a row.
static double brightest(const SkyImage *sky, const SkyRow *row, uint32_t x)
{
    if (sky->image) return vector_largest(sky_texel(sky->image, x, row->y));
    return fmax(vector_largest(blended_color(sky->scene, row->highest)),
                vector_largest(blended_color(sky->scene, row->lowest)));
}

// Adds the light of a part of a row to its columns, raises their brightness to that of its texels and returns
// its light.
static double row_add(const SkyImage *sky, const SkyRow *row, double *light, double *brightness)
{
    double sum = 0;
    for (uint32_t x = 0; x < sky->width; x++) {
        const double bright = brightest(sky, row, x);
        light[x] += row->solid_angle * bright;
        brightness[x] = fmax(brightness[x], bright);
        sum += row->solid_angle * bright;
    }
    return sum;
}

// Returns whether an item has about as much light as those next to it.
static bool is_even(const double *light, size_t length, size_t item)
{
    enum { RATIO_MAX = 4 };
    const double before = light[item > 0 ? item - 1 : item],
                 after = light[item + 1 < length ? item + 1 : item];
    return fmax(before, fmax(light[item], after)) <= RATIO_MAX * fmin(before, fmin(light[item], after));
}

// Divides a line of items into parts of nearly equal light. Part i lies between edges[i] and edges[i + 1],
// in items. Next to items with another brightness, edges lie within an item only between parts that do so as
// a whole, because a part that spans a bright item and dark ones would seldom be sampled where it is bright.
// `light` has a value per item.
static void line_divide(const double *light, size_t length, double *edges, size_t part_count)
{
    double sum = 0, before = 0;
    size_t item = 0;
    for (size_t i = 0; i < length; i++)
        sum += light[i];
    for (size_t i = 0; i <= part_count; i++) {
        const double target = sum * (double)i / (double)part_count;
        while (item + 1 < length && before + light[item] <= target)
            before += light[item++];
        edges[i] = (double)item + (light[item] > 0 ? fmin((target - before) / light[item], 1) : 0);
    }
    edges[part_count] = (double)length;
    double last = -1; // the item of the edge before
    for (size_t i = 0; i < part_count; i++) {
        const double here = floor(edges[i]);
        const bool begins = here != last, ends = here != fmin(floor(edges[i + 1]), (double)length - 1);
        last = here;
        if (is_even(light, length, (size_t)fmin(here, (double)length - 1))) continue;
        if (begins && ends)
            edges[i] = rint(edges[i]);
        else if (begins || ends)
            edges[i] = begins ? here : here + 1;
    }
}

// Sets the cells of a row of them, by the columns of a row of the image with their light and their brightest
// texel. Returns the largest product of a cell's solid angle and color.
static double cells_set(SkyCell *cells, const SkyImage *sky, const SkyRow *row, const double *light,
                        const double *brightness)
{
    double edges[SKY_CELL_COLUMNS + 1], largest = 0;
    line_divide(light, sky->width, edges, SKY_CELL_COLUMNS);
    for (size_t i = 0; i < SKY_CELL_COLUMNS; i++) {
        cells[i] = (SkyCell){edges[i] / sky->width - 0.5, edges[i + 1] / sky->width - 0.5, row->lowest,
                             row->highest};
        const double solid_angle = row->solid_angle * (edges[i + 1] - edges[i]);
        for (size_t x = (size_t)edges[i]; (double)x < edges[i + 1]; x++)
            largest = fmax(largest, solid_angle * brightness[x]);
    }
    return largest;
}

void scene_add_sky_light(Scene *scene)
{
    const SkyImage sky = sky_image(scene);
    OWNED double *rows = memory_allocate(sky.height, sizeof *rows),
                 *light = memory_allocate_zeroed(sky.width, sizeof *light),
                 *brightness = memory_allocate_zeroed(sky.width, sizeof *brightness);
    double edges[SKY_CELL_ROWS + 1], largest = 0;
    for (uint32_t y = 0; y < sky.height; y++) {
        const SkyRow row = sky_row(&sky, y, y, y + 1.0);
        rows[y] = row_add(&sky, &row, light, brightness);
    }
    line_divide(rows, sky.height, edges, SKY_CELL_ROWS);
    scene->sky.cells = memory_allocate(SKY_CELL_ROWS * SKY_CELL_COLUMNS, sizeof *scene->sky.cells);
    for (size_t i = 0; i < SKY_CELL_ROWS; i++) {
        for (uint32_t x = 0; x < sky.width; x++)
            light[x] = brightness[x] = 0;
        for (uint32_t y = (uint32_t)edges[i]; y < edges[i + 1]; y++) {
            const SkyRow row = sky_row(&sky, y, fmax(y, edges[i]), fmin(y + 1.0, edges[i + 1]));
            row_add(&sky, &row, light, brightness);
        }
        const SkyRow cells_row = sky_row(&sky, 0, edges[i], edges[i + 1]);
        largest = fmax(
            largest, cells_set(scene->sky.cells + i * SKY_CELL_COLUMNS, &sky, &cells_row, light, brightness));
    }
    const double cell_count = SKY_CELL_ROWS * SKY_CELL_COLUMNS,
                 intensity = sky.image ? scene->sky.intensity : 1;
    if (largest * intensity < faint_light) return;
    // scaled so that a white surface that sees all of a uniform sky has the sky's color
    const Light sky_light = {.type = LIGHT_DIRECTIONAL,
                             .area.type = AREA_SKY,
                             .color = vector_all(largest * cell_count * intensity / M_PI),
                             .direction = vector_scale(scene->sky.up, -1)};
    scene->sky.cell_factor = 2 * M_PI / largest;
    array_push(scene->lights, sky_light);
}
