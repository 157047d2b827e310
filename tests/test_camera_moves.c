// Tests the camera's movements, its YAML, and the pace of coarse frames, without a window or a device.
#include "host/import/load.h"
#include "host/scene/portable.h"
#include "host/view/camera_file.h"
#include "host/view/camera_moves.h"
#include "host/view/camera_yaml.h"
#include "host/view/preview.h"
#include "tests/check.h"
#include "tests/scene_reading.h"

static const ImageSize size = {640, 360};

static Camera camera_make(FieldAxis axis)
{
    return (Camera){.position = {3, 2, -5},
                    .look_at = {0.5, 1, 0.25},
                    .up = {0.1, 2, 0},
                    .field_axis = axis,
                    .half_tangent = 0.4};
}

static Vector3 point_along(const Camera *camera, const double pixel[2], double distance)
{
    const CameraRay ray = camera_ray(camera, size, pixel[0], pixel[1]);
    return vector_add(ray.origin, vector_scale(ray.direction, distance));
}

// Checks that the point is seen in the pixel.
static void check_pixel(const Camera *camera, Vector3 point, const double pixel[2])
{
    const CameraRay ray = camera_ray(camera, size, pixel[0], pixel[1]);
    Vector3 seen = vector_normalize(vector_subtract(point, ray.origin));
    assert_vector(seen, ray.direction.x, ray.direction.y, ray.direction.z);
}

static double distance_to(const Camera *camera, Vector3 point)
{
    return vector_length(vector_subtract(point, camera->position));
}

TEST(grabbed_point_stays_under_the_cursor)
{
    static const double from[2] = {100, 50}, to[2] = {420, 333};
    for (int i = 0; i < 5; i++) {
        Camera start = camera_make((FieldAxis)(i % 2));
        start.projection = i == 4   ? PROJECTION_EQUIRECTANGULAR
                           : i >= 2 ? PROJECTION_ORTHOGRAPHIC
                                    : PROJECTION_PERSPECTIVE;
        start.shift[0] = -0.2;
        start.shift[1] = 0.4;
        Camera camera = start;
        Vector3 point = point_along(&start, from, 4);

        camera_orbit(&camera, point, 0.7, -0.3);
        check_pixel(&camera, point, from);
        if (start.projection != PROJECTION_ORTHOGRAPHIC) assert_number(distance_to(&camera, point), 4);
        assert_true(distance_to(&camera, start.position) > 0.2);

        camera = start;
        camera_dolly(&camera, point, 0.25);
        check_pixel(&camera, point, from);
        if (start.projection == PROJECTION_ORTHOGRAPHIC)
            assert_number(camera.half_tangent, start.half_tangent / 4);
        else
            assert_number(distance_to(&camera, point), 1);

        camera = start;
        camera_pan(&camera, size, 4, from, to);
        check_pixel(&camera, point, to);
    }
}

TEST(view_does_not_turn_over)
{
    const double one_degree = M_PI / 180;
    Camera camera = camera_make(FIELD_VERTICAL);
    Vector3 pivot = {1, 1, 1};
    for (int step = 0; step < 40; step++) {
        camera_orbit(&camera, pivot, 0.1, step < 20 ? 0.5 : -0.5);
        Vector3 forward = vector_normalize(vector_subtract(camera.look_at, camera.position));
        double angle = acos(vector_dot(forward, camera.up));
        assert_true(angle > 0.99 * one_degree && angle < M_PI - 0.99 * one_degree);
        if (step == 19) assert_true(fabs(angle - one_degree) < 1e-9);
    }
}

// A scene may look straight down, or have no `up`.
TEST(useless_up_is_replaced)
{
    static const Vector3 ups[] = {{0, 0, 0}, {0, 1, 0}, {0, -3, 0}};
    for (size_t i = 0; i < COUNT_OF(ups); i++) {
        Camera camera = {.position = {0, 5, 0}, .up = ups[i], .half_tangent = 1};
        camera_orbit(&camera, camera.look_at, 0, -0.2);
        assert_number(vector_length(camera.position), 5);
        assert_number(acos(camera.position.y / 5), 0.2);
    }
}

