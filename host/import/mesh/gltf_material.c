// Converts glTF's metallic-roughness materials to glint's (docs/scene-format.md) and reads their textures.
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/mesh/gltf.h"
#include "host/import/number.h"
#include "host/scene/portable.h"

#include <stdlib.h>
#include <string.h>

// The properties of a glTF material.
typedef struct {
    double base[4], emissive[3], emissive_strength;
    double metal, roughness, transmission, ior, thickness, cutoff;
    double attenuation[3], attenuation_distance; // the color left after the distance; DBL_MAX: clear
    GltfItem base_texture, emissive_texture;
    bool is_unlit;
} GltfSurface;

// A writer's float may round 1 up.
static const Range range_factor = {-1e-6, 1 + 1e-6, false, "from 0 to 1"};

// Reads a member of up to 4 numbers. Warns and keeps the defaults if one is out of range.
static void factors_read(Gltf *gltf, const GltfItem *item, const char *key, size_t count, const Range *range,
                         double *values)
{
    double read[4];
    memcpy(read, values, count * sizeof *read);
    if (!gltf_numbers(gltf, item, key, count, read)) return;
    for (size_t i = 0; i < count; i++) {
        if (range_holds(range, read[i])) continue;
        const GltfItem member = gltf_member(item, key);
        gltf_warn(gltf, &member, "must be %s, not %g; the default is used", range->must, read[i]);
        return;
    }
    memcpy(values, read, count * sizeof *read);
}

static void surface_read(Gltf *gltf, const GltfItem *item, GltfSurface *surface)
{
    *surface = (GltfSurface){.base = {1, 1, 1, 1},
                             .emissive_strength = 1,
                             .metal = 1,
                             .roughness = 1,
                             .ior = 1.5,
                             .cutoff = 0.5,
                             .attenuation = {1, 1, 1},
                             .attenuation_distance = DBL_MAX};
    const GltfItem pbr = gltf_object(gltf, item, "pbrMetallicRoughness"),
                   strength = gltf_extension(gltf, item, "KHR_materials_emissive_strength"),
                   glass = gltf_extension(gltf, item, "KHR_materials_transmission"),
                   ior = gltf_extension(gltf, item, "KHR_materials_ior"),
                   volume = gltf_extension(gltf, item, "KHR_materials_volume");
    surface->is_unlit = gltf_extension(gltf, item, "KHR_materials_unlit").json != NULL;
    surface->base_texture = gltf_object(gltf, &pbr, "baseColorTexture");
    surface->emissive_texture = gltf_object(gltf, item, "emissiveTexture");
    factors_read(gltf, &pbr, "baseColorFactor", 4, &range_factor, surface->base);
    factors_read(gltf, &pbr, "metallicFactor", 1, &range_factor, &surface->metal);
    factors_read(gltf, &pbr, "roughnessFactor", 1, &range_factor, &surface->roughness);
    factors_read(gltf, item, "emissiveFactor", 3, &range_not_negative, surface->emissive);
    factors_read(gltf, item, "alphaCutoff", 1, &range_not_negative, &surface->cutoff);
    factors_read(gltf, &strength, "emissiveStrength", 1, &range_not_negative, &surface->emissive_strength);
    factors_read(gltf, &glass, "transmissionFactor", 1, &range_factor, &surface->transmission);
    factors_read(gltf, &ior, "ior", 1, &range_not_negative, &surface->ior);
    factors_read(gltf, &volume, "thicknessFactor", 1, &range_not_negative, &surface->thickness);
    factors_read(gltf, &volume, "attenuationColor", 3, &range_factor, surface->attenuation);
    factors_read(gltf, &volume, "attenuationDistance", 1, &range_positive, &surface->attenuation_distance);
    const struct {
        const GltfItem *item;
        const char *key;
        const char *text;
    } losses[] = {
        {&pbr, "metallicRoughnessTexture", "metallic-roughness textures are ignored; the factors are used"},
        {item, "occlusionTexture", "occlusion textures are ignored; shadows come from the lights"}};
    for (size_t i = 0; i < COUNT_OF(losses); i++) {
        const GltfItem lost = gltf_member(losses[i].item, losses[i].key);
        if (lost.json) gltf_warn_once(gltf, &lost, losses[i].text);
    }
}

