// Shows the faults of the program in Mouad Sidqi's "Ray Tracing in C explained". Each test writes out its
// formula in float, as its kernel has it, shows by the reference that the answer is wrong, and compares glint
// with the right answer on the same `.cfg` scene.
//
// run_tests: sanitize-long-only
#include "host/base/ulp.h"
#include "host/verify/reference_color.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/scene_reading.h"

#define MATERIAL "\tcolor 200 100 50\n\tdiffuse 0.5 0.5 0.5\n\tspecular 1\n}\n"
#define CAMERA   "=>camera :\n{\n\tposition 0 0 0\n\tlook_at 0 0 1\n}\n"

typedef struct {
    float x, y, z;
} Float3;

static float dot(Float3 a, Float3 b)
{
    return a.x * b.x + a.y * b.y + a.z * b.z;
}

static Float3 narrow(Vector3 a)
{
    return (Float3){(float)a.x, (float)a.y, (float)a.z};
}

// Returns whether the program counts a distance as a hit.
static bool within_limits(float t)
{
    return t > 1e-6f && t < 300.0f;
}

// Returns the nearer root of a t^2 + b t + c = 0, the only one that the program uses.
static float nearer_root(float a, float b, float c)
{
    float discriminant = b * b - 4 * a * c;
    return discriminant < 0 ? -1 : (-b - sqrtf(discriminant)) / (2 * a);
}

static float article_sphere(Float3 center, float radius, Float3 o, Float3 d)
{
    Float3 f = {o.x - center.x, o.y - center.y, o.z - center.z};
    return nearer_root(dot(d, d), 2 * dot(d, f), dot(f, f) - radius * radius);
}

static float article_cylinder(Float3 from, Float3 axis, float radius, Float3 o, Float3 d)
{
    Float3 f = {o.x - from.x, o.y - from.y, o.z - from.z};
    float along_d = dot(d, axis), along_f = dot(f, axis);
    return nearer_root(dot(d, d) - along_d * along_d, 2 * (dot(d, f) - along_d * along_f),
                       dot(f, f) - along_f * along_f - radius * radius);
}

static float article_cone(Float3 apex, Float3 axis, float angle, Float3 o, Float3 d)
{
    Float3 f = {o.x - apex.x, o.y - apex.y, o.z - apex.z};
    float along_d = dot(d, axis), along_f = dot(f, axis);
    float k = (float)(1 + tan(angle) * tan(angle));
    return nearer_root(dot(d, d) - k * along_d * along_d, 2 * (dot(d, f) - k * along_d * along_f),
                       dot(f, f) - k * along_f * along_f);
}

static Scene read_scene(const char *text)
{
    return scene_of_text("article.cfg", text);
}

// Returns the reference's hit, after comparing glint's with it at `single`.
static ReferenceHit hit_of_both(Scene *scene, Vector3 origin, Vector3 direction)
{
    for (size_t i = 0; i < scene->objects.count; i++)
        scene->objects.items[i] = reference_round_object(&scene->objects.items[i]);
    ReferenceRay ray = reference_ray_rounded(origin, direction);
    ReferenceHit expected = reference_hit(scene, &ray);
    assert_true(expected.found);

    const TraceRay probe = {quad3_rounded(ray.origin), quad3_rounded(ray.direction), 0, FLT_MAX};
    TraceHit hit = {0};
    assert_true(probe_trace(scene, PRECISION_SINGLE, 0, &probe, 1, &hit));
    assert_int_equal(hit.object, expected.object);
    assert_true(fabs((double)(hit.t - expected.t)) <= 8 * ulp_of((double)expected.t, 24));
    assert_true(reference_distance(hit.normal, expected.normal) <= 0x1p-20);
    return expected;
}

TEST(sees_a_sphere_from_inside)
{
    OwnedScene scene = read_scene(CAMERA "=>sphere :\n{\n\tradius 2\n\tcenter 0 0 0.5\n" MATERIAL);
    Vector3 eye = scene.camera.position, forward = {0, 0, 1};
    ReferenceHit hit = hit_of_both(&scene, eye, forward);
    assert_true(hit.t == (Quad)2.5);
    assert_false(within_limits(article_sphere((Float3){0, 0, 0.5f}, 2, narrow(eye), narrow(forward))));
}

