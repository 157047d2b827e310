#include "host/compile/stages.h"
#include "host/scene/portable.h"

#include <float.h>
#include <string.h>

_Static_assert((int)WRAP_CLAMPED == TEXTURE_CLAMPED && (int)WRAP_MIRRORED == TEXTURE_MIRRORED,
               "the kernels' values are the scene's");

static uint4 optical_depth_of(double transmission)
{
    if (transmission == 0) return (uint4){OPAQUE, 0, 0, 0};
    const double log2_loss = fmin(-portable_log2(transmission), PASSING_DEPTH_MAX);
    uint64_t fine = (uint64_t)llround(ldexp(log2_loss, 48));
    return (uint4){(uint32_t)llround(ldexp(log2_loss, 24)), (uint32_t)fine, (uint32_t)(fine >> 32), 0};
}

// Returns a part that no precision rounds to 0, which would end the path.
static double part_of_light(double part)
{
    return part > 0 ? fmax(part, FLT_MIN) : 0;
}

// Returns a density whose products with lengths are in range. Times the largest length of
// kernels/shading/medium.h it is at least 2^10, of which exp makes 0.
static double density_of(double absorption, bool is_double)
{
    const double largest = is_double ? 0x1p500 : 0x1p60;
    return absorption > 0 ? fmin(fmax(absorption, 0x1p10 / largest), largest) : 0;
}

static scalar4 conductor_real(const Material *material)
{
    const Color n = material->conductor.n, k = material->conductor.k;
    return scalar4_of(vector_subtract(vector_multiply(n, n), vector_multiply(k, k)), n.x > 0);
}

static scalar4 conductor_imaginary_squared(const Material *material)
{
    const Color root = vector_scale(vector_multiply(material->conductor.n, material->conductor.k), 2);
    return scalar4_of(vector_multiply(root, root), 0);
}

static uint4 cutout_of(const CompiledScene *compiled, const Material *material)
{
    if (material->cutout.threshold == 0 || material->cutout.texture == 0) return (uint4){0, 0, 0, 0};
    const CompiledTexture *texture = &compiled->textures[material->cutout.texture - 1];
    const float threshold = (float)material->cutout.threshold;
    uint4 cutout = {1 + texture->first_level, 0, material->image.wraps[0], material->image.wraps[1]};
    memcpy(&cutout.y, &threshold, sizeof threshold);
    return cutout;
}

static uint4 texture_of(const CompiledScene *compiled, uint32_t number, const TextureWrap wraps[2])
{
    const CompiledTexture *texture = &compiled->textures[number - 1];
    return (uint4){1 + texture->first_level, texture->level_count, wraps[0], wraps[1]};
}

// Sets the normal map. `any` is the texture whose texels define the surface's texel density.
static void normal_map_set(FlatMaterial *flat, const CompiledScene *compiled, const Material *material,
                           const CompiledTexture *any)
{
    const CompiledTexture *map = &compiled->textures[material->normal_map.texture - 1];
    const double(*rows)[3] = material->normal_map.rows;
    const double area = fabs(rows[0][0] * rows[1][1] - rows[0][1] * rows[1][0]),
                 texels = (double)map->width * map->height / ((double)any->width * any->height);
    flat->normal_map = texture_of(compiled, material->normal_map.texture, material->normal_map.wraps);
    // larger ones would overflow when squared; with this one, the normal already lies in the surface
    const double strength_max = 1e8,
                 strength = fmax(fmin(material->normal_map.strength, strength_max), -strength_max);
    flat->normal_u = (scalar4){rows[0][0], rows[0][1], rows[0][2], strength};
    flat->normal_v = (scalar4){rows[1][0], rows[1][1], rows[1][2], sqrt(area * texels)};
}

void materials_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding)
{
    flat_array_renew(compiled, FLAT_MATERIALS, scene->materials.count);
    FlatMaterial *materials = compiled->arrays[FLAT_MATERIALS].items;
    for (size_t i = 0; i < scene->materials.count; i++) {
        const Material *material = &scene->materials.items[i];
        double size = material->checker.size;
        Vector3 eye = rounding->eye;
        const Color passed = material_passing(material);
        materials[i] = (FlatMaterial){
            .color = scalar4_of(material->checker.is_on ? material->checker.colors[0] : material->color,
                                material->ambient),
            .diffuse = scalar4_of(material->diffuse, material->specular.largest),
            .other_color = scalar4_of(material->checker.colors[1], material->shininess),
            .reflection_transmission_ior = {part_of_light(material->reflection.largest),
                                            part_of_light(material->transmission.largest), material->ior, 0},
            .reflection_tint = scalar4_of(tint_factors(material->reflection.tint), material->fresnel),
            .specular_tint = scalar4_of(tint_factors(material->specular.tint), 0),
            .transmission_tint = scalar4_of(tint_factors(material->transmission.tint), 0),
            .emission = scalar4_of(material->emission, 0),
            .absorption = {density_of(material->absorption.x, rounding->is_double),
                           density_of(material->absorption.y, rounding->is_double),
                           density_of(material->absorption.z, rounding->is_double), 0},
            .conductor_real = conductor_real(material),
            .conductor_imaginary_squared = conductor_imaginary_squared(material),
            .optical_depth = optical_depth_of(passed.x),
            .optical_depth_green = optical_depth_of(passed.y),
            .optical_depth_blue = optical_depth_of(passed.z),
        };
        if (material->checker.is_on) // the remainders are exact, quotients far from the origin are not
            materials[i].grid = (scalar4){fmod(eye.x, 2 * size) / size, fmod(eye.y, 2 * size) / size,
                                          fmod(eye.z, 2 * size) / size, 1 / size};
        materials[i].cutout = cutout_of(compiled, material);
        if (material_any_texture(material) == 0) continue;
        const CompiledTexture *any = &compiled->textures[material_any_texture(material) - 1];
        materials[i].reflection_transmission_ior.w = any->width / material->texture_size;
        if (material->image.texture > 0)
            materials[i].texture = texture_of(compiled, material->image.texture, material->image.wraps);
        if (material->normal_map.texture > 0) normal_map_set(&materials[i], compiled, material, any);
    }
}