TEST(camera_turns_and_flies)
{
    Camera camera = {.look_at = {0, 0, 1}, .up = {0, 1, 0}, .half_tangent = 1};
    camera_fly(&camera, 2, 0, 0);
    assert_vector(camera.position, 0, 0, 2);
    camera_fly(&camera, 0, 1, 3); // right is -x where the view is along z
    assert_vector(camera.position, -1, 3, 2);
    assert_vector(camera.look_at, -1, 3, 3);
    camera_orbit(&camera, camera.position, M_PI / 2, 0); // to the left
    assert_vector(camera.position, -1, 3, 2);
    assert_vector(camera.look_at, 0, 3, 2);
    camera_look_at(&camera, (Vector3){-1, 3, 9});
    assert_vector(camera.look_at, -1, 3, 9);
    camera_look_at(&camera, camera.position);
    assert_vector(camera.look_at, -1, 3, 9);
}

static void check_yaml(const Camera *camera)
{
    OwnedText text = {0};
    camera_write_yaml(&text, camera, 1.5);
    text_appendf(&text, "lights: [{point: {position: [0, 0, 0]}}]\n"
                        "objects: [{sphere: {center: [0, 0, 0], radius: 1}}]\n");
    OwnedScene scene = scene_of_text("camera.yaml", text_c(&text));
    const Camera *read = &scene.camera;
    assert_memory_equal(&read->position, &camera->position, sizeof(Vector3));
    assert_memory_equal(&read->look_at, &camera->look_at, sizeof(Vector3));
    assert_memory_equal(&read->up, &camera->up, sizeof(Vector3));
    assert_int_equal(read->field_axis, camera->field_axis);
    if (read->half_tangent != camera->half_tangent)
        fail_msg("%.17g read as %.17g from %s", camera->half_tangent, read->half_tangent, text_c(&text));
    assert_int_equal(read->projection, camera->projection);
    assert_memory_equal(read->shift, camera->shift, sizeof camera->shift);
    assert_true(read->lens.radius == camera->lens.radius);
    assert_true(read->lens.distance == camera->lens.distance);
    assert_int_equal(read->lens.focus, camera->lens.focus);
    assert_memory_equal(&read->lens.point, &camera->lens.point, sizeof(Vector3));
}

TEST(yaml_gives_the_same_camera)
{
    Camera camera = camera_make(FIELD_HORIZONTAL);
    check_yaml(&camera);
    camera.field_axis = FIELD_VERTICAL;
    for (int i = 1; i < 2000; i++) {
        double degrees = i % 2 ? 0.09 * i : i / 11.3;
        camera.half_tangent = portable_tangent(degrees * (M_PI / 360));
        camera.position = vector_scale(camera.position, 1.0 + 1.0 / i);
        check_yaml(&camera);
    }
    Camera focused = camera;
    focused.lens.radius = 0.1;
    focused.lens.focus = FOCUS_DISTANCE;
    focused.lens.distance = 1.0 / 3;
    check_yaml(&focused);
    focused.projection = PROJECTION_ORTHOGRAPHIC;
    focused.shift[1] = 0.1;
    check_yaml(&focused);
    focused.lens.focus = FOCUS_LOOK_AT;
    focused.lens.distance = 0;
    check_yaml(&focused);
    focused.lens.focus = FOCUS_POINT;
    focused.lens.point = focused.look_at;
    check_yaml(&focused);
    Camera panorama = camera_make(FIELD_HORIZONTAL);
    panorama.projection = PROJECTION_EQUIRECTANGULAR;
    panorama.half_tangent = M_PI;
    check_yaml(&panorama);
    camera.half_tangent = portable_tangent(50 * (M_PI / 360));
    camera.position = (Vector3){0.1, 1e300, -40};
    OwnedText text = {0};
    camera_write_yaml(&text, &camera, 1.5);
    assert_string_equal(text_c(&text), "camera: {position: [0.1, 1e+300, -40], look_at: [0.5, 1, 0.25], "
                                       "up: [0.1, 2, 0], fov: 50}\n");
}

#define REST "objects: [] # none\n"

// Checks the text that replaces the camera, or records it at a frame. An `expected` of NULL means a refusal
// with one message.
static void check_written(const char *text, const uint32_t *frame, const char *expected)
{
    const Camera camera = {
        .position = {1, 2.5, 3}, .look_at = {0, 0, 1e-3}, .up = {0, 0, 1}, .half_tangent = 0.5};
    const Source source = {.file = "scene.yaml", .bytes = text, .length = strlen(text)};
    OwnedText replaced;
    MessageList messages = {0};
    assert_int_equal(camera_replace(&replaced, &source, &camera, frame, &messages), expected != NULL);
    assert_int_equal(messages.count, expected == NULL);
    message_list_free(&messages);
    if (!expected) return;
    assert_string_equal(text_c(&replaced), expected);
    OwnedScene scene;
    const Source written = {.file = "scene.yaml", .bytes = expected, .length = strlen(expected)};
    assert_true(scene_read_yaml(&scene, &written, &(SceneOptions){.frame = frame ? *frame : 0}, &messages));
    assert_true(vectors_equal(scene.camera.position, camera.position));
    assert_true(vectors_equal(scene.camera.look_at, camera.look_at));
    assert_true(vectors_equal(scene.camera.up, camera.up));
    message_list_free(&messages);
}

