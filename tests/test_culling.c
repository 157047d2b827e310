// Tests the cull spheres of rays from the eye or to a light. No sphere within the error bound of a line may
// be culled, and every sphere clearly outside it must be. The cull of several packets is tried with one ray,
// where it bounds a single direction. test_invariances compares whole scenes with and without cull spheres.
// run_tests: sanitize-long-only
#include "host/compile/stages.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"
#include "tests/probe.h"

enum { SPHERES_PER_ORIGIN = 4096, ORIGIN_COUNT = 64, SPHERE_COUNT = SPHERES_PER_ORIGIN * ORIGIN_COUNT };

static const char kernel_text[] =
    "#include \"cull_sphere.h\"\n"
    "kernel void misses(global const scalar *lines, global const CullSphere *cull_spheres, uint "
    "common_origin, global int "
    "*missed, global int *missed_by_bounds)\n"
    "{\n"
    "    size_t i = get_global_id(0);\n"
    "    global const scalar *line = lines + 6 * i;\n"
    "    Vector origin = {line[0], line[1], line[2]}, direction = {line[3], line[4], line[5]};\n"
    "    Ray ray = ray_make(origin, direction, 0, 1, mask_all());\n"
    "    ray_set_common_origin(&ray, common_origin, mask_none());\n"
    "    missed[i] = !lanes_any(ray_hits_cull_sphere(&ray, &cull_spheres[i]));\n"
    "    DirectionBounds bounds;\n"
    "    missed_by_bounds[i] = rays_bound_directions(&ray, 1, &bounds) &&\n"
    "                          directions_hit_cull_spheres(&bounds, &cull_spheres[i]) == 0;\n"
    "}\n";

typedef struct {
    bool is_double;
    double unit_roundoff;
    Random random;
    double scale; // of all lengths but the eye's directions
    Vector3 common_origin;
    CompiledScene flat; // a light at the common origin, and a sphere for each line
    double *lines;      // origin and direction of each
    int *missed, *missed_by_bounds;
    size_t hit_count, missed_count, between_count, missed_by_bounds_count;
} Trial;

static double trial_rounded(const Trial *trial, double value)
{
    return trial->is_double ? value : rounded_to_float(value);
}

static Vector3 trial_vector_rounded(const Trial *trial, Vector3 v)
{
    return (Vector3){trial_rounded(trial, v.x), trial_rounded(trial, v.y), trial_rounded(trial, v.z)};
}

// Makes a line through the common origin, and a sphere that it barely hits or barely misses, on either side
// of the origin.
static void line_make(Trial *trial, size_t index, bool from_eye)
{
    Random *random = &trial->random;
    Vector3 offset =
        vector_scale(vector_normalize(random_in_sphere(random)), trial->scale * random_power(random, -2, 4));
    Vector3 origin = from_eye ? (Vector3){0, 0, 0}
                              : trial_vector_rounded(trial, vector_subtract(trial->common_origin, offset));
    Vector3 direction = trial_vector_rounded(trial, from_eye ? vector_normalize(offset)
                                                             : vector_subtract(trial->common_origin, origin));
    double *line = trial->lines + 6 * index;
    memcpy(line, (double[]){origin.x, origin.y, origin.z, direction.x, direction.y, direction.z},
           6 * sizeof *line);

    double along = trial->scale * random_between(random, -1, 1) * random_power(random, -2, 4);
    double radius = trial_rounded(trial, trial->scale * random_power(random, -3, 3));
    double off =
        random_power(random, trial->is_double ? -15 : -8, 1) * (random_between(random, -1, 1) < 0 ? -1 : 1);
    Vector3 across = vector_normalize(vector_cross(direction, random_in_sphere(random)));
    Vector3 point = vector_add(trial->common_origin, vector_scale(vector_normalize(direction), along));
    Vector3 center =
        trial_vector_rounded(trial, vector_add(point, vector_scale(across, radius * fmax(0, 1 + off))));
    ((Sphere *)trial->flat.arrays[FLAT_FIRST_SHAPE + TYPE_SPHERES].items)[index].center_radius =
        (scalar4){center.x, center.y, center.z, radius};
}

