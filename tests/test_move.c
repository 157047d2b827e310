// Checks that a scene that was compiled for one eye and moved to another has the numbers of one compiled for
// the other.
// run_tests: sanitized
#include "host/base/parallel.h"
#include "host/compile/shapes.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"
#include "tests/scene_reading.h"
#include <stdatomic.h>

enum { OBJECTS = 3 * FLAT_RANGE_MIN }; // of them some types are moved by several threads

static const char scene_text[] =
    "camera: {position: [1, 2, -40], look_at: [0, 0, 0], fov: 50}\n"
    "lights: [{point: {position: [0, 30, -20]}}, {spot: {position: [9, 9, 9], look_at: [0, 0, 0], angle: "
    "20}}]\n"
    "objects:\n"
    "  - plane: {point: [0, -9, 0], normal: [0, 1, 0], material: {checker: {colors: [[1, 1, 1], [0, 0, 0]], "
    "size: 2}}}\n"
    "  - cylinder: {from: [0, 0, 0], to: [0, 1, 0], radius: 0.5}\n"
    "  - sphere: {center: [0, -6371000, 0], radius: 6370990, material: {transmission: 0.5}}\n"
    "  - mesh: {file: scenes/meshes/bunny.obj, smooth: true}\n"
    "  - mesh: {file: tests/textures/quad.obj, material: {image: scenes/images/globe.png}}\n";

static Scene scene_make(void)
{
    Scene scene = scene_of_text("move.yaml", scene_text);
    ShapeForm forms[SHAPE_FORMS_MAX];
    const size_t form_count = shape_forms(forms);
    Random random = {19};
    for (size_t i = 0; i < OBJECTS; i++) {
        // of some types many, so that they are moved by several threads
        const ShapeForm *form = &forms[i % 2 ? random_bits(&random) % form_count : (i / 2) % 2];
        array_push(scene.objects, random_shape(form, &random).object);
    }
    return scene;
}

static const CompileSettings single = {.width = 40,
                                       .height = 30,
                                       .sample_count = 1,
                                       .precision = PRECISION_SINGLE,
                                       .lanes = 8,
                                       .shift_to_eye = true};

static uint4 entry_of(const CompiledScene *compiled, size_t id)
{
    return ((const ObjectEntry *)compiled->arrays[FLAT_OBJECTS].items)[id].type_index_material;
}

static void check_array(const CompiledScene *moved, const CompiledScene *expected, size_t type)
{
    const FlatArray *got = &moved->arrays[type], *wanted = &expected->arrays[type];
    assert_int_equal(got->count, wanted->count);
    assert_memory_equal(got->items, wanted->items, got->count * got->layout.size);
}

// Compares everything except the order of primitives and the BVH.
static void check_numbers(const CompiledScene *moved, const CompiledScene *expected)
{
    assert_int_equal(moved->features, expected->features);
    for (size_t type = FLAT_HEADER; type < FLAT_COUNT; type++)
        if (!is_ordered_by_bvh(type)) check_array(moved, expected, type);
    for (size_t id = 0; id < expected->arrays[FLAT_OBJECTS].count; id++) {
        const uint4 got = entry_of(moved, id), wanted = entry_of(expected, id);
        assert_int_equal(got.x, wanted.x);
        assert_int_equal(got.z, wanted.z);
        const FlatArray *array = &moved->arrays[FLAT_FIRST_SHAPE + got.x];
        assert_memory_equal(flat_array_at(array, got.y),
                            flat_array_at(&expected->arrays[FLAT_FIRST_SHAPE + got.x], wanted.y),
                            array->layout.size);
    }
}

typedef struct {
    const double *planes;
    const uint32_t *child_index, *child_type;
} Node;

static Node node_at(const CompiledScene *compiled, size_t index)
{
    const double *planes = flat_array_at(&compiled->arrays[FLAT_NODES], index);
    const uint32_t *child_index = (const void *)(planes + (size_t)BVH_PLANES * single.lanes);
    return (Node){planes, child_index, child_index + single.lanes};
}

