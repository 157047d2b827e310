// Tests meshes: what a file's triangles become, where they are placed, what is refused, and which ids they
// get. test_mesh_formats has the formats.
#include "host/compile/scene_bounds.h"
#include "host/import/mesh/mesh_import.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

#define CAMERA_AND_LIGHT                                                                                     \
    "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\n"                                                   \
    "lights: [{point: {position: [0, 0, -5]}}]\n"

static int meshes_open(void **state)
{
    return folder_open(state) == 0 ? probe_open(state) : -1;
}

static int meshes_close(void **state)
{
    return probe_close(state) + folder_close(state);
}

// Returns a scene whose only objects are `objects`, one per line.
static Scene scene_of_objects(const char *objects)
{
    return scene_of_text("scene.yaml", formatted(CAMERA_AND_LIGHT "objects:\n%s", objects));
}

static const char square[] = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n";

TEST(vertices_are_joined)
{
    file_write("a.obj", square);
    OwnedScene scene = scene_of_objects("  - mesh: {file: a.obj}\n");
    assert_int_equal(scene.objects.count, 1);
    assert_int_equal(scene.meshes.count, 1);
    const Mesh *mesh = &scene.meshes.items[0];
    assert_int_equal(mesh->vertex_count, 4);
    assert_int_equal(mesh->triangle_count, 2);
    assert_null(mesh->normals);
    assert_int_equal(scene_primitive_count(&scene), 2);
    const Bounds bounds = scene_extent(&scene).bounds;
    assert_vector(bounds.min, 0, 0, 0);
    assert_vector(bounds.max, 1, 1, 0);
}

static Vector3 only_corner(const Scene *scene, int corner)
{
    const Mesh *mesh = &scene->meshes.items[0];
    return mesh->vertices[mesh->triangles[0][corner]];
}

TEST(transforms_scale_then_turn_then_move)
{
    file_write("a.obj", "v 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n");
    OwnedScene scene =
        scene_of_objects("  - mesh: {file: a.obj, transform: {scale: [2, 3, 4], rotate: [90, 0, 90], "
                         "translate: [10, 20, 30]}}\n");
    assert_vector(only_corner(&scene, 0), 10, 22, 30);
    assert_vector(only_corner(&scene, 1), 10, 20, 33);
    assert_vector(only_corner(&scene, 2), 14, 20, 30);
}

// The outer side is where the corners are seen counterclockwise. A mirror keeps it outside.
TEST(mirrored_mesh_keeps_its_outer_side)
{
    file_write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    OwnedScene scene = scene_of_objects("  - mesh: {file: a.obj, transform: {scale: [-1, 1, 1]}}\n");
    Vector3 a = only_corner(&scene, 0), b = only_corner(&scene, 1), c = only_corner(&scene, 2);
    Vector3 normal = vector_cross(vector_subtract(b, a), vector_subtract(c, a));
    assert_vector(normal, 0, 0, 1);
}

static const char octahedron[] = "v 1 0 0\nv -1 0 0\nv 0 1 0\nv 0 -1 0\nv 0 0 1\nv 0 0 -1\n"
                                 "f 1 3 5\nf 3 2 5\nf 2 4 5\nf 4 1 5\nf 3 1 6\nf 2 3 6\nf 4 2 6\nf 1 4 6\n";

TEST(normals_come_from_the_triangles)
{
    file_write("a.obj", octahedron);
    OwnedScene scene =
        scene_of_objects("  - mesh: {file: a.obj, smooth: true, transform: {scale: [3, 3, -3]}}\n");
    const Mesh *mesh = &scene.meshes.items[0];
    assert_int_equal(mesh->vertex_count, 6);
    assert_non_null(mesh->normals);
    for (size_t i = 0; i < 6; i++) {
        Vector3 outward = vector_scale(mesh->vertices[i], 1 / 3.0);
        assert_vector(mesh->normals[i], outward.x, outward.y, outward.z);
    }
}