// Adds the image to the scene's textures. Returns 0 with a warning if it cannot be used.
static uint32_t gltf_image_add(Gltf *gltf, const GltfItem *image, TextureContent content)
{
    MeshDraft *draft = gltf->draft;
    const GltfItem uri = gltf_string(gltf, image, "uri");
    const char *text = json_string_value(uri.json);
    if (uri.is_wrong) return 0;
    if (text && strncmp(text, "data:", 5) != 0) {
        OWNED char *path = gltf_path(gltf, &uri);
        if (!path)
            gltf_warn(gltf, &uri, "must be a relative path or base64 data; %s", texture_fallback(content));
        return path ? draft_add_texture(draft, path, content, image->path) : 0;
    }
    if (!text && !gltf_member(image, "bufferView").json) {
        gltf_warn(gltf, image, "has no 'uri' or 'bufferView'; %s", texture_fallback(content));
        return 0;
    }
    Source bytes = {.bytes = ""};
    OwnedText decoded = {0};
    size_t stride;
    if (!text) gltf_view_read(gltf, image, "bufferView", &bytes, &stride);
    if (text && gltf_data_decode(&decoded, text))
        bytes = (Source){.bytes = text_c(&decoded), .length = decoded.count};
    return draft_add_embedded_texture(draft, &bytes, content, image->path);
}

static bool wrap_read(Gltf *gltf, const GltfItem *sampler, const char *key, TextureWrap *wrap)
{
    enum { REPEAT = 10497, CLAMP_TO_EDGE = 33071, MIRRORED_REPEAT = 33648 };
    size_t mode = REPEAT;
    if (!gltf_integer(gltf, sampler, key, REPEAT, MIRRORED_REPEAT, &mode)) return false;
    *wrap = mode == CLAMP_TO_EDGE     ? TEXTURE_CLAMPED
            : mode == MIRRORED_REPEAT ? TEXTURE_MIRRORED
                                      : TEXTURE_REPEATED;
    return true;
}

static void sampler_read(Gltf *gltf, const GltfItem *texture, GltfTexture *place)
{
    enum { NEAREST = 9728, LINEAR };
    size_t index = SIZE_MAX, filter = LINEAR;
    if (!gltf_index(gltf, texture, "sampler", "samplers", &index) || index == SIZE_MAX) return;
    const GltfItem sampler = gltf_entry(gltf, "samplers", index),
                   filter_item = gltf_member(&sampler, "magFilter");
    wrap_read(gltf, &sampler, "wrapS", &place->wraps[0]);
    wrap_read(gltf, &sampler, "wrapT", &place->wraps[1]);
    gltf_integer(gltf, &sampler, "magFilter", NEAREST, LINEAR, &filter);
    if (filter == NEAREST)
        gltf_warn_once(gltf, &filter_item,
                       "filtering by the nearest texel is not supported; texels are interpolated");
}

// Reads KHR_texture_transform, which scales, rotates counterclockwise as the image is seen, with v downward,
// and moves. The GLSL listing of its specification rotates the other way (KhronosGroup/glTF, issue 1563),
// unlike its text, its sample model and other programs.
static void uv_transform_read(Gltf *gltf, const GltfItem *info, GltfTexture *place)
{
    const GltfItem transform = gltf_extension(gltf, info, "KHR_texture_transform");
    double offset[2] = {0, 0}, scale[2] = {1, 1}, angle = 0;
    if (!gltf_numbers(gltf, &transform, "offset", 2, offset) ||
        !gltf_numbers(gltf, &transform, "scale", 2, scale) ||
        !gltf_numbers(gltf, &transform, "rotation", 1, &angle))
        return;
    gltf_integer(gltf, &transform, "texCoord", 0, UV_SETS_MAX, &place->uv_set);
    const double c = portable_cosine(angle), s = portable_sine(angle);
    const double rows[2][3] = {{c * scale[0], s * scale[1], offset[0]},
                               {-s * scale[0], c * scale[1], offset[1]}};
    memcpy(place->uv_rows, rows, sizeof rows);
}

