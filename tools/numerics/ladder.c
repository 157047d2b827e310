// Measures the error of t by shape, precision and distance. Traces random rays with the kernels that this
// program was built with, and compares each with the quadruple-precision reference of
// host/verify/reference.c, which receives the same bits as the kernel. Prints JSON, of which
// tools/numerics/ulp-ladder makes tables. With --check, prints the errors beyond the hard cases' bounds.
#include "host/base/array.h"
#include "host/base/clock.h"
#include "host/base/fault.h"
#include "host/base/json.h"
#include "host/base/memory.h"
#include "host/base/ulp.h"
#include "host/render/renderer.h"
#include "host/verify/random_shape.h"
#include "host/verify/reference.h"
#include "tests/random_ray.h"
#include <getopt.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

// Distances from rays' origins to the shape's center, in radii of the shape's bounding sphere.
static const double rungs[] = {1.0001, 1.01, 1.1, 2, 10, 100, 1e3, 1e4, 1e5, 1e6};

enum {
    RUNG_COUNT = COUNT_OF(rungs),
    INSTANCES = 6,  // per shape; each rung's rays are divided among them
    COPIES = 64,    // copies of a shape that are added to time a test
    TIMED_RUNS = 5, // the shortest counts
    TIMED_RAYS = 1 << 17
};

typedef struct {
    size_t ray_count; // per shape, over all rungs; 0 if no errors are measured
    bool check, time;
    unsigned precisions; // a set
    const char *shape;   // NULL for all
} LadderOptions;

// Rays of one rung towards one shape, with the expected hits and the kernel's.
typedef struct {
    TraceRay *rays;
    ReferenceHit *hits;
    TraceHit *answers;
    size_t count;
} Rays;

// The errors of t that one precision made on one rung, in units of the last place.
typedef struct {
    double *ulps;
    size_t count;
} Errors;

typedef struct {
    Errors steep, grazing; // at a cosine of 0.1 or more, and at a smaller one
    // `compared` counts all hits and misses, `wrong` those that differ from the reference outside the band in
    // which both are right, and `uncertain` those that differ within it.
    size_t compared, wrong, uncertain;
    double bound_fraction; // the largest error as a fraction of the tier's bound
} Tally;

// A tier's bounds: the error of t in ulps, plus a slack in u of the size or distance over the cosine, and
// the band in u in which hit and miss are both right. The hard cases allow tier B its slack only below a
// cosine of 0.1. Here it is allowed at every angle, for the reason in tests/test_shapes.c.
// docs/measurements/README.md lists the rungs that need it. The textbook has no bounds.
typedef struct {
    double ulps, slack, band;
    bool of_size; // whether the slack scales with the size, else with the distance
} Tier;

static const Tier tiers[ARITHMETIC_COUNT] = {
    [PRECISION_SINGLE] = {8, 16, 4, false},
    [PRECISION_STRICT] = {4, 4, 16, true},
    [PRECISION_DOUBLE] = {4, 4, 16, true},
};

// Returns a ray from `rung` radii away to a random point of the bounding sphere enlarged by a fiftieth.
static RandomRay ladder_ray(const RandomShape *shape, double rung, Random *random)
{
    Vector3 out = vector_normalize(random_in_sphere(random));
    Vector3 eye = vector_add(shape->center, vector_scale(out, rung * shape->radius));
    Vector3 target = vector_add(shape->center, vector_scale(random_in_sphere(random), 1.02 * shape->radius));
    return (RandomRay){eye, vector_normalize(vector_subtract(target, eye))};
}

static void rays_free(Rays *rays)
{
    free(rays->rays);
    free(rays->hits);
    free(rays->answers);
}

static Rays rays_make(const Object *object, const RandomShape *shape, double rung, size_t count,
                      bool is_double, Random *random)
{
    Rays rays = {memory_allocate(count + 1, sizeof(TraceRay)),
                 memory_allocate(count + 1, sizeof(ReferenceHit)),
                 memory_allocate(count + 1, sizeof(TraceHit)), count};
    for (size_t i = 0; i < count; i++) {
        RandomRay given = ladder_ray(shape, rung, random);
        ReferenceRay ray = is_double ? reference_ray(given.origin, given.direction)
                                     : reference_ray_rounded(given.origin, given.direction);
        rays.rays[i] = (TraceRay){quad3_rounded(ray.origin), quad3_rounded(ray.direction), (double)ray.tmin,
                                  (double)ray.tmax};
        rays.hits[i] = reference_hit_object(object, &ray);
    }
    return rays;
}