// Four corners of one square, whose two triangles together weigh as much as each of the others' single
// triangle.
TEST(normals_do_not_see_the_cut_of_a_polygon)
{
    file_write("a.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 4 3 2\nf 1 2 5\nf 1 5 4\n");
    OwnedScene scene = scene_of_objects("  - mesh: {file: a.obj, smooth: true}\n");
    const Mesh *mesh = &scene.meshes.items[0];
    double third = -1 / sqrt(3);
    size_t seen = 0;
    for (size_t i = 0; i < mesh->vertex_count; i++) {
        if (!vector_is_zero(mesh->vertices[i])) continue;
        assert_vector(mesh->normals[i], third, third, third);
        seen++;
    }
    assert_int_equal(seen, 1);
}

TEST(normals_of_the_file_are_taken)
{
    file_write("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 3 4\nf 1//1 2//1 3//1\n");
    Scene scene = scene_of_objects("  - mesh: {file: a.obj, transform: {scale: [1, 2, 1]}}\n");
    assert_non_null(scene.meshes.items[0].normals);
    Vector3 normal = scene.meshes.items[0].normals[0]; // along (0, 3 / 2, 4)
    assert_true(fabs(normal.y * 8 - normal.z * 3) < 1e-7);
    assert_true(fabs(vector_length(normal) - 1) < 1e-7);
    scene_free(&scene);
    scene = scene_of_objects("  - mesh: {file: a.obj, smooth: false}\n");
    assert_null(scene.meshes.items[0].normals);
    scene_free(&scene);
}

static const Material *material_of_triangle(const Scene *scene, size_t triangle)
{
    return &scene->materials.items[scene->meshes.items[0].materials[triangle]];
}

TEST(materials_come_from_the_file)
{
    file_write(
        "a.mtl",
        "newmtl red\nKd 0.75 0.25 0\nKs 0.5 0.5 0.5\nNs 40\nillum 2\nnewmtl glass\nKd 0 0 0\nd 0.25\n");
    file_write("a.obj",
               "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl glass\nf 1 3 2\n");
    Scene scene = scene_of_objects("  - mesh: {file: a.obj}\n");
    assert_int_equal(scene.meshes.items[0].triangle_count, 2);
    const Material *red = material_of_triangle(&scene, 0), *glass = material_of_triangle(&scene, 1);
    assert_vector(red->color, 0.75, 0.25, 0);
    assert_number(red->specular.largest, 0.5);
    assert_number(red->shininess, 40);
    assert_number(red->transmission.largest, 0);
    assert_number(glass->transmission.largest, 0.75);
    scene_free(&scene);

    scene = scene_of_objects("  - mesh: {file: a.obj, material: {color: [0, 0, 1]}}\n");
    assert_null(scene.meshes.items[0].materials);
    assert_vector(scene.materials.items[scene.objects.items[0].material].color, 0, 0, 1);
    scene_free(&scene);
}

// Returns twice the area of all triangles, which must all turn left seen from above.
static double area_of(const Mesh *mesh)
{
    double area = 0;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *triangle = mesh->triangles[i];
        Vector3 a = mesh->vertices[triangle[0]];
        Vector3 normal = vector_cross(vector_subtract(mesh->vertices[triangle[1]], a),
                                      vector_subtract(mesh->vertices[triangle[2]], a));
        assert_true(normal.z > 0);
        area += normal.z;
    }
    return area;
}

// A comb with more teeth than assimp cuts out in full.
TEST(concave_polygon_is_cut_in_full)
{
    enum { TEETH = 100 };
    OwnedText text = {0}, face = {0};
    text_appendf(&text, "v 0 0 0\nv %d 0 0\n", TEETH);
    text_appendf(&face, "f 1 2");
    for (int tooth = TEETH - 1; tooth >= 0; tooth--) {
        text_appendf(&text, "v %d.75 0.5 0\nv %d.5 0.5 0\nv %d.5 2 0\nv %d 2 0\n", tooth, tooth, tooth,
                     tooth);
        for (int i = 0; i < 4; i++)
            text_appendf(&face, " %d", 3 + 4 * (TEETH - 1 - tooth) + i);
    }
    text_appendf(&text, "%s\n", text_c(&face));
    file_write("a.obj", text_c(&text));
    OwnedScene scene = scene_of_objects("  - mesh: {file: a.obj}\n");
    assert_int_equal(scene.meshes.items[0].triangle_count, 4 * TEETH);
    assert_number(area_of(&scene.meshes.items[0]), 287.0);
}