TEST(sees_a_cylinder_from_inside)
{
    OwnedScene scene =
        read_scene(CAMERA "=>cylinder :\n{\n\tradius 2\n\tcenter 0 0 0\n\tnormal 0 1 0\n" MATERIAL);
    Vector3 eye = {0, 5, 0.5}, forward = {0, 0, 1};
    ReferenceHit hit = hit_of_both(&scene, eye, forward);
    assert_true(hit.t == (Quad)1.5);
    assert_false(within_limits(
        article_cylinder((Float3){0, 0, 0}, (Float3){0, 1, 0}, 2, narrow(eye), narrow(forward))));
}

TEST(looks_along_a_cylinder)
{
    OwnedScene scene =
        read_scene(CAMERA "=>cylinder :\n{\n\tradius 2\n\tcenter 0 0 0\n\tnormal 0 0 1\n" MATERIAL
                          "=>plane :\n{\n\tposition 0 0 7\n\tnormal 0 0 1\n" MATERIAL);
    Vector3 eye = {0.5, 0, 0}, forward = {0, 0, 1};
    ReferenceHit hit = hit_of_both(&scene, eye, forward);
    assert_int_equal(hit.object, 1);
    assert_true(hit.t == 7);
    const Float3 axis = {0, 0, 1};
    assert_true(isnan(article_cylinder((Float3){0, 0, 0}, axis, 2, narrow(eye), narrow(forward))));
    // Near enough to the axis that a^2 - b^2 cancels, the ray hits the side, at 1.5 / 2^-13.
    const Vector3 nearly = {0x1p-13, 0, 1};
    hit = hit_of_both(&scene, (Vector3){0.5, 0, 8}, nearly);
    assert_int_equal(hit.object, 0);
    assert_true(hit.t == 12288);
    float t = article_cylinder((Float3){0, 0, 0}, axis, 2, (Float3){0.5f, 0, 8}, narrow(nearly));
    assert_false(isfinite(t) && fabsf(t - 12288) < 1);
}

TEST(looks_along_a_cone)
{
    // Half the angle between the axes: the side runs along (-1, 0, 1).
    OwnedScene scene = read_scene(
        CAMERA "=>cone :\n{\n\tangle 0.78539816339744831\n\tcenter 0 0 0\n\tnormal 0 0 1\n" MATERIAL);
    Vector3 eye = {3, 0.5, 1}, along = {-1, 0, 1};
    ReferenceHit hit = hit_of_both(&scene, eye, along);
    assert_true(hit.t == (Quad)1.03125);
    float t = article_cone((Float3){0, 0, 0}, (Float3){0, 0, 1}, 0.78539816f, narrow(eye), narrow(along));
    assert_true(isnan(t));
}

TEST(turns_a_cones_normal_by_its_tangent)
{
    const float angle = 1;
    OwnedScene scene = read_scene(CAMERA "=>cone :\n{\n\tangle 1\n\tcenter 0 0 0\n\tnormal 0 1 0\n" MATERIAL);
    Vector3 eye = {0.25, 1, -5}, forward = {0, 0, 1};
    ReferenceHit hit = hit_of_both(&scene, eye, forward);
    // Its intersection is right here, its normal P - C - (1 + angle^2) ((P - C) . V) V is not.
    float t = article_cone((Float3){0, 0, 0}, (Float3){0, 1, 0}, angle, narrow(eye), narrow(forward));
    assert_true(fabs((double)(t - hit.t)) < 1e-5);
    Vector3 point = {eye.x, eye.y, eye.z + t};
    Vector3 normal = vector_subtract(point, (Vector3){0, (1 + angle * angle) * point.y, 0});
    assert_true(reference_distance(vector_normalize(normal), hit.normal) > 0.3);
    Vector3 right = vector_subtract(point, (Vector3){0, (1 + tan(angle) * tan(angle)) * point.y, 0});
    assert_true(reference_distance(vector_normalize(right), hit.normal) < 1e-6);
}

static double cut(double value)
{
    return floor(fmin(fmax(value, 0), 255));
}