// Opens a renderer. Times need the kernels of the shape alone. Errors use those with every feature, which
// return the same bits and serve all shapes.
static Renderer *renderer_of(Compute *compute, const Scene *scene, Precision precision, FeatureSet features)
{
    RenderSettings settings = settings_of_image(1, 1, precision);
    settings.bvh = BVH_OFF;
    settings.extra_features = features;
    MessageList messages = {0};
    Renderer *renderer = renderer_open(compute, scene, &settings, &messages);
    message_list_print(&messages, stderr);
    message_list_free(&messages);
    if (!renderer) exit(EXIT_FAILURE);
    return renderer;
}

static void tally_add(Tally *tally, const RandomShape *shape, const Rays *rays, size_t i, Precision precision)
{
    const ReferenceHit *expected = &rays->hits[i];
    const TraceHit *hit = &rays->answers[i];
    const Tier *tier = &tiers[precision];
    const int bits = precision == PRECISION_DOUBLE ? 53 : 24;
    const double u = ldexp(1, -bits);
    Vector3 origin = rays->rays[i].origin, direction = rays->rays[i].direction;
    double distance = vector_length(vector_subtract(origin, shape->center)) + shape->radius;
    // a plane may be hit far beyond the reach
    if (expected->found) distance = fmax(distance, (double)expected->t * vector_length(direction));
    double scale = u * (tier->of_size ? shape->radius : distance);
    // flat shapes have no compensated edges
    double flat = shape->object.type == SHAPE_TRIANGLE ? TRIANGLE_BAND : 4;
    bool uncertain = expected->margin <= fmax(tier->band * scale, flat * u * distance);

    tally->compared++;
    if ((hit->object != UINT32_MAX) != expected->found) {
        (*(uncertain ? &tally->uncertain : &tally->wrong))++;
        return;
    }
    if (!expected->found) return;
    double cosine = (double)expected->cosine, ulp = ulp_of((double)expected->t, bits);
    double off = fabs((double)(hit->t - expected->t));
    Errors *errors = cosine >= 0.1 ? &tally->steep : &tally->grazing;
    // NaN and infinity exceed every bound
    errors->ulps[errors->count++] = isfinite(off) ? off / ulp : HUGE_VAL;
    if (uncertain) return;
    double bound = tier->ulps * ulp + tier->slack * scale / (cosine * vector_length(direction));
    tally->bound_fraction = fmax(tally->bound_fraction, isfinite(off) ? off / bound : HUGE_VAL);
}

