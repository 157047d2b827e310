// glint verify with its oracle overheard: runs one hard case as the program does and writes, as JSON, a
// sample of what the oracle of the pictures (host/verify/exact.c) was asked and answered, and of the
// pictures' pixels with the scene that they are of. tests/oracle/overheard.py holds both to the exact oracle.
//
//     overhear OUT.json EVERY PIXELS CASE --precision P
//
// takes one of EVERY questions and PIXELS pixels of each picture. The linker puts the functions named
// __wrap_… below in the place of the oracle's (ld --wrap); what they call __real_… are those.
#include "host/base/fault.h"
#include "host/base/json.h"
#include "host/cli/commands.h"
#include "host/verify/exact.h"
#include <math.h>
#include <stdlib.h>

ExactHit __real_exact_sphere(LongVector center, Long radius, LongVector direction);
ExactHit __wrap_exact_sphere(LongVector center, Long radius, LongVector direction);
ExactHit __real_exact_plane(LongVector point, LongVector normal, LongVector direction);
ExactHit __wrap_exact_plane(LongVector point, LongVector normal, LongVector direction);
ExactHit __real_exact_cylinder(LongVector point, LongVector axis, Long radius, double size,
                               LongVector direction);
ExactHit __wrap_exact_cylinder(LongVector point, LongVector axis, Long radius, double size,
                               LongVector direction);
ExactHit __real_exact_torus(LongVector center, Long major, Long minor, LongVector direction);
ExactHit __wrap_exact_torus(LongVector center, Long major, Long minor, LongVector direction);
Long __real_exact_highlight(LongVector normal, LongVector to_light, LongVector ray, double power);
Long __wrap_exact_highlight(LongVector normal, LongVector to_light, LongVector ray, double power);
void __real_exact_judge_surface(VerifyRun *run, const Object *object, const TraceRay *ray,
                                const TraceHit *hit);
void __wrap_exact_judge_surface(VerifyRun *run, const Object *object, const TraceRay *ray,
                                const TraceHit *hit);
Film __real_verify_render(VerifyRun *run, const Scene *scene, bool hierarchy, uint32_t width,
                          uint32_t height);
Film __wrap_verify_render(VerifyRun *run, const Scene *scene, bool hierarchy, uint32_t width,
                          uint32_t height);

static Json *json;
static size_t every, pixels_per_picture;

// What is just decided is asked for more often.
enum { NEARLY = 50 };

static bool is_taken(bool nearly)
{
    static size_t passed;
    passed += nearly ? NEARLY : 1;
    if (passed < every) return false;
    passed -= every;
    return true;
}

static void numbers_write(const char *key, const double *numbers, size_t count)
{
    json_begin_array(json, key);
    for (size_t i = 0; i < count; i++)
        json_number(json, NULL, numbers[i]);
    json_end(json);
}

static void vector_write(const char *key, Vector3 v)
{
    numbers_write(key, (const double[]){v.x, v.y, v.z}, 3);
}

// The oracle is asked about numbers of the renderer's own precision.
static double given(Long number)
{
    if ((Long)(double)number != number) fault("the oracle was asked about a number that is no double");
    return (double)number;
}

static void given_write(const char *key, LongVector v)
{
    numbers_write(key, (const double[]){given(v.x), given(v.y), given(v.z)}, 3);
}

// As a double and what is left.
static void long_write(const char *key, Long number)
{
    numbers_write(key, (const double[]){(double)number, (double)(number - (double)number)}, 2);
}

static void question_begin(const char *kind, LongVector direction)
{
    json_begin_object(json, NULL);
    json_text(json, "kind", kind);
    given_write("direction", direction);
}

static void answer_write(const ExactHit *exact)
{
    json_boolean(json, "found", exact->found);
    long_write("margin", exact->margin);
    if (exact->found) {
        long_write("t", exact->t);
        long_write("cosine", exact->cosine);
        long_write("x", exact->normal.x);
        long_write("y", exact->normal.y);
        long_write("z", exact->normal.z);
    }
    json_end(json);
}

static bool hit_is_taken(const ExactHit *exact)
{
    return is_taken(fabsl(exact->margin) < 0.05L);
}

ExactHit __wrap_exact_sphere(LongVector center, Long radius, LongVector direction)
{
    ExactHit exact = __real_exact_sphere(center, radius, direction);
    if (!hit_is_taken(&exact)) return exact;
    question_begin("sphere", direction);
    given_write("center", center);
    json_number(json, "radius", given(radius));
    answer_write(&exact);
    return exact;
}

ExactHit __wrap_exact_plane(LongVector point, LongVector normal, LongVector direction)
{
    ExactHit exact = __real_exact_plane(point, normal, direction);
    if (!is_taken(false)) return exact;
    question_begin("plane", direction);
    given_write("point", point);
    given_write("normal", normal);
    answer_write(&exact);
    return exact;
}

