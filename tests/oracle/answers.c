// Prints rays and what the reference answers (host/verify/reference.h): those of the hard cases, at the width
// of float and of double, and random ones at random objects. tests/oracle/certify.py checks them in exact
// arithmetic.
//
//     answers [SAMPLES [FURTHER]]
//     answers image WIDTH HEIGHT
//
// SAMPLES is the number of random rays at each random object. FURTHER is the last ray, without an answer, to
// print of each family that is closed. A line is a JSON object: a set's name, then its objects, then its
// rays. With `image` these are the rays of images of tests/exact_scenes.txt, and what they show.
#include "host/base/memory.h"
#include "host/verify/checks.h"
#include "host/verify/reference_color.h"
#include "tests/random_ray.h"
#include "tests/scene_reading.h"
#include <stdio.h>
#include <stdlib.h>

enum { OBJECTS_OF_A_TYPE = 4 };

static void numbers_print(const char *key, const double *numbers, size_t count)
{
    printf("\"%s\": [", key);
    for (size_t i = 0; i < count; i++)
        printf("%s%.17g", i > 0 ? ", " : "", numbers[i]);
    printf("]");
}

// Prints a number as a double and the remainder.
static void quad_print(const char *key, Quad number)
{
    printf(", ");
    numbers_print(key, (const double[]){(double)number, (double)(number - (double)number)}, 2);
}

static const char *json_of(bool value)
{
    return value ? "true" : "false";
}

static void set_print(const char *name, bool is_double)
{
    printf("{\"set\": \"%s\", \"wide\": %s}\n", name, json_of(is_double));
}

static void flags_print(bool finite, bool caps)
{
    printf("\"finite\": %s, \"caps\": %s, ", json_of(finite), json_of(caps));
}

static void object_print(const Object *object)
{
    printf("{\"shape\": \"%s\", ", shape_names[object->type]);
    switch (object->type) {
    case SHAPE_CYLINDER:
        flags_print(object->as.cylinder.finite, object->as.cylinder.caps);
        break;
    case SHAPE_CONE:
        flags_print(object->as.cone.finite, object->as.cone.caps);
        break;
    case SHAPE_PARABOLOID:
        flags_print(object->as.paraboloid.finite, object->as.paraboloid.caps);
        break;
    default:
        break;
    }
    // the members of each shape begin with its doubles in a row
    numbers_print("numbers", (const double *)(const void *)&object->as, 13);
    printf("}\n");
}

static void ray_print(const TraceRay *ray)
{
    printf("{");
    numbers_print("origin", &ray->origin.x, 3);
    printf(", ");
    numbers_print("direction", &ray->direction.x, 3);
    printf(", \"start\": %.17g", ray->tmin);
}

static void hit_print(const ReferenceHit *hit)
{
    printf(", \"margin\": %.17g, \"found\": %s", fmin((double)hit->margin, DBL_MAX), json_of(hit->found));
    if (!hit->found) return;
    quad_print("t", hit->t);
    quad_print("cosine", hit->cosine);
    quad_print("x", hit->normal.x);
    quad_print("y", hit->normal.y);
    quad_print("z", hit->normal.z);
}

// Prints the nearest hit, and what the tiers leave open and allow. If nothing is hit, they are those of the
// object that is missed by the least.
static void test_ray_print(bool is_double, const Object *objects, size_t count, const VerifyTestRay *test)
{
    ReferenceRay ray = verify_reference_ray(&test->ray);
    size_t nearest = 0;
    ReferenceHit hit = reference_hit_object(&objects[0], &ray);
    for (size_t i = 1; i < count; i++) {
        ReferenceHit other = reference_hit_object(&objects[i], &ray);
        bool nearer = other.found ? !hit.found || other.t < hit.t : !hit.found && other.margin < hit.margin;
        if (!nearer) continue;
        nearest = i;
        hit = other;
    }
    ray_print(&test->ray);
    hit_print(&hit);
    printf(", \"object\": %zu, \"tiers\": {", nearest);
    for (VerifyTier tier = is_double ? TIER_D : TIER_A; tier <= (is_double ? TIER_D : TIER_C); tier++) {
        const VerifyRun run = {.tier = tier};
        VerifyExpected expected = verify_expected(&run, &objects[nearest], test, hit);
        printf("%s\"%c\": {\"open\": %s, \"decided\": %s, \"touch\": %s, \"bound\": %.17g}",
               tier % TIER_D > 0 ? ", " : "", 'A' + (int)tier, json_of(expected.open),
               json_of(verify_is_exact(&run, test)), json_of(expected.exact.found && !hit.found),
               fmin(expected.bound, DBL_MAX));
    }
    printf("}}\n");
}

