// A scene of every shape, scaled, mirrored and turned. The image may change only in the known way.
#include "host/base/array.h"
#include "host/compile/transform.h"
#include "host/verify/run.h"
#include <math.h>

// The eye is the origin, so that rays can be traced in the scene unchanged.
static const char every_shape[] =
    "background: [0.1, 0.15, 0.25]\nambient: [0.08, 0.07, 0.06]\n"
    "lights:\n"
    "  - point:       {position: [-5.9, 4.6, 4.1], color: [1, 0.9, 0.7], intensity: 0.6}\n"
    "  - directional: {direction: [-0.4, -1, 0.55], color: [0.35, 0.4, 0.5]}\n"
    "  - spot:        {position: [0.8, 3.1, 5.9], look_at: [0.9, -3.1, 10.4], angle: 31, penumbra: 9}\n"
    "materials:\n"
    "  floor:  {checker: {colors: [[0.9, 0.85, 0.8], [0.25, 0.3, 0.35]], size: 0.83}, diffuse: 0.9}\n"
    "  red:    {color: [0.85, 0.2, 0.15], diffuse: 0.8, specular: 0.5, shininess: 37}\n"
    "  matt:   {color: [0.8, 0.75, 0.7], diffuse: 0.85, specular: 0.2, shininess: 0}\n"
    "  cubes:  {checker: {colors: [[0.95, 0.7, 0.2], [0.2, 0.2, 0.3]], size: 0.37}, diffuse: 0.8, "
    "specular: 0.4, shininess: 40}\n"
    "  mirror: {color: [0.4, 0.4, 0.45], diffuse: 0.4, specular: 0.6, shininess: 30, reflection: 0.6}\n"
    "  glass:  {diffuse: 0.1, specular: 0.5, shininess: 50, transmission: 0.8, reflection: 0.1, ior: 1.45}\n"
    "objects:\n"
    "  - plane:    {point: [0.1, -3.15, 10.2], normal: [0.02, 1, -0.03], material: floor}\n"
    "  - sphere:   {center: [-3.7, -2.2, 8.1], radius: 0.87, material: red}\n"
    "  - sphere:   {center: [2.1, -0.2, 11.5], radius: 0.61, material: cubes}\n"
    "  - disc:     {center: [-5, -0.8, 13.3], normal: [0.5, 0.3, -1], radius: 1.35, material: cubes}\n"
    "  - box:      {min: [-2.05, -3.3, 9.05], max: [-0.95, -2.03, 10.33], material: cubes}\n"
    "  - cylinder: {from: [-0.05, -3.1, 8.1], to: [0.3, -1.75, 8.5], radius: 0.46, material: red}\n"
    "  - cylinder: {from: [3.5, -2.7, 10.9], to: [2.7, -1.2, 9.8], radius: 0.53, caps: false, "
    "material: matt}\n"
    "  - cylinder: {point: [-6.8, -3.1, 16.5], axis: [0.12, 1, 0.07], radius: 0.42, material: matt}\n"
    "  - cone:     {from: [1.6, -3.1, 7.6], to: [1.7, -1.6, 7.8], radius: [0.66, 0], material: red}\n"
    "  - cone:     {from: [0.3, -3, 12.1], to: [0.6, -0.9, 12.3], radius: [0.85, 0.35], material: matt}\n"
    "  - cone:     {from: [-2.9, -1.5, 11.9], to: [-2.8, -0.2, 11.7], radius: [0.3, 0.75], caps: false, "
    "material: matt}\n"
    "  - cone:     {apex: [5.5, -0.7, 15.4], axis: [0.2, 1, 0.1], angle: 17, material: red}\n"
    "  - triangle: {vertices: [[-1.5, -1.2, 12.9], [0.1, 0.5, 12.4], [-2, 0.8, 13.3]], material: red}\n"
    "  - triangle: {vertices: [[1.1, -3, 6.6], [2.1, -3.05, 6.3], [1.5, -2.2, 6.8]], material: matt,\n"
    "      normals: [[-0.4, 0.1, -1], [0.4, 0.1, -1], [0, 0.6, -1]]}\n"
    "  - sphere:   {center: [-2.1, -0.7, 9.3], radius: 0.52, material: mirror}\n"
    "  - sphere:   {center: [-1.3, -2.6, 6.8], radius: 0.49, material: glass}\n"
    "  - torus:    {center: [3.3, -2.6, 7.5], axis: [0.3, 1, -0.4], major: 0.6, minor: 0.22, "
    "material: matt}\n";

