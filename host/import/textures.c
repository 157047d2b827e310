#include "host/import/textures.h"

#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/scene/sky.h"
#include <math.h>
#include <stdlib.h>

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

static float height_at(const Image *image, size_t x, size_t y)
{
    return image->values[(y * image->width + x) * image->channels];
}

static bool image_is_gray(const Image *image)
{
    const size_t count = image->channels < 3 ? 0 : (size_t)image->width * image->height;
    for (size_t i = 0; i < count; i++) {
        const float *value = image->values + i * image->channels;
        if (fabsf(value[0] - value[1]) > 0x1p-7F || fabsf(value[1] - value[2]) > 0x1p-7F) return false;
    }
    return true;
}

// Replaces heights with the normals of their slopes, where white is 1/50 of the image's width above black
// and a slope is the difference of the two neighbors (Blinn, Simulation of wrinkled surfaces, SIGGRAPH
// 1978).
static void normals_of_heights(Image *image)
{
    const size_t width = image->width, height = image->height;
    const double scale = (double)width / 50 / 2;
    float *normals = memory_allocate(3 * width * height, sizeof *normals);
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < width; x++) {
            const float right = height_at(image, (x + 1) % width, y),
                        left = height_at(image, (x + width - 1) % width, y),
                        above = height_at(image, x, (y + height - 1) % height),
                        below = height_at(image, x, (y + 1) % height);
            const Vector3 normal = vector_normalize(
                (Vector3){scale * ((double)left - right), scale * ((double)below - above), 1});
            float *encoded = normals + 3 * (y * width + x);
            encoded[0] = (float)(0.5 + 0.5 * normal.x);
            encoded[1] = (float)(0.5 + 0.5 * normal.y);
            encoded[2] = (float)(0.5 + 0.5 * normal.z);
        }
    free(image->values);
    image->values = normals;
    image->channels = 3;
}

static bool scene_texture_read(SceneTexture *texture, uint32_t max_pixels, MessageList *messages)
{
    const ImageReadOptions options = {.layer = texture->layer, .max_pixels = max_pixels};
    const Text *bytes = &texture->bytes;
    if (bytes->count > 0)
        return image_read_bytes(&texture->image, &(Source){texture->path, bytes->items, bytes->count},
                                &options, messages);
    const char *obstacle = file_obstacle(texture->path);
    if (obstacle) return message_error(messages, "cannot read '%s': %s", texture->path, obstacle);
    return image_read(&texture->image, texture->path, &options, messages);
}

static bool colors_are_finite(const Image *image)
{
    const size_t count = (size_t)image->width * image->height;
    for (size_t i = 0; i < count; i++)
        for (size_t channel = 0; channel < (image->channels < 3 ? 1 : 3); channel++)
            if (!isfinite(image->values[i * image->channels + channel])) return false;
    return true;
}

// Describes why an image cannot join a scene whose other images have `texel_count` texels. Returns NULL if
// it can. The caller frees it.
static char *image_problem(const Image *image, size_t texel_count)
{
    if (image->width > TEXTURE_SIDE_MAX || image->height > TEXTURE_SIDE_MAX)
        return text_format("has a side of more than %d texels", TEXTURE_SIDE_MAX);
    if ((size_t)image->width * image->height > TEXELS_MAX - texel_count)
        return text_format("brings the scene's textures to more than %d texels in total", TEXELS_MAX);
    if (image->integers) return text_format("is an array of integers; a texture needs the type <f4 or <f8");
    return colors_are_finite(image) ? NULL : text_format("has a color that is not finite");
}