// Returns the first triangle of a block, after checks that it has the vertices of `count` from there.
static size_t check_block(const CompiledScene *compiled, size_t index, size_t count)
{
    const size_t width = single.lanes;
    const size_t first = ((const uint32_t *)compiled->arrays[FLAT_BLOCK_TRIANGLES].items)[index];
    const FlatArray *blocks = &compiled->arrays[FLAT_TRIANGLE_BLOCKS];
    const bool is_double = blocks->layout.scalar4_count > 0;
    const void *rows = flat_array_at(blocks, index);
    for (size_t lane = 0; lane < width; lane++) {
        const Triangle *triangle = flat_array_at(&compiled->arrays[FLAT_FIRST_SHAPE + TYPE_TRIANGLES],
                                                 first + (lane < count ? lane : 0));
        const double vertices[BLOCK_ROWS] = {triangle->a.x, triangle->a.y, triangle->a.z,
                                             triangle->b.x, triangle->b.y, triangle->b.z,
                                             triangle->c.x, triangle->c.y, triangle->c.z};
        for (size_t row = 0; row < BLOCK_ROWS; row++)
            assert_true(is_double ? ((const double *)rows)[row * width + lane] == vertices[row]
                                  : ((const float *)rows)[row * width + lane] == (float)vertices[row]);
    }
    return first;
}

// Checks that a block has the spheres of its leaf. Returns the first one's place.
static size_t check_sphere_block(const CompiledScene *compiled, size_t index, size_t count)
{
    const size_t width = single.lanes;
    const double *rows = flat_array_at(&compiled->arrays[FLAT_SPHERE_BLOCKS], index);
    const uint32_t *ids = (const void *)(rows + SPHERE_ROWS * width), *places = ids + width;
    for (size_t lane = 0; lane < width; lane++) {
        const size_t place = places[0] + (lane < count ? lane : 0);
        const Sphere *sphere = flat_array_at(&compiled->arrays[FLAT_FIRST_SHAPE + TYPE_SPHERES], place);
        assert_int_equal(places[lane], place);
        assert_true(rows[lane] == sphere->center_radius.x);
        assert_true(rows[width + lane] == sphere->center_radius.y);
        assert_true(rows[2 * width + lane] == sphere->center_radius.z);
        const double least = sphere->id.y & HAS_POWER ? FLT_MAX : 0;
        assert_true(rows[3 * width + lane] == fmax(sphere->center_radius.w, least));
        assert_int_equal(ids[lane], sphere->id.x | (sphere->id.y != 0 ? SPHERE_HAS_FLAGS : 0));
    }
    return places[0];
}

// Returns the box of everything below a node, after checks that its children's boxes are exact.
static Bounds check_node(const CompiledScene *compiled, size_t index, const Bounds *empty)
{
    const Node node = node_at(compiled, index);
    const size_t width = single.lanes;
    Bounds all = bounds_empty();
    for (size_t i = 0; i < width; i++) {
        const double *low = node.planes + i, *high = low + BVH_HIGH * width;
        const Bounds stored = {{low[0], low[width], low[2 * width]}, {high[0], high[width], high[2 * width]}};
        const size_t type = leaf_type(node.child_type[i]), count = leaf_count(node.child_type[i]);
        Bounds expected = bounds_empty();
        if (node.child_type[i] == BVH_NODE) expected = check_node(compiled, node.child_index[i], empty);
        size_t first = node.child_index[i];
        if (type == TYPE_TRIANGLES && count > 0) first = check_block(compiled, first, count);
        if (type == TYPE_SPHERES && count > 0) first = check_sphere_block(compiled, first, count);
        for (size_t k = first; k < first + count; k++) {
            const Bounds box =
                primitive_bounds(type, flat_array_at(&compiled->arrays[FLAT_FIRST_SHAPE + type], k));
            assert_false(bounds_is_everywhere(&box));
            expected = bounds_join(expected, box);
        }
        all = bounds_join(all, expected);
        if (bounds_is_empty(&expected)) expected = *empty;
        assert_memory_equal(&stored, &expected, sizeof stored);
    }
    return all;
}