// Sets the texture that a material names if it can be used.
static void gltf_texture_read(Gltf *gltf, const GltfItem *info, TextureContent content, GltfTexture *place)
{
    size_t index = SIZE_MAX, source = SIZE_MAX;
    if (!info->json || !gltf_index(gltf, info, "index", "textures", &index) || index == SIZE_MAX) return;
    const GltfItem texture = gltf_entry(gltf, "textures", index);
    if (!gltf_index(gltf, &texture, "source", "images", &source)) return;
    if (source == SIZE_MAX) {
        gltf_warn(gltf, &texture, "has no PNG or JPEG image; %s", texture_fallback(content));
        return;
    }
    if (!gltf_integer(gltf, info, "texCoord", 0, UV_SETS_MAX, &place->uv_set)) return;
    uv_transform_read(gltf, info, place);
    sampler_read(gltf, &texture, place);
    const GltfItem image = gltf_entry(gltf, "images", source);
    uint32_t *known = &gltf->images[2 * source + (content == TEXTURE_NORMALS)];
    if (*known == DRAFT_NONE) *known = gltf_image_add(gltf, &image, content);
    place->number = *known;
}

static double channels_mean(const double color[3])
{
    return (color[0] + color[1] + color[2]) / 3;
}

static double clamped(double value)
{
    return fmin(fmax(value, 0), 1);
}

// Sets a Phong highlight with the peak and about the width of a GGX highlight for light along the normal
// (Walter et al., Microfacet models for refraction through rough surfaces, EGSR 2007). Beyond the highlight
// a rough surface reflects diffusely and a smooth metal mirrors.
static void gloss_set(Gltf *gltf, const GltfItem *item, const GltfSurface *surface, Material *look)
{
    enum { SHININESS_MAX = 1 << 20 };
    const double metal = clamped(surface->metal), roughness = clamped(surface->roughness),
                 smooth = 1 - roughness;
    const double alpha = roughness * roughness;
    const Color base = {surface->base[0], surface->base[1], surface->base[2]},
                facing = vector_add(vector_scale(base, metal), vector_all(0.04 * (1 - metal)));
    look->diffuse = vector_all(1 - metal * smooth);
    look->specular.largest = alpha > 0 ? fmin(smooth * vector_largest(facing) / (4 * alpha * alpha), 1) : 1;
    look->shininess = fmin(0.5 / fmax(alpha * alpha, 1e-12) - 0.5, SHININESS_MAX);
    look->specular.tint = color_tint(facing);
    look->reflection.largest = clamped(metal * smooth * smooth * vector_largest(base));
    if (look->reflection.largest == 0) return;
    look->reflection.tint = color_tint(base);
    if (surface->base_texture.json)
        gltf_warn_once(gltf, item, "reflections of metals do not have the colors of a texture");
}

static const char unlit_tint[] = "an emitted texture is multiplied by the mean of its factors";

// Makes a texture emit light by reflecting an ambient light of 1, which no other material of the scene
// reflects. Returns false with a warning for a mesh of another scene, which has an ambient light.
static bool texture_can_emit(Gltf *gltf, const GltfItem *item, GltfMaterial *material, double ambient)
{
    material->texture_emits = gltf->draft->import->view != NULL;
    if (material->texture_emits) {
        gltf->draft->scene->ambient = vector_all(1);
        material->textured_ambient = ambient;
    } else {
        gltf_warn_once(gltf, item,
                       "textures emit light or are unlit only if the file is rendered as a scene; here "
                       "lights light them");
    }
    return material->texture_emits;
}

