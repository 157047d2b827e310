// Triangles, alone and in meshes.
#ifdef __clang__
#pragma STDC FP_CONTRACT OFF // gcc's default: one result with and without instructions for fma
#endif
#include "host/compile/shapes.h"
#include "host/compile/texture_mapping.h"
#include "host/scene/mesh.h"
#include "host/scene/polygon.h"
#include <math.h>
#include <string.h>

// Returns a b - c d to 1.5 ulp (Kahan's; Jeannerod, Louvet, Muller, Further analysis of Kahan's algorithm
// for the accurate computation of 2x2 determinants, Mathematics of Computation 82, 2013).
static inline __attribute__((always_inline)) double product_difference(double a, double b, double c, double d)
{
    double cd = c * d;
    return fma(a, b, -cd) + fma(-c, d, cd);
}

static inline __attribute__((always_inline)) Vector3 cross_product(Vector3 a, Vector3 b)
{
    return (Vector3){product_difference(a.y, b.z, a.z, b.y), product_difference(a.z, b.x, a.x, b.z),
                     product_difference(a.x, b.y, a.y, b.x)};
}

// Returns the normal of the corners before they are rounded, or 0 if the sine of the angle at `a` is below
// `least_sine`.
static Vector3 needle_normal(Vector3 a, Vector3 b, Vector3 c, double least_sine)
{
    const Quad3 from = quad3(a), ab = quad3_subtract(quad3(b), from), ac = quad3_subtract(quad3(c), from),
                across = quad3_cross(ab, ac);
    const Quad largest =
        quad_maximum(quad_absolute(across.x), quad_maximum(quad_absolute(across.y), quad_absolute(across.z)));
    const Quad length_min = least_sine * quad3_length(ab) * quad3_length(ac);
    if (!(largest > 0) || quad3_length(across) < length_min) return (Vector3){0, 0, 0};
    return quad3_rounded(quad3_scale(across, 1 / largest));
}

// Returns the normal of the corners before they are rounded, within TRIANGLE_NORMAL_ERROR of
// kernels/shapes/certain_triangle.h, or 0, with which every hit is uncertain. If s is the sine of the angle
// at `a`, its direction is off by less than (3 + 3 / s) 2^-53: by 27 of these down to 1/8, and by a 2^-9th of
// a float's roundoff down to 2^-18. In quadruple precision the roundoff is 2^-QUAD_BITS.
static Vector3 certified_normal(const Rounding *rounding, Vector3 a, Vector3 b, Vector3 c)
{
    const double least_sine = rounding->is_double ? 0x1p-3 : 0x1p-18;
    const Vector3 ab = axis_scaled(vector_subtract(b, a)), ac = axis_scaled(vector_subtract(c, a)),
                  across = cross_product(ab, ac);
    const double least_squared = least_sine * least_sine * vector_dot(ab, ab) * vector_dot(ac, ac);
    const double least_in_quad = ldexp(1, 50 - QUAD_BITS);
    return vector_dot(across, across) >= least_squared ? across : needle_normal(a, b, c, least_in_quad);
}

// Returns a rounded triangle. One without area becomes a point, which no ray hits, since kernels rotate
// vertices and a line could gain an area. One that rounding leaves without area stays, to fill what
// neighbors leave open.
static inline __attribute__((always_inline)) Triangle triangle_of(const Rounding *rounding, Vector3 a,
                                                                  Vector3 b, Vector3 c)
{
    const bool has_area = triangle_has_area(a, b, c);
    if (!has_area) b = c = a;
    Vector3 seen_a = point_from_eye(rounding, a), seen_b = point_from_eye(rounding, b),
            seen_c = point_from_eye(rounding, c);
    Vector3 ab = vector_subtract(seen_b, seen_a), ac = vector_subtract(seen_c, seen_a);
    if (rounding->is_double) { // the products of floats fit double, those of doubles may not
        ab = axis_scaled(ab);
        ac = axis_scaled(ac);
    }
    Vector3 across = rounding->certifies ? certified_normal(rounding, a, b, c) : cross_product(ab, ac);
    if (has_area && !rounding->certifies && vector_is_zero(across)) across = needle_normal(a, b, c, 0);
    Vector3 normal = vector_rounded(rounding, axis_scaled(across));
    return (Triangle){
        scalar4_of(seen_a, normal.x), scalar4_of(seen_b, normal.y), scalar4_of(seen_c, normal.z), {0}};
}

