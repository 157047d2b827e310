// Tests that shapes next to the eye that rounding would move are stored relative to it, and that other
// scenes' kernels pay nothing for this.
#include "host/compile/shapes.h"
#include "tests/check.h"
#include "tests/scene_reading.h"

static CompiledScene compile_for(const Scene *scene, Precision precision, bool shift_to_eye)
{
    const CompileSettings settings = {.width = 64,
                                      .height = 64,
                                      .sample_count = 1,
                                      .precision = precision,
                                      .shift_to_eye = shift_to_eye,
                                      .bvh = BVH_OFF,
                                      .lanes = 1};
    return scene_compiled(scene, &settings);
}

static CompiledScene compile(const Scene *scene, Precision precision)
{
    return compile_for(scene, precision, true);
}

static CompiledScene compile_text(const char *objects, Precision precision)
{
    OwnedScene scene = scene_of_text(
        "next.yaml",
        formatted("camera: {position: [0, 1.75, 0], look_at: [0, 0, 4]}\nobjects:\n%s", objects));
    CompiledScene compiled = compile(&scene, precision);
    return compiled;
}

static const void *first(const CompiledScene *compiled, int type)
{
    return flat_array_at(&compiled->arrays[FLAT_FIRST_SHAPE + type], 0);
}

static double power_of(uint4 id, bool is_double)
{
    assert_true(id.y & HAS_POWER);
    uint64_t bits = (uint64_t)id.w << 32 | id.z;
    double wide;
    float narrow;
    memcpy(&wide, &bits, sizeof wide);
    memcpy(&narrow, &id.z, sizeof narrow);
    return is_double ? wide : (double)narrow;
}

TEST(ordinary_scenes_have_no_powers)
{
    static const char *const files[] = {"tests/scenes/every_shape.yaml", "scenes/cylinders-cones.yaml",
                                        "scenes/triangles.yaml"};
    for (size_t i = 0; i < COUNT_OF(files); i++) {
        OwnedScene scene = scene_of_file(files[i]);
        OwnedCompiledScene compiled = compile(&scene, PRECISION_SINGLE);
        assert_false(compiled.features & FEATURE_EYE_POWERS);
    }
}

// The eye is 1.75 above the top of a cylinder with the radius of a planet, far from both ends.
TEST(a_cylinder_is_seen_from_its_nearest_point)
{
    const double radius = 6371001, height = 1.75;
    for (int precision = PRECISION_SINGLE; precision <= PRECISION_DOUBLE; precision++) {
        OwnedCompiledScene compiled =
            compile_text("  - cylinder: {from: [0, -6371001, -1234567.8], to: [0, -6371001, 7654321.1], "
                         "radius: 6371001}\n",
                         (Precision)precision);
        const Cylinder *cylinder = first(&compiled, TYPE_CYLINDERS);
        const bool is_double = precision == PRECISION_DOUBLE;
        const double squared = cylinder->range.z, length = cylinder->range.y;
        const double expected = squared * height * (2 * radius + height);
        const double error = fabs(power_of(cylinder->id, is_double) / expected - 1);
        assert_true(error < (is_double ? 0x1p-50 : 0x1p-23));
        assert_number(cylinder->base_radius.z, 0);
        assert_number(cylinder->range.w / length, -1234567.8);
        assert_number(cylinder->range.x / length, 7654321.1);
        const Bounds bounds = primitive_bounds(TYPE_CYLINDERS, cylinder);
        assert_true(fabs(bounds.min.z + 1234567.8) < 1 && fabs(bounds.max.z - 7654321.1) < 1);
    }
}

TEST(a_plane_goes_through_its_nearest_point)
{
    OwnedCompiledScene compiled =
        compile_text("  - plane: {point: [2e7, -1e7, 0], normal: [1, 2, 3]}\n", PRECISION_SINGLE);
    const Plane *plane = first(&compiled, TYPE_PLANES);
    const double height = -3.5 / 14; // of the plane over the eye, in normals
    assert_true(fabs(plane->point.x - height) < 1e-7);
    assert_true(fabs(plane->point.y - 2 * height) < 1e-7);
    assert_true(fabs(plane->point.z - 3 * height) < 1e-7);
}

// Explicit rays may start next to the plane's stored point. In double that point is exact. The point nearest
// to the origin would be off by rounding, 4e5 ulp of a t of 1 in this plane.
TEST(explicit_rays_see_a_plane_through_its_own_point)
{
    const double point[3] = {-7351234.1, 1534783.4, 1735961.9};
    OwnedScene scene = scene_of_text(
        "far.yaml", formatted("camera: {position: [0, 1.75, 0], look_at: [0, 0, 4]}\n"
                              "objects:\n  - plane: {point: [%.17g, %.17g, %.17g], normal: [1, 2, 3]}\n",
                              point[0], point[1], point[2]));
    OwnedCompiledScene compiled = compile_for(&scene, PRECISION_DOUBLE, false);
    const Plane *plane = first(&compiled, TYPE_PLANES);
    assert_true(plane->point.x == point[0] && plane->point.y == point[1] && plane->point.z == point[2]);
}

// The stored height and normal are those of the triangle before its vertices are rounded, also in double,
// where the height is a float.
TEST(a_triangle_has_the_eyes_height)
{
    for (int precision = PRECISION_SINGLE; precision <= PRECISION_DOUBLE; precision++) {
        const bool is_double = precision == PRECISION_DOUBLE;
        const char *text = is_double
                               ? "  - triangle: {vertices: [[3e16, -15e15, 0], [-45e15, 0, 15e15], "
                                 "[15e15, 15e15, -15e15]]}\n"
                               : "  - triangle: {vertices: [[22345677, -11172838.5, 0], "
                                 "[-33518515.5, 0, 11172838.5], [11172838.5, 11172838.5, -11172838.5]]}\n";
        OwnedCompiledScene compiled = compile_text(text, (Precision)precision);
        const Triangle *triangle = first(&compiled, TYPE_TRIANGLES);
        assert_true(compiled.features & FEATURE_EYE_POWERS);
        float height;
        memcpy(&height, &triangle->id.w, sizeof height);
        const Vector3 normal = {triangle->a.w, triangle->b.w, triangle->c.w};
        // the plane through the origin has the normal (1, 2, 3)
        const double expected = fabs(2 * 1.75 / sqrt(14));
        const double error = fabs(fabs((double)height) / vector_length(normal) / expected - 1);
        assert_true(error < (is_double ? 0x1p-51 : 0x1p-23));
    }
}

TEST_MAIN(NULL, NULL)
