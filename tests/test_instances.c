// Tests that instances which share a mesh look as copies of it do, wherever and however they lie.
//
// run_tests: sanitize-long-only
#include "host/compile/instances.h"
#include "host/compile/stages.h"
#include "host/render/render_job.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/probe.h"
#include "tests/random_ray.h"
#include "tests/scene_reading.h"

enum { WIDTH = 83, HEIGHT = 47, SIDE = 24, TRIANGLES = 2 * SIDE * SIDE };

// A plain folder, not scratch_open's, since compiled kernels are in the run's cache.
static char *folder;

// Writes a bumpy ball with texture coordinates, and normals if it is smooth.
static void ball_write(const char *name, bool is_smooth)
{
    OwnedText text = {0};
    for (int i = 0; i <= SIDE; i++)
        for (int k = 0; k <= SIDE; k++) {
            const double across = M_PI * (0.02 + 0.96 * i / SIDE), around = 2 * M_PI * k / SIDE;
            const double radius = 1 + 0.1 * sin(7 * across) * cos(5 * around);
            const double x = sin(across) * cos(around), y = cos(across), z = sin(across) * sin(around);
            text_appendf(&text, "v %.9g %.9g %.9g\nvt %.9g %.9g\nvn %.9g %.9g %.9g\n", 0.3 + radius * x,
                         radius * y - 0.2, radius * z, (double)k / SIDE, (double)i / SIDE, x, y, z);
        }
    for (int i = 0; i < SIDE; i++)
        for (int k = 0; k < SIDE; k++) {
            const int a = i * (SIDE + 1) + k + 1, b = a + 1, c = b + SIDE + 1, d = c - 1;
            const char *format = is_smooth ? "f %d/%d/%d %d/%d/%d %d/%d/%d\n" : "f %d/%d %d/%d %d/%d\n";
            if (is_smooth) {
                text_appendf(&text, format, a, a, a, b, b, b, c, c, c);
                text_appendf(&text, format, a, a, a, c, c, c, d, d, d);
            } else {
                text_appendf(&text, format, a, a, b, b, c, c);
                text_appendf(&text, format, a, a, c, c, d, d);
            }
        }
    file_write(formatted("%s/%s", folder, name), text_c(&text));
}

static int instances_open(void **state)
{
    folder = folder_make();
    ball_write("smooth.obj", true);
    ball_write("flat.obj", false);
    return probe_open(state);
}

static int instances_close(void **state)
{
    folder_remove(folder);
    return probe_close(state);
}

// Returns a scene of balls in a group scaled by `size` and moved to `place`, with the camera and the lights.
static Scene scene_with(double size, Vector3 place, const char *objects)
{
    OwnedText text = {0};
    const Vector3 points[] = {{0.5, 2.2, -7}, {0, 0.2, 0}, {4, 7, -5}};
    Vector3 at[3];
    for (int i = 0; i < 3; i++)
        at[i] = vector_add(place, vector_scale(points[i], size));
    text_appendf(&text,
                 "camera: {position: [%.17g, %.17g, %.17g], look_at: [%.17g, %.17g, %.17g], fov: 42}\n",
                 at[0].x, at[0].y, at[0].z, at[1].x, at[1].y, at[1].z);
    text_appendf(&text,
                 "background: [0.1, 0.2, 0.4]\nambient: [0.3, 0.3, 0.3]\n"
                 "lights: [{point: {position: [%.17g, %.17g, %.17g]}}, {directional: {direction: [1, -2, 1], "
                 "color: [0.3, 0.3, 0.4]}}]\n",
                 at[2].x, at[2].y, at[2].z);
    text_appendf(&text, "materials:\n"
                        "  matte: {color: [0.8, 0.3, 0.2], specular: 0.4}\n"
                        "  globe: {image: scenes/images/globe.png}\n"
                        "  mirror: {color: [0.2, 0.3, 0.2], reflection: 0.6}\n"
                        "  glass: {color: [0.1, 0.1, 0.1], transmission: [0.8, 0.5, 0.7], ior: 1.3}\n");
    text_appendf(&text,
                 "define:\n"
                 "  smooth: {objects: [{mesh: {file: %s/smooth.obj, material: globe}}]}\n"
                 "  flat: {objects: [{mesh: {file: %s/flat.obj, material: matte}}]}\n"
                 "  both: {objects: [{instance: {of: flat, transform: {scale: 0.5, translate: [-1, 0, 0]}}},"
                 " {mesh: {file: %s/smooth.obj, material: mirror, transform: {scale: 0.6}}},"
                 " {sphere: {center: [1.4, 0, 0], radius: 0.3, material: mirror}}]}\n",
                 folder, folder, folder);
    text_appendf(
        &text,
        "objects:\n  - group:\n      transform: [{scale: %.17g}, {translate: [%.17g, %.17g, %.17g]}]\n"
        "      objects:\n        - plane: {point: [0, -1.2, 0], normal: [0, 1, 0]}\n%s\n",
        size, place.x, place.y, place.z, objects);
    Scene scene = scene_of_text("a.yaml", text_c(&text));
    return scene;
}

