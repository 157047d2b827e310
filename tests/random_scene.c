#include "tests/random_scene.h"

#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/scene/object_transform.h"

Vector3 random_point(Random *random, double least, double most)
{
    Vector3 direction = vector_normalize(random_in_sphere(random));
    return vector_scale(direction, random_between(random, least, most));
}

static Color random_color(Random *random)
{
    double red = random_between(random, 0.1, 1), green = random_between(random, 0.1, 1);
    return (Color){red, green, random_between(random, 0.1, 1)};
}

static Material random_material(Random *random, size_t index)
{
    Material material = material_default();
    material.color = random_color(random);
    material.diffuse = random_color(random);
    material.specular.largest = random_between(random, 0, 1);
    material.shininess = random_between(random, 0, 100);
    if (index == 1) {
        material.reflection.largest = random_between(random, 0.2, 0.8);
        material.reflection.tint = (Color){1, random_between(random, 0, 1), random_between(random, 0, 1)};
    }
    if (index == 2) material.transmission.largest = random_between(random, 0.5, 0.9);
    // from numbers that are drawn anyway, since others would change all scenes
    if (index == 2) material.transmission.tint = color_tint(material.color);
    if (index == 0) material.emission = (Color){material.diffuse.y, 0, 1.5 * material.diffuse.x};
    if (index == 3) {
        material.checker.is_on = true;
        material.checker.size = random_between(random, 0.3, 1);
        material.checker.colors[0] = random_color(random);
        material.checker.colors[1] = random_color(random);
    }
    return material;
}

// Makes a shape an oval around the same point, if it is a type that can be one.
static void object_stretch(Scene *scene, Object *object, Vector3 center)
{
    if (object->type == SHAPE_BOX || object->type == SHAPE_PLANE || object->type == SHAPE_TRIANGLE) return;
    const Affine stretch = {
        {{1, 0.3, 0, -0.3 * center.y}, {0, 0.75, 0, 0.25 * center.y}, {0, 0, 1.25, -0.25 * center.z}}};
    const char *why = object_transform(scene, object, &stretch);
    if (why) fault("a random object %s", why);
}

// Returns one object of each form, then bounded ones, none so large that it hides the rest.
static Object random_object(Scene *scene, Random *random, size_t index)
{
    ShapeForm forms[SHAPE_FORMS_MAX];
    const size_t form_count = shape_forms(forms);
    for (;;) {
        const bool first = index < form_count;
        const ShapeForm *form = &forms[first ? index : (size_t)random_between(random, 0, (double)form_count)];
        RandomShape shape = random_shape(form, random);
        if (shape.radius > 3 || (!form->bounded && !first)) continue;
        Object *object = &shape.object;
        // a plane behind the objects and a narrow cone next to them, not across the view
        if (form->type == SHAPE_PLANE) object->as.plane.point = vector_scale(object->as.plane.normal, 0x1p5);
        if (form->type == SHAPE_CONE && !form->bounded) object->as.cone.slope *= 0x1p-4;
        // the order of a triangle's vertices distinguishes glass from air, and the mirror reverses it
        object->material = (uint32_t)index % (form->type == SHAPE_TRIANGLE ? 2 : 4);
        if (!first && index % 4 == 0) object_stretch(scene, object, shape.center);
        return *object;
    }
}

Scene random_scene(uint64_t seed, size_t object_count)
{
    Random random = {seed};
    Scene scene = {.background = random_color(&random), .ambient = {0.1, 0.1, 0.1}};
    for (size_t i = 0; i < 4; i++)
        array_push(scene.materials, random_material(&random, i));
    for (size_t i = 0; i < object_count; i++)
        array_push(scene.objects, random_object(&scene, &random, i));
    // from where the plane is not in the way
    size_t plane = 0;
    while (scene.objects.items[plane].type != SHAPE_PLANE)
        plane++;
    Vector3 up = vector_normalize(scene.objects.items[plane].as.plane.normal);
    Vector3 position = vector_subtract(random_point(&random, 10, 13), vector_scale(up, 6));
    scene.camera = (Camera){.position = position,
                            .look_at = random_point(&random, 0, 2),
                            .up = random_point(&random, 1, 1),
                            .half_tangent = random_between(&random, 0.4, 0.8)};
    for (int i = 0; i < 4; i++) {
        static const LightType types[] = {LIGHT_POINT, LIGHT_DIRECTIONAL, LIGHT_SPOT, LIGHT_POINT};
        Light light = {.type = types[i], .color = random_color(&random)};
        light.position = vector_subtract(random_point(&random, 5, 15), vector_scale(up, 8));
        light.direction = vector_subtract(random_point(&random, 0, 3), light.position);
        light.spot.half_angle = random_between(&random, 15, 40);
        light.spot.penumbra = random_between(&random, 0, 10);
        if (light.type == LIGHT_POINT) {
            light.color = vector_scale(light.color, 100);
            light.fading[0] = random_between(&random, 0, 1);
            light.fading[2] = 1;
        }
        array_push(scene.lights, light);
    }
    scene.sky.up = up;
    scene.sky.zenith = random_color(&random);
    scene.sky.nadir = random_color(&random);
    return scene;
}
