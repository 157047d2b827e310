// Tests that transformed objects are hit where the same objects are, written out.
#include "host/scene/affine.h"
#include "host/scene/describe.h"
#include "host/scene/object_transform.h"
#include "tests/check.h"
#include "tests/files.h"
#include "tests/probe.h"
#include "tests/random_ray.h"
#include "tests/scene_reading.h"

enum { RAYS = 400 };

#define SCENE                                                                                                \
    "camera: {position: [0, 0, -9], look_at: [0, 0, 0]}\nlights: [{point: {position: [5, 9, -9]}}]\n"

typedef struct {
    const char *name, *transformed, *plain;
} Pair;

// The turns are by quarters or about the shape's axis, so that the plain numbers are simple.
static const Pair pairs[] = {
    {"sphere",
     "[{sphere: {center: [1, 0, 0], radius: 0.5, transform: {scale: 2, rotate: [0, 0, 90], translate: [0, 0, "
     "1]}}}]",
     "[{sphere: {center: [0, 2, 1], radius: 1}}]"},
    {"mirrored sphere", "[{sphere: {center: [1, 0, 0], radius: 1, transform: {scale: [-1, 1, 1]}}}]",
     "[{sphere: {center: [-1, 0, 0], radius: 1}}]"},
    {"sphere that is stretched and compressed",
     "[{group: {transform: {scale: [1, 0.5, 1]}, objects: [{sphere: {center: [0, 1, 0], radius: 1, "
     "transform: "
     "{scale: [1, 2, 1]}}}]}}]",
     "[{sphere: {center: [0, 1, 0], radius: 1}}]"},
    {"stretched instance", "[{instance: {of: row, transform: {scale: [1, 2, 1]}}}]",
     "[{sphere: {center: [-1, 0, 0], radius: 0.5, transform: {scale: [1, 2, 1]}}}, {sphere: {center: [0, 0, "
     "0], "
     "radius: 1, transform: [{translate: [2, 0, 0]}, {scale: [1, 2, 1]}]}}]"},
    {"cylinder that is sheared and back",
     "[{group: {transform: {matrix: [[1, 0, -0.5, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}, objects: [{cylinder: "
     "{from: "
     "[0, 0, -1], to: [0, 0, 1], radius: 1, transform: {matrix: [[1, 0, 0.5, 0], [0, 1, 0, 0], [0, 0, 1, "
     "0]]}}}]}}]",
     "[{cylinder: {from: [0, 0, -1], to: [0, 0, 1], radius: 1}}]"},
    {"plane",
     "[{plane: {point: [0, -1, 0], normal: [0, 1, 0], transform: {rotate: {axis: [2, 0, 0], angle: 90}}}}]",
     "[{plane: {point: [0, 0, -1], normal: [0, 0, 1]}}]"},
    {"sheared plane",
     "[{plane: {point: [1, 0, 0], normal: [1, 0, 0], transform: {matrix: [[1, 1, 0, 0], [0, 1, 0, 0], [0, 0, "
     "1, 0]]}}}]",
     "[{plane: {point: [1, 0, 0], normal: [1, -1, 0]}}]"},
    {"disc",
     "[{disc: {center: [0, 1, 0], normal: [0, 1, 0], radius: 1, transform: {scale: [2, 3, 2], rotate: [90, "
     "0, 0]}}}]",
     "[{disc: {center: [0, 0, 3], normal: [0, 0, 1], radius: 2}}]"},
    {"box", "[{box: {min: [0, 0, 0], max: [1, 2, 3], transform: {rotate: [0, 90, 0], scale: [1, -1, 1]}}}]",
     "[{box: {min: [0, -2, -1], max: [3, 0, 0]}}]"},
    {"turned box",
     "[{group: {transform: {rotate: [0, 0, -45]}, objects: [{box: {min: [-1.1, -1, -1], max: [1, 1, 1], "
     "transform: {rotate: [0, 0, 45]}}}]}}]",
     "[{box: {min: [-1.1, -1, -1], max: [1, 1, 1]}}]"},
    {"cylinder",
     "[{cylinder: {from: [0, 0, 0], to: [0, 1, 0], radius: 1, transform: {scale: [0.5, 3, 0.5], rotate: [0, "
     "0, 90]}}}]",
     "[{cylinder: {from: [0, 0, 0], to: [-3, 0, 0], radius: 0.5}}]"},
    {"infinite cylinder",
     "[{cylinder: {point: [0, 0, 0], axis: [0, 1, 0], radius: 1, transform: [{rotate: [90, 0, 0]}, "
     "{translate: [1, 0, 0]}]}}]",
     "[{cylinder: {point: [1, 0, 0], axis: [0, 0, 1], radius: 1}}]"},
    {"cone",
     "[{cone: {from: [0, 0, 0], to: [0, 1, 0], radius: [1, 0.25], transform: {scale: [2, 1, 2], translate: "
     "[0, -1, 0]}}}]",
     "[{cone: {from: [0, -1, 0], to: [0, 0, 0], radius: [2, 0.5]}}]"},
    {"infinite cone",
     "[{cone: {apex: [0, 1, 0], axis: [0, 1, 0], angle: 45, transform: {scale: [0.5, 1, 0.5]}}}]",
     "[{cone: {apex: [0, 1, 0], axis: [0, 1, 0], angle: 26.565051177077989}}]"},
    {"triangle",
     "[{triangle: {vertices: [[0, 0, 0], [1, 0, 0], [0, 1, 0]], transform: {scale: [3, 2, 1], translate: "
     "[-1, -1, 0]}}}]",
     "[{triangle: {vertices: [[-1, -1, 0], [2, -1, 0], [-1, 1, 0]]}}]"},
    // with sanitizers: no member of another shape is read
    {"smooth triangle",
     "[{triangle: {vertices: [[0, 0, 0], [3, 0, 0], [0, 2, 0]], normals: [[0.6, 0, 0.8], [0, 0.6, 0.8], [0, "
     "0, 1]], transform: {translate: [-1, -1, 0]}}}]",
     "[{triangle: {vertices: [[-1, -1, 0], [2, -1, 0], [-1, 1, 0]], normals: [[0.6, 0, 0.8], [0, 0.6, 0.8], "
     "[0, 0, 1]]}}]"},
    {"torus",
     "[{torus: {center: [0, 0, 0], axis: [0, 1, 0], major: 1, minor: 0.25, transform: {rotate: [90, 0, 0], "
     "scale: 2}}}]",
     "[{torus: {center: [0, 0, 0], axis: [0, 0, 1], major: 2, minor: 0.5}}]"},
    {"paraboloid",
     "[{paraboloid: {apex: [0, 0, 0], axis: [0, 1, 0], height: 1, radius: 1, transform: {scale: [2, 3, 2], "
     "translate: [0, -1, 0]}}}]",
     "[{paraboloid: {apex: [0, -1, 0], axis: [0, 1, 0], height: 3, radius: 2}}]"},
    {"superellipsoid",
     "[{superellipsoid: {center: [0, 0, 0], radii: [1, 0.5, 1], exponent: 4, transform: {scale: [2, 1, 1], "
     "rotate: [0, 0, 90], translate: [0, 0.5, 1]}}}]",
     "[{superellipsoid: {center: [0, 0.5, 1], radii: [0.5, 2, 1], exponent: 4}}]"},
    {"superellipsoid that is sheared and back",
     "[{group: {transform: {matrix: [[1, 0, -0.5, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}, objects: "
     "[{superellipsoid: {center: [0, 1, 0], radii: [1, 0.5, 1], exponent: 6, transform: {matrix: "
     "[[1, 0, 0.5, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}}}]}}]",
     "[{superellipsoid: {center: [0, 1, 0], radii: [1, 0.5, 1], exponent: 6}}]"},
    {"superellipsoid, a sphere, that is sheared",
     "[{superellipsoid: {center: [0, 1, 0], radii: [1, 1, 1], exponent: 2, transform: {matrix: "
     "[[1, 0, 0.5, 0], [0, 1, 0, 0], [0, 0, 1, 0]]}}}]",
     "[{sphere: {center: [0, 1, 0], radius: 1, transform: {matrix: [[1, 0, 0.5, 0], [0, 1, 0, 0], [0, 0, 1, "
     "0]]}}}]"},
    {"mesh",
     "[{group: {transform: {scale: [1, 2, 1]}, objects: [{mesh: {file: scenes/meshes/bunny.obj, transform: "
     "{rotate: [0, 90, 0]}}}]}}]",
     "[{mesh: {file: scenes/meshes/bunny.obj, transform: {rotate: [0, 90, 0], scale: [1, 2, 1]}}}]"},
    {"instances of instances",
     "[{instance: {of: row, transform: {translate: [0, 1, 0]}}}, {instance: {of: row, transform: {scale: [1, "
     "-1, 1]}}}]",
     "[{sphere: {center: [-1, 1, 0], radius: 0.5}}, {sphere: {center: [2, 1, 0], radius: 1}},"
     " {sphere: {center: [-1, 0, 0], radius: 0.5}}, {sphere: {center: [2, 0, 0], radius: 1}}]"},
};

