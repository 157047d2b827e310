#include "host/compile/compile.h"
#include "host/compile/stages.h"

#include <float.h>
#include <math.h>

// The most that rounding in shading may add to a color that is bounded in exact arithmetic.
static const double shading_slack = 1.01;

static Color background_max(const CompiledScene *compiled, const Scene *scene)
{
    if (scene->sky.texture > 0)
        return vector_all(compiled->textures[scene->sky.texture - 1].largest_texel * scene->sky.intensity);
    return vector_max(scene->background, vector_max(scene->sky.zenith, scene->sky.nadir));
}

// Returns what a material emits and reflects at most: of the ambient light, and of all lights at once.
static Color material_color_max(const CompiledScene *compiled, const Scene *scene, const Material *material,
                                Color light_sum)
{
    Color color = material->color;
    if (material->checker.is_on) color = vector_max(material->checker.colors[0], material->checker.colors[1]);
    if (material->image.texture > 0)
        color = vector_all(compiled->textures[material->image.texture - 1].largest_texel);
    const Color ambient = vector_scale(vector_multiply(scene->ambient, color), material->ambient);
    const Color factor =
        vector_add(vector_multiply(material->diffuse, color), vector_all(material->specular.largest));
    return vector_add(vector_add(material->emission, ambient), vector_multiply(light_sum, factor));
}

double scene_color_max(const CompiledScene *compiled, const Scene *scene, uint32_t bounces)
{
    Color light_sum = {0}, seen = {0};
    for (size_t i = 0; i < scene->lights.count; i++) {
        const Light *light = &scene->lights.items[i];
        if (vector_is_zero(light->color)) continue;
        const double nearest = light_fades(light) ? 1 / light->fading[0] : 1;
        if (nearest > DBL_MAX) return INFINITY;
        light_sum = vector_add(light_sum, vector_scale(light->color, nearest));
    }
    // `seen` bounds what a ray sees that may bounce `left` more times: the background, or a material's color
    // plus what its reflected and refracted rays see.
    for (uint32_t left = 0; left <= bounces; left++) {
        const Color before = seen;
        seen = vector_max(seen, background_max(compiled, scene));
        for (size_t i = 0; i < scene->materials.count; i++) {
            const Material *material = &scene->materials.items[i];
            const Color passed =
                vector_scale(before, material->reflection.largest + material->transmission.largest);
            seen = vector_max(seen,
                              vector_add(material_color_max(compiled, scene, material, light_sum), passed));
        }
        if (left > 0 && vectors_equal(seen, before)) break;
    }
    return shading_slack * vector_largest(seen);
}