static int compare_doubles(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void errors_write(Json *json, const char *key, Errors *errors)
{
    json_begin_object(json, key);
    json_int64(json, "hits", (int64_t)errors->count);
    if (errors->count > 0) {
        qsort(errors->ulps, errors->count, sizeof *errors->ulps, compare_doubles);
        json_number(json, "p999", errors->ulps[(size_t)(0.999 * (double)(errors->count - 1))]);
        json_number(json, "max", errors->ulps[errors->count - 1]);
    }
    json_end(json);
}

static double cpu_seconds(void)
{
    struct timespec time;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static void rays_trace(Renderer *renderer, const Rays *rays)
{
    if (!renderer_trace(renderer, rays->rays, rays->count, rays->answers)) fault("the device failed");
}

// Returns the CPU time of all threads in the shortest of several runs of the trace kernel.
static double trace_seconds(Renderer *renderer, const Rays *rays)
{
    double least = HUGE_VAL;
    for (int run = 0; run <= TIMED_RUNS; run++) {
        double start = cpu_seconds();
        rays_trace(renderer, rays);
        double seconds = cpu_seconds() - start;
        if (run > 0) least = fmin(least, seconds); // the first run includes the build
    }
    return least;
}

// Returns the time per test, (time with 1 + COPIES copies - time with 1) / COPIES, for rays of all rungs.
static double test_seconds(Compute *compute, const RandomShape *shape, Precision precision)
{
    bool is_double = precision == PRECISION_DOUBLE;
    Object object = is_double ? shape->object : reference_round_object(&shape->object);
    Rays all = {memory_allocate(TIMED_RAYS, sizeof(TraceRay)), NULL,
                memory_allocate(TIMED_RAYS, sizeof(TraceHit)), 0};
    Random random = {2};
    for (int rung = 0; rung < RUNG_COUNT; rung++)
        for (int i = 0; i < TIMED_RAYS / RUNG_COUNT; i++) {
            RandomRay ray = ladder_ray(shape, rungs[rung], &random);
            all.rays[all.count++] = (TraceRay){ray.origin, ray.direction, 0, (double)FLT_MAX};
        }
    double seconds[2];
    for (int many = 0; many < 2; many++) {
        Object copies[1 + COPIES];
        for (int i = 0; i <= COPIES; i++)
            copies[i] = object;
        Material material;
        Scene scene = scene_of_shapes(copies, many ? 1 + COPIES : 1, &material);
        Renderer *renderer = renderer_of(compute, &scene, precision, 0);
        seconds[many] = trace_seconds(renderer, &all);
        renderer_close(renderer);
    }
    double test = (seconds[1] - seconds[0]) / (COPIES * (double)all.count);
    rays_free(&all);
    return test;
}

typedef struct {
    RandomShape instances[INSTANCES];
    Renderer *renderers[INSTANCES][ARITHMETIC_COUNT]; // opened when first needed
    const char *name;
} LadderShape;

// Makes a shape of the first form.
static LadderShape shape_make(ShapeType type)
{
    LadderShape shape = {.name = shape_names[type]};
    const ShapeForm form = {.type = type};
    Random random = {1};
    for (int i = 0; i < INSTANCES; i++)
        shape.instances[i] = random_shape(&form, &random);
    return shape;
}

// Ovals are made of other shapes (tests/test_ovals.c).
static bool is_measured(ShapeType type, const LadderOptions *options)
{
    return type != SHAPE_OVAL && (!options->shape || strcmp(options->shape, shape_names[type]) == 0);
}

static void shape_close(LadderShape *shape)
{
    for (int i = 0; i < INSTANCES; i++)
        for (int precision = 0; precision < ARITHMETIC_COUNT; precision++)
            renderer_close(shape->renderers[i][precision]);
}

static void shape_trace(LadderShape *shape, int which, Precision precision, Compute *compute, Object *object,
                        Rays *rays)
{
    Renderer **renderer = &shape->renderers[which][precision];
    if (!*renderer) {
        Material material;
        Scene scene = scene_of_shapes(object, 1, &material);
        *renderer = renderer_of(compute, &scene, precision, FEATURE_ALL);
    }
    rays_trace(*renderer, rays);
}

// Adds one shape's errors on one rung. All precisions of one width trace the same rays.
static void rung_measure(Compute *compute, LadderShape *shape, int rung, bool is_double,
                         const LadderOptions *options, size_t count, Tally tallies[ARITHMETIC_COUNT])
{
    Random random = {3 + (uint64_t)rung};
    for (int which = 0; which < INSTANCES; which++) {
        const RandomShape *instance = &shape->instances[which];
        Object object = is_double ? instance->object : reference_round_object(&instance->object);
        Rays rays = rays_make(&object, instance, rungs[rung], count, is_double, &random);
        for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
            if (!(options->precisions >> precision & 1) || is_double != (precision == PRECISION_DOUBLE))
                continue;
            shape_trace(shape, which, precision, compute, &object, &rays);
            for (size_t i = 0; i < count; i++)
                tally_add(&tallies[precision], instance, &rays, i, precision);
        }
        rays_free(&rays);
    }
}

static void tally_write(Tally *tally, const char *shape, Precision precision, double distance, Json *json)
{
    json_begin_object(json, NULL);
    json_text(json, "shape", shape);
    json_text(json, "precision", precision_names[precision]);
    json_number(json, "distance", distance);
    json_int64(json, "rays", (int64_t)tally->compared);
    errors_write(json, "steep", &tally->steep);
    errors_write(json, "grazing", &tally->grazing);
    json_int64(json, "wrong", (int64_t)tally->wrong);
    json_int64(json, "undecided", (int64_t)tally->uncertain);
    json_number(json, "bound_fraction", tally->bound_fraction);
    json_end(json);
}

static bool tally_within_bounds(const Tally *tally)
{
    return tally->wrong == 0 && tally->bound_fraction <= 1;
}

// Prints what exceeds the bounds, for --check.
static void tally_report(const Tally *tally, const char *shape, Precision precision, double distance)
{
    if (tally_within_bounds(tally)) return;
    printf("%s at %g, %s: %zu of %zu wrong, error of t %.3g of the bound\n", shape, distance,
           precision_names[precision], tally->wrong, tally->compared, tally->bound_fraction);
}

// Measures one shape on one rung. Returns whether each precision of one width is within the bounds.
static bool rung_run(Compute *compute, LadderShape *shape, int rung, bool is_double,
                     const LadderOptions *options, Json *json)
{
    size_t count = options->ray_count / (RUNG_COUNT * INSTANCES) + 1;
    Tally tallies[ARITHMETIC_COUNT] = {0};
    for (int precision = 0; precision < ARITHMETIC_COUNT; precision++) {
        tallies[precision].steep.ulps = memory_allocate(count * INSTANCES, sizeof(double));
        tallies[precision].grazing.ulps = memory_allocate(count * INSTANCES, sizeof(double));
    }
    rung_measure(compute, shape, rung, is_double, options, count, tallies);
    bool within_bounds = true;
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
        Tally *tally = &tallies[precision];
        if (tally->compared > 0) {
            tally_write(tally, shape->name, precision, rungs[rung], json);
            if (options->check) tally_report(tally, shape->name, precision, rungs[rung]);
            within_bounds &= tally_within_bounds(tally);
        }
        free(tally->steep.ulps);
        free(tally->grazing.ulps);
    }
    return within_bounds;
}