// A copy with fma instructions, for processors that have them, since a call takes as long as the rest.
#ifdef __x86_64__
__attribute__((target("fma"))) static Triangle triangle_of_fma(const Rounding *rounding, Vector3 a, Vector3 b,
                                                               Vector3 c)
{
    return triangle_of(rounding, a, b, c);
}
#endif

static Triangle triangle_rounded(const Rounding *rounding, Vector3 a, Vector3 b, Vector3 c)
{
#ifdef __x86_64__
    if (__builtin_cpu_supports("fma")) return triangle_of_fma(rounding, a, b, c);
#endif
    return triangle_of(rounding, a, b, c);
}

// Returns whether a triangle is too far away, for its size, for rounding to matter. Most are.
static inline bool triangle_is_far(const Triangle *triangle)
{
    const Vector3 a = vector3_of(&triangle->a);
    const Bounds box = bounds_of_triangle(a, vector3_of(&triangle->b), vector3_of(&triangle->c));
    const Vector3 outside = vector_max(vector_max(box.min, vector_scale(box.max, -1)), (Vector3){0, 0, 0});
    return 4 * vector_dot(outside, outside) > vector_dot(a, a);
}

// Lets the eye's height define the plane, with the normal of the vertices before they are rounded, if
// rounding moves the plane by more than 4 roundings of its distance from the eye.
static void triangle_set_height(Triangle *triangle, Flattening *flattening, Vector3 a, Vector3 b, Vector3 c)
{
    const Rounding *rounding = &flattening->rounding;
    const Vector3 seen = vector3_of(&triangle->a);
    const Quad3 to_a = exact_from_eye(rounding, a), ab = quad3_subtract(quad3(b), quad3(a)),
                ac = quad3_subtract(quad3(c), quad3(a)), across = quad3_cross(ab, ac);
    int exponent;
    frexp(vector_largest(quad3_rounded(across)), &exponent);
    const Quad3 normal = quad3_scale(across, ldexp(1, -exponent));
    const Quad height = quad3_dot(normal, to_a), length = quad3_length(normal);
    const Quad3 stored = {triangle->a.w, triangle->b.w, triangle->c.w};
    const Quad stored_height = quad3_dot(stored, quad3(seen)), stored_length = quad3_length(stored);
    const double above = fabs((double)(height / length)),
                 moved = fabs((double)(stored_height / stored_length - height / length));
    if (!(moved > 4 * roundoff_of(rounding) * above)) return;
    // the height's rounding to float scales the normal, so that the plane stays, also in double
    const float eye_height = height == 0 ? -0.0f : (float)height;
    if (!isfinite(eye_height) || (eye_height == 0 && height != 0)) return;
    const Quad scale = height == 0 ? 1 : eye_height / height;
    const Vector3 scaled = vector_rounded(rounding, quad3_rounded(quad3_scale(normal, scale)));
    triangle->a.w = scaled.x;
    triangle->b.w = scaled.y;
    triangle->c.w = scaled.z;
    memcpy(&triangle->id.w, &eye_height, sizeof eye_height);
    flattening->features |= FEATURE_EYE_POWERS;
}

static Triangle triangle_make(Flattening *flattening, Vector3 a, Vector3 b, Vector3 c)
{
    Triangle triangle = triangle_rounded(&flattening->rounding, a, b, c);
    if (!flattening->rounding.is_local && !triangle_is_far(&triangle))
        triangle_set_height(&triangle, flattening, a, b, c);
    return triangle;
}

// Copies the attributes, which do not depend on the eye.
static void triangle_keep_attributes(Triangle *triangle, const Triangle *moved)
{
    triangle->id.y = moved->id.y;
    triangle->id.z = moved->id.z;
}

// Returns a triangle's id.y. A triangle with a vertex without a normal is flat. If the normals lie on
// different sides of the triangle, no nearby smooth surface has them, and shadow rays start on the triangle.
static uint32_t normals_add(Flattening *flattening, const Vector3 vertices[3], Vector3 a, Vector3 b,
                            Vector3 c)
{
    if (vector_is_zero(a) || vector_is_zero(b) || vector_is_zero(c)) return 0;
    const Vector3 flat = triangle_normal(vertices[0], vertices[1], vertices[2]);
    const double heights[] = {vector_dot(a, flat), vector_dot(b, flat), vector_dot(c, flat)};
    const bool agree = (heights[0] > 0 && heights[1] > 0 && heights[2] > 0) ||
                       (heights[0] < 0 && heights[1] < 0 && heights[2] < 0);
    TriangleNormals *normals = flattening->compiled->arrays[FLAT_TRIANGLE_NORMALS].items;
    normals[flattening->normals_count++] =
        (TriangleNormals){scalar4_of(a, agree), scalar4_of(b, 0), scalar4_of(c, 0)};
    return (uint32_t)flattening->normals_count;
}