TEST(polygons_that_cannot_be_filled_are_reported)
{
    file_write("a.obj", "v 0 0 0\nv 2 0 0\nv 0 1 0\nv 3 3 0\nv 3 0 0\nv 4 0 0\nf 1 2 3 4\nf 1 2 5 6\n");
    OwnedText got =
        scene_messages("scene.yaml", CAMERA_AND_LIGHT "objects:\n  - mesh: {file: a.obj}\n", false);
    assert_string_equal(
        text_c(&got),
        "4:18: warning: a.obj: 2 triangles have no area and are never hit\n"
        "4:18: warning: a.obj: 1 polygon intersects itself or is far from planar; only parts are filled\n");
}

TEST(scene_file_faults_are_reported)
{
    file_write("a.obj", square);
#define REFUSED(mesh, expected)                                                                              \
    assert_messages("scene.yaml", CAMERA_AND_LIGHT "objects:\n  - mesh: " mesh "\n", expected)
    REFUSED("{file: none.obj}", "4:18: error: none.obj: cannot read the file: No such file or directory\n");
    REFUSED("{file: a.mtl}",
            "4:18: error: a.mtl: a mesh's name must have a known ending, such as .obj, .ply, .stl, "
            ".gltf, .fbx or .dae\n");
    REFUSED("{file: [1]}", "4:18: error: 'file' must be the name of a file, not a list of 1\n");
    REFUSED("{smooth: true}", "4:11: error: the mesh lacks 'file'\n");
    REFUSED("{file: a.obj, smooth: 1}", "4:33: error: 'smooth' must be true or false, not '1'\n");
    REFUSED("{file: a.obj, transform: {scale: [1, 0, 1]}}", "4:44: error: 'scale' must not be zero\n");
    REFUSED("{file: a.obj, transform: {rotate: 90}}",
            "4:45: error: 'rotate' must be three numbers, not '90'\n");
    REFUSED("{file: a.obj, transform: {turn: 90}}",
            "4:37: error: unknown transform key 'turn'; the choices are translate, rotate, scale, matrix\n");
}

TEST(ids_count_the_triangles)
{
    file_write("a.obj", octahedron);
    OwnedScene scene = scene_of_objects("  - sphere: {center: [9, 0, 0], radius: 1}\n"
                                        "  - mesh: {file: a.obj}\n"
                                        "  - triangle: {vertices: [[0, 0, 5], [1, 0, 5], [0, 1, 5]]}\n"
                                        "  - sphere: {center: [-9, 0, 0], radius: 1}\n");
    const CompileSettings settings = {.width = 1, .height = 1, .sample_count = 1, .bvh = BVH_OFF};
    OwnedCompiledScene flat = scene_compiled(&scene, &settings);
    assert_int_equal(flat.arrays[FLAT_OBJECTS].count, 11);
    const ObjectEntry *entries = flat.arrays[FLAT_OBJECTS].items;
    for (uint32_t id = 0; id < 11; id++) {
        uint4 entry = entries[id].type_index_material;
        assert_int_equal(entry.x, id == 0 || id == 10 ? TYPE_SPHERES : TYPE_TRIANGLES);
        const FlatArray *array = &flat.arrays[FLAT_FIRST_SHAPE + entry.x];
        assert_int_equal(*flat_id(array, flat_array_at(array, entry.y)), id);
    }
}

enum { GRID = 64 };

// Makes rays down on the unit square and slightly around it, every other one through a point of the line from
// (0.1, 0.1, 1) to (0.7, 0.7, 1).
static void rays_down(TraceRay *rays)
{
    for (size_t i = 0; i < GRID * GRID; i++) {
        size_t column = i % GRID, row = i / GRID;
        double x = (double)column / 50 - 0.125, y = (double)row / 50 - 0.125;
        double along = 0.1 + 0.6 * (double)i / (GRID * GRID);
        rays[i] = (TraceRay){{x, y, 4}, {0.0625, 0.03125, -1}, 0, INFINITY};
        if (i % 2 == 1) rays[i].direction = (Vector3){along - x, along - y, -3};
    }
}