#define INSTANCE(name, transform) "        - instance: {of: " name ", transform: " transform "}\n"

static const char turned[] = INSTANCE("smooth", "{rotate: [20, 130, 50], translate: [-1.5, 0, 0]}")
    INSTANCE("flat", "{rotate: [70, 10, -30], scale: 0.8, translate: [1.2, 0.1, 0.5]}")
        INSTANCE("flat", "{scale: [0.5, 0.5, 0.5], translate: [0.2, 1.4, 0]}");
static const char uneven[] =
    INSTANCE("smooth", "{scale: [-1, 0.7, 1.2], rotate: [20, 30, 0], translate: [-1.5, 0, 0]}")
        INSTANCE("flat", "{matrix: [[0.8, 0.4, 0, 1.3], [0, 0.8, 0.2, 0], [0.1, 0, 0.9, 0.5]]}")
            INSTANCE("smooth", "{matrix: [[0.3, 0.3, 0, 0.2], [0, -0.4, 0, 1.4], [0, 0, 0.4, 0]]}");
static const char nested[] = INSTANCE("both", "{rotate: [0, 40, 10]}")
    INSTANCE("both", "{scale: [0.7, 0.7, -0.7], translate: [0.4, 1.5, 1]}");
static const char clear[] =
    "        - instance: {of: smooth, material: glass, transform: {rotate: [0, 70, 0], translate: [-1.3, 0, "
    "0]}}\n"
    "        - instance: {of: flat, material: glass, transform: {scale: [0.8, -0.8, 0.8], translate: [1, "
    "-0.2, "
    "0]}}\n"
    "        - instance: {of: smooth, material: globe, transform: {scale: 0.4, translate: [0, 1.3, 0.5]}}\n"
    "        - instance: {of: flat, transform: {scale: 0.5, translate: [0, 0, 2.5]}}\n";

static const struct {
    const char *name;
    double size;
    Vector3 place;
    const char *objects;
} cases[] = {
    {"turned", 1, {0, 0, 0}, turned},
    {"mirrored, stretched and sheared", 1, {0, 0, 0}, uneven},
    {"nested", 1, {0, 0, 0}, nested},
    {"of glass", 1, {0, 0, 0}, clear},
    {"scaled by a millionth", 1e-6, {0, 0, 0}, uneven},
    {"at 1e7", 1, {1e7, -2e6, 3e6}, turned},
    {"of a million", 1e6, {3, 4, 5}, nested},
};

static Film render(const Scene *scene, RenderSettings *settings, InstanceChoice instances)
{
    settings->instances = instances;
    return film_render(&probe_compute, scene, settings,
                       AOV_T | AOV_NORMAL | AOV_POSITION | AOV_OBJECT | AOV_SHADOW | AOV_PATH);
}

