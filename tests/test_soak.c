// Renders random scenes with random settings one after another in one process, as a window or a program that
// uses the renderer does. Its memory does not grow, and each image is that of a process that renders nothing
// else. Long tests render 10,000 scenes.
// run_tests: sanitize-long-only
#include "host/base/hash.h"
#include "host/scene/mesh.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/files.h"
#include "tests/probe.h"
#include "tests/random_scene.h"
#include <malloc.h>

enum {
    OBJECTS = 40,
    SCENES_MAX = 10000,
    SCENES = 24,     // where tests are short
    FRESH_MAX = 100, // processes that render one of them each
    FRESH = 2,
    RAYS = 3,
    // What all scenes may leave allocated the second time: PoCL's pools still grow by 28 KiB in 24 scenes,
    // and a lost film of these has 5 KiB.
    BYTES_KEPT_MAX = 1 << 16,
};

typedef struct {
    size_t count;
    uint64_t images[SCENES_MAX];    // their hashes
    size_t bytes_once, bytes_twice; // allocated when all were rendered once, and twice
} Soak;

static char image_path[64];

static uint32_t random_index(Random *random, uint32_t count)
{
    return (uint32_t)(random_bits(random) % count);
}

// Returns a strip of triangles, smooth or flat, with texture coordinates.
static Mesh random_mesh(Random *random, uint32_t material_count)
{
    const size_t count = 3 + random_index(random, 30);
    Mesh mesh = {.vertex_count = count, .triangle_count = count - 2};
    mesh.vertices = memory_allocate(count, sizeof *mesh.vertices);
    mesh.uvs = memory_allocate(count, sizeof *mesh.uvs);
    mesh.triangles = memory_allocate(count - 2, sizeof *mesh.triangles);
    for (size_t i = 0; i < count; i++) {
        mesh.vertices[i] = vector_scale(random_in_sphere(random), 3);
        mesh.uvs[i][0] = random_between(random, -1, 2);
        mesh.uvs[i][1] = random_between(random, 0, 1);
    }
    for (uint32_t i = 0; i < count - 2; i++)
        memcpy(mesh.triangles[i], (uint32_t[]){i, i + 1, i + 2}, sizeof *mesh.triangles);
    if (random_coin(random)) mesh_make_normals(&mesh);
    if (random_coin(random)) {
        mesh.materials = memory_allocate(count - 2, sizeof *mesh.materials);
        for (size_t i = 0; i < count - 2; i++)
            mesh.materials[i] = random_index(random, material_count);
    }
    return mesh;
}

static bool takes_image(ShapeType type)
{
    return type == SHAPE_SPHERE || type == SHAPE_PLANE || type == SHAPE_DISC;
}

// Returns a scene of one object up to all, mostly with a mesh and with an image on what can have one.
static Scene soak_scene(Random *random)
{
    Scene scene = random_scene(random_bits(random), OBJECTS);
    const uint32_t kept = 1 + random_index(random, OBJECTS);
    for (uint32_t i = 0; i < kept; i++) {
        const uint32_t other = i + random_index(random, OBJECTS - i);
        const Object object = scene.objects.items[i];
        scene.objects.items[i] = scene.objects.items[other];
        scene.objects.items[other] = object;
    }
    scene.objects.count = kept;
    scene.lights.count = random_index(random, (uint32_t)scene.lights.count + 1);
    const uint32_t plain_count = (uint32_t)scene.materials.count;
    Material textured = scene.materials.items[random_index(random, plain_count)];
    textured.checker.is_on = false;
    textured.image.texture = scene_add_texture(&scene, image_path, NULL, false, 0);
    MessageList messages = {0};
    assert_true(
        image_read(&scene.textures.items[textured.image.texture - 1].image, image_path, NULL, &messages));
    textured.texture_size = random_between(random, 0.5, 4);
    array_push(scene.materials, textured);
    for (uint32_t i = 0; i < kept; i++)
        if (takes_image(scene.objects.items[i].type) && random_coin(random))
            scene.objects.items[i].material = plain_count;
    if (random_coin(random)) {
        const Mesh mesh = random_mesh(random, plain_count + 1);
        array_push(scene.meshes, mesh);
        array_push(scene.objects, ((Object){.type = SHAPE_MESH, .material = plain_count}));
    }
    return scene;
}

static RenderSettings soak_settings(Random *random)
{
    // certified only in long tests, since its kernels with all features take half a minute to build
    const Precision precision =
        (Precision)random_index(random, tests_are_long() ? PRECISION_COUNT : PRECISION_CERTIFIED);
    RenderSettings settings = film_settings(16, 12, probe_has(precision) ? precision : PRECISION_SINGLE);
    settings.extra_features = FEATURE_ALL; // one kernel for all
    settings.sample_count = 1 + random_index(random, 3);
    settings.bounce_count = random_index(random, 7);
    settings.bvh = (BvhChoice)random_index(random, BVH_CHOICE_COUNT);
    settings.band_rows = random_index(random, 5);
    if (random_coin(random)) {
        settings.region_x = random_index(random, settings.width);
        settings.region_y = random_index(random, settings.height);
        settings.region_width = 1 + random_index(random, settings.width - settings.region_x);
        settings.region_height = 1 + random_index(random, settings.height - settings.region_y);
    }
    return settings;
}

static uint64_t film_hash(const Film *film)
{
    uint64_t hash = HASH_START;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (film->layers[layer]) hash = hash_bytes(hash, film->layers[layer], film_layer_size(film, layer));
    return hash;
}