// A repeated corner, three corners in a line and a needle lie among the square's triangles.
TEST(triangles_without_area_are_never_hit)
{
    static TraceRay rays[GRID * GRID];
    static TraceHit clean[GRID * GRID], hits[GRID * GRID];
    rays_down(rays);
    const char *objects = "  - mesh: {file: a.obj, material: {}}\n";
    static const char degenerate[] = "v 0.1 0.1 1\nv 0.7 0.7 1\nv 0.4 0.4 1\nv 0.25 0.25 1\n"
                                     "f 5 6 5\nf 5 6 7\nf 5 8 6\nf 5 5 5\n";
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
        if (!probe_has(precision)) continue;
        file_write("a.obj", square);
        Scene scene = scene_of_objects(objects);
        assert_true(probe_trace(&scene, precision, 0, rays, GRID * GRID, clean));
        scene_free(&scene);

        Text text = {0};
        text_appendf(&text, "%s%s", square, degenerate);
        file_write("a.obj", text_c(&text));
        text_free(&text);
        OwnedMessageList messages = {0};
        OwnedText source = {0};
        text_appendf(&source, CAMERA_AND_LIGHT "objects:\n%s", objects);
        assert_true(scene_read_text(&scene, "scene.yaml", &source, false, &messages));
        assert_int_equal(messages.count, 1);
        assert_non_null(strstr(messages.items[0].text, "no area and"));
        assert_true(probe_trace(&scene, precision, 0, rays, GRID * GRID, hits));
        scene_free(&scene);

        size_t hit_count = 0;
        for (size_t i = 0; i < GRID * GRID; i++) {
            assert_int_equal(hits[i].object, clean[i].object);
            if (clean[i].object == UINT32_MAX) continue;
            hit_count++;
            assert_true(hits[i].t == clean[i].t);
        }
        assert_true(hit_count > 1000);
    }
}

// Checks that a renderer is not opened, with this error as the only message.
static void assert_refused(Compute *compute, const Scene *scene, const char *expected)
{
    OwnedMessageList messages = {0};
    const RenderSettings settings = {.width = 1, .height = 1, .sample_count = 1};
    assert_null(renderer_open(compute, scene, &settings, &messages));
    assert_int_equal(messages.count, 1);
    assert_int_equal(messages.items[0].severity, MESSAGE_ERROR);
    assert_non_null(strstr(messages.items[0].text, expected));
}

TEST(too_many_triangles_are_refused)
{
    Mesh mesh = {.triangle_count = ((size_t)1 << 28) + 1};
    Object object = {.type = SHAPE_MESH};
    Scene scene = {.meshes = {&mesh, 1, 1}, .objects = {&object, 1, 1}};
    assert_refused(&probe_compute, &scene,
                   "268435457 objects and triangles; at most 268435456 are supported");
}

// The first mesh of a file is not a copy. The third, of two triangles, is one too many, whatever its name.
TEST(copies_are_limited)
{
    file_write("a.obj", square);
    OwnedMessageList messages = {0};
    const Source source = {.file = "scene.yaml", .bytes = "", .length = 0};
    Report report = report_open(&source, &messages);
    OwnedScene scene = {.copied_triangle_count = (1 << 24) - 2};
    static const char *const paths[] = {"a.obj", "./a.obj", "a.obj"};
    for (size_t i = 0; i < 3; i++) {
        const MeshImport import = {.path = paths[i], .transform = affine_identity, .report = &report};
        uint32_t index;
        assert_int_equal(mesh_import(&scene, &import, &index), i < 2);
        assert_int_equal(messages.count, i < 2 ? 0 : 1);
    }
    assert_non_null(strstr(messages.items[0].text,
                           "a.obj: copies of mesh files have 16777218 triangles in total; "
                           "at most 16777216 are allowed"));
    report_close(&report);
}

TEST(mesh_of_one_point_has_a_camera)
{
    static const char *const points[] = {"0 0 0", "3 -4 1e20"};
    for (size_t i = 0; i < COUNT_OF(points); i++) {
        file_write("a.obj", formatted("v %s\nf 1 1 1\n", points[i]));
        const SceneOptions options = {0};
        OwnedMessageList messages = {0};
        OwnedScene scene;
        assert_true(scene_load(&scene, "a.obj", &options, &messages));
        assert_false(vectors_equal(scene.camera.position, scene.camera.look_at));
        for (size_t k = 0; k < scene.lights.count; k++)
            assert_false(vector_is_zero(scene.lights.items[k].direction));
    }
}