static bool options_read(LadderOptions *options, int argument_count, char **arguments)
{
    static const struct option names[] = {{"rays", required_argument, NULL, 'r'},
                                          {"shape", required_argument, NULL, 's'},
                                          {"precision", required_argument, NULL, 'p'},
                                          {"check", no_argument, NULL, 'c'},
                                          {"time", no_argument, NULL, 't'},
                                          {0}};
    *options = (LadderOptions){.ray_count = 1000000};
    int option;
    while ((option = getopt_long(argument_count, arguments, "", names, NULL)) != -1) {
        if (option == 'r') options->ray_count = strtoul(optarg, NULL, 10);
        if (option == 's') options->shape = optarg;
        if (option == 'c') options->check = true;
        if (option == 't') options->time = true;
        for (int i = 0; option == 'p' && i < ARITHMETIC_COUNT; i++)
            if (strcmp(optarg, precision_names[i]) == 0) options->precisions |= 1U << i;
        if (option == '?') return false;
    }
    if (options->precisions == 0) options->precisions = (1U << ARITHMETIC_COUNT) - 1;
    return optind == argument_count;
}

int main(int argument_count, char **arguments)
{
    LadderOptions options;
    if (!options_read(&options, argument_count, arguments)) {
        fputs("usage: ladder [--rays COUNT] [--shape NAME] [--precision P]... [--time] [--check]\n", stderr);
        return EXIT_FAILURE;
    }
    DeviceList devices;
    Compute compute;
    MessageList messages = {0};
    device_list_open(&devices, NULL);
    const Device *device = device_choose(&devices, getenv("GLINT_DEVICE"), &messages);
    message_list_print(&messages, stderr);
    message_list_free(&messages);
    if (!device) return EXIT_FAILURE;
    compute_open(&compute, device);
    if (!device->fp64) options.precisions &= ~(1U << PRECISION_DOUBLE);

    bool within_bounds = true;
    Json *json = json_open();
    json_text(json, "device", device->name);
    json_begin_array(json, "rungs");
    for (int i = 0; options.ray_count > 0 && i < SHAPE_MESH; i++) {
        if (!is_measured((ShapeType)i, &options)) continue;
        LadderShape shape = shape_make((ShapeType)i);
        for (int rung = 0; rung < RUNG_COUNT; rung++)
            for (int is_double = 0; is_double < 2; is_double++)
                within_bounds &= rung_run(&compute, &shape, rung, is_double, &options, json);
        shape_close(&shape);
    }
    json_end(json);
    json_begin_array(json, "tests");
    for (int i = 0; options.time && i < SHAPE_MESH; i++) {
        if (!is_measured((ShapeType)i, &options)) continue;
        LadderShape shape = shape_make((ShapeType)i);
        for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
            if (!(options.precisions >> precision & 1)) continue;
            json_begin_object(json, NULL);
            json_text(json, "shape", shape.name);
            json_text(json, "precision", precision_names[precision]);
            // milliseconds per million tests are nanoseconds per test
            json_number(json, "ms_per_million", 1e9 * test_seconds(&compute, &shape.instances[0], precision));
            json_end(json);
        }
    }
    json_end(json);
    if (options.check)
        printf("%s\n", within_bounds ? "all within their bounds" : "beyond their bounds");
    else
        json_print(json, stdout);
    compute_close(&compute);
    device_list_close(&devices);
    return within_bounds || !options.check ? EXIT_SUCCESS : 3;
}