static Scene *every_shape_scene(VerifyRun *run)
{
    Scene *scene = verify_scene(run, "%s", every_shape);
    const Vector3 eye = {0, 0, 0}, middle = {-0.5, -2, 10};
    scene->camera = verify_camera(eye, middle, 40);
    scene->camera.up = (Vector3){0.1, 1, 0};
    return scene;
}

// Counts the objects that no pixel shows, because two empty images would agree.
static void check_every_object(VerifyRun *run, const Scene *scene, const Film *image)
{
    for (size_t object = 0; object < scene->objects.count; object++) {
        size_t pixel = 0;
        while (pixel < film_pixel_count(image) && image->object[pixel] != object)
            pixel++;
        run->result->wrong += pixel == film_pixel_count(image);
    }
}

typedef struct {
    const Film *image;
    double scale; // of lengths
    bool mirrored;
} ChangedImage;

static bool pixels_agree(const Film *a, size_t i, const ChangedImage *changed, size_t k)
{
    const Film *b = changed->image;
    double side = changed->mirrored ? -1 : 1, scale = changed->scale;
    bool same = a->object[i] == b->object[k] && a->path[i] == b->path[k];
    same &= b->t[k] == a->t[i] * scale;
    for (size_t axis = 0; axis < 3; axis++) {
        double flip = axis == 0 ? side : 1;
        same &= a->color[3 * i + axis] == b->color[3 * k + axis];
        same &= a->normal[3 * i + axis] * flip == b->normal[3 * k + axis];
        same &= a->position[3 * i + axis] * scale * flip == b->position[3 * k + axis];
        same &= a->ray[3 * i + axis] * flip == b->ray[3 * k + axis];
    }
    for (size_t light = 0; light < a->light_count; light++)
        same &= a->shadow[i * a->light_count + light] == b->shadow[k * a->light_count + light];
    return same;
}

// Counts the pixels that differ between two images, bit for bit except for the sign of a zero.
static void check_change(VerifyRun *run, const Film *a, const ChangedImage *changed)
{
    for (size_t i = 0; i < film_pixel_count(a); i++) {
        size_t column = i % a->width, other = changed->mirrored ? i + a->width - 1 - 2 * column : i;
        run->result->differing += !pixels_agree(a, i, changed, other);
    }
}

void verify_scaled_scenes(VerifyRun *run)
{
    static const int exponents[] = {-20, -10, -3, 3, 10, 20};
    Scene *scene = every_shape_scene(run);
    Film image = verify_render(run, scene, false, 160, 120);
    check_every_object(run, scene, &image);
    for (size_t i = 0; i < COUNT_OF(exponents); i++) {
        const CaseMemory before = run->memory;
        double scale = ldexp(1, exponents[i]);
        Scene *scaled = every_shape_scene(run);
        scene_scale(scaled, scale);
        Film other = verify_render(run, scaled, i % 2, 160, 120);
        check_change(run, &image, &(ChangedImage){&other, scale, false});
        verify_release_since(run, &before);
    }
}

// Returns whether a ray, or one turned by a few roundings, hits the object.
static bool hits_nearby(VerifyRun *run, Renderer *opened, Vector3 direction, uint32_t object)
{
    enum { COUNT = 27 };
    // A tier leaves 4 u times distance over radius, or 16 u, of 1 - (l / radius)^2 open (is_open). As an
    // angle that is 2 u at any distance, or up to 8 u. Each of the two scenes may be off by that, and by as
    // much again through the rounding of its pixels' rays.
    const double turn = 4 * 8 * verify_roundoff(run);
    TraceRay rays[COUNT];
    TraceHit hits[COUNT];
    for (int i = 0; i < COUNT; i++) {
        const int x = i % 3 - 1, y = i / 3 % 3 - 1, z = i / 9 - 1;
        const Vector3 offset = vector_scale((Vector3){x, y, z}, turn);
        rays[i] = verify_ray(run, (Vector3){0, 0, 0}, vector_add(direction, offset));
    }
    verify_trace_opened(run, opened, rays, COUNT, hits);
    for (int i = 0; i < COUNT; i++)
        if (hits[i].object == object) return true;
    return false;
}