TEST(device_without_room_is_reported)
{
    file_write("a.obj", octahedron);
    OwnedScene scene = scene_of_objects("  - mesh: {file: a.obj}\n");
    Device small = *probe_compute.device;
    Compute compute = probe_compute;
    compute.device = &small;
    small.largest_buffer_bytes = 64;
    assert_refused(&compute, &scene, "and at most 64 bytes in one buffer");
    small = *probe_compute.device;
    small.memory_bytes = 64;
    assert_refused(&compute, &scene, "has 64 bytes, and");
}

// Triangles without a vertex normal or an image leave gaps among the places that were counted for them.
TEST(attributes_of_many_triangles_follow_each_other)
{
    enum { COUNT = 3 * FLAT_RANGE_MIN };
    file_write("a.ppm", "P6 1 1 255\nabc");
    OwnedScene scene = scene_of_text("scene.yaml", CAMERA_AND_LIGHT
                                     "materials: {plain: {}, seen: {image: a.ppm}}\n"
                                     "objects: [{sphere: {center: [0, 0, 0], radius: 1, material: plain}},\n"
                                     "          {sphere: {center: [0, 0, 0], radius: 1, material: seen}}]\n");
    const uint32_t materials[] = {scene.objects.items[0].material, scene.objects.items[1].material};
    Mesh mesh = {.vertices = memory_allocate(3 * COUNT, sizeof *mesh.vertices),
                 .normals = memory_allocate_zeroed(3 * COUNT, sizeof *mesh.normals),
                 .uvs = memory_allocate(3 * COUNT, sizeof *mesh.uvs),
                 .vertex_count = 3 * COUNT,
                 .triangles = memory_allocate(COUNT, sizeof *mesh.triangles),
                 .materials = memory_allocate(COUNT, sizeof *mesh.materials),
                 .triangle_count = COUNT};
    for (uint32_t i = 0; i < COUNT; i++) {
        for (uint32_t k = 0; k < 3; k++) {
            const uint32_t vertex = 3 * i + k;
            mesh.vertices[vertex] = (Vector3){i, k == 1, k == 2};
            if (i % 1000 != 7) mesh.normals[vertex] = (Vector3){i + 1, 0, 0};
            mesh.uvs[vertex][0] = mesh.uvs[vertex][1] = i;
            mesh.triangles[i][k] = vertex;
        }
        mesh.materials[i] = materials[i % 3 > 0];
    }
    array_push(scene.meshes, mesh);
    array_push(scene.objects, ((Object){.type = SHAPE_MESH, .as.mesh.index = 0}));
    const CompileSettings settings = {
        .width = 1, .height = 1, .sample_count = 1, .lanes = 1, .bvh = BVH_OFF, .shift_to_eye = true};
    CompiledScene compiled = scene_compiled(&scene, &settings);
    const Triangle *triangles = compiled.arrays[FLAT_FIRST_SHAPE + TYPE_TRIANGLES].items;
    const TriangleNormals *normals = compiled.arrays[FLAT_TRIANGLE_NORMALS].items;
    const TriangleUvs *uvs = compiled.arrays[FLAT_TRIANGLE_UVS].items;
    const ObjectEntry *entries = compiled.arrays[FLAT_OBJECTS].items;
    uint32_t normals_count = 0, uvs_count = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        assert_int_equal(triangles[i].id.x, 2 + i);
        assert_int_equal(entries[2 + i].type_index_material.y, i);
        assert_int_equal(triangles[i].id.y, i % 1000 == 7 ? 0 : ++normals_count);
        if (i % 1000 != 7) assert_true(normals[normals_count - 1].a.x == i + 1);
        assert_int_equal(triangles[i].id.z, i % 3 == 0 ? 0 : ++uvs_count);
        if (i % 3 > 0) assert_true(uvs[uvs_count - 1].a_b.x == i);
    }
    assert_int_equal(compiled.arrays[FLAT_TRIANGLE_NORMALS].count, normals_count);
    assert_int_equal(compiled.arrays[FLAT_TRIANGLE_UVS].count, uvs_count);
    compiled_scene_free(&compiled);
}

TEST_MAIN(meshes_open, meshes_close)
