#include "host/verify/random_shape.h"
#include "host/verify/reference_shape.h"

static void hit_box(const Object *object, const ReferenceRay *ray, ReferenceHit *hit)
{
    Vector3 corners[2] = {object->as.box.min, object->as.box.max};
    const Quad low[3] = {corners[0].x, corners[0].y, corners[0].z};
    const Quad high[3] = {corners[1].x, corners[1].y, corners[1].z};
    // along an axis a hit is a comparison of given numbers, so nothing is uncertain
    bool along_axis = (ray->direction.x == 0) + (ray->direction.y == 0) + (ray->direction.z == 0) == 2;
    for (int axis = 0; axis < 3; axis++) {
        Quad3 along = {axis == 0, axis == 1, axis == 2};
        for (int side = 0; side < 2; side++) {
            Quad t;
            if (!plane_crossing(ray, quad3(corners[side]), along, &t)) continue;
            Quad3 point = reference_point(ray, t);
            const Quad at[3] = {point.x, point.y, point.z};
            int next = (axis + 1) % 3, last = (axis + 2) % 3;
            if (at[next] >= low[next] && at[next] <= high[next] && at[last] >= low[last] &&
                at[last] <= high[last])
                hit_keep_nearest(hit, ray, t, quad3_scale(along, side ? 1 : -1), UNBOUNDED);
        }
        for (int edge = 0; edge < 4 && !along_axis; edge++) {
            Vector3 y_and_z = {corners[0].x, corners[edge & 1].y, corners[edge >> 1].z};
            Vector3 z_and_x = {corners[edge & 1].x, corners[0].y, corners[edge >> 1].z};
            Vector3 x_and_y = {corners[edge & 1].x, corners[edge >> 1].y, corners[0].z};
            Vector3 on_edge = axis == 0 ? y_and_z : axis == 1 ? z_and_x : x_and_y;
            hit_reduce_margin(hit, 2 * line_distance(ray, quad3(on_edge), along));
        }
    }
}

static void surface_box(const Object *object, Quad3 point, ReferenceSurface *surface)
{
    const Vector3 min = object->as.box.min, max = object->as.box.max;
    const double low[] = {min.x, min.y, min.z}, high[] = {max.x, max.y, max.z};
    const Quad at[] = {point.x, point.y, point.z};
    Vector3 center = vector_scale(vector_add(object->as.box.min, object->as.box.max), 0.5);
    double size = vector_length(vector_subtract(object->as.box.max, object->as.box.min)) / 2;
    surface_measure(surface, center, size, size);
    for (int axis = 0; axis < 3; axis++) {
        int next = (axis + 1) % 3, last = (axis + 2) % 3;
        Quad outside = quad_hypotenuse(quad_outside(at[next], low[next], high[next]),
                                       quad_outside(at[last], low[last], high[last]));
        Quad3 normal = {axis == 0, axis == 1, axis == 2};
        surface_add(surface, quad_hypotenuse(at[axis] - low[axis], outside), normal, UNBOUNDED);
        surface_add(surface, quad_hypotenuse(at[axis] - high[axis], outside), normal, UNBOUNDED);
    }
}

const ReferenceShape reference_box = {hit_box, surface_box, 6};

static void box_randomize(RandomShape *made, unsigned form, Random *random)
{
    (void)form;
    Vector3 half = {random_between(random, 0.2, 1), random_between(random, 0.2, 1),
                    random_between(random, 0.2, 1)};
    half = vector_scale(half, made->radius);
    made->object.as.box.min = vector_subtract(made->center, half);
    made->object.as.box.max = vector_add(made->center, half);
    made->radius = vector_length(half);
}

const RandomForms box_forms = {{"box"}, box_randomize};
