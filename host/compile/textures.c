#include "host/compile/stages.h"

#include "host/base/array.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/image/image.h"
#include "host/image/srgb.h"
#include "host/scene/portable.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// SIDE_MAX: a position in float, 24 bits, cannot resolve a texel of a longer side. TEXELS_MAX: a kernel
// counts the texels of all textures in 32 bits.
enum { SIDE_MAX = 1 << 16, TEXELS_MAX = 1 << 28 };

typedef struct {
    uint32_t width, height;
    float (*colors)[3];
    float *alpha; // of each texel in the first level of a texture with transparent ones; else NULL
} Level;

typedef struct {
    struct {
        Level *items;
        size_t count, capacity;
    } levels; // of all textures, one after another
    size_t texel_count;
} LevelList;

static Level level_open(uint32_t width, uint32_t height)
{
    return (Level){width, height, memory_allocate((size_t)width * height, sizeof(float[3])), NULL};
}

static void levels_free(LevelList *list)
{
    for (size_t i = 0; i < list->levels.count; i++) {
        free(list->levels.items[i].colors);
        free(list->levels.items[i].alpha);
    }
    free(list->levels.items);
}

// A line of texels re-divided: `part` from 0 to `count` covers the old texels first .. last, the outer ones
// in part.
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

// Half as many texels in each dimension, rounded up; each is the mean of what it covers, so that the
// texture's mean stays.
static Level level_halved(const Level *fine)
{
    Level coarse = level_open(half_of(fine->width), half_of(fine->height));
    for (uint32_t y = 0; y < coarse.height; y++) {
        Span rows = span_of(y, coarse.height, fine->height);
        for (uint32_t x = 0; x < coarse.width; x++) {
            Span columns = span_of(x, coarse.width, fine->width);
            double sum[3] = {0};
            for (uint32_t row = rows.first; row <= rows.last; row++) {
                for (uint32_t column = columns.first; column <= columns.last; column++) {
                    const float *color = fine->colors[(size_t)row * fine->width + column];
                    double weight = span_covers(&rows, row) * span_covers(&columns, column);
                    for (size_t channel = 0; channel < 3; channel++)
                        sum[channel] += weight * (double)color[channel];
                }
            }
            double area = (rows.end - rows.start) * (columns.end - columns.start);
            float *color = coarse.colors[(size_t)y * coarse.width + x];
            for (size_t channel = 0; channel < 3; channel++)
                color[channel] = (float)(sum[channel] / area);
        }
    }
    return coarse;
}

// Light below 0, which the filters of other programs leave, counts as none.
static bool level_fill(Level *level, const Image *image, bool decodes)
{
    size_t count = (size_t)image->width * image->height;
    for (size_t i = 0; i < count; i++) {
        for (size_t channel = 0; channel < 3; channel++) {
            float value = image->values[i * image->channels + (image->channels < 3 ? 0 : channel)];
            if (!isfinite(value)) return false;
            level->colors[i][channel] = decodes ? (float)srgb_decode((double)value) : fmaxf(value, 0);
        }
    }
    return true;
}

// Moves the image's alpha to the first level. Returns what is wrong with the image, or NULL.
static const char *levels_add(LevelList *list, Image *image, bool as_displayed)
{
    if (image->width > SIDE_MAX || image->height > SIDE_MAX) return "a side of more than 65536 texels";
    if ((size_t)image->width * image->height > TEXELS_MAX - list->texel_count)
        return "too many texels in all textures";
    Level level = level_open(image->width, image->height);
    level.alpha = image->alpha;
    image->alpha = NULL;
    array_push(list->levels, level);
    if (!level_fill(&level, image, image->display && !as_displayed)) return "a color is not finite";
    list->texel_count += (size_t)level.width * level.height;
    while (level.width > 1 || level.height > 1) {
        level = level_halved(&level);
        array_push(list->levels, level);
        list->texel_count += (size_t)level.width * level.height;
    }
    return list->texel_count > TEXELS_MAX ? "too many texels in all textures" : NULL;
}

// Sets the alpha of an opaque image to the luminance of its values, as they are stored.
static void alpha_by_luminance(Image *image)
{
    const size_t count = (size_t)image->width * image->height;
    image->alpha = memory_allocate(count, sizeof *image->alpha);
    for (size_t i = 0; i < count; i++) {
        const float *value = image->values + i * image->channels;
        const float luminance =
            image->channels < 3 ? value[0] : 0.2126F * value[0] + 0.7152F * value[1] + 0.0722F * value[2];
        image->alpha[i] = luminance < 1 ? fmaxf(luminance, 0) : 1;
    }
}

static bool texture_read(Image *image, const SceneTexture *texture, MessageList *messages)
{
    const Text *bytes = &texture->bytes;
    if (bytes->count > 0)
        return image_read_bytes(image, &(Source){texture->path, bytes->items, bytes->count}, messages);
    const char *obstacle = file_obstacle(texture->path);
    if (obstacle) return message_error(messages, "cannot read '%s': %s", texture->path, obstacle);
    return image_read_layer(image, texture->path, texture->layer, messages);
}

// A coarser level's texels are means.
static float largest_texel(const Level *level)
{
    float largest = 0;
    for (size_t i = 0; i < (size_t)level->width * level->height; i++)
        largest = fmaxf(largest, fmaxf(level->colors[i][0], fmaxf(level->colors[i][1], level->colors[i][2])));
    return largest;
}

