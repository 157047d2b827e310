// Computes the point and the color of a surface for the lanes that hit it.
#ifndef LANE_POINTS_H
#define LANE_POINTS_H

#include "shading/normal_map.h"
#include "traversal/traversal.h"

// Marks finished lanes. It is larger than any id.
#define NO_OBJECT ((integer)(INT_MAX))

static inline SurfacePoint shape_surface_point(const Scene *scene, uint type, uint index, const Ray *ray,
                                               real t)
{
#define SHAPE_SURFACE_POINT(feature, Type, name, names)                                                      \
    if (HAS_##feature && type == TYPE_##feature) {                                                           \
        Type shape = scene->names[index];                                                                    \
        return name##_surface_point(&shape, ray, t);                                                         \
    }
    SHAPE_LIST(SHAPE_SURFACE_POINT)
    return surface_point_make(ray->origin, ray->direction, (real)(0));
}

// The surface points of the lanes that hit the same object, or triangles of the same material.
typedef struct {
    mask lanes;
    uint4 entry; // the object's type_index_material
    SurfacePoint point;
    ImageLookup images; // with HAS_IMAGES, if the material has any
    mask uncertain;     // at `certified`
} LaneSurfacePoints;

// Sets the errors of the point and the lanes that may be at an edge.
static inline void shape_set_errors(const Scene *scene, LaneSurfacePoints *points, const Ray *ray, real t,
                                    real position_error)
{
#define SHAPE_SET_ERRORS(feature, Type, name, names)                                                         \
    if (HAS_##feature && points->entry.x == TYPE_##feature) {                                                \
        Type shape = scene->names[points->entry.y];                                                          \
        points->uncertain = name##_set_errors(&shape, ray, t, position_error, &points->point);               \
    }
    SHAPE_LIST(SHAPE_SET_ERRORS)
}

// Bounds the error of the shading normal.
static inline real point_normal_error(const SurfacePoint *point, real position_error)
{
    real turned = point->curvature * position_error; // to first order
    return real_fma(turned, real_fma((real)(4), turned, (real)(1)), point->normal_error) + DIRECTION_ROUNDING;
}

static inline mask floor_is_uncertain(real a, real error)
{
    return !(real_floor(a - error) == real_floor(a + error));
}

// How far behind the surface the cubes of a checker are looked up, in cubes, so that a face on the border
// between cubes has one color.
#define CHECKER_DEPTH 0x1p-10f

// Bounds the error of a point's coordinates in cubes of a checker.
static inline real cubes_error(const SurfacePoint *point, scalar4 grid, real position_error)
{
    const real per_unit = (real)(fabs(grid.w));
    return per_unit * position_error + 2 * CHECKER_DEPTH * point_normal_error(point, position_error) +
           8 * UNIT_ROUNDOFF * (per_unit * vector_norm1(point->position) + vector_norm1(vector_of(grid)) + 1);
}

// Returns the lanes where the checker has its second color. Adds the lanes where that is uncertain to
// points->uncertain. On planes and discs squares lie in the surface. Elsewhere they are cubes in space.
static inline mask checker_odd(const Scene *scene, LaneSurfacePoints *points, const Ray *ray, scalar4 grid,
                               real position_error)
{
    const SurfacePoint *point = &points->point;
    const uint type = points->entry.x, index = points->entry.y;
    Vector cell;
    real error = (real)(0);
    if (type_has_grid(type)) {
        const GridCoordinates square = grid_coordinates(scene, type, index, point->position);
        cell = (Vector){square.u, square.v, (real)(0.5f)};
        if (IS_CERTIFIED) error = grid_error(scene, type, index, point->position, position_error);
    } else {
        mask along = vector_dot(point->normal, ray->direction) > 0;
        Vector inward = vector_select(along, point->normal, vector_negate(point->normal));
        cell = vector_fma(point->position, (real)(grid.w), vector_of(grid));
        cell = vector_fma(inward, (real)(CHECKER_DEPTH), cell);
        if (IS_CERTIFIED) error = cubes_error(point, grid, position_error);
    }
    if (IS_CERTIFIED)
        points->uncertain = points->uncertain | floor_is_uncertain(cell.x, error) |
                            floor_is_uncertain(cell.y, error) | floor_is_uncertain(cell.z, error);
    const real halved = (real_floor(cell.x) + real_floor(cell.y) + real_floor(cell.z)) * 0.5f;
    return real_floor(halved) != halved;
}

// Completes the lookup of a material's images. For triangles it already has the coordinates and
// tangents.
static inline void points_set_images(LaneSurfacePoints *points, const Scene *scene,
                                     const FlatMaterial *material, const Ray *ray, real travelled)
{
    const uint type = points->entry.x, index = points->entry.y;
    const Vector normal = points->point.normal;
    points->images.footprint = ray_footprint(scene, ray, normal, travelled);
    if (type == TYPE_TRIANGLES) return;
    points->images.coordinates = texture_coordinates(scene, type, index, material, &points->point);
    if (HAS_NORMAL_MAPS) points->images.tangents = shape_tangents(scene, type, index, normal);
}

// Returns the object's color at the hit: plain, checkered or textured.
static inline Color3 object_color(const Scene *scene, const FlatMaterial *material, LaneSurfacePoints *points,
                                  const Ray *ray, real position_error)
{
    Color3 color = vector_of(material->color);
    if (HAS_CHECKERS && material->grid.w != 0) {
        mask odd = checker_odd(scene, points, ray, material->grid, position_error);
        color = vector_select(odd, vector_of(material->other_color), color);
    }
    if (HAS_IMAGES && material->texture.x > 0)
        color = texture_color(scene, image_wrapped(material->texture, points->entry.x == TYPE_SPHERES),
                              points->images.coordinates, points->images.footprint, points->lanes);
    return color;
}

#endif