static void emission_set(Gltf *gltf, const GltfItem *item, const GltfSurface *surface, GltfMaterial *material)
{
    Material *look = &material->look;
    const double strength = surface->emissive_strength, *base = surface->base;
    const Color emission = {surface->emissive[0] * strength, surface->emissive[1] * strength,
                            surface->emissive[2] * strength};
    look->ambient = gltf->draft->import->view ? 0 : look->diffuse.x;
    material->textured_ambient = look->ambient * channels_mean(base);
    if (surface->is_unlit) {
        if (material->texture.number > 0 && !texture_can_emit(gltf, item, material, channels_mean(base)))
            return;
        if (material->texture.number > 0 && (base[0] != base[1] || base[1] != base[2]))
            gltf_warn_once(gltf, item, unlit_tint);
        look->emission = look->color;
        look->ambient = look->specular.largest = look->reflection.largest = 0;
        look->diffuse = vector_all(0);
        return;
    }
    if (vector_is_zero(emission)) return;
    // an emissive texture is shown if it is the only texture or the same as the base color texture
    const json_t *emissive = gltf_member(&surface->emissive_texture, "index").json,
                 *base_color = gltf_member(&surface->base_texture, "index").json;
    if (!emissive) {
        look->emission = emission;
        return;
    }
    if (!base_color && channels_mean(base) == 0)
        gltf_texture_read(gltf, &surface->emissive_texture, TEXTURE_COLORS, &material->texture);
    if (material->texture.number == 0 || (base_color && !json_equal(emissive, base_color))) {
        gltf_warn_once(gltf, item, "emission next to a different texture is not shown");
    } else if (texture_can_emit(gltf, item, material,
                                channels_mean((double[]){emission.x, emission.y, emission.z}))) {
        look->emission = emission;
        if (!vector_is_zero(color_tint(emission))) gltf_warn_once(gltf, item, unlit_tint);
    }
}

static void transparency_set(Gltf *gltf, const GltfItem *item, const GltfSurface *surface,
                             GltfMaterial *material)
{
    Material *look = &material->look;
    const GltfItem mode = gltf_string(gltf, item, "alphaMode");
    const char *name = json_string_value(mode.json);
    const bool is_mask = name && strcmp(name, "MASK") == 0, is_blend = name && strcmp(name, "BLEND") == 0;
    const double transmission = clamped(surface->transmission) * (1 - clamped(surface->metal)),
                 alpha = clamped(surface->base[3]);
    if (name && !is_mask && !is_blend && strcmp(name, "OPAQUE") != 0)
        gltf_warn(gltf, &mode, "must be OPAQUE, MASK or BLEND, not '%.20s'; OPAQUE is used", name);
    const double opacity = is_mask ? alpha >= surface->cutoff : is_blend ? alpha : 1;
    if (surface->base_texture.json && opacity > 0) {
        if (is_mask && surface->cutoff > 0) look->cutout.threshold = surface->cutoff / alpha;
        if (is_blend) look->cutout.threshold = CUTOUT_OF_BLENDED;
        look->cutout.blends = is_blend;
    }
    if (opacity < 1) {
        material_set_opacity(look, opacity);
        material->textured_ambient *= opacity;
        if (transmission > 0)
            gltf_warn_once(gltf, item,
                           "a material that is transparent by its alpha transmits no other light");
    } else if (transmission > 0) {
        const Material opaque = *look;
        material_set_opacity(look, 1 - transmission);
        material->textured_ambient *= 1 - transmission;
        look->specular = opaque.specular;
        look->reflection = opaque.reflection;
        look->emission = opaque.emission;
        look->transmission.largest *= fmin(vector_largest(look->color), 1);
        look->transmission.tint = color_tint(look->color);
        if (surface->base_texture.json)
            gltf_warn_once(gltf, item, "transmitted light does not have the colors of a texture");
        // without thickness a surface has no inside
        if (surface->thickness > 0 && surface->ior > 0) look->ior = surface->ior;
        if (surface->thickness > 0 && surface->attenuation_distance < DBL_MAX)
            look->absorption = color_absorption(
                (Color){surface->attenuation[0], surface->attenuation[1], surface->attenuation[2]},
                surface->attenuation_distance);
    }
}

// Composes two affine maps of the plane.
static void rows_multiply(double (*after)[3], double (*first)[3], double (*product)[3])
{
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 3; k++)
            product[i][k] =
                after[i][0] * first[0][k] + after[i][1] * first[1][k] + (k == 2 ? after[i][2] : 0);
}

