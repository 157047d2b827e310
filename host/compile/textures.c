#include "host/compile/stages.h"

#include "host/base/memory.h"
#include "host/image/srgb.h"
#include <math.h>
#include <string.h>

static void texel_set(Texel *texel, const float color[3])
{
    memcpy(&texel->color, color, sizeof(float[3]));
}

static void texel_color(const Texel *texel, float color[3])
{
    memcpy(color, &texel->color, sizeof(float[3]));
}

// The old texels first .. last that one new texel covers, from `start` to `end`, the outer ones partly.
typedef struct {
    double start, end;
    uint32_t first, last;
} Span;

static Span span_of(uint32_t part, uint32_t parts, uint32_t count)
{
    Span span = {(double)part * count / parts, (double)(part + 1) * count / parts, 0, 0};
    span.first = (uint32_t)span.start;
    span.last = (uint32_t)ceil(span.end) - 1;
    return span;
}

static double span_covers(const Span *span, uint32_t texel)
{
    return fmin(span->end, texel + 1.0) - fmax(span->start, texel);
}

static uint32_t half_of(uint32_t side)
{
    return (side + 1) / 2;
}

// Returns how many levels lead from the full size to a single texel.
static uint32_t level_count_of(uint32_t width, uint32_t height)
{
    uint32_t count = 1;
    for (; width > 1 || height > 1; count++) {
        width = half_of(width);
        height = half_of(height);
    }
    return count;
}

// Halves the number of texels in each dimension, rounded up. Each is the mean of those that it covers, which
// preserves the texture's mean.
static void level_halve(Texel *coarse, const Texel *fine, uint32_t fine_width, uint32_t fine_height)
{
    const uint32_t width = half_of(fine_width), height = half_of(fine_height);
    for (uint32_t y = 0; y < height; y++) {
        Span rows = span_of(y, height, fine_height);
        for (uint32_t x = 0; x < width; x++) {
            Span columns = span_of(x, width, fine_width);
            double sum[3] = {0};
            float color[3];
            for (uint32_t row = rows.first; row <= rows.last; row++) {
                for (uint32_t column = columns.first; column <= columns.last; column++) {
                    double weight = span_covers(&rows, row) * span_covers(&columns, column);
                    texel_color(&fine[(size_t)row * fine_width + column], color);
                    for (size_t channel = 0; channel < 3; channel++)
                        sum[channel] += weight * (double)color[channel];
                }
            }
            double area = (rows.end - rows.start) * (columns.end - columns.start);
            for (size_t channel = 0; channel < 3; channel++)
                color[channel] = (float)(sum[channel] / area);
            texel_set(&coarse[(size_t)y * width + x], color);
        }
    }
}

// Fills the first level.
static void level_fill(Texel *texels, const Image *image, bool decodes)
{
    size_t count = (size_t)image->width * image->height;
    for (size_t i = 0; i < count; i++) {
        float color[3];
        image_light(image, i, decodes, color);
        texel_set(&texels[i], color);
        if (image->alpha) memcpy(&texels[i].color.w, &image->alpha[i], sizeof image->alpha[i]);
    }
}

// Returns the largest texel of a full-size level. Coarser levels are means.
static float largest_texel(const Texel *texels, size_t count)
{
    float largest = 0, color[3];
    for (size_t i = 0; i < count; i++) {
        texel_color(&texels[i], color);
        largest = fmaxf(largest, fmaxf(color[0], fmaxf(color[1], color[2])));
    }
    return largest;
}

// Lists the levels of each texture, down to a single texel. Returns how many texels they have in all.
static size_t levels_flatten(CompiledScene *compiled, size_t texture_count)
{
    size_t level_count = 0;
    for (size_t i = 0; i < texture_count; i++)
        level_count += compiled->textures[i].level_count;
    flat_array_renew(compiled, FLAT_TEXTURE_LEVELS, level_count);
    TextureLevel *level = compiled->arrays[FLAT_TEXTURE_LEVELS].items;
    uint32_t first = 0;
    for (size_t i = 0; i < texture_count; i++) {
        uint32_t width = compiled->textures[i].width, height = compiled->textures[i].height;
        for (uint32_t k = 0; k < compiled->textures[i].level_count; k++) {
            *level++ = (TextureLevel){{first, width, height, 0}};
            first += width * height;
            width = half_of(width);
            height = half_of(height);
        }
    }
    return first;
}

static void texels_flatten(CompiledScene *compiled, const Scene *scene)
{
    Texel *texels = compiled->arrays[FLAT_TEXELS].items;
    const TextureLevel *levels = compiled->arrays[FLAT_TEXTURE_LEVELS].items;
    for (size_t i = 0; i < scene->textures.count; i++) {
        CompiledTexture *texture = &compiled->textures[i];
        const TextureLevel *level = &levels[texture->first_level];
        const Image *image = &scene->textures.items[i].image;
        Texel *fine = texels + level->range.x;
        level_fill(fine, image,
                   image->display && scene->textures.items[i].content < TEXTURE_NORMALS &&
                       scene->color_meaning != COLORS_DISPLAY);
        texture->largest_texel = largest_texel(fine, (size_t)image->width * image->height);
        for (uint32_t k = 1; k < texture->level_count; k++)
            level_halve(texels + level[k].range.x, texels + level[k - 1].range.x, level[k - 1].range.y,
                        level[k - 1].range.z);
    }
}

void textures_flatten(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings)
{
    const size_t count = scene->textures.count;
    compiled->textures = memory_allocate_zeroed(count, sizeof *compiled->textures);
    if (settings->textures) {
        memcpy(compiled->textures, settings->textures, count * sizeof *compiled->textures);
        levels_flatten(compiled, count);
        return;
    }
    uint32_t level_count = 0;
    for (size_t i = 0; i < count; i++) {
        const Image *image = &scene->textures.items[i].image;
        compiled->textures[i] = (CompiledTexture){.width = image->width,
                                                  .height = image->height,
                                                  .first_level = level_count,
                                                  .level_count = level_count_of(image->width, image->height)};
        level_count += compiled->textures[i].level_count;
    }
    flat_array_renew(compiled, FLAT_TEXELS, levels_flatten(compiled, count));
    texels_flatten(compiled, scene);
}