#define DEFINITIONS                                                                                          \
    "define:\n"                                                                                              \
    "  ball: {objects: [{sphere: {center: [0, 0, 0], radius: 0.5}}]}\n"                                      \
    "  row: {objects: [{instance: {of: ball, transform: {translate: [-1, 0, 0]}}},"                          \
    " {instance: {of: ball, transform: {scale: 2, translate: [2, 0, 0]}}}]}\n"

static Scene scene_with(const char *objects)
{
    return scene_of_text("a.yaml", formatted("%s%sobjects: %s\n", SCENE, DEFINITIONS, objects));
}

TEST(transformed_objects_are_hit_where_plain_ones_are)
{
    if (!probe_has(PRECISION_DOUBLE)) skip();
    for (size_t p = 0; p < COUNT_OF(pairs); p++) {
        Scene scenes[2] = {scene_with(pairs[p].transformed), scene_with(pairs[p].plain)};
        Random random = {p + 1};
        TraceRay rays[RAYS];
        TraceHit hits[2][RAYS];
        for (size_t i = 0; i < RAYS; i++) {
            const Vector3 from = vector_scale(vector_normalize(random_cube_point(&random, 1)), 6),
                          to = random_cube_point(&random, 2),
                          way = vector_normalize(vector_subtract(to, from));
            rays[i] = (TraceRay){from, way, 0, 1e30};
        }
        for (int k = 0; k < 2; k++)
            assert_true(probe_trace(&scenes[k], PRECISION_DOUBLE, 1, rays, RAYS, hits[k]));
        size_t hit_count = 0;
        for (size_t i = 0; i < RAYS; i++) {
            const bool hit = hits[0][i].object != UINT32_MAX, other = hits[1][i].object != UINT32_MAX;
            hit_count += hit;
            if (hit != other || (hit && !(fabs(hits[0][i].t - hits[1][i].t) <= 1e-9 * hits[1][i].t)))
                fail_msg("%s: ray %zu: t %.17g, expected %.17g", pairs[p].name, i, hits[0][i].t,
                         hits[1][i].t);
        }
        if (hit_count < RAYS / 20) fail_msg("%s: only %zu rays hit", pairs[p].name, hit_count);
        scene_free(&scenes[0]);
        scene_free(&scenes[1]);
    }
}