// Sets the normal texture. A mesh stores the color texture's coordinates, with v upward. Those of the normal
// texture follow from them if both use one set.
static void normals_set(Gltf *gltf, const GltfItem *item, GltfMaterial *material)
{
    double upward[2][3] = {{1, 0, 0}, {0, -1, 1}};
    const GltfItem info = gltf_object(gltf, item, "normalTexture");
    GltfTexture *normals = &material->normals, *color = &material->texture;
    Material *look = &material->look;
    gltf_texture_read(gltf, &info, TEXTURE_NORMALS, normals);
    if (normals->number == 0) return;
    if (color->number == 0) {
        *color = *normals;
        color->number = 0;
    }
    double(*c)[3] = color->uv_rows;
    const double area = c[0][0] * c[1][1] - c[0][1] * c[1][0];
    if (normals->uv_set != color->uv_set || area == 0) {
        gltf_warn_once(gltf, &info,
                       "the normal texture is ignored, because its coordinates differ from the color's");
        normals->number = 0;
        return;
    }
    double back[2][3] = {{c[1][1] / area, -c[0][1] / area, (c[0][1] * c[1][2] - c[1][1] * c[0][2]) / area},
                         {-c[1][0] / area, c[0][0] / area, (c[1][0] * c[0][2] - c[0][0] * c[1][2]) / area}};
    double rows[2][3], from_upward[2][3];
    rows_multiply(back, upward, from_upward);
    rows_multiply(normals->uv_rows, from_upward, rows);
    rows_multiply(upward, rows, look->normal_map.rows);
    gltf_numbers(gltf, &info, "scale", 1, &look->normal_map.strength);
}

static void gltf_material_read(Gltf *gltf, const GltfItem *item, GltfMaterial *material)
{
    GltfSurface surface;
    gltf->is_optional = true;
    surface_read(gltf, item, &surface);
    *material = (GltfMaterial){.look = material_default(),
                               .name = json_string_value(gltf_member(item, "name").json),
                               .is_read = true,
                               .texture = {.uv_rows = {{1, 0, 0}, {0, 1, 0}}},
                               .normals = {.uv_rows = {{1, 0, 0}, {0, 1, 0}}},
                               .scene_index = {DRAFT_NONE, DRAFT_NONE}};
    Material *look = &material->look;
    look->image.ignores_alpha = true; // alphaMode decides
    for (int i = 0; i < 4; i++)
        surface.base[i] = fmax(surface.base[i], 0);
    gltf_texture_read(gltf, &surface.base_texture, TEXTURE_COLORS, &material->texture);
    look->color = (Color){surface.base[0], surface.base[1], surface.base[2]};
    gloss_set(gltf, item, &surface, look);
    emission_set(gltf, item, &surface, material);
    transparency_set(gltf, item, &surface, material);
    normals_set(gltf, item, material);
    gltf->is_optional = false;
}

GltfMaterial *gltf_material(Gltf *gltf, const GltfItem *primitive)
{
    const size_t count = gltf_count(gltf, "materials");
    size_t index = count;
    gltf->is_optional = true;
    gltf_index(gltf, primitive, "material", "materials", &index);
    GltfMaterial *material = &gltf->materials[index];
    const GltfItem item = gltf_entry(gltf, "materials", index);
    if (!material->is_read) gltf_material_read(gltf, &item, material);
    gltf->is_optional = false;
    return material;
}

// Multiplies the texture by the factors, which are the color of a primitive that does not show it.
uint32_t gltf_material_index(Gltf *gltf, GltfMaterial *material, bool is_textured)
{
    uint32_t *index = &material->scene_index[is_textured];
    if (*index != DRAFT_NONE) return *index;
    Material look = material->look;
    const bool is_colored = is_textured && material->texture.number > 0;
    if (!is_colored) look.cutout.threshold = 0;
    if (is_textured && material->normals.number > 0) {
        look.normal_map.texture = material->normals.number;
        memcpy(look.normal_map.wraps, material->normals.wraps, sizeof look.normal_map.wraps);
    }
    if (is_colored) {
        look.image.texture = look.cutout.texture = material->texture.number;
        look.ambient = material->textured_ambient;
        if (material->texture_emits) look.emission = vector_all(0);
        memcpy(look.image.wraps, material->texture.wraps, sizeof look.image.wraps);
        look.diffuse = vector_multiply(look.diffuse, look.color);
    }
    return *index = scene_add_material(gltf->draft->scene, &look, material->name ? material->name : "");
}
