// Attacks the culls of macro-tiles with triangles and spheres within a few ulp of where a cull changes its
// answer. The image must have the same bits with the BVH and without it.
//
// run_tests: sanitize-long-only
#include "host/verify/random_shape.h"
#include "tests/check.h"
#include "tests/probe.h"

static Random random_state;

enum { WIDTH = 48, HEIGHT = 36, OBJECTS = 300, MATERIALS = 7 };

static const double half_tangent = 0.75, floor_y = -3, farthest = 12;

// Returns the direction of a pixel. The camera looks from 0 along -z. All sizes below are in units of the
// scene's size.
static Vector3 pixel_direction(uint64_t column, uint64_t row)
{
    double unit = half_tangent / WIDTH;
    return (Vector3){(2 * (double)column + 1 - WIDTH) * unit, (HEIGHT - 1 - 2 * (double)row) * unit, -1};
}

static Vector3 random_pixel_direction(void)
{
    return pixel_direction(random_bits(&random_state) % WIDTH, random_bits(&random_state) % HEIGHT);
}

// Returns the point that a camera ray hits if nothing is in its way.
static Vector3 point_behind(Vector3 direction)
{
    double t = direction.y < 0 ? fmin(floor_y / direction.y, farthest) : farthest;
    return vector_scale(direction, t);
}

// Moves a value by up to 4 ulp of a float.
static double nudge(double value)
{
    float nudged = (float)value;
    for (uint64_t steps = random_bits(&random_state) % 5; steps > 0; steps--)
        nudged = nextafterf(nudged, random_coin(&random_state) ? INFINITY : -INFINITY);
    return nudged;
}

static Vector3 vector_nudge(Vector3 v)
{
    return (Vector3){nudge(v.x), nudge(v.y), nudge(v.z)};
}

// The common origins: the eye, one light above all, one among the objects, one at the height of the floor.
static const Vector3 origins[] = {{0, 0, 0}, {2, 9, 1}, {0.25, -0.5, -6}, {-7, -3, -5}};
enum { ORIGINS = COUNT_OF(origins) };

// Returns a point on the ray of a pixel, or on the way from what it sees to a light, at any distance from
// there.
static Vector3 point_in_view(size_t origin, Vector3 seen, double along)
{
    return vector_add(origins[origin], vector_scale(vector_subtract(seen, origins[origin]), along));
}

static double *component(Vector3 *v, size_t axis)
{
    return axis == 0 ? &v->x : axis == 1 ? &v->y : &v->z;
}

// Returns a triangle that fills a corner of a flat box, whose sides along the axes meet at a point in view.
static Object flat_triangle_in_view(void)
{
    static const double layers[] = {0.5, 1, 2, 4}; // few, so that triangles of one share leaves
    size_t origin = random_bits(&random_state) % ORIGINS;
    Vector3 seen = point_behind(random_pixel_direction());
    Vector3 way = vector_subtract(seen, origins[origin]);
    size_t w_axis = 0;
    for (size_t axis = 1; axis < 3; axis++)
        if (fabs(*component(&way, axis)) > fabs(*component(&way, w_axis))) w_axis = axis;
    double along = layers[random_bits(&random_state) % 4] / fabs(*component(&way, w_axis));
    Vector3 corner = vector_nudge(point_in_view(origin, seen, along));
    Object object = {.type = SHAPE_TRIANGLE, .as.triangle.vertices = {corner, corner, corner}};
    for (size_t i = 1; i < 3; i++) {
        double side = random_power(&random_state, -2, 0) * (random_coin(&random_state) ? 1 : -1);
        *component(&object.as.triangle.vertices[i], (w_axis + i) % 3) += side;
    }
    return object;
}

// Returns a triangle whose first edge is in a plane with the common origin and through pixels. All vertices
// of every third triangle are, so that it is seen edge-on.
static Object triangle_in_view(size_t index)
{
    size_t origin = random_bits(&random_state) % ORIGINS;
    Vector3 first = random_pixel_direction(), second = first;
    if (random_coin(&random_state))
        second.x = random_pixel_direction().x;
    else
        second.y = random_pixel_direction().y;
    double along = random_between(&random_state, 0.05, 0.95);
    double size = random_power(&random_state, -2, 0);
    Vector3 a = point_in_view(origin, point_behind(first), along);
    Vector3 b = point_in_view(origin, point_behind(second), along + size * 0.1);
    Vector3 c = index % 3 == 0 ? point_in_view(origin, point_behind(first), along + size * 0.2)
                               : vector_add(a, vector_scale(random_unit_vector(&random_state), size));
    return (Object){.type = SHAPE_TRIANGLE,
                    .as.triangle.vertices = {vector_nudge(a), vector_nudge(b), vector_nudge(c)}};
}

// Returns a sphere that touches the ray of a pixel.
static Object sphere_in_view(void)
{
    size_t origin = random_bits(&random_state) % ORIGINS;
    Vector3 seen = point_behind(random_pixel_direction());
    Vector3 along = vector_normalize(vector_subtract(seen, origins[origin]));
    Vector3 touched = point_in_view(origin, seen, random_between(&random_state, 0.05, 0.95));
    Vector3 aside = vector_normalize(vector_cross(along, random_unit_vector(&random_state)));
    double radius = random_power(&random_state, -4, -0.5); // from less than a pixel on
    Vector3 center = vector_add(touched, vector_scale(aside, radius));
    return (Object){.type = SHAPE_SPHERE, .as.sphere = {vector_nudge(center), nudge(radius), false}};
}

