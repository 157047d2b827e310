#include "host/scene/shape_members.h"

#define MEMBER(name) &object->as.name

ShapeMembers shape_members(Object *object)
{
    switch (object->type) {
    case SHAPE_SPHERE:
        return (ShapeMembers){{MEMBER(sphere.center)}, {NULL}, {MEMBER(sphere.radius)}};
    case SHAPE_PLANE:
        return (ShapeMembers){{MEMBER(plane.point)}, {MEMBER(plane.normal)}, {NULL}};
    case SHAPE_DISC:
        return (ShapeMembers){{MEMBER(disc.center)}, {MEMBER(disc.normal)}, {MEMBER(disc.radius)}};
    case SHAPE_BOX:
        return (ShapeMembers){{MEMBER(box.min), MEMBER(box.max)}, {NULL}, {NULL}};
    case SHAPE_CYLINDER:
        return (ShapeMembers){{MEMBER(cylinder.from)}, {MEMBER(cylinder.axis)}, {MEMBER(cylinder.radius)}};
    case SHAPE_CONE:
        return (ShapeMembers){
            {MEMBER(cone.from)}, {MEMBER(cone.axis)}, {MEMBER(cone.radius[0]), MEMBER(cone.radius[1])}};
    case SHAPE_TRIANGLE: {
        Vector3 *vertices = object->as.triangle.vertices, *normals = object->as.triangle.normals;
        return (ShapeMembers){
            {vertices, vertices + 1, vertices + 2}, {normals, normals + 1, normals + 2}, {NULL}};
    }
    case SHAPE_TORUS:
        return (ShapeMembers){
            {MEMBER(torus.center)}, {MEMBER(torus.axis)}, {MEMBER(torus.major), MEMBER(torus.minor)}};
    case SHAPE_PARABOLOID:
        return (ShapeMembers){{MEMBER(paraboloid.apex)},
                              {MEMBER(paraboloid.axis)},
                              {MEMBER(paraboloid.focal_length), MEMBER(paraboloid.height)}};
    case SHAPE_OVAL:
        return (ShapeMembers){{MEMBER(oval.center)},
                              {MEMBER(oval.axes[0]), MEMBER(oval.axes[1]), MEMBER(oval.axes[2])},
                              {NULL}};
    default:
        return (ShapeMembers){{NULL}, {NULL}, {NULL}};
    }
}

void box_order(Object *object)
{
    if (object->type != SHAPE_BOX) return;
    const Vector3 a = object->as.box.min, b = object->as.box.max;
    object->as.box.min = vector_min(a, b);
    object->as.box.max = vector_max(a, b);
}