// A mesh's materials stay with its instances unless they have one.
TEST(an_instance_may_have_a_material)
{
    char *folder = scratch_open(), name[256];
    snprintf(name, sizeof name, "%s/m.mtl", folder);
    file_write(name, "newmtl gray\nKd 0.5 0.5 0.5\n");
    snprintf(name, sizeof name, "%s/m.obj", folder);
    file_write(name, "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl gray\nf 1 2 3\n");
    snprintf(name, sizeof name, "%s/a.yaml", folder);
    OwnedScene scene = scene_of_text(
        name, SCENE "materials: {red: {color: [1, 0, 0]}, blue: {color: [0, 0, 1]}}\n"
                    "define: {pair: {objects: [{sphere: {center: [0, 0, 0], radius: 1, material: red}},"
                    " {mesh: {file: m.obj}}]}}\n"
                    "objects: [{instance: {of: pair}}, {instance: {of: pair, material: blue}}]\n");
    assert_int_equal(scene.objects.count, 4);
    assert_string_equal(scene.material_names.items[scene.objects.items[0].material], "red");
    assert_string_equal(scene.material_names.items[scene.objects.items[2].material], "blue");
    assert_string_equal(scene.material_names.items[scene.objects.items[3].material], "blue");
    assert_non_null(scene.meshes.items[scene.objects.items[1].as.mesh.index].materials);
    assert_int_equal(scene.objects.items[1].as.mesh.index, scene.objects.items[3].as.mesh.index);
    assert_string_equal(scene.material_names.items[object_material(&scene, &scene.objects.items[1], 0)],
                        "gray");
    assert_string_equal(scene.material_names.items[object_material(&scene, &scene.objects.items[3], 0)],
                        "blue");
    assert_int_equal(scene.objects.items[3].line, 5);
    scratch_close(folder);
}

TEST(a_scale_that_is_nearly_the_same_counts_as_the_same)
{
    AxisScale scale;
    const Affine nearly =
        affine_of_steps((Vector3){1, 1 + 0.4e-6, 1}, (Vector3){10, 20, 30}, (Vector3){0, 0, 0});
    const Affine clearly =
        affine_of_steps((Vector3){1, 1 + 3e-6, 1}, (Vector3){10, 20, 30}, (Vector3){0, 0, 0});
    assert_true(affine_keeps_balls(&nearly, &scale));
    assert_false(affine_keeps_balls(&clearly, &scale));
}

TEST(a_tube_that_vanishes_is_refused)
{
    const Affine shrink = affine_of_steps(vector_all(1e-29), vector_all(0), vector_all(0));
    Object torus = {.type = SHAPE_TORUS, .as.torus = {.axis = {0, 1, 0}, .major = 1, .minor = 1e-300}};
    Scene scene = {0};
    const char *problem = object_transform(&scene, &torus, &shrink);
    assert_non_null(problem);
    assert_string_equal(problem, "would have a size of 0 or numbers above 1e30");
}

TEST_MAIN(probe_open, probe_close)
