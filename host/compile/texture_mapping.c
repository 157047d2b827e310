#include "host/compile/texture_mapping.h"

// Where the eye is along a direction, in squares or textures of `size`, modulo `period`, which keeps the bits
// far from the origin.
static double eye_phase(const Flattening *flattening, Vector3 direction, double size, double period)
{
    return fmod(vector_dot(flattening->rounding.eye, direction) / size, period);
}

static scalar4 texture_axis(const Flattening *flattening, Vector3 direction, double size)
{
    return (scalar4){direction.x / size, direction.y / size, direction.z / size,
                     eye_phase(flattening, direction, size, 1)};
}

static scalar4 checker_axis(const Flattening *flattening, Vector3 direction, double size)
{
    return scalar4_of(vector_scale(direction, 1 / size), eye_phase(flattening, direction, size, 2));
}

// The part of an axis across the unit normal, unit.
static Vector3 axis_across(Vector3 axis, Vector3 unit_normal)
{
    return vector_normalize(vector_subtract(axis, vector_scale(unit_normal, vector_dot(axis, unit_normal))));
}

// A texture stands upright on a wall; on a floor or a ceiling its top lies towards -z.
static Vector3 texture_up(Vector3 unit_normal)
{
    bool level = fabs(unit_normal.y) >= fmax(fabs(unit_normal.x), fabs(unit_normal.z));
    return axis_across(level ? (Vector3){0, 0, -1} : (Vector3){0, 1, 0}, unit_normal);
}

void surface_grid(const Flattening *flattening, uint32_t material, Vector3 normal, scalar4 *u, scalar4 *v)
{
    const Material *look = &flattening->scene->materials.items[material];
    Vector3 unit = vector_normalize(normal);
    if (look->texture > 0) {
        const CompiledTexture *texture = &flattening->compiled->textures[look->texture - 1];
        double width = look->texture_size;
        Vector3 up = texture_up(unit);
        *u = texture_axis(flattening, vector_cross(up, unit), width);
        *v = texture_axis(flattening, up, width * texture->height / texture->width);
    } else if (look->checker) {
        Vector3 across = axis_across(vector_least_aligned_axis(unit), unit);
        *u = checker_axis(flattening, across, look->checker_size);
        *v = checker_axis(flattening, vector_cross(unit, across), look->checker_size);
    }
}

TriangleUvs triangle_uvs(const Mesh *mesh, const uint32_t *corners, const CompiledTexture *texture)
{
    const double *a = mesh->uvs[corners[0]], *b = mesh->uvs[corners[1]], *c = mesh->uvs[corners[2]];
    const Vector3 *vertices = mesh->vertices, origin = vertices[corners[0]];
    // twice the areas, in texels and in the scene
    double texels = fabs((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) * texture->width *
                    texture->height;
    double area = vector_length(vector_cross(vector_subtract(vertices[corners[1]], origin),
                                             vector_subtract(vertices[corners[2]], origin)));
    return (TriangleUvs){{a[0], a[1], b[0], b[1]}, {c[0], c[1], area > 0 ? sqrt(texels / area) : 0, 0}};
}
