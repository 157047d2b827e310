// Tests the points of areas (kernels/sampling.h): that they are spread as the sources promise, and are the
// same at every precision.
//
// run_tests: sanitize-long-only
#include "tests/check.h"
#include "tests/probe.h"

enum { COUNT = 4096 };

typedef struct {
    float x, y;
} Point;

typedef struct {
    Point square[COUNT], disc[COUNT];
} Points;

static const char text[] =
    "#include \"lanes.h\"\n#include \"sampling.h\"\n"
    "kernel void points(global float2 *square, global float2 *disc, int column, int row, uint area)\n{\n"
    "    for (uint i = 0; i < 4096; i++) {\n"
    "        Sample sample = sample_of_pixels((integer)(column), (integer)(row), i);\n"
    "        SquarePoint point = sample_point(&sample, area), round = disc_of_square(point);\n"
    "        square[i] = (float2)((float)point.x, (float)point.y);\n"
    "        disc[i] = (float2)((float)round.x, (float)round.y);\n"
    "    }\n}\n";

// Returns the first points of a pixel's area, freed by the caller.
static Points *points_make(bool is_double, int32_t column, int32_t row, uint32_t area)
{
    cl_program program =
        probe_program(text, 1, is_double ? PRECISION_DOUBLE : PRECISION_STRICT, true, 0, "-cl-std=CL1.2");
    cl_kernel kernel = probe_kernel(program, "points");
    Points *points = memory_allocate(1, sizeof *points);
    cl_mem square = buffer_create(&probe_compute, sizeof points->square, NULL, CL_MEM_READ_WRITE),
           disc = buffer_create(&probe_compute, sizeof points->disc, NULL, CL_MEM_READ_WRITE);
    kernel_argument(&probe_compute, kernel, 0, sizeof(cl_mem), &square);
    kernel_argument(&probe_compute, kernel, 1, sizeof(cl_mem), &disc);
    kernel_argument(&probe_compute, kernel, 2, sizeof column, &column);
    kernel_argument(&probe_compute, kernel, 3, sizeof row, &row);
    kernel_argument(&probe_compute, kernel, 4, sizeof area, &area);
    const size_t one = 1;
    kernel_launch(&probe_compute, kernel, 1, NULL, &one, &one);
    buffer_read(&probe_compute, square, sizeof points->square, points->square);
    buffer_read(&probe_compute, disc, sizeof points->disc, points->disc);
    buffer_release(square);
    buffer_release(disc);
    clReleaseKernel(kernel);
    clReleaseProgram(program);
    return points;
}

// Asserts that each of the 2^log2 rectangles of 2^-a by 2^-b, a + b = log2, has one of the points.
static void assert_net(const Point *points, unsigned log2)
{
    for (unsigned a = 0; a <= log2; a++) {
        bool seen[COUNT] = {false};
        for (unsigned i = 0; i < 1u << log2; i++) {
            assert_true(points[i].x >= -1 && points[i].x < 1 && points[i].y >= -1 && points[i].y < 1);
            const unsigned column = (unsigned)ldexp(points[i].x / 2.0 + 0.5, (int)a),
                           row = (unsigned)ldexp(points[i].y / 2.0 + 0.5, (int)(log2 - a));
            const unsigned place = column << (log2 - a) | row;
            assert_false(seen[place]);
            seen[place] = true;
        }
    }
}

TEST(points_are_nets)
{
    static const int32_t pixels[][2] = {{0, 0}, {1, 0}, {0, 1}, {3839, 2159}};
    Points *all[4];
    for (size_t i = 0; i < 4; i++) {
        all[i] = points_make(false, pixels[i][0], pixels[i][1], (uint32_t)i);
        for (unsigned log2 = 1; log2 <= 12; log2++)
            assert_net(all[i]->square, log2);
        // and aligned parts of the sequence
        assert_net(all[i]->square + 64, 6);
        assert_net(all[i]->square + 3072, 10);
    }
    for (size_t i = 0; i < 4; i++)
        for (size_t k = i + 1; k < 4; k++)
            assert_memory_not_equal(all[i]->square, all[k]->square, sizeof(Point));
    for (size_t i = 0; i < 4; i++)
        free(all[i]);
}

TEST(precisions_agree)
{
    if (!probe_has(PRECISION_DOUBLE)) skip();
    OWNED Points *strict = points_make(false, 17, 4, 3), *exact = points_make(true, 17, 4, 3);
    assert_memory_equal(strict->square, exact->square, sizeof strict->square);
    for (size_t i = 0; i < COUNT; i++) {
        assert_true(fabs((double)strict->disc[i].x - exact->disc[i].x) < 4e-7);
        assert_true(fabs((double)strict->disc[i].y - exact->disc[i].y) < 4e-7);
    }
}

// Equal parts of the square are equal parts of the disc, so that rings and quarters have as many points as
// their area.
TEST(disc_is_uniform)
{
    enum { RINGS = 16 };
    OWNED Points *points = points_make(false, 5, 6, 1);
    size_t rings[RINGS] = {0}, quarters[4] = {0};
    for (size_t i = 0; i < COUNT; i++) {
        const double x = points->disc[i].x, y = points->disc[i].y, squared = x * x + y * y;
        assert_true(squared <= 1 + 1e-6);
        rings[(size_t)fmin(squared * RINGS, RINGS - 1)]++;
        quarters[(fabs(x) > fabs(y) ? 0 : 2) + (fabs(x) > fabs(y) ? x > 0 : y > 0)]++;
        // the same direction from the center as in the square, up to the map's turn of less than 5 degrees
        const double u = points->square[i].x, v = points->square[i].y;
        assert_true(x * u + y * v >= 0.99 * sqrt((x * x + y * y) * (u * u + v * v)));
    }
    for (size_t i = 0; i < RINGS; i++)
        assert_true(fabs((double)rings[i] - (double)COUNT / RINGS) <= 16);
    for (size_t i = 0; i < 4; i++)
        assert_true(fabs((double)quarters[i] - COUNT / 4.0) <= 16);
}

TEST_MAIN(probe_open, probe_close)