TEST(adds_light_before_it_cuts)
{
    OwnedScene scene = read_scene(CAMERA "=>plane :\n{\n\tposition 0 0 4\n\tnormal 0 0 -1\n"
                                         "\tcolor 109 59 19\n\tdiffuse 0.33 0.33 0.33\n\tspecular 0.4\n}\n"
                                         "=>light :\n{\n\tposition 1 0 0\n\tintensity 0.7 0.7 0.7\n}\n");
    float pixel[3] = {0};
    assert_true(probe_render(&scene, 1, 1, PRECISION_SINGLE, pixel));
    ReferenceRay ray = reference_camera_ray(&scene.camera, 1, 1, 0, 0);
    Color expected = reference_color(&scene, &ray).color;
    assert_true(fabs(pixel[0] - expected.x) < 1e-6 && fabs(pixel[1] - expected.y) < 1e-6 &&
                fabs(pixel[2] - expected.z) < 1e-6);

    // The same three parts, each cut to a byte: Ia = 0.2, N.L = R.V = 4 / sqrt 17.
    const double cosine = 4 / sqrt(17);
    double ambient = 0.2 * 109, diffuse = 0.7 * 0.33 * 109 * cosine;
    double highlight = 255 * 0.7 * 0.4 * pow(cosine, 30);
    assert_true(fabs(ambient + diffuse + highlight - 255 * expected.x) < 1e-9);
    assert_true(cut(ambient) + cut(diffuse) + cut(highlight) < cut(255 * expected.x));
}

TEST(sees_far_and_near)
{
    OwnedScene scene = read_scene(CAMERA "=>sphere :\n{\n\tradius 10\n\tcenter 0 0 1000\n" MATERIAL
                                         "=>sphere :\n{\n\tradius 1e-7\n\tcenter 0 0 -4e-7\n" MATERIAL);
    Vector3 eye = scene.camera.position, far = {0, 0, 1}, near = {0, 0, -1};
    assert_true(hit_of_both(&scene, eye, far).t == 990);
    float t = article_sphere((Float3){0, 0, 1000}, 10, narrow(eye), narrow(far));
    assert_true(t == 990 && !within_limits(t));
    assert_true(fabs((double)hit_of_both(&scene, eye, near).t - 3e-7) < 1e-13);
    t = article_sphere((Float3){0, 0, -4e-7f}, 1e-7f, narrow(eye), narrow(near));
    assert_true(fabs(t - 3e-7) < 1e-12 && !within_limits(t));
}

// The number of lit pixels in an image's middle row and middle column.
typedef struct {
    unsigned across, down;
} Extent;

enum { WIDTH = 128, HEIGHT = 72 };

TEST(keeps_a_sphere_round)
{
    OwnedScene scene = read_scene(CAMERA "=>sphere :\n{\n\tradius 1\n\tcenter 0 0 9\n" MATERIAL);
    static float image[HEIGHT][WIDTH][3];
    assert_true(probe_render(&scene, WIDTH, HEIGHT, PRECISION_SINGLE, &image[0][0][0]));
    Extent seen = {0}, expected = {0}, article = {0};
    for (unsigned row = 0; row < HEIGHT; row++) {
        for (unsigned column = 0; column < WIDTH; column++) {
            ReferenceRay ray = reference_camera_ray(&scene.camera, WIDTH, HEIGHT, column, row);
            bool there = reference_hit(&scene, &ray).found;
            assert_int_equal(image[row][column][0] > 0, there);
            // A frame of 1 by 1 at distance 2, whatever the window's shape.
            Float3 d = {((float)column + 0.5f) / WIDTH - 0.5f, ((float)row + 0.5f) / HEIGHT - 0.5f, 2};
            bool stretched = within_limits(article_sphere((Float3){0, 0, 9}, 1, (Float3){0, 0, 0}, d));
            bool across = row == HEIGHT / 2, down = column == WIDTH / 2;
            seen.across += across && image[row][column][0] > 0;
            seen.down += down && image[row][column][0] > 0;
            expected.across += across && there;
            expected.down += down && there;
            article.across += across && stretched;
            article.down += down && stretched;
        }
    }
    assert_int_equal(seen.across, seen.down);
    assert_int_equal(expected.across, expected.down);
    assert_true(article.across > article.down + article.down / 2);
}

TEST_MAIN(probe_open, probe_close)