static void object_scale(Object *object, double scale)
{
    if (object->type == SHAPE_SPHERE) {
        object->as.sphere.center = vector_scale(object->as.sphere.center, scale);
        object->as.sphere.radius *= scale;
        return;
    }
    for (size_t i = 0; i < 3; i++)
        object->as.triangle.vertices[i] = vector_scale(object->as.triangle.vertices[i], scale);
}

static Scene scene_attacking(double scale)
{
    Scene scene = {.camera = {.look_at = {0, 0, -scale},
                              .up = {0, 1, 0},
                              .field_axis = FIELD_HORIZONTAL,
                              .half_tangent = half_tangent}};
    for (size_t i = 0; i < MATERIALS; i++) {
        Material material = material_default();
        material.diffuse = vector_all(0.3 + 0.6 * (double)i / MATERIALS);
        array_push(scene.materials, material);
    }
    for (size_t i = 1; i < ORIGINS; i++)
        array_push(scene.lights, ((Light){.type = LIGHT_POINT,
                                          .color = {0.5, 0.4, 0.3},
                                          .position = vector_scale(origins[i], scale)}));
    for (size_t i = 0; i < OBJECTS; i++) {
        Object object = i % 4 == 3   ? sphere_in_view()
                        : i % 4 == 2 ? triangle_in_view(i / 4)
                                     : flat_triangle_in_view();
        object.material = (uint32_t)(i % MATERIALS);
        object_scale(&object, scale);
        array_push(scene.objects, object);
    }
    array_push(scene.objects,
               ((Object){.type = SHAPE_PLANE, .as.plane = {{0, floor_y * scale, 0}, {0, 1, 0}}}));
    return scene;
}

// Counts the pixels that see an object, and those of them that are in the shadow of a light.
static void count_seen(const Film *film, const Scene *scene, size_t *seen, size_t *shadowed)
{
    const size_t light_count = scene->lights.count;
    *seen = *shadowed = 0;
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; i++) {
        *seen += film->object[i] < scene->objects.count &&
                 scene->objects.items[film->object[i]].type != SHAPE_PLANE;
        for (size_t light = 0; light < light_count; light++)
            *shadowed += film->shadow[i * light_count + light] == 1;
    }
}

static void assert_same_with_the_bvh(const Scene *scene, Precision precision)
{
    for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
        if (*lanes == 1) continue; // has no macro-tiles
        RenderSettings settings = film_settings(WIDTH, HEIGHT, precision);
        settings.lanes = *lanes;
        settings.bvh = BVH_OFF;
        OwnedFilm expected = film_render(&probe_compute, scene, &settings, AOV_OBJECT | AOV_SHADOW);
        settings.bvh = BVH_ON;
        OwnedFilm film = film_render(&probe_compute, scene, &settings, AOV_OBJECT | AOV_SHADOW);
        film_assert_same(&film, &expected, precision_names[precision]);
        size_t seen, shadowed;
        count_seen(&expected, scene, &seen, &shadowed);
        assert_true(seen >= WIDTH * HEIGHT / 8 && seen <= WIDTH * HEIGHT * 7 / 8);
        assert_true(shadowed >= 16);
    }
}

static bool is_tested(Precision precision)
{
    const Precision from = probe_sound_from();
    return precision == from || (tests_are_long() && precision > from && probe_has(precision));
}

TEST(no_pixel_depends_on_the_bvh)
{
    static const double scales[] = {1, 0x1p-30, 0x1p26}; // beyond, the scene's unit changes
    const size_t scene_count = tests_are_long() ? 60 : 12;
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++)
        for (size_t i = 0; i < scene_count && is_tested(precision); i++) {
            random_state.state = i + 1;
            OwnedScene scene = scene_attacking(scales[i % 3]);
            assert_same_with_the_bvh(&scene, precision);
        }
}

static void sheet_add(Scene *scene, double z, bool has_holes)
{
    enum { COLUMNS = 20, ROWS = 12 };
    const double cell = 0.1;
    for (int i = 0; i < COLUMNS * ROWS; i++) {
        const int column = i % COLUMNS - COLUMNS / 2, row = i / COLUMNS - ROWS / 2;
        const double x = column * cell, y = row * cell;
        const Vector3 a = {x, y, z}, b = {x + cell, y, z}, c = {x, y + cell, z}, d = {x + cell, y + cell, z};
        for (int half = 0; half < 2; half++) {
            if (has_holes && random_coin(&random_state)) continue;
            array_push(scene->objects,
                       ((Object){.type = SHAPE_TRIANGLE,
                                 .as.triangle.vertices = {half ? d : a, half ? c : b, half ? b : c}}));
        }
    }
}

// Light of a lamp that is so far off that a vertex seen from there is rounded by more than two sheets of
// triangles are apart, the nearer with holes.
TEST(no_shadow_of_a_far_lamp_depends_on_the_bvh)
{
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
        if (!is_tested(precision)) continue;
        random_state.state = 1;
        OwnedScene scene = {.camera = {.look_at = {0, 0, -1},
                                       .up = {0, 1, 0},
                                       .field_axis = FIELD_HORIZONTAL,
                                       .half_tangent = half_tangent}};
        array_push(scene.materials, material_default());
        array_push(scene.lights,
                   ((Light){.type = LIGHT_POINT, .color = {1, 1, 1}, .position = {9e3, 3e3, 3.5e3}}));
        sheet_add(&scene, -1.5, false);
        sheet_add(&scene, -1.498, true);
        assert_same_with_the_bvh(&scene, precision);
    }
}

TEST_MAIN(probe_open, probe_close)