static bool has_shadow_edge_near(const Film *image, size_t pixel, size_t light)
{
    size_t column = pixel % image->width, row = pixel / image->width;
    uint32_t here = image->shadow[pixel * image->light_count + light];
    for (size_t y = row > 0 ? row - 1 : 0; y <= row + 1 && y < image->height; y++)
        for (size_t x = column > 0 ? column - 1 : 0; x <= column + 1 && x < image->width; x++)
            if (image->shadow[(y * image->width + x) * image->light_count + light] != here) return true;
    return false;
}

// Compares the scene with its axes exchanged. The object may differ if a ray within a few roundings hits the
// other one, and a shadow may differ at its edge. All other pixels must have the same colors within 1e-5.
static void check_turned(VerifyRun *run, Renderer *opened, const Film *image, const Film *turned)
{
    for (size_t i = 0; i < film_pixel_count(image); i++) {
        bool same = image->object[i] == turned->object[i];
        if (!same)
            run->result->wrong +=
                !hits_nearby(run, opened, vector_from(&image->ray[3 * i]), turned->object[i]);
        for (size_t light = 0; light < image->light_count && same; light++) {
            size_t k = i * image->light_count + light;
            if (image->shadow[k] == turned->shadow[k]) continue;
            same = false;
            run->result->wrong += !has_shadow_edge_near(image, i, light);
        }
        for (size_t k = 3 * i; k < 3 * i + 3 && same; k++)
            verify_record(run, fabs(image->color[k] - turned->color[k]), 1e-5, "of 1");
    }
}

// Returns the scene without checkers, because an edge of squares belongs to one, and in the mirror to the
// other.
static Scene *unchecked_scene(VerifyRun *run)
{
    Scene *scene = every_shape_scene(run);
    for (size_t i = 0; i < scene->materials.count; i++)
        scene->materials.items[i].checker.is_on = false;
    return scene;
}

// Returns the scene without checkers, without mirrors and glass, which magnify roundings, and without the
// tip of a cone, around which the normal turns by the point's error over its distance from the tip.
static Scene *plain_scene(VerifyRun *run)
{
    Scene *scene = unchecked_scene(run);
    for (size_t i = 0; i < scene->materials.count; i++)
        scene->materials.items[i].reflection = scene->materials.items[i].transmission = (TintedFactor){0};
    for (size_t i = 0; i < scene->objects.count; i++) {
        Object *object = &scene->objects.items[i];
        if (object->type == SHAPE_CONE && object->as.cone.finite)
            object->as.cone.radius[1] = fmax(object->as.cone.radius[1], 0.3);
    }
    return scene;
}

void verify_mirrored_scenes(VerifyRun *run)
{
    for (uint32_t width = 511; width <= 512; width++) {
        Scene *scene = unchecked_scene(run), *mirrored = unchecked_scene(run);
        scene_mirror(mirrored);
        Film image = verify_render(run, scene, false, width, 128);
        check_every_object(run, scene, &image);
        Film other = verify_render(run, mirrored, false, width, 128);
        check_change(run, &image, &(ChangedImage){&other, 1, true});
    }
    Scene *scene = plain_scene(run), *turned = plain_scene(run);
    Film image = verify_render(run, scene, false, 256, 192);
    check_every_object(run, scene, &image);
    Renderer *opened = verify_open(run, scene, false);
    for (unsigned turns = 1; turns < 3; turns++) {
        scene_turn_axes(turned);
        Film other = verify_render(run, turned, false, 256, 192);
        check_turned(run, opened, &image, &other);
    }
    renderer_close(opened);
}
