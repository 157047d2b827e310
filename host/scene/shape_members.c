#include "host/scene/shape_members.h"
#include <stddef.h>

#define SHAPE_COUNTS(NAME, name, points, directions, lengths) [SHAPE_##NAME] = {points, directions, lengths},
static const struct {
    unsigned points, directions, lengths;
} member_counts[SHAPE_COUNT] = {SCENE_SHAPE_LIST(SHAPE_COUNTS)[SHAPE_OVAL] = {1, 3, 0}};

// The members of each shape are in this order, with no others in between.
#define MEMBER_FOLLOWS(member, vectors, lengths)                                                             \
    _Static_assert(offsetof(Object, as.member) ==                                                            \
                       offsetof(Object, as) + (vectors) * sizeof(Vector3) + (lengths) * sizeof(double),      \
                   #member)
MEMBER_FOLLOWS(sphere.radius, 1, 0);
MEMBER_FOLLOWS(plane.normal, 1, 0);
MEMBER_FOLLOWS(disc.normal, 1, 0);
MEMBER_FOLLOWS(disc.radius, 2, 0);
MEMBER_FOLLOWS(box.max, 1, 0);
MEMBER_FOLLOWS(cylinder.axis, 1, 0);
MEMBER_FOLLOWS(cylinder.radius, 2, 0);
MEMBER_FOLLOWS(cone.axis, 1, 0);
MEMBER_FOLLOWS(cone.radius, 2, 0);
MEMBER_FOLLOWS(triangle.normals, 3, 0);
MEMBER_FOLLOWS(torus.axis, 1, 0);
MEMBER_FOLLOWS(torus.major, 2, 0);
MEMBER_FOLLOWS(torus.minor, 2, 1);
MEMBER_FOLLOWS(paraboloid.axis, 1, 0);
MEMBER_FOLLOWS(paraboloid.focal_length, 2, 0);
MEMBER_FOLLOWS(paraboloid.height, 2, 1);
MEMBER_FOLLOWS(superellipsoid.axes, 1, 0);
MEMBER_FOLLOWS(oval.axes, 1, 0);

ShapeMembers shape_members(Object *object)
{
    ShapeMembers members = {0};
    Vector3 *vector = (Vector3 *)(void *)&object->as;
    for (unsigned i = 0; i < member_counts[object->type].points; i++)
        members.points[i] = vector++;
    for (unsigned i = 0; i < member_counts[object->type].directions; i++)
        members.directions[i] = vector++;
    double *length = (double *)(void *)vector;
    for (unsigned i = 0; i < member_counts[object->type].lengths; i++)
        members.lengths[i] = length++;
    return members;
}

void box_order(Object *object)
{
    if (object->type != SHAPE_BOX) return;
    const Vector3 a = object->as.box.min, b = object->as.box.max;
    object->as.box.min = vector_min(a, b);
    object->as.box.max = vector_max(a, b);
}