static double vectors_apart(const double *a, const double *b)
{
    return error_max(fabs(a[0] - b[0]), error_max(fabs(a[1] - b[1]), fabs(a[2] - b[2])));
}

// How far pixels that both films see alike are apart, and the number of others.
typedef struct {
    double t, normal, position, color;
    size_t other_objects, other_shadows, other_paths;
} Difference;

static Difference difference_of(const Film *film, const Film *other)
{
    assert_int_equal(film_count_faulty(film), 0);
    Difference found = {0};
    for (size_t i = 0; i < film_pixel_count(film); i++) {
        if (film->object[i] != other->object[i]) {
            found.other_objects++;
            continue;
        }
        bool is_lit_alike = true;
        for (uint32_t light = 0; light < film->light_count; light++)
            is_lit_alike &=
                film->shadow[i * film->light_count + light] == other->shadow[i * film->light_count + light];
        found.other_shadows += !is_lit_alike;
        found.other_paths += film->path[i] != other->path[i];
        if (film->object[i] == UINT32_MAX) continue;
        found.t = error_max(found.t, fabs(film->t[i] - other->t[i]) / other->t[i]);
        found.normal = error_max(found.normal, vectors_apart(film->normal + 3 * i, other->normal + 3 * i));
        found.position = error_max(
            found.position, vectors_apart(film->position + 3 * i, other->position + 3 * i) / other->t[i]);
        if (is_lit_alike && film->path[i] == other->path[i])
            found.color = error_max(found.color, vectors_apart(film->color + 3 * i, other->color + 3 * i));
    }
    return found;
}

// Checks how far copies and shared meshes differ, with t and positions relative to the distance. The normals
// of copies are those of rounded vertices, which turns them by u times the distance over the size of a
// triangle. In double the vertices are rounded before the camera's position is subtracted.
static void difference_check(const Difference *d, Precision precision, Vector3 place, const char *name)
{
    const double roundoff = (precision == PRECISION_DOUBLE ? DBL_EPSILON : FLT_EPSILON) / 2,
                 far = precision == PRECISION_DOUBLE ? 1 + vector_largest(place) : 1;
    const size_t others = precision == PRECISION_DOUBLE ? 0 : WIDTH * HEIGHT / 1000;
    if (d->other_objects <= others && d->other_shadows <= others && d->other_paths <= others &&
        d->t <= 64 * roundoff * far && d->position <= 64 * roundoff * far &&
        d->normal <= 1024 * roundoff * far && d->color <= 2048 * roundoff * far)
        return;
    fail_msg("%s, %s: %zu other objects, %zu other shadows, %zu other paths; t %.3g, position %.3g, normal "
             "%.3g, color %.3g apart",
             precision_names[precision], name, d->other_objects, d->other_shadows, d->other_paths, d->t,
             d->position, d->normal, d->color);
}

// Returns whether the precision is tested. Short tests take only that whose kernels test_variants has.
static bool is_tested(Precision precision)
{
    return precision == probe_same_bits_from() || (tests_are_long() && probe_has(precision));
}

TEST(shared_meshes_look_as_copies)
{
    for (Precision precision = PRECISION_SINGLE; precision <= PRECISION_DOUBLE; precision++) {
        if (!is_tested(precision)) continue;
        for (size_t i = 0; i < COUNT_OF(cases); i++) {
            OwnedScene scene = scene_with(cases[i].size, cases[i].place, cases[i].objects);
            RenderSettings settings = film_settings(WIDTH, HEIGHT, precision);
            OwnedFilm copied = render(&scene, &settings, INSTANCES_COPIED);
            OwnedFilm shared = render(&scene, &settings, INSTANCES_SHARED);
            const Difference d = difference_of(&shared, &copied);
            difference_check(&d, precision, cases[i].place, cases[i].name);
        }
    }
}