static void check_replaced(const char *text, const char *expected)
{
    check_written(text, NULL, expected);
}

static void check_recorded(const char *text, const char *expected)
{
    check_written(text, &(uint32_t){12}, expected);
}

TEST(camera_is_written_into_the_file)
{
    check_replaced(
        "# a scene\ncamera: {position: [9, 9, 9], fov: 30, look_at: [0,0,0] , up: [0, 1, 0]} # eye\n" REST,
        "# a scene\ncamera: {position: [1, 2.5, 3], fov: 30, look_at: [0, 0, 0.001] , "
        "up: [0, 0, 1]} # eye\n" REST);
    check_replaced(
        "camera:\n  position: # the eye\n    - 1\n    - 9 # high\n    - 3\n\n  # below\n  look_at: [0, 0, 1]"
        " # there\n" REST,
        "camera:\n  up: [0, 0, 1]\n  position: # the eye\n    [1, 2.5, 3]\n\n  # below\n  look_at: "
        "[0, 0, 0.001] # there\n" REST);
    check_replaced("camera:\n  position:\n  - 1\n  - 9\n  - 3\n  look_at: [0, 0, 0.001]\n" REST,
                   "camera:\n  up: [0, 0, 1]\n  position:\n   [1, 2.5, 3]\n  look_at: [0, 0, 0.001]\n" REST);
    check_replaced("camera: {look_at: [0, 0, 0.001], position: [1, 2.50, 3.0]}\n" REST,
                   "camera: {up: [0, 0, 1], look_at: [0, 0, 0.001], position: [1, 2.50, 3.0]}\n" REST);
    check_replaced("{\"camera\": {\"look_at\": [0, 0, 0], \"position\": [1, 2.5, 3]}, \"objects\": []}\n",
                   "{\"camera\": {\"up\": [0, 0, 1], \"look_at\": [0, 0, 0.001], \"position\": [1, 2.5, 3]}, "
                   "\"objects\": []}\n");
    check_replaced(
        "camera: {position: [9, 9, 9], look_at: [0, 0, 0], up: [0, 0, 1], turn: 90, fov: 40}\n" REST,
        "camera: {position: [1, 2.5, 3], look_at: [0, 0, 0.001], up: [0, 0, 1], turn: 0, fov: 40}\n" REST);
    check_replaced(
        "camera: {position: [1, 2.5, 3], look_at: [0, 0, 0.001], up: [0, 0, 1], height: 4}\n" REST,
        "camera: {position: [1, 2.5, 3], look_at: [0, 0, 0.001], up: [0, 0, 1], height: 1}\n" REST);
    check_replaced("camera: {position: [9, 9, 9], look_at: [0, 0, 0], turn: {keys: {0: 0}}}\n" REST, NULL);
    check_replaced("{objects: [&a [9, 9, 9]], camera: {position: *a, look_at: [0, 0, 0]}}\n", NULL);
    check_replaced("{a: [1], objects: []}\n", NULL);
    check_replaced("camera: {position: [1, 2, 3]}\n", NULL);
    check_replaced("camera: {position: [1, 2, 3]\n", NULL);
}