// Decodes an image and adds its texels to the count. Moves its reader's messages to its place in the scene.
// Returns false if it cannot be used.
static bool texture_decode(SceneTexture *texture, size_t *texel_count, uint32_t max_pixels, Report *report)
{
    OwnedMessageList problems = {0};
    const bool is_read = texture->image.values || scene_texture_read(texture, max_pixels, &problems);
    for (size_t i = 0; i < problems.count; i++)
        report_message(report, problems.items[i].severity, texture->offset, "%s", problems.items[i].text);
    text_free(&texture->bytes);
    const Image *image = &texture->image;
    OWNED char *problem = is_read ? image_problem(image, *texel_count) : NULL;
    if (problem) report_error(report, texture->offset, "'%s' %s", texture->path, problem);
    if (!is_read || problem) return false;
    *texel_count += (size_t)image->width * image->height;
    if (!image->alpha && texture->content == TEXTURE_OPACITY) alpha_by_luminance(&texture->image);
    if (texture->content == TEXTURE_BUMPS && image_is_gray(image)) normals_of_heights(&texture->image);
    return true;
}

// Describes how a scene uses the alpha of an image.
typedef struct {
    bool is_ignored;   // a material shows the image as opaque, although its format does not ask for that
    bool cuts;         // a material has holes where alpha is low
    bool blends;       // those holes replace blending
    bool is_requested; // the scene's author asked for those holes
} AlphaUse;

// Returns the use of each image. The caller frees it.
static AlphaUse *alpha_uses(const Scene *scene)
{
    AlphaUse *uses = memory_allocate_zeroed(scene->textures.count + 1, sizeof *uses);
    uses[scene->sky.texture].is_ignored = true; // uses[0] stands for materials without an image
    for (size_t i = 0; i < scene->materials.count; i++) {
        const Material *material = &scene->materials.items[i];
        const uint32_t cutout = material->cutout.threshold > 0 ? material->cutout.texture : 0;
        uses[cutout].cuts = true;
        uses[cutout].blends |= material->cutout.blends;
        uses[cutout].is_requested |= !material->image.ignores_alpha;
        if (material->image.texture != cutout)
            uses[material->image.texture].is_ignored |= !material->image.ignores_alpha;
    }
    return uses;
}

// Returns whether a pixel is neither transparent nor opaque.
static bool is_translucent(const Image *image)
{
    const size_t count = image->alpha ? (size_t)image->width * image->height : 0;
    for (size_t i = 0; i < count; i++)
        if (image->alpha[i] > 0 && image->alpha[i] < 1) return true;
    return false;
}

// Returns the warning that an image's alpha requires, or NULL if it requires none.
static const char *alpha_warning(const Image *image, const AlphaUse *use)
{
    if (image->alpha && use->is_ignored) return "is ignored, so its transparent parts are opaque";
    if (use->cuts && use->blends && is_translucent(image))
        return "does not blend; the surface is cut out where it is below 0.5 and opaque elsewhere";
    return use->is_requested && !image->alpha ? "is 1 everywhere, so nothing is cut out" : NULL;
}

// Removes the holes of opaque images, so that kernels need not look for them.
static void cutouts_prune(Scene *scene)
{
    for (size_t i = 0; i < scene->materials.count; i++) {
        Material *material = &scene->materials.items[i];
        if (material->cutout.threshold == 0 || material->cutout.texture == 0) continue;
        if (!scene->textures.items[material->cutout.texture - 1].image.alpha)
            material->cutout.threshold = material->cutout.texture = 0;
    }
}

void textures_decode(Scene *scene, Report *report, const SceneOptions *options)
{
    OWNED AlphaUse *uses = alpha_uses(scene);
    size_t texel_count = 0;
    for (size_t i = 0; i < scene->textures.count && !report_is_full(report); i++) {
        SceneTexture *texture = &scene->textures.items[i];
        stage_begin(options->stage, "reading", texture->path, 0);
        if (!texture_decode(texture, &texel_count, options->max_pixels, report)) continue;
        const char *warning = alpha_warning(&texture->image, &uses[i + 1]);
        if (warning) report_warning(report, texture->offset, "the alpha of '%s' %s", texture->path, warning);
    }
    cutouts_prune(scene);
    if (report->error_count > 0) return;
    if (scene->sky.is_ambient) scene->ambient = sky_mean(scene);
    if (scene->sky.is_light) scene_add_sky_light(scene);
}