static void check_lanes(Precision precision, size_t i)
{
    OwnedScene scene = scene_with(cases[i].size, cases[i].place, cases[i].objects);
    RenderSettings settings = film_settings(WIDTH, HEIGHT, precision);
    settings.lanes = 1;
    OwnedFilm expected = render(&scene, &settings, INSTANCES_SHARED);
    for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
        if (*lanes == 1) continue;
        settings.lanes = *lanes;
        OwnedFilm film = render(&scene, &settings, INSTANCES_SHARED);
        film_assert_same(&film, &expected, cases[i].name);
    }
}

TEST(lanes_agree)
{
    for (Precision precision = probe_same_bits_from(); precision <= PRECISION_STRICT; precision++) {
        if (!is_tested(precision)) continue;
        for (size_t i = 0; i < COUNT_OF(cases); i++)
            check_lanes(precision, i);
    }
}

// Returns a scene of many instances, some of which overlap.
static Scene many_make(size_t count)
{
    OwnedText text = {0};
    Random random = {7};
    for (size_t i = 0; i < count; i++) {
        const Vector3 turn = vector_scale(random_cube_point(&random, 1), 180),
                      place = random_cube_point(&random, 2.5), scale = random_cube_point(&random, 0.3);
        text_appendf(&text,
                     "        - instance: {of: %s, transform: {scale: [%g, %g, %g], rotate: [%g, %g, %g], "
                     "translate: [%g, %g, %g]}}\n",
                     i % 2 ? "flat" : "smooth", 0.1 + fabs(scale.x), -0.1 - fabs(scale.y),
                     0.1 + fabs(scale.z), turn.x, turn.y, turn.z, place.x, 0.5 * place.y, place.z);
    }
    Scene scene = scene_with(1, (Vector3){0, 0, 0}, text_c(&text));
    return scene;
}

TEST(many_instances_look_as_copies)
{
    OwnedScene scene = many_make(80);
    for (Precision precision = probe_same_bits_from(); precision <= PRECISION_DOUBLE; precision++) {
        if (!is_tested(precision)) continue;
        RenderSettings settings = film_settings(WIDTH, HEIGHT, precision);
        settings.lanes = 1;
        OwnedFilm copied = render(&scene, &settings, INSTANCES_COPIED);
        OwnedFilm expected = render(&scene, &settings, INSTANCES_SHARED);
        const Difference d = difference_of(&expected, &copied);
        difference_check(&d, precision, (Vector3){0, 0, 0}, "many");
        for (const uint32_t *lanes = tested_lanes(probe_compute.device); *lanes; lanes++) {
            if (*lanes == 1) continue;
            settings.lanes = *lanes;
            Film film = render(&scene, &settings, INSTANCES_SHARED);
            film_assert_same(&film, &expected, "lanes");
            film_free(&film);
            settings.bvh = BVH_OFF;
            film = render(&scene, &settings, INSTANCES_SHARED);
            film_assert_same(&film, &expected, "without a BVH around the instances");
            film_free(&film);
            settings.bvh = BVH_AUTO;
        }
    }
}

TEST(the_feature_alone_and_all_together_agree)
{
    OwnedScene scene = many_make(30);
    RenderSettings settings = film_settings(WIDTH, HEIGHT, probe_same_bits_from());
    settings.instances = INSTANCES_SHARED;
    settings.extra_features = 0;
    OwnedFilm alone = film_render(&probe_compute, &scene, &settings, 0);
    settings.extra_features = FEATURE_ALL;
    OwnedFilm all = film_render(&probe_compute, &scene, &settings, 0);
    film_assert_same(&alone, &all, "features");
}

TEST(renderers_share_a_compiled_scene)
{
    OwnedScene scene = many_make(3);
    RenderSettings settings = film_settings(WIDTH, HEIGHT, PRECISION_SINGLE);
    settings.instances = INSTANCES_SHARED;
    Renderer *renderers[2] = {NULL};
    MessageList messages[3] = {0};
    const RendererSet set = {renderers, (Compute *[]){&probe_compute, &probe_compute}, messages, 2};
    assert_true(renderers_open(&set, &scene, &settings, NULL, &messages[2]));
    for (size_t i = 0; i < 2; i++)
        renderer_close(renderers[i]);
}