// Returns a triangle's id.z.
static uint32_t uvs_add(Flattening *flattening, const Mesh *mesh, const MeshTriangle *triangle,
                        const uint32_t *corners, uint32_t material)
{
    const uint32_t texture = material_any_texture(&flattening->scene->materials.items[material]);
    if (!mesh->uvs || texture == 0) return 0;
    TriangleUvs *uvs = flattening->compiled->arrays[FLAT_TRIANGLE_UVS].items;
    uvs[flattening->uvs_count++] =
        triangle_uvs(mesh, triangle->vertices, corners, &flattening->compiled->textures[texture - 1]);
    return (uint32_t)flattening->uvs_count;
}

static void triangle_flatten(Flattening *flattening, const Object *object)
{
    const Vector3 *vertices = object->as.triangle.vertices, *normals = object->as.triangle.normals;
    Triangle triangle = triangle_make(flattening, vertices[0], vertices[1], vertices[2]);
    if (flattening->moved)
        triangle_keep_attributes(&triangle, flattening->moved);
    else if (object->as.triangle.smooth)
        triangle.id.y = normals_add(flattening, vertices, vector_normalize(normals[0]),
                                    vector_normalize(normals[1]), vector_normalize(normals[2]));
    primitive_add(flattening, TYPE_TRIANGLES, &triangle, object->material);
}

// Sets the corners of the triangle in the order of mesh_triangle_at.
static void corners_ordered(const Mesh *mesh, const Object *object, size_t part, uint32_t corners[3])
{
    memcpy(corners, mesh->triangles[part], 3 * sizeof *corners);
    if (!object->as.mesh.is_instance || affine_determinant(&object->as.mesh.transform) >= 0) return;
    corners[1] = mesh->triangles[part][2];
    corners[2] = mesh->triangles[part][1];
}

static void mesh_flatten(Flattening *flattening, const Object *object)
{
    const Mesh *mesh = &flattening->scene->meshes.items[object->as.mesh.index];
    const MeshTriangle placed = mesh_triangle_at(mesh, object, flattening->part);
    const Vector3 *vertices = placed.vertices, *normals = placed.normals;
    const uint32_t *materials = mesh_materials(mesh, object);
    const uint32_t material = materials ? materials[flattening->part] : object->material;
    Triangle triangle = triangle_make(flattening, vertices[0], vertices[1], vertices[2]);
    if (flattening->moved) {
        triangle_keep_attributes(&triangle, flattening->moved);
    } else {
        if (mesh->normals)
            triangle.id.y = normals_add(flattening, vertices, normals[0], normals[1], normals[2]);
        uint32_t corners[3];
        corners_ordered(mesh, object, flattening->part, corners);
        triangle.id.z = uvs_add(flattening, mesh, &placed, corners, material);
    }
    primitive_add(flattening, TYPE_TRIANGLES, &triangle, material);
}

static Bounds triangle_bounds(const Object *object)
{
    const Vector3 *vertices = object->as.triangle.vertices;
    return bounds_of_triangle(vertices[0], vertices[1], vertices[2]);
}

static Bounds instance_primitive_bounds(const void *primitive)
{
    const Instance *instance = primitive;
    return bounds_around((Vector3){instance->rows[0].w, instance->rows[1].w, instance->rows[2].w},
                         vector3_of(&instance->extent));
}

static Bounds triangle_primitive_bounds(const void *primitive)
{
    const Triangle *triangle = primitive;
    return bounds_of_triangle(vector3_of(&triangle->a), vector3_of(&triangle->b), vector3_of(&triangle->c));
}

const ShapeOps triangle_ops = {
    .bounds = triangle_bounds,
    .flatten = triangle_flatten,
    .primitive_bounds = triangle_primitive_bounds,
};

const ShapeOps mesh_ops = {
    .flatten = mesh_flatten,
    .primitive_bounds = instance_primitive_bounds,
};