static void trial_make(Trial *trial, bool from_eye)
{
    FlatArray *arrays = trial->flat.arrays;
    flat_array_renew(&trial->flat, FLAT_LIGHTS, 1);
    flat_array_renew(&trial->flat, FLAT_FIRST_SHAPE + TYPE_SPHERES, SPHERES_PER_ORIGIN);
    // elsewhere float's fourth powers of lengths vanish or are infinite, and no sphere is culled
    trial->scale = ldexp(1, (int)random_between(&trial->random, -16, 16));
    Vector3 common_origin =
        vector_scale(random_in_sphere(&trial->random), trial->scale * random_power(&trial->random, -2, 4));
    trial->common_origin = from_eye ? (Vector3){0, 0, 0} : trial_vector_rounded(trial, common_origin);
    ((FlatLight *)arrays[FLAT_LIGHTS].items)->position =
        (scalar4){trial->common_origin.x, trial->common_origin.y, trial->common_origin.z, 0};
    for (size_t i = 0; i < SPHERES_PER_ORIGIN; i++)
        line_make(trial, i, from_eye);
    const CompileSettings settings = {.precision = trial->is_double ? PRECISION_DOUBLE : PRECISION_SINGLE};
    culling_fill(&trial->flat, &settings);
}

// Finds on the device which lines miss their spheres, with the arrays in its width.
static void trial_run(Trial *trial, cl_program program, uint32_t common_origin)
{
    size_t scalar = trial->is_double ? sizeof(double) : sizeof(float),
           lines_size = SPHERES_PER_ORIGIN * 6 * scalar;
    OWNED char *lines = memory_allocate(SPHERES_PER_ORIGIN * 6, scalar);
    for (size_t i = 0; i < (size_t)SPHERES_PER_ORIGIN * 6; i++) {
        if (trial->is_double)
            ((double *)(void *)lines)[i] = trial->lines[i];
        else
            ((float *)(void *)lines)[i] = (float)trial->lines[i];
    }
    const FlatArray *cull_spheres = &trial->flat.arrays[FLAT_CULL_SPHERES];
    // after those of the BVH
    FlatArray row = {
        flat_array_at(cull_spheres, (common_origin - COMMON_ORIGIN_EYE) * trial->flat.cull_sphere_count + 1),
        SPHERES_PER_ORIGIN, cull_spheres->layout};
    size_t row_size = flat_array_size(&row, trial->is_double);
    OWNED void *row_bytes = memory_allocate(row_size, 1);
    flat_array_write(&row, trial->is_double, row_bytes);

    cl_kernel kernel = probe_kernel(program, "misses");
    const size_t count = SPHERES_PER_ORIGIN, missed_size = SPHERES_PER_ORIGIN * sizeof(int);
    cl_mem buffers[] = {buffer_create(&probe_compute, lines_size, lines, CL_MEM_READ_ONLY),
                        buffer_create(&probe_compute, row_size, row_bytes, CL_MEM_READ_ONLY),
                        buffer_create(&probe_compute, missed_size, NULL, CL_MEM_WRITE_ONLY),
                        buffer_create(&probe_compute, missed_size, NULL, CL_MEM_WRITE_ONLY)};
    kernel_argument(&probe_compute, kernel, 0, sizeof(cl_mem), &buffers[0]);
    kernel_argument(&probe_compute, kernel, 1, sizeof(cl_mem), &buffers[1]);
    kernel_argument(&probe_compute, kernel, 2, sizeof common_origin, &common_origin);
    kernel_argument(&probe_compute, kernel, 3, sizeof(cl_mem), &buffers[2]);
    kernel_argument(&probe_compute, kernel, 4, sizeof(cl_mem), &buffers[3]);
    kernel_launch(&probe_compute, kernel, 1, NULL, &count, NULL);
    buffer_read(&probe_compute, buffers[2], missed_size, trial->missed);
    buffer_read(&probe_compute, buffers[3], missed_size, trial->missed_by_bounds);
    for (size_t i = 0; i < 4; i++)
        buffer_release(buffers[i]);
    clReleaseKernel(kernel);
}

