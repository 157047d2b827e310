#include "host/compile/texture_mapping.h"

// Returns the eye's coordinate along a unit direction, in squares or textures of `size`, modulo `period` of
// them. Divides only the exact remainder, because a rounded quotient has no bits left within the period far
// from the origin.
static double eye_phase(const Flattening *flattening, Quad3 direction, double size, double period)
{
    const Quad along = quad3_dot(quad3(flattening->rounding.eye), direction);
    const long double length = (long double)period * (long double)size, high = (long double)along,
                      low = (long double)(along - high);
    return (double)(fmodl(fmodl(high, length) + fmodl(low, length), length) / (long double)size);
}

static scalar4 grid_axis(const Flattening *flattening, Quad3 direction, double size, double period)
{
    return scalar4_of(quad3_rounded(quad3_scale(direction, 1 / (Quad)size)),
                      eye_phase(flattening, direction, size, period));
}

// Returns the unit vector of an axis' part perpendicular to the unit normal.
static Quad3 axis_across(Vector3 axis, Quad3 unit_normal)
{
    const Quad3 wide = quad3(axis);
    return quad3_unit(quad3_subtract(wide, quad3_scale(unit_normal, quad3_dot(wide, unit_normal))));
}

// Returns the direction of a texture's top: upright on a wall, towards -z on a floor or a ceiling.
static Quad3 texture_up(Vector3 normal, Quad3 unit_normal)
{
    bool level = fabs(normal.y) >= fmax(fabs(normal.x), fabs(normal.z));
    return axis_across(level ? (Vector3){0, 0, -1} : (Vector3){0, 1, 0}, unit_normal);
}

void surface_grid(const Flattening *flattening, uint32_t material, Vector3 normal, scalar4 *u, scalar4 *v)
{
    const Material *look = &flattening->scene->materials.items[material];
    const uint32_t any = material_any_texture(look);
    if (any == 0 && !look->checker.is_on) return;
    const Quad3 unit = quad3_unit(quad3(axis_scaled(normal)));
    if (any > 0) {
        const CompiledTexture *texture = &flattening->compiled->textures[any - 1];
        double width = look->texture_size;
        Quad3 up = texture_up(normal, unit);
        *u = grid_axis(flattening, quad3_cross(up, unit), width, 1);
        *v = grid_axis(flattening, up, width * texture->height / texture->width, 1);
    } else {
        Quad3 across = axis_across(vector_least_aligned_axis(vector_normalize(normal)), unit);
        *u = grid_axis(flattening, across, look->checker.size, 2);
        *v = grid_axis(flattening, quad3_cross(unit, across), look->checker.size, 2);
    }
}

TriangleUvs triangle_uvs(const Mesh *mesh, const Vector3 vertices[3], const uint32_t *corners,
                         const CompiledTexture *texture)
{
    const double *a = mesh->uvs[corners[0]], *b = mesh->uvs[corners[1]], *c = mesh->uvs[corners[2]];
    // twice the areas, in texels and in the scene
    double texels = fabs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) * texture->width *
                    texture->height;
    double area = vector_length(triangle_normal(vertices[0], vertices[1], vertices[2]));
    return (TriangleUvs){{a[0], a[1], b[0], b[1]}, {c[0], c[1], area > 0 ? sqrt(texels / area) : 0, 0}};
}
