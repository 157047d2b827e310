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
#include "host/cli/open_device.h"
#include "host/render/renderer.h"
#include "host/verify/random_shape.h"
#include "host/verify/reference.h"
#include "tests/random_ray.h"
#include <getopt.h>
#include <stdlib.h>
#include <string.h>

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

// Summarizes the answers of one precision to the rays of one rung.
typedef struct {
    // `compared` counts all hits and misses, `wrong` those that differ from the reference outside the band in
    // which both are right, and `uncertain` those that differ within it.
    size_t compared, wrong, uncertain;
    double steep_ulps;     // the largest error of t, in units of the last place, at a cosine of 0.1 or more
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
    messages_print(&messages, NULL);
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
    if (!isfinite(off)) off = HUGE_VAL; // NaN exceeds every bound
    if (cosine >= 0.1) tally->steep_ulps = fmax(tally->steep_ulps, off / ulp);
    if (uncertain) return;
    double bound = tier->ulps * ulp + tier->slack * scale / (cosine * vector_length(direction));
    tally->bound_fraction = fmax(tally->bound_fraction, off / bound);
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
        double start = clock_processor_seconds();
        rays_trace(renderer, rays);
        double seconds = clock_processor_seconds() - start;
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
    Object objects[INSTANCES][2];                     // with float and with double numbers
    Renderer *renderers[INSTANCES][ARITHMETIC_COUNT]; // NULL for precisions that are not measured
    const char *name;
} LadderShape;

typedef struct {
    OpenDevice open;
    LadderOptions options;
    Json *json;
    bool within_bounds;
} Ladder;

static bool is_measured(const Ladder *ladder, Precision precision)
{
    return ladder->options.precisions >> precision & 1;
}

// Makes a shape of the first form, with a renderer for each instance and precision.
static LadderShape shape_open(Ladder *ladder, ShapeType type)
{
    LadderShape shape = {.name = shape_names[type]};
    const ShapeForm form = {.type = type};
    Random random = {1};
    for (int i = 0; i < INSTANCES; i++) {
        shape.instances[i] = random_shape(&form, &random);
        shape.objects[i][0] = reference_round_object(&shape.instances[i].object);
        shape.objects[i][1] = shape.instances[i].object;
        for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
            if (!is_measured(ladder, precision)) continue;
            Material material;
            Scene scene = scene_of_shapes(&shape.objects[i][precision == PRECISION_DOUBLE], 1, &material);
            shape.renderers[i][precision] =
                renderer_of(&ladder->open.compute, &scene, precision, FEATURE_ALL);
        }
    }
    return shape;
}

static void shape_close(LadderShape *shape)
{
    for (int i = 0; i < INSTANCES; i++)
        for (int precision = 0; precision < ARITHMETIC_COUNT; precision++)
            renderer_close(shape->renderers[i][precision]);
}

static void tally_write(const Tally *tally, const char *shape, Precision precision, double distance,
                        Json *json)
{
    json_begin_object(json, NULL);
    json_text(json, "shape", shape);
    json_text(json, "precision", precision_names[precision]);
    json_number(json, "distance", distance);
    json_count(json, "rays", tally->compared);
    json_begin_object(json, "steep");
    json_number(json, "max", tally->steep_ulps);
    json_end(json);
    json_count(json, "wrong", tally->wrong);
    json_count(json, "uncertain", tally->uncertain);
    json_number(json, "bound_fraction", tally->bound_fraction);
    json_end(json);
}

// Measures one shape on one rung. All precisions of one width trace the same rays.
static void rung_measure(Ladder *ladder, const LadderShape *shape, int rung, bool is_double)
{
    size_t count = ladder->options.ray_count / (RUNG_COUNT * INSTANCES) + 1;
    Tally tallies[ARITHMETIC_COUNT] = {0};
    Random random = {3 + (uint64_t)rung};
    for (int i = 0; i < INSTANCES; i++) {
        Rays rays = rays_make(&shape->objects[i][is_double], &shape->instances[i], rungs[rung], count,
                              is_double, &random);
        for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
            if (!is_measured(ladder, precision) || is_double != (precision == PRECISION_DOUBLE)) continue;
            rays_trace(shape->renderers[i][precision], &rays);
            for (size_t k = 0; k < count; k++)
                tally_add(&tallies[precision], &shape->instances[i], &rays, k, precision);
        }
        rays_free(&rays);
    }
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
        const Tally *tally = &tallies[precision];
        if (tally->compared == 0) continue;
        tally_write(tally, shape->name, precision, rungs[rung], ladder->json);
        if (tally->wrong == 0 && tally->bound_fraction <= 1) continue;
        ladder->within_bounds = false;
        if (ladder->options.check)
            printf("%s at %g, %s: %zu of %zu wrong, error of t %.3g of the bound\n", shape->name, rungs[rung],
                   precision_names[precision], tally->wrong, tally->compared, tally->bound_fraction);
    }
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

static void shape_measure(Ladder *ladder, ShapeType type)
{
    LadderShape shape = shape_open(ladder, type);
    for (int rung = 0; rung < RUNG_COUNT; rung++)
        for (int is_double = 0; is_double < 2; is_double++)
            rung_measure(ladder, &shape, rung, is_double);
    shape_close(&shape);
}

static void shape_time(Ladder *ladder, ShapeType type)
{
    const ShapeForm form = {.type = type};
    Random random = {1};
    RandomShape shape = random_shape(&form, &random);
    for (Precision precision = 0; precision < ARITHMETIC_COUNT; precision++) {
        if (!is_measured(ladder, precision)) continue;
        json_begin_object(ladder->json, NULL);
        json_text(ladder->json, "shape", shape_names[type]);
        json_text(ladder->json, "precision", precision_names[precision]);
        // milliseconds per million tests are nanoseconds per test
        json_number(ladder->json, "ms_per_million",
                    1e9 * test_seconds(&ladder->open.compute, &shape, precision));
        json_end(ladder->json);
    }
}

// Writes an array of measurements of the chosen shapes. Ovals are made of other shapes (tests/test_ovals.c).
static void shapes_measure(Ladder *ladder, const char *key, void (*measure)(Ladder *, ShapeType))
{
    json_begin_array(ladder->json, key);
    for (ShapeType type = 0; measure && type < SHAPE_MESH; type++)
        if (type != SHAPE_OVAL &&
            (!ladder->options.shape || strcmp(ladder->options.shape, shape_names[type]) == 0))
            measure(ladder, type);
    json_end(ladder->json);
}

int main(int argument_count, char **arguments)
{
    Ladder ladder = {.json = json_open(), .within_bounds = true};
    if (!options_read(&ladder.options, argument_count, arguments)) {
        fputs("usage: ladder [--rays COUNT] [--shape NAME] [--precision P]... [--time] [--check]\n", stderr);
        return EXIT_FAILURE;
    }
    if (!device_open(&ladder.open, &(CommonOptions){0})) return EXIT_FAILURE;
    const Device *device = ladder.open.compute.device;
    if (!device->fp64) ladder.options.precisions &= ~(1U << PRECISION_DOUBLE);
    json_text(ladder.json, "device", device->name);
    shapes_measure(&ladder, "rungs", ladder.options.ray_count > 0 ? shape_measure : NULL);
    shapes_measure(&ladder, "tests", ladder.options.time ? shape_time : NULL);
    if (ladder.options.check)
        printf("%s\n", ladder.within_bounds ? "all within their bounds" : "beyond their bounds");
    else
        json_print(ladder.json, stdout);
    return device_close(&ladder.open, ladder.within_bounds || !ladder.options.check ? EXIT_SUCCESS : 3);
}