static void check_bvh(const CompiledScene *compiled)
{
    const Node root = node_at(compiled, 0);
    Bounds empty = bounds_empty();
    for (size_t i = 0; i < compiled->arrays[FLAT_NODES].count; i++) {
        const Node node = node_at(compiled, i);
        for (size_t k = 0; k < single.lanes; k++)
            if (node.child_type[k] == 0) {
                const double *low = node.planes + k, *high = low + BVH_HIGH * (size_t)single.lanes;
                empty = (Bounds){{low[0], low[single.lanes], low[2 * single.lanes]},
                                 {high[0], high[single.lanes], high[2 * single.lanes]}};
            }
    }
    assert_true(root.child_type[0] != 0);
    const Bounds all = check_node(compiled, 0, &empty);
    assert_memory_equal(&all, &compiled->bvh_bounds, sizeof all);
    // beyond all boxes
    assert_true(empty.min.x > all.max.x && empty.max.x < all.min.x);
    assert_true(empty.min.y > all.max.y && empty.max.z < all.min.z);
}

TEST(moved_scene_has_the_numbers_of_a_compiled_one)
{
    static const Vector3 eyes[] = {{1.3, 2.7, -39}, {0, -8.25, 0}, {1e4, 2, -1}, {1, 2, -40}};
    OwnedScene scene = scene_make();
    const Camera start = scene.camera;
    for (int is_double = 0; is_double < 2; is_double++) {
        CompileSettings settings = single;
        if (is_double) settings.precision = PRECISION_DOUBLE;
        scene.camera = start;
        OwnedCompiledScene moved = scene_compiled(&scene, &settings);
        for (size_t i = 0; i < COUNT_OF(eyes); i++) {
            scene.camera.position = eyes[i];
            settings.width += 2;
            MessageList messages = {0};
            assert_true(scene_move(&moved, &scene, &settings, &messages));
            OwnedCompiledScene expected = scene_compiled(&scene, &settings);
            check_numbers(&moved, &expected);
            check_bvh(&moved);
        }
    }
}

// Only an eye next to the planet needs its power.
TEST(powers_come_and_go)
{
    OwnedScene scene =
        scene_of_text("planet.yaml", "camera: {position: [0, 1e7, 0], look_at: [0, 0, 1]}\n"
                                     "objects:\n"
                                     "  - sphere: {center: [0, -6371000.3, 0], radius: 6371000.3}\n");
    OwnedCompiledScene moved = scene_compiled(&scene, &single);
    assert_false(moved.features & FEATURE_EYE_POWERS);
    for (int i = 0; i < 4; i++) {
        const bool is_near = i % 2 == 0;
        scene.camera.position.y = is_near ? 1.75 : 1e7;
        MessageList messages = {0};
        assert_true(scene_move(&moved, &scene, &single, &messages));
        assert_int_equal(!(moved.features & FEATURE_EYE_POWERS), !is_near);
    }
}

// Another camera at the same place changes the header alone.
TEST(turned_camera_changes_the_header_alone)
{
    OwnedScene scene = scene_of_text("move.yaml", scene_text);
    OwnedCompiledScene compiled = scene_compiled(&scene, &single);
    memset(compiled.changed, 0, sizeof compiled.changed);
    scene.camera.look_at = (Vector3){3, 3, 3};
    MessageList messages = {0};
    assert_true(scene_move(&compiled, &scene, &single, &messages));
    for (size_t type = 0; type < FLAT_COUNT; type++)
        assert_int_equal(compiled.changed[type], type == FLAT_HEADER);
    OwnedCompiledScene expected = scene_compiled(&scene, &single);
    check_array(&compiled, &expected, FLAT_HEADER);
}

