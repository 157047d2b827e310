// Compares bounds with points on each shape, which are known in closed form.
#include "host/compile/scene_bounds.h"
#include "tests/check.h"
#include "tests/scene_reading.h"

#define CAMERA "camera: {position: [0, 0, -5], look_at: [0, 0, 0]}\nobjects:\n"

static Bounds bounds_of(const char *objects, size_t expected_unbounded_count)
{
    OwnedScene scene = scene_of_text("s.yaml", formatted(CAMERA "%s", objects));
    const SceneExtent extent = scene_extent(&scene);
    assert_int_equal(extent.unbounded_count, expected_unbounded_count);
    return extent.bounds;
}

TEST(sphere_box_triangle)
{
    Bounds sphere = bounds_of("  - sphere: {center: [1, 2, 3], radius: 2}\n", 0);
    assert_vector(sphere.min, -1, 0, 1);
    assert_vector(sphere.max, 3, 4, 5);
    Bounds box = bounds_of("  - box: {min: [1, 2, 3], max: [4, 5, 6]}\n", 0);
    assert_vector(box.min, 1, 2, 3);
    assert_vector(box.max, 4, 5, 6);
    Bounds triangle = bounds_of("  - triangle: {vertices: [[0, 5, 0], [2, 0, 1], [1, 1, -7]]}\n", 0);
    assert_vector(triangle.min, 0, 0, -7);
    assert_vector(triangle.max, 2, 5, 1);
}

TEST(discs)
{
    Bounds flat = bounds_of("  - disc: {center: [1, 2, 3], normal: [0, 5, 0], radius: 2}\n", 0);
    assert_vector(flat.min, -1, 2, 1);
    assert_vector(flat.max, 3, 2, 5);
    Bounds tilted = bounds_of("  - disc: {center: [0, 0, 0], normal: [1, 1, 0], radius: 2}\n", 0);
    assert_vector(tilted.min, -sqrt(2), -sqrt(2), -2);
    assert_vector(tilted.max, sqrt(2), sqrt(2), 2);
}

TEST(cylinder_and_cone)
{
    Bounds cylinder =
        bounds_of("  - cylinder: {from: [0, 0, 0], to: [3, 3, 0], radius: 1, caps: false}\n", 0);
    assert_vector(cylinder.min, -sqrt(0.5), -sqrt(0.5), -1);
    assert_vector(cylinder.max, 3 + sqrt(0.5), 3 + sqrt(0.5), 1);
    Bounds cone = bounds_of("  - cone: {from: [0, 0, 0], to: [0, 4, 0], radius: [0, 2]}\n", 0);
    assert_vector(cone.min, -2, 0, -2);
    assert_vector(cone.max, 2, 4, 2);
}

TEST(unbounded)
{
    Bounds bounds = bounds_of("  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n"
                              "  - cylinder: {point: [0, 0, 0], axis: [0, 1, 0], radius: 1}\n"
                              "  - cone: {apex: [0, 0, 0], axis: [0, 1, 0], angle: 10}\n"
                              "  - sphere: {center: [0, 0, 0], radius: 1}\n",
                              3);
    assert_vector(bounds.min, -1, -1, -1);
    assert_vector(bounds.max, 1, 1, 1);
    Bounds empty = bounds_of("  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n", 1);
    assert_true(empty.min.x > empty.max.x);
}

TEST_MAIN(NULL, NULL)
