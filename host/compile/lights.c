#include "host/compile/stages.h"
#include "host/scene/portable.h"

_Static_assert((int)LIGHT_POINT == LIGHT_TYPE_POINT && (int)LIGHT_DIRECTIONAL == LIGHT_TYPE_DIRECTIONAL &&
                   (int)LIGHT_SPOT == LIGHT_TYPE_SPOT,
               "types of lights have the kernels' numbers");
_Static_assert((int)AREA_NONE == LIGHT_AREA_NONE && (int)AREA_RECTANGLE == LIGHT_AREA_RECTANGLE &&
                   (int)AREA_ELLIPSE == LIGHT_AREA_ELLIPSE && (int)AREA_SPHERE == LIGHT_AREA_SPHERE &&
                   (int)AREA_TRIANGLE == LIGHT_AREA_TRIANGLE && (int)AREA_SKY == LIGHT_AREA_SKY,
               "areas of lights have the kernels' numbers");

// Returns 1 - cos of an angle in degrees, without cancellation.
static double versine(double degrees)
{
    double half = portable_sine(degrees * (M_PI / 360));
    return 2 * half * half;
}

void lights_flatten(CompiledScene *compiled, const Scene *scene, const Rounding *rounding)
{
    flat_array_renew(compiled, FLAT_LIGHTS, scene->lights.count);
    FlatLight *lights = compiled->arrays[FLAT_LIGHTS].items;
    for (size_t i = 0; i < scene->lights.count; i++) {
        const Light *light = &scene->lights.items[i];
        lights[i] = (FlatLight){.color = scalar4_of(light->color, vector_largest(light->color)),
                                .type = {.x = (uint32_t)light->type, .y = (uint32_t)light->area.type}};
        if (light->area.type != AREA_NONE) {
            const double factor = light->area.type == AREA_SKY ? scene->sky.cell_factor : light->area.radius;
            const double unit = light->type == LIGHT_DIRECTIONAL ? 1 / vector_length(light->direction) : 1;
            lights[i].across_u = scalar4_of(vector_scale(light->area.across[0], unit), factor);
            lights[i].across_v = scalar4_of(vector_scale(light->area.across[1], unit), 0);
        }
        lights[i].fading =
            (scalar4){light_fades(light) ? light->fading[0] : 1, light->fading[1], light->fading[2], 0};
        if (light->type != LIGHT_DIRECTIONAL)
            lights[i].position = scalar4_of(point_from_eye(rounding, light->position), 0);
        if (light->type != LIGHT_POINT)
            lights[i].direction = scalar4_of(vector_normalize(light->direction), 0);
        if (light->type == LIGHT_SPOT) {
            double outer = versine(light->spot.half_angle),
                   inner = versine(light->spot.half_angle - light->spot.penumbra);
            lights[i].cone = (scalar4){outer, inner, outer > inner ? 1 / (outer - inner) : 0, 0};
        }
    }
}

void sky_cells_flatten(CompiledScene *compiled, const Scene *scene)
{
    flat_array_renew(compiled, FLAT_SKY_CELLS,
                     scene->sky.cells ? (size_t)SKY_CELL_ROWS * SKY_CELL_COLUMNS : 0);
    FlatSkyCell *cells = compiled->arrays[FLAT_SKY_CELLS].items;
    for (size_t i = 0; i < compiled->arrays[FLAT_SKY_CELLS].count; i++) {
        const SkyCell *cell = &scene->sky.cells[i];
        cells[i].range = (scalar4){cell->longitude_begin, cell->longitude_end - cell->longitude_begin,
                                   cell->sine_begin, cell->sine_end - cell->sine_begin};
    }
}