TEST(a_moved_camera_sees_what_a_new_one_sees)
{
    for (int few = 0; few < 2; few++) {
        OwnedScene scene = many_make(few ? 3 : 30);
        RenderSettings settings = film_settings(WIDTH, HEIGHT, probe_same_bits_from());
        settings.instances = INSTANCES_SHARED;
        settings.moves = true;
        MessageList messages = {0};
        Renderer *renderer = probe_renderer(&scene, &settings);
        static const Vector3 places[] = {{3, 2, -5}, {-4, 1, 3}, {0, 6, 0.1}};
        for (size_t i = 0; i < 3; i++) {
            scene.camera.position = places[i];
            assert_true(renderer_move(renderer, &scene, &settings, &messages));
            OwnedFilm moved, fresh = film_render(&probe_compute, &scene, &settings, AOV_OBJECT);
            assert_true(renderer_render_film(renderer, AOV_OBJECT, &moved));
            film_assert_same(&moved, &fresh, "moved");
        }
        renderer_close(renderer);
        assert_int_equal(messages.count, 0);
    }
}

static const CompileSettings plain_settings = {.width = 1,
                                               .height = 1,
                                               .sample_count = 1,
                                               .precision = PRECISION_SINGLE,
                                               .lanes = 16,
                                               .shift_to_eye = true};

static size_t instance_count(const Scene *scene, const CompileSettings *settings)
{
    OwnedCompiledScene compiled = scene_compiled(scene, settings);
    const size_t count = compiled.arrays[FLAT_FIRST_SHAPE + TYPE_INSTANCES].count;
    return count;
}

// Copies of more than 2^18 triangles are not made.
TEST(meshes_are_shared_where_copies_are_large)
{
    enum { MOST = (1 << 18) / TRIANGLES };
    Scene scenes[2] = {many_make(MOST), many_make(MOST + 1)};
    CompileSettings settings = plain_settings;
    assert_int_equal(instance_count(&scenes[0], &settings), 0);
    assert_int_equal(instance_count(&scenes[1], &settings), MOST + 1);
    settings.certifies = true;
    assert_int_equal(instance_count(&scenes[1], &settings), 0);
    scene_free(&scenes[0]);
    scene_free(&scenes[1]);
}

TEST(an_uneven_transform_makes_a_copy)
{
    // across a diagonal, and along the mesh's axes, where no digit is lost
    OwnedScene scene =
        scene_with(1, (Vector3){0, 0, 0},
                   INSTANCE("flat", "[{rotate: [0, 0, 45]}, {scale: [1, 0.01, 1]}]")
                       INSTANCE("flat", "{scale: [1, 0.01, 1]}") INSTANCE("flat", "{rotate: [0, 0, 45]}")
                           INSTANCE("smooth", "[{rotate: [0, 0, 45]}, {scale: [1, 0.01, 1]}]"));
    CompileSettings settings = plain_settings;
    settings.instances = INSTANCES_SHARED;
    OwnedCompiledScene compiled = scene_compiled(&scene, &settings);
    assert_int_equal(compiled.arrays[FLAT_FIRST_SHAPE + TYPE_INSTANCES].count, 2);
    assert_int_equal(compiled.arrays[FLAT_SHARED_MESHES].count, 1);
    assert_int_equal(compiled.arrays[FLAT_FIRST_SHAPE + TYPE_TRIANGLES].count, 3 * TRIANGLES);
}

// A material with an image makes separate texture coordinates, other materials do not.
TEST(materials_share_geometry)
{
    OwnedScene scene =
        scene_with(1, (Vector3){0, 0, 0},
                   INSTANCE("flat", "{scale: 1}")
                       INSTANCE("flat", "{scale: 2}") "        - instance: {of: smooth, material: matte}\n"
                                                      "        - instance: {of: smooth, material: globe}\n"
                                                      "        - instance: {of: smooth, material: globe}\n");
    CompileSettings settings = plain_settings;
    settings.instances = INSTANCES_SHARED;
    OwnedCompiledScene compiled = scene_compiled(&scene, &settings);
    assert_int_equal(compiled.arrays[FLAT_SHARED_MESHES].count, 3);
}

