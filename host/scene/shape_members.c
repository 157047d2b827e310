#include "host/scene/shape_members.h"

#define SHAPE_COUNTS(NAME, name, points, directions, lengths) [SHAPE_##NAME] = {points, directions, lengths},
static const struct {
    unsigned points, directions, lengths;
} member_counts[SHAPE_COUNT] = {SCENE_SHAPE_LIST(SHAPE_COUNTS)[SHAPE_OVAL] = {1, 3, 0}};

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