ExactHit __wrap_exact_cylinder(LongVector point, LongVector axis, Long radius, double size,
                               LongVector direction)
{
    ExactHit exact = __real_exact_cylinder(point, axis, radius, size, direction);
    if (!hit_is_taken(&exact)) return exact;
    question_begin("cylinder", direction);
    given_write("point", point);
    given_write("axis", axis);
    json_number(json, "radius", given(radius));
    answer_write(&exact);
    return exact;
}

ExactHit __wrap_exact_torus(LongVector center, Long major, Long minor, LongVector direction)
{
    ExactHit exact = __real_exact_torus(center, major, minor, direction);
    if (!hit_is_taken(&exact)) return exact;
    question_begin("torus", direction);
    given_write("center", center);
    json_number(json, "major", given(major));
    json_number(json, "minor", given(minor));
    answer_write(&exact);
    return exact;
}

Long __wrap_exact_highlight(LongVector normal, LongVector to_light, LongVector ray, double power)
{
    Long value = __real_exact_highlight(normal, to_light, ray, power);
    if (!is_taken(true)) return value;
    question_begin("highlight", ray);
    given_write("normal", normal);
    given_write("to_light", to_light);
    json_number(json, "power", power);
    long_write("value", value);
    json_end(json);
    return value;
}

static void color_write(const char *key, Color color)
{
    vector_write(key, color);
}

static void material_write(const Material *material)
{
    if (material->image || material->full_shadow) fault("the exact oracle does not know such a material");
    json_begin_object(json, "material");
    color_write("color", material->color);
    color_write("diffuse", material->diffuse);
    json_number(json, "ambient", material->ambient);
    json_number(json, "specular", material->specular);
    json_number(json, "shininess", material->shininess);
    json_number(json, "reflection", material->reflection);
    json_number(json, "transmission", material->transmission);
    json_number(json, "ior", material->ior);
    if (material->checker) {
        json_begin_object(json, "checker");
        json_begin_array(json, "colors");
        color_write(NULL, material->checker_colors[0]);
        color_write(NULL, material->checker_colors[1]);
        json_end(json);
        json_number(json, "size", material->checker_size);
        json_end(json);
    }
    json_end(json);
}

// A cylinder or a cone without its radii.
static void round_write(Vector3 from, Vector3 axis, bool finite, bool caps, const char *start)
{
    vector_write(finite ? "from" : start, from);
    vector_write(finite ? "to" : "axis", finite ? vector_add(from, axis) : axis);
    json_boolean(json, "caps", caps);
}

static void vectors_write(const char *key, const Vector3 vectors[3])
{
    json_begin_array(json, key);
    for (size_t i = 0; i < 3; i++)
        vector_write(NULL, vectors[i]);
    json_end(json);
}

// As scene files have it (docs/scene-format.md), but for an endless cone, which has its slope in place of the
// angle.
static void shape_write(const Object *object)
{
    switch (object->kind) {
    case SHAPE_SPHERE:
        vector_write("center", object->as.sphere.center);
        json_number(json, "radius", object->as.sphere.radius);
        break;
    case SHAPE_PLANE:
        vector_write("point", object->as.plane.point);
        vector_write("normal", object->as.plane.normal);
        break;
    case SHAPE_DISC:
        vector_write("center", object->as.disc.center);
        vector_write("normal", object->as.disc.normal);
        json_number(json, "radius", object->as.disc.radius);
        break;
    case SHAPE_BOX:
        vector_write("min", object->as.box.min);
        vector_write("max", object->as.box.max);
        break;
    case SHAPE_CYLINDER:
        round_write(object->as.cylinder.from, object->as.cylinder.axis, object->as.cylinder.finite,
                    object->as.cylinder.caps, "point");
        json_number(json, "radius", object->as.cylinder.radius);
        break;
    case SHAPE_CONE:
        round_write(object->as.cone.from, object->as.cone.axis, object->as.cone.finite, object->as.cone.caps,
                    "apex");
        numbers_write("radius", object->as.cone.radius, 2);
        if (!object->as.cone.finite) json_number(json, "slope", object->as.cone.slope);
        break;
    case SHAPE_TRIANGLE:
        vectors_write("vertices", object->as.triangle.vertices);
        if (object->as.triangle.smooth) vectors_write("normals", object->as.triangle.normals);
        break;
    case SHAPE_TORUS:
        vector_write("center", object->as.torus.center);
        vector_write("axis", object->as.torus.axis);
        json_number(json, "major", object->as.torus.major);
        json_number(json, "minor", object->as.torus.minor);
        break;
    default:
        fault("the exact oracle does not know such a shape");
    }
}

static bool is_only_inside(const Object *object)
{
    return (object->kind == SHAPE_SPHERE && object->as.sphere.only_inside) ||
           (object->kind == SHAPE_CYLINDER && object->as.cylinder.only_inside) ||
           (object->kind == SHAPE_CONE && object->as.cone.only_inside);
}

static void object_write(const char *key, const Object *object, const Material *material)
{
    if (is_only_inside(object)) fault("the exact oracle does not know surfaces of one side");
    json_begin_object(json, key);
    json_begin_object(json, shape_names[object->kind]);
    shape_write(object);
    if (material) material_write(material);
    json_end(json);
    json_end(json);
}