// A kernel may be built for a BVH that the scene does not have. Its one node stays empty.
TEST(missing_bvh_stays_empty)
{
    OwnedScene scene = scene_of_text("move.yaml", scene_text);
    CompileSettings settings = single;
    settings.bvh = BVH_OFF;
    settings.extra_features = FEATURE_BVH;
    OwnedCompiledScene compiled = scene_compiled(&scene, &settings),
                       expected = scene_compiled(&scene, &settings);
    scene.camera.position.z -= 1;
    MessageList messages = {0};
    assert_true(scene_move(&compiled, &scene, &settings, &messages));
    check_array(&compiled, &expected, FLAT_NODES);
}

// Moves to eyes at which the device's unit changes or which do not fit, and back.
TEST(far_eyes)
{
    OwnedScene scene = scene_of_text("move.yaml", scene_text);
    const Vector3 start = scene.camera.position;
    OwnedCompiledScene compiled = scene_compiled(&scene, &single);
    static const double distances[] = {1e11, 1e39, 0};
    for (size_t i = 0; i < COUNT_OF(distances); i++) {
        scene.camera.position = (Vector3){start.x, start.y, start.z - distances[i]};
        OwnedMessageList messages = {0};
        const bool moved = scene_move(&compiled, &scene, &single, &messages);
        assert_int_equal(moved, distances[i] != 1e39);
        assert_int_equal(message_count(&messages, MESSAGE_ERROR), !moved);
        if (!moved) continue;
        OwnedCompiledScene expected = scene_compiled(&scene, &single);
        assert_true(compiled.unit == expected.unit);
        assert_true((compiled.unit != 1) == (distances[i] == 1e11));
        check_numbers(&compiled, &expected);
    }
}

// Fails to move to one camera, then moves to the other.
static void check_move_after_failure(const char *text, const Camera *failing, const Camera *next)
{
    OwnedScene scene = scene_of_text("move.yaml", text);
    OwnedCompiledScene compiled = scene_compiled(&scene, &single);
    MessageList messages = {0};
    scene.camera = *failing;
    assert_false(scene_move(&compiled, &scene, &single, &messages));
    assert_int_equal(message_count(&messages, MESSAGE_ERROR), 1);
    message_list_free(&messages);
    scene.camera = *next;
    assert_true(scene_move(&compiled, &scene, &single, &messages));
    OwnedCompiledScene expected = scene_compiled(&scene, &single);
    check_numbers(&compiled, &expected);
    if (expected.pending_children_max > 0) check_bvh(&compiled);
}

// A move that failed has changed some arrays. The next one, to whichever eye, must set all of them.
TEST(moves_after_a_failure)
{
    // without a light or a bounded object, so that a far eye keeps the unit and fails for a plane's number
    static const char planes[] = "camera: {position: [1, 2, -40], look_at: [0, 0, 0], fov: 50}\n"
                                 "objects:\n"
                                 "  - plane: {point: [0, -9, 0], normal: [0, 1, 0]}\n"
                                 "  - plane: {point: [0, 0, 90], normal: [0, 1, -1]}\n";
    static const char *const texts[] = {planes, scene_text};
    for (size_t i = 0; i < COUNT_OF(texts); i++) {
        OwnedScene scene = scene_of_text("move.yaml", texts[i]);
        const Camera start = scene.camera;
        Camera other = start, wide, far = start;
        other.position = (Vector3){3, 4, -50};
        wide = other;
        wide.half_tangent = 1e42;
        far.position.z = -1e39;
        check_move_after_failure(texts[i], &wide, &other); // the eye was right
        check_move_after_failure(texts[i], &wide, &start); // the eye was right before
        check_move_after_failure(texts[i], &far, &start);
    }
}

static void range_count(void *context, size_t begin, size_t end)
{
    atomic_uchar *counts = context;
    for (size_t i = begin; i < end; i++)
        atomic_fetch_add(&counts[i], 1);
}

TEST(loops_over_threads_cover_each_index_once)
{
    static atomic_uchar counts[10007];
    for (size_t count = 0; count <= sizeof counts; count = count * 3 + 1) {
        memset(counts, 0, sizeof counts);
        parallel_run(count, 5, range_count, counts);
        for (size_t i = 0; i < sizeof counts; i++)
            assert_int_equal(counts[i], i < count);
    }
}

TEST_MAIN(NULL, NULL)