static void must(bool done, const char *what)
{
    if (!done) fault("%s failed", what);
}

static uint64_t rays_hash(Renderer *renderer, Random *random, uint64_t hash)
{
    TraceRay rays[RAYS];
    TraceHit hits[RAYS];
    for (size_t i = 0; i < RAYS; i++) {
        const Vector3 origin = random_point(random, 0, 12), direction = random_unit_vector(random);
        rays[i] = (TraceRay){origin, direction, 0, INFINITY};
    }
    must(renderer_trace(renderer, rays, RAYS, hits), "renderer_trace");
    for (size_t i = 0; i < RAYS; i++) {
        hash = hash_bytes(hash, &hits[i].light, sizeof hits[i].light);
        if (hits[i].object != UINT32_MAX) hash = hash_bytes(hash, &hits[i].position, sizeof hits[i].position);
    }
    return hash;
}

// Returns a renderer that was opened for another camera, which sees the same scene, and moved.
static Renderer *moved_renderer(Scene *scene, RenderSettings settings)
{
    const Camera camera = scene->camera;
    scene->camera.position = vector_scale(camera.position, 1.25);
    settings.moves = true;
    Renderer *renderer = probe_renderer(scene, &settings);
    scene->camera = camera;
    OwnedMessageList messages = {0};
    must(renderer && renderer_move(renderer, scene, &settings, &messages), "renderer_move");
    return renderer;
}

// Renders a scene. A renderer is moved from the last scene of its precision and keeps its kernels, since
// drivers keep some memory each time that they load a kernel. Without renderers this is a separate process.
static uint64_t soak_render(uint64_t seed, Renderer *renderers[PRECISION_COUNT])
{
    Random random = {seed};
    OwnedScene scene = soak_scene(&random);
    const RenderSettings settings = soak_settings(&random);
    Renderer *renderer = renderers ? renderers[settings.precision] : NULL;
    OwnedMessageList messages = {0};
    if (renderer)
        must(renderer_move(renderer, &scene, &settings, &messages), "renderer_move");
    else if (!renderers && seed % 2 > 0)
        renderer = moved_renderer(&scene, settings);
    else
        renderer = probe_renderer(&scene, &settings);
    must(renderer, "renderer_open");
    OwnedFilm film;
    must(renderer_render_film(renderer, (unsigned)random_bits(&random) & AOVS_ALL, &film),
         "renderer_render_film");
    renderer_report_restart(renderer);
    uint64_t hash = film_hash(&film);
    if (random_index(&random, 4) == 0) hash = rays_hash(renderer, &random, hash);
    if (renderers)
        renderers[settings.precision] = renderer;
    else
        renderer_close(renderer);
    return hash;
}

static size_t bytes_allocated(void)
{
    const struct mallinfo2 info = mallinfo2();
    return info.uordblks + info.hblkhd;
}

// Renders all scenes twice. The second time all kernels have been built.
static void soak_run(void *result)
{
    Soak *soak = result;
    if (probe_open(NULL) != 0) exit(NO_DEVICE);
    Renderer *renderers[PRECISION_COUNT] = {NULL};
    for (size_t i = 0; i < soak->count; i++)
        soak->images[i] = soak_render(i, renderers);
    soak->bytes_once = bytes_allocated();
    for (size_t i = 0; i < soak->count; i++)
        if (soak_render(i, renderers) != soak->images[i])
            fault("scene %zu renders differently the second time", i);
    soak->bytes_twice = bytes_allocated();
    for (size_t i = 0; i < PRECISION_COUNT; i++)
        renderer_close(renderers[i]);
    exit(probe_close(NULL) == 0 ? 0 : 1);
}

typedef struct {
    uint64_t seed, image;
} Alone;

static void render_alone(void *result)
{
    Alone *alone = result;
    if (probe_open(NULL) != 0) exit(NO_DEVICE);
    alone->image = soak_render(alone->seed, NULL);
    exit(probe_close(NULL) == 0 ? 0 : 1);
}

TEST(memory_and_images_stay)
{
    static Soak all;
    all.count = tests_are_long() ? SCENES_MAX : SCENES;
    ChildEnd end = child_run_with_device(soak_run, &all, sizeof all);
    if (end.status != 0) fail_msg("%s", end.errors);
    print_message("%zu scenes: %zu bytes allocated, and %zu after the second time\n", all.count,
                  all.bytes_once, all.bytes_twice);
    const size_t fresh = tests_are_long() ? FRESH_MAX : FRESH;
    for (size_t i = 0; i < fresh; i++) {
        Alone alone = {.seed = (i + 1) * all.count / fresh - 1 - i % 2};
        end = child_run(render_alone, &alone, sizeof alone);
        if (end.status != 0) fail_msg("%s", end.errors);
        if (alone.image != all.images[alone.seed])
            fail_msg("scene %u renders differently in a separate process", (unsigned)alone.seed);
    }
    assert_true(all.bytes_twice <= all.bytes_once + BYTES_KEPT_MAX);
}

static char *folder;

static int image_open(void **state)
{
    (void)state;
    folder = folder_make();
    snprintf(image_path, sizeof image_path, "%s/a.ppm", folder);
    file_write(image_path, "P3 3 2 255 255 0 0 0 255 0 0 0 255 9 9 9 200 200 200 90 50 10\n");
    return 0;
}

static int image_close(void **state)
{
    (void)state;
    folder_remove(folder);
    return 0;
}

TEST_MAIN(image_open, image_close)