void __wrap_exact_judge_surface(VerifyRun *run, const Object *object, const TraceRay *ray,
                                const TraceHit *hit)
{
    __real_exact_judge_surface(run, object, ray, hit);
    if (!is_taken(false)) return;
    LongVector direction = long_vector(verify_vector(ray->direction));
    LongVector point = long_add(long_vector(verify_vector(ray->origin)), long_scale(direction, hit->t));
    question_begin("surface", direction);
    numbers_write("origin", ray->origin, 3);
    json_number(json, "t", hit->t);
    object_write("object", object, NULL);
    long_write("distance", exact_surface_distance(run, object, point));
    json_end(json);
}

static void light_write(const Light *light)
{
    static const char *const names[] = {
        [LIGHT_POINT] = "point", [LIGHT_DIRECTIONAL] = "directional", [LIGHT_SPOT] = "spot"};
    json_begin_object(json, NULL);
    json_begin_object(json, names[light->kind]);
    color_write("color", light->color);
    if (light->kind != LIGHT_DIRECTIONAL) vector_write("position", light->position);
    if (light->kind != LIGHT_POINT) vector_write("direction", light->direction);
    if (light->kind == LIGHT_SPOT) {
        json_number(json, "angle", light->angle);
        json_number(json, "penumbra", light->penumbra);
    }
    json_end(json);
    json_end(json);
}

static void scene_write(const Scene *scene)
{
    json_begin_object(json, "scene");
    json_begin_object(json, "camera");
    vector_write("position", scene->camera.position);
    json_end(json);
    color_write("background", scene->background);
    color_write("ambient", scene->ambient);
    json_begin_array(json, "lights");
    for (size_t i = 0; i < scene->lights.count; i++)
        light_write(&scene->lights.items[i]);
    json_end(json);
    json_begin_array(json, "objects");
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        object_write(NULL, object, &scene->materials.items[object->material]);
    }
    json_end(json);
    json_end(json);
}

static void pixel_write(const Film *picture, size_t pixel)
{
    json_begin_object(json, NULL);
    json_integer(json, "pixel", (int64_t)pixel);
    numbers_write("ray", picture->ray + 3 * pixel, 3);
    json_integer(json, "object", picture->object[pixel]);
    json_number(json, "t", picture->t[pixel]);
    numbers_write("normal", picture->normal + 3 * pixel, 3);
    numbers_write("color", picture->color + 3 * pixel, 3);
    json_begin_array(json, "shadow");
    for (size_t light = 0; light < picture->light_count; light++)
        json_integer(json, NULL, picture->shadow[pixel * picture->light_count + light]);
    json_end(json);
    json_end(json);
}

// Something begins or ends here: the next pixel shows another object, way or shadow.
static bool is_border(const Film *picture, size_t pixel)
{
    if (pixel + 1 == film_pixel_count(picture)) return false;
    bool same = picture->path[pixel] == picture->path[pixel + 1];
    for (size_t light = 0; light < picture->light_count; light++) {
        const uint32_t *shadow = picture->shadow + pixel * picture->light_count + light;
        same &= shadow[0] == shadow[picture->light_count];
    }
    return !same;
}

// Half of them evenly over the picture, half of them evenly over its borders.
Film __wrap_verify_render(VerifyRun *run, const Scene *scene, bool hierarchy, uint32_t width, uint32_t height)
{
    Film picture = __real_verify_render(run, scene, hierarchy, width, height);
    size_t pixels = film_pixel_count(&picture), borders = 0, passed = 0;
    for (size_t i = 0; i < pixels; i++)
        borders += is_border(&picture, i);
    size_t half = pixels_per_picture / 2, stride = pixels / (half + 1) + 1,
           border_stride = borders / (half + 1) + 1;
    json_begin_object(json, NULL);
    json_text(json, "kind", "picture");
    scene_write(scene);
    json_begin_array(json, "pixels");
    for (size_t i = 0; i < pixels; i++) {
        bool border = is_border(&picture, i);
        passed += border;
        if (i % stride == stride / 2 || (border && passed % border_stride == 0)) pixel_write(&picture, i);
    }
    json_end(json);
    json_end(json);
    return picture;
}

int main(int argument_count, char **arguments)
{
    if (argument_count < 5) {
        fputs("usage: overhear OUT.json EVERY PIXELS CASE [OPTIONS of glint verify]\n", stderr);
        return EXIT_FAILURE;
    }
    every = strtoul(arguments[2], NULL, 10);
    pixels_per_picture = strtoul(arguments[3], NULL, 10);
    FILE *output = fopen(arguments[1], "w");
    if (!output) {
        perror(arguments[1]);
        return EXIT_FAILURE;
    }
    json = json_open();
    json_begin_array(json, "samples");
    int status = command_verify(argument_count - 3, arguments + 3);
    json_end(json);
    json_print(json, output);
    return fclose(output) == 0 ? status : EXIT_FAILURE;
}