// A row's share of the directions is the difference of the sines of its edges' latitudes.
static Color sky_mean(const Level *level)
{
    Color mean = {0};
    double below = 1;
    for (uint32_t y = 0; y < level->height; y++) {
        const double above = below;
        below = portable_cosine((y + 1) * M_PI / level->height);
        const double share = (above - below) / 2 / level->width;
        for (uint32_t x = 0; x < level->width; x++) {
            const float *color = level->colors[(size_t)y * level->width + x];
            mean = vector_add(mean, vector_scale((Color){color[0], color[1], color[2]}, share));
        }
    }
    return mean;
}

// Sets which textures cut out parts of surfaces.
static void cutouts_find(CompiledTexture *textures, const Scene *scene)
{
    for (size_t i = 0; i < scene->materials.count; i++) {
        const Material *material = &scene->materials.items[i];
        if (material->cutout > 0 && material->cutout_texture > 0)
            textures[material->cutout_texture - 1].cuts = true;
    }
}

// Returns whether a texel is neither transparent nor opaque.
static bool level_is_translucent(const Level *level)
{
    const size_t count = level->alpha ? (size_t)level->width * level->height : 0;
    for (size_t i = 0; i < count; i++)
        if (level->alpha[i] > 0 && level->alpha[i] < 1) return true;
    return false;
}

// Warns of alpha that is not shown, and of a cutout by an opaque image.
static void alpha_check(const Scene *scene, const SceneTexture *texture, const Level *level, bool cuts,
                        MessageList *messages)
{
    const Source source = scene_source(scene);
    const char *what = NULL;
    if (cuts && texture->alpha_blends && level_is_translucent(level))
        what = "does not blend: below 0.5 the surface is cut out, elsewhere it is opaque";
    if (!texture->ignores_alpha && level->alpha && !cuts)
        what = "is ignored: its transparent parts are opaque";
    if (!texture->ignores_alpha && !level->alpha && cuts) what = "is 1 everywhere: nothing is cut out";
    if (what)
        message_add_at(messages, MESSAGE_WARNING, &source, texture->offset, "the alpha of '%s' %s",
                       texture->path, what);
}

static bool texture_add(LevelList *list, CompiledTexture *texture, const Scene *scene,
                        const SceneTexture *scene_texture, MessageList *messages)
{
    const uint32_t first_level = (uint32_t)list->levels.count;
    const Source source = scene_source(scene);
    Image image = {0};
    MessageList problems = {0};
    bool done = texture_read(&image, scene_texture, &problems);
    if (done) {
        if (!image.alpha && scene_texture->alpha_by_luminance) alpha_by_luminance(&image);
        const char *problem = levels_add(list, &image, scene->color_meaning == COLORS_DISPLAY);
        done = !problem;
        if (done) {
            const Level *first = &list->levels.items[first_level];
            *texture = (CompiledTexture){.width = first->width,
                                         .height = first->height,
                                         .first_level = first_level,
                                         .level_count = (uint32_t)list->levels.count - first_level,
                                         .cuts = texture->cuts,
                                         .has_alpha = first->alpha != NULL,
                                         .largest_texel = largest_texel(first),
                                         .sky_mean = sky_mean(first)};
            alpha_check(scene, scene_texture, first, texture->cuts, messages);
        }
        image_free(&image);
        if (problem)
            message_add_at(messages, MESSAGE_ERROR, &source, scene_texture->offset, "cannot use '%s': %s",
                           scene_texture->path, problem);
    }
    for (size_t i = 0; i < problems.count; i++)
        message_add_at(messages, problems.items[i].severity, &source, scene_texture->offset, "%s",
                       problems.items[i].text);
    message_list_free(&problems);
    return done;
}

bool textures_cut(const CompiledScene *compiled, const Scene *scene)
{
    for (size_t i = 0; i < scene->textures.count; i++)
        if (compiled->textures[i].cuts && compiled->textures[i].has_alpha) return true;
    return false;
}

static void texels_flatten(CompiledScene *compiled, const LevelList *list)
{
    flat_array_renew(compiled, FLAT_TEXELS, list->texel_count);
    Texel *texel = compiled->arrays[FLAT_TEXELS].items;
    for (size_t i = 0; i < list->levels.count; i++) {
        const Level *level = &list->levels.items[i];
        for (size_t k = 0; k < (size_t)level->width * level->height; k++, texel++) {
            memcpy(&texel->color, level->colors[k], sizeof level->colors[k]);
            if (level->alpha) memcpy(&texel->color.w, &level->alpha[k], sizeof level->alpha[k]);
        }
    }
}

static void levels_flatten(CompiledScene *compiled, size_t texture_count)
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
}

bool textures_load(CompiledScene *compiled, const Scene *scene, const CompileSettings *settings,
                   MessageList *messages)
{
    LevelList list = {0};
    compiled->textures = memory_allocate_zeroed(scene->textures.count + 1, sizeof *compiled->textures);
    if (settings->textures) {
        memcpy(compiled->textures, settings->textures, scene->textures.count * sizeof *compiled->textures);
        levels_flatten(compiled, scene->textures.count);
        return true;
    }
    bool done = true;
    cutouts_find(compiled->textures, scene);
    for (size_t i = 0; i < scene->textures.count && done; i++) {
        stage_begin(settings->stage, "reading", scene->textures.items[i].path, 0);
        done = texture_add(&list, &compiled->textures[i], scene, &scene->textures.items[i], messages);
    }
    if (done) {
        levels_flatten(compiled, scene->textures.count);
        texels_flatten(compiled, &list);
    }
    levels_free(&list);
    return done;
}