static long double dot(const long double *a, const long double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

// The enlargement of the squared radius, 256 + 128 (CULL_SPHERE_SLACK, CULL_DIRECTION_SLACK), and as much
// again for roundings.
#define CLEAR_MISS 800
// The part of the squared distance that bounds of directions must tell from the radius. 2^-13 in each
// component are up to 3^(1/2) 2^-12 of the square; the limit is about twice that.
#define CLEAR_MISS_BY_BOUNDS 0x1p-10L

// Checks one answer by the line's distance from the center, in long double.
static void line_check(Trial *trial, size_t index, bool from_eye)
{
    const double *line = trial->lines + 6 * index;
    const Sphere *sphere = flat_array_at(&trial->flat.arrays[FLAT_FIRST_SHAPE + TYPE_SPHERES], index);
    scalar4 c = sphere->center_radius;
    const long double d[3] = {line[3], line[4], line[5]};
    const long double f[3] = {(long double)c.x - line[0], (long double)c.y - line[1],
                              (long double)c.z - line[2]};
    const long double v[3] = {(long double)c.x - trial->common_origin.x,
                              (long double)c.y - trial->common_origin.y,
                              (long double)c.z - trial->common_origin.z};
    const long double moment[3] = {f[1] * d[2] - f[2] * d[1], f[2] * d[0] - f[0] * d[2],
                                   f[0] * d[1] - f[1] * d[0]};
    long double distance = sqrtl(dot(moment, moment) / dot(d, d)),
                reach = sqrtl(dot(v, v)) + (from_eye ? 0 : sqrtl(dot(d, d)));
    long double u = trial->unit_roundoff, radius = c.w, slack = 64 * u * reach;
    if (distance <= radius + slack) {
        trial->hit_count++;
        if (trial->missed[index])
            fail_msg("sphere %zu of radius %a: culled although a line is %La from its center", index, c.w,
                     distance);
    } else if (distance * distance - radius * radius > CLEAR_MISS * u * reach * reach) {
        trial->missed_count++;
        if (!trial->missed[index])
            fail_msg("sphere %zu of radius %a: not culled although a line is %La from its center", index, c.w,
                     distance);
    } else {
        trial->between_count++;
    }
    // half a line, since none of the ray lies beyond the common origin
    const long double away = dot(v, d) * (from_eye ? 1 : -1);
    if (away <= 0) distance = sqrtl(dot(v, v));
    if (distance <= radius + slack) {
        if (trial->missed_by_bounds[index])
            fail_msg("sphere %zu of radius %a: culled by bounds although a ray is %La from its center", index,
                     c.w, distance);
    } else if (distance * distance - radius * radius > CLEAR_MISS_BY_BOUNDS * reach * reach) {
        trial->missed_by_bounds_count++;
        if (!trial->missed_by_bounds[index])
            fail_msg("sphere %zu of radius %a: not culled by bounds although a ray is %La from its center",
                     index, c.w, distance);
    }
}

typedef struct {
    bool is_double, from_eye;
} Variant;

static void culling_check(void **state)
{
    const Variant *variant = *state;
    const bool is_double = variant->is_double, from_eye = variant->from_eye;
    if (is_double && !probe_has(PRECISION_DOUBLE)) skip();
    cl_program program = probe_program(kernel_text, 1, is_double ? PRECISION_DOUBLE : PRECISION_SINGLE, true,
                                       0, "-cl-std=CL1.2");
    Trial trial = {.is_double = is_double,
                   .unit_roundoff = is_double ? DBL_EPSILON / 2 : FLT_EPSILON / 2,
                   .random = {7}};
    trial.lines = memory_allocate((size_t)SPHERES_PER_ORIGIN * 6, sizeof *trial.lines);
    trial.missed = memory_allocate(SPHERES_PER_ORIGIN, sizeof *trial.missed);
    trial.missed_by_bounds = memory_allocate(SPHERES_PER_ORIGIN, sizeof *trial.missed_by_bounds);
    for (size_t i = 0; i < ORIGIN_COUNT; i++) {
        trial_make(&trial, from_eye);
        trial_run(&trial, program, from_eye ? COMMON_ORIGIN_EYE : COMMON_ORIGIN_FIRST_LIGHT);
        for (size_t k = 0; k < SPHERES_PER_ORIGIN; k++)
            line_check(&trial, k, from_eye);
        compiled_scene_free(&trial.flat);
    }
    // few answers are too near to call
    assert_true(trial.hit_count > SPHERE_COUNT / 4);
    assert_true(trial.missed_count > SPHERE_COUNT / 8);
    assert_true(trial.missed_by_bounds_count > SPHERE_COUNT / 8);
    free(trial.lines);
    free(trial.missed);
    free(trial.missed_by_bounds);
    clReleaseProgram(program);
}

TEST_CASE(from_the_eye, culling_check, &(Variant){false, true})
TEST_CASE(from_the_eye_in_double, culling_check, &(Variant){true, true})
TEST_CASE(to_a_light, culling_check, &(Variant){false, false})
TEST_CASE(to_a_light_in_double, culling_check, &(Variant){true, false})

TEST_MAIN(probe_open, probe_close)