static void check_message(const Scene *scene, const CompileSettings *settings, const char *expected)
{
    CompiledScene compiled;
    OwnedMessageList messages = {0};
    assert_false(scene_compile(&compiled, scene, settings, &messages));
    OwnedText text = {0};
    message_describe(&text, &messages.items[0]);
    assert_string_equal(text_c(&text), expected);
}

// Repeats the scene's last object, which costs no memory but its own.
static void object_repeat(Scene *scene, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const Object object = scene->objects.items[scene->objects.count - 1];
        array_push(scene->objects, object);
    }
}

TEST(too_many_are_refused)
{
    OwnedScene scene = scene_with(1, (Vector3){0, 0, 0}, INSTANCE("flat", "{scale: 1}"));
    object_repeat(&scene, (1 << 24) / TRIANGLES);
    CompileSettings settings = plain_settings;
    settings.certifies = true;
    check_message(&scene, &settings,
                  "error: copies of meshes have 16777728 triangles in total; at most 16777216 are allowed; "
                  "precision certified copies the mesh of each instance\n");
    object_repeat(&scene, (INT32_MAX - 1) / TRIANGLES - scene.objects.count + 2);
    settings.certifies = false;
    check_message(
        &scene, &settings,
        "error: the scene has 2147484673 objects and triangles, those of all instances included; at "
        "most 2147483646 are supported\n");
}

// Counts only: the mesh does not have these triangles.
TEST(one_instance_of_a_large_mesh_is_not_a_copy)
{
    OwnedScene scene = scene_with(1, (Vector3){0, 0, 0}, INSTANCE("flat", "{scale: 1}"));
    Mesh *mesh = &scene.meshes.items[scene.objects.items[1].as.mesh.index];
    const size_t count = mesh->triangle_count;
    const CompiledScene compiled = {0};
    OwnedMessageList messages = {0};
    mesh->triangle_count = (1 << 24) + 1;
    assert_true(size_fits(&compiled, &scene, &plain_settings, &messages));
    object_repeat(&scene, 1);
    assert_false(size_fits(&compiled, &scene, &plain_settings, &messages));
    mesh->triangle_count = count;
}

// 10,000 instances of 20,000 triangles need the arrays of one mesh and of the instances.
TEST(instances_take_little_memory)
{
    OwnedScene scene = scene_with(1, (Vector3){0, 0, 0}, INSTANCE("flat", "{scale: 1}"));
    const Mesh small = scene.meshes.items[scene.objects.items[1].as.mesh.index];
    Mesh *mesh = &scene.meshes.items[scene.objects.items[1].as.mesh.index];
    enum { TIMES = 20000 / TRIANGLES + 1 };
    mesh->triangles = memory_allocate(TIMES * small.triangle_count, sizeof *mesh->triangles);
    for (size_t i = 0; i < TIMES * small.triangle_count; i++)
        memcpy(mesh->triangles[i], small.triangles[i % small.triangle_count], sizeof *mesh->triangles);
    mesh->triangle_count = TIMES * small.triangle_count;
    free(small.triangles);
    object_repeat(&scene, 9999);
    for (uint32_t lanes = 1; lanes <= 16; lanes *= 16) {
        CompileSettings settings = plain_settings;
        settings.lanes = lanes;
        OwnedCompiledScene compiled = scene_compiled(&scene, &settings);
        size_t device = 0, host = 0;
        for (size_t type = 0; type < FLAT_COUNT; type++) {
            device += flat_array_size(&compiled.arrays[type], false);
            host += compiled.arrays[type].count * compiled.arrays[type].layout.size;
        }
        assert_true(device > 0 && device <= 10 << 20);
        assert_true(host > 0 && host <= 16 << 20);
    }
}

TEST_MAIN(instances_open, instances_close)