TEST(camera_is_recorded_in_the_file)
{
    check_recorded( // its first keys; what stays constant stays
        "camera: {position: [9, 9, 9], fov: 30, look_at: [0, 0, 0], up: [0, 0, 1], turn: 0} # eye\n" REST,
        "camera: {position: {keys: {12: [1, 2.5, 3]}}, fov: 30, look_at: {keys: {12: [0, 0, 0.001]}}, "
        "up: [0, 0, 1], turn: 0} # eye\n" REST);
    check_recorded( // in front, in the place of another, and behind
        "camera:\n  up: {keys: {12.5: [0, 1, 0] }, ease: step}\n"
        "  position: {ease: smooth, keys: {0: [0, 0, 0], 12.0: [9, 9, 9], 24: [1, 1, 1]}}\n"
        "  look_at: {keys: {-1: [0, 0, 1], 3: [0, 0, 2]}}\n  fov: {keys: {0: 30, 24: 40}}\n" REST,
        "camera:\n  up: {keys: {12: [0, 0, 1], 12.5: [0, 1, 0] }, ease: step}\n"
        "  position: {ease: smooth, keys: {0: [0, 0, 0], 12.0: [1, 2.5, 3], 24: [1, 1, 1]}}\n"
        "  look_at: {keys: {-1: [0, 0, 1], 3: [0, 0, 2], 12: [0, 0, 0.001]}}\n"
        "  fov: {keys: {0: 30, 24: 40}}\n" REST);
    check_recorded( // in blocks
        "camera:\n  up: [0, 0, 1]\n  position:\n    keys: # of the eye\n      24: [9, 9, 9] # last\n"
        "  look_at:\n    keys:\n      0: [0, 0, 0] # first\n      # none\n    ease: smooth\n"
        "  height:\n    keys:\n      12:\n        2\n" REST,
        "camera:\n  up: [0, 0, 1]\n  position:\n    keys: # of the eye\n      12: [1, 2.5, 3]\n"
        "      24: [9, 9, 9] # last\n  look_at:\n    keys:\n      0: [0, 0, 0] # first\n"
        "      12: [0, 0, 0.001]\n      # none\n    ease: smooth\n"
        "  height:\n    keys:\n      12:\n        1\n" REST);
    check_recorded("{\"camera\": {\"position\": {\"keys\": {\"0\": [1, 1, 1]}}, \"look_at\": [0, 0, 0]}}",
                   "{\"camera\": {\"up\": [0, 0, 1], \"position\": {\"keys\": {\"0\": [1, 1, 1], "
                   "\"12\": [1, 2.5, 3]}}, \"look_at\": {\"keys\": {\"12\": [0, 0, 0.001]}}}}");
    check_recorded("camera: {position: [9, 9, 9], look_at: [0, 0, 0], turn: {keys: {0: 0}}}\n" REST, NULL);
    check_recorded("camera: {position: [9, 9, 9], look_at: [0, 0, 0], turn: 90}\n" REST, NULL);
    check_recorded("{a: &a {0: [9, 9, 9]}, camera: {position: {keys: *a}, look_at: [0, 0, 0]}}\n", NULL);
    check_recorded("{a: &a [9, 9, 9], camera: {position: {keys: {0: *a}}, look_at: [0, 0, 0]}}\n", NULL);
    check_recorded("camera: {position: {keys: {0: [1, 2]}}, look_at: [0, 0, 0]}\n" REST, NULL);
}

// Checks that, for a scene that takes this long to move and per pixel, every frame after the first few is in
// time, and the resolution settles at the best there is.
static void check_pace(double move_seconds, double seconds_of_pixel, uint32_t expected)
{
    Preview preview = {0};
    uint32_t divisor = 0;
    for (int frame = 0; frame < 20; frame++) {
        uint32_t before = divisor;
        divisor = preview_divisor(&preview, size.width, size.height);
        double pixels = (double)size.width / divisor * size.height / divisor;
        double seconds = pixels * seconds_of_pixel;
        preview_record(&preview, divisor, move_seconds, seconds, pixels);
        if (frame >= 1 && divisor < 16) assert_true(move_seconds + seconds <= PREVIEW_SECONDS);
        if (frame >= 2) assert_int_equal(divisor, before);
    }
    assert_int_equal(divisor, expected);
}

TEST(coarse_frames_are_in_time)
{
    check_pace(0.0001, 1e-9, 1);
    check_pace(0.001, 1e-7, 2);
    check_pace(0.001, 1e-6, 4);
    check_pace(0.010, 1e-6, 5);
    check_pace(0.001, 1e-4, 16);
    check_pace(0.1, 1e-7, 16);
}

TEST(one_slow_frame_changes_nothing)
{
    Preview preview = {0};
    const uint32_t divisor = 2;
    const double pixels = (double)size.width / divisor * size.height / divisor;
    for (int frame = 0; frame < 6; frame++) {
        const double times_slower = frame == 3 ? 20 : 1;
        preview_record(&preview, divisor, times_slower * 0.001, times_slower * pixels * 1e-7, pixels);
        assert_int_equal(preview_divisor(&preview, size.width, size.height), divisor);
    }
    preview_record(&preview, divisor, 0.001, 20 * pixels * 1e-7, pixels);
    preview_record(&preview, divisor, 0.001, 20 * pixels * 1e-7, pixels);
    assert_true(preview_divisor(&preview, size.width, size.height) > divisor);
}

TEST_MAIN(NULL, NULL)