static void case_print(const VerifyRays *set, bool is_double, size_t further)
{
    VerifyRun run = {.tier = is_double ? TIER_D : TIER_C};
    const Scene *scene = verify_rays_scene(&run, set);
    Object *objects = verify_objects(&run, scene);
    VerifyTestRays tests = verify_test_rays(&run, set);
    set_print(set->name, is_double);
    for (size_t i = 0; i < scene->objects.count; i++)
        object_print(&objects[i]);
    for (size_t i = 0; i < tests.count; i++)
        test_ray_print(is_double, objects, scene->objects.count, &tests.items[i]);
    for (size_t i = tests.count; set->closed && i < further; i++) {
        TraceRay ray = set->family(i);
        verify_round_ray(&run, &ray);
        ray_print(&ray);
        printf("}\n");
    }
    verify_release(&run);
}

static void shapes_print(const ShapeForm *form, uint64_t seed, size_t samples)
{
    Random random = {seed};
    for (int i = 0; i < OBJECTS_OF_A_TYPE; i++) {
        RandomShape shape = random_shape(form, &random);
        set_print(form->name, true);
        object_print(&shape.object);
        for (size_t k = 0; k < samples; k++) {
            RandomRay given = random_ray(&shape, &random);
            TraceRay ray = {given.origin, given.direction, 0, INFINITY};
            ReferenceRay exact_ray = verify_reference_ray(&ray);
            ReferenceHit hit = reference_hit_object(&shape.object, &exact_ray);
            ray_print(&ray);
            hit_print(&hit);
            printf("}\n");
        }
    }
}

static void pixel_print(const Scene *scene, unsigned bounce_count, const ReferenceRay *ray)
{
    OWNED bool *shadows = memory_allocate_zeroed(scene->lights.count, sizeof *shadows);
    const ReferenceScene world = {*scene, NULL};
    const ReferencePixel pixel =
        reference_pixel(&world, ray, &(ReferencePath){.bounce_count = bounce_count}, shadows);
    printf("{");
    numbers_print("color", &pixel.color.x, 3);
    printf(", \"object\": %u, \"path\": %u, \"shadows\": [", pixel.object, pixel.path);
    for (size_t i = 0; i < scene->lights.count; i++)
        printf("%s%s", i > 0 ? ", " : "", json_of(shadows[i]));
    printf("]");
    quad_print("x", ray->direction.x);
    quad_print("y", ray->direction.y);
    quad_print("z", ray->direction.z);
    printf("}\n");
}

static void images_print(unsigned width, unsigned height)
{
    static ExactScene scenes[EXACT_SCENES_MAX];
    const size_t count = exact_scenes_read(scenes);
    for (size_t i = 0; i < count; i++) {
        printf("{\"scene\": \"%s\", \"bounces\": %u}\n", scenes[i].name, scenes[i].bounce_count);
        OwnedScene scene = scene_of_text("image.yaml", text_c(&scenes[i].text));
        for (unsigned pixel = 0; pixel < width * height; pixel++) {
            const ReferenceRay ray =
                reference_camera_ray(&scene.camera, width, height, pixel % width, pixel / width);
            pixel_print(&scene, scenes[i].bounce_count, &ray);
        }
    }
}

int main(int argument_count, char **arguments)
{
    if (argument_count == 4 && strcmp(arguments[1], "image") == 0) {
        images_print((unsigned)strtoul(arguments[2], NULL, 10), (unsigned)strtoul(arguments[3], NULL, 10));
        return EXIT_SUCCESS;
    }
    size_t samples = argument_count > 1 ? strtoul(arguments[1], NULL, 10) : 0;
    size_t further = argument_count > 2 ? strtoul(arguments[2], NULL, 10) : 0;
    for (size_t i = 0; i < verify_rays_count; i++)
        for (int is_double = 0; is_double < 2; is_double++)
            case_print(&verify_rays[i], is_double, further);
    ShapeForm forms[SHAPE_FORMS_MAX];
    const size_t form_count = shape_forms(forms);
    for (size_t i = 0; i < form_count && samples > 0; i++)
        shapes_print(&forms[i], i, samples);
    return EXIT_SUCCESS;
}
