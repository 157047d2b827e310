// Cuts polygons into triangles. Every point of the polygon must lie in exactly one, whatever its form.
#include "host/scene/polygon.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"

typedef ARRAY_OF(Vector3) Outline;

static PolygonTriangles triangles;

static void outline_add(Outline *outline, double x, double y)
{
    array_push(*outline, ((Vector3){x, y, 0}));
}

static double cross_at(Vector3 a, Vector3 b, Vector3 c)
{
    return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
}

static double outline_area(const Outline *outline)
{
    double area = 0;
    for (size_t i = 1; i + 1 < outline->count; i++)
        area += cross_at(outline->items[0], outline->items[i], outline->items[i + 1]) / 2;
    return area;
}

// Returns whether the outline contains a point, by the crossing number of a ray along x.
static bool outline_holds(const Outline *outline, double x, double y)
{
    bool inside = false;
    for (size_t i = 0; i < outline->count; i++) {
        Vector3 a = outline->items[i], b = outline->items[(i + 1) % outline->count];
        if ((a.y > y) != (b.y > y) && x < a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y)) inside = !inside;
    }
    return inside;
}

static size_t triangles_holding(const Outline *outline, double x, double y)
{
    size_t count = 0;
    Vector3 p = {x, y, 0};
    for (size_t i = 0; i < triangles.count; i++) {
        const uint32_t *t = triangles.items[i];
        Vector3 a = outline->items[t[0]], b = outline->items[t[1]], c = outline->items[t[2]];
        count += cross_at(a, b, p) > 0 && cross_at(b, c, p) > 0 && cross_at(c, a, p) > 0;
    }
    return count;
}

static Random generator = {1};

// Checks that the cut of an outline that turns left uses every corner, and that no triangle is turned over
// or overlaps another.
static void check_cut(const Outline *outline)
{
    assert_int_equal(polygon_triangulate(outline->items, outline->count, &triangles), POLYGON_CUT);
    double area = 0, low_x = INFINITY, low_y = INFINITY, high_x = -INFINITY, high_y = -INFINITY;
    OWNED bool *used = memory_allocate_zeroed(outline->count, sizeof *used);
    for (size_t i = 0; i < triangles.count; i++) {
        const uint32_t *t = triangles.items[i];
        double twice = cross_at(outline->items[t[0]], outline->items[t[1]], outline->items[t[2]]);
        assert_true(twice > 0);
        area += twice / 2;
        for (size_t k = 0; k < 3; k++)
            used[t[k]] = true;
    }
    for (size_t i = 0; i < outline->count; i++) {
        assert_true(used[i]);
        low_x = fmin(low_x, outline->items[i].x);
        low_y = fmin(low_y, outline->items[i].y);
        high_x = fmax(high_x, outline->items[i].x);
        high_y = fmax(high_y, outline->items[i].y);
    }
    assert_int_equal(triangles.count, outline->count - 2);
    assert_true(fabs(area - outline_area(outline)) <= 1e-12 * area);
    for (size_t i = 0; i < 300; i++) {
        double x = random_between(&generator, low_x, high_x), y = random_between(&generator, low_y, high_y);
        assert_int_equal(triangles_holding(outline, x, y), outline_holds(outline, x, y));
    }
}

// Checks the cut in each coordinate plane, turning either way, starting at each corner, far from the origin.
static void check_everywhere(const Outline *outline)
{
    check_cut(outline);
    size_t expected = triangles.count;
    Outline moved = {0};
    for (size_t start = 0; start < outline->count; start += 1 + outline->count / 7) {
        for (int plane = 0; plane < 6; plane++) {
            moved.count = 0;
            for (size_t i = 0; i < outline->count; i++) {
                Vector3 p = outline->items[(start + i) % outline->count];
                p.x += 1000;
                if (plane % 3 == 0) p = (Vector3){p.y, p.z, p.x};
                if (plane % 3 == 1) p = (Vector3){p.z, p.x, p.y};
                array_push(moved, p);
            }
            for (size_t i = 0; plane >= 3 && i < moved.count / 2; i++) {
                Vector3 swapped = moved.items[i];
                moved.items[i] = moved.items[moved.count - 1 - i];
                moved.items[moved.count - 1 - i] = swapped;
            }
            assert_int_equal(polygon_triangulate(moved.items, moved.count, &triangles), POLYGON_CUT);
            assert_int_equal(triangles.count, expected);
        }
    }
    free(moved.items);
}

static void check_points(const double (*points)[2], size_t count)
{
    Outline outline = {0};
    for (size_t i = 0; i < count; i++)
        outline_add(&outline, points[i][0], points[i][1]);
    check_everywhere(&outline);
    free(outline.items);
}

#define CHECK_POINTS(...)                                                                                    \
    do {                                                                                                     \
        const double points[][2] = {__VA_ARGS__};                                                            \
        check_points(points, COUNT_OF(points));                                                              \
    } while (0)

TEST(small)
{
    CHECK_POINTS({0, 0}, {1, 0}, {0, 1});
    CHECK_POINTS({0, 0}, {1, 0}, {1, 1}, {0, 1});
    CHECK_POINTS({0, 0}, {4, 0}, {1, 1}, {0, 4}); // an arrowhead
    CHECK_POINTS({0, 0}, {3, 0}, {3, 1}, {1, 1}, {1, 2}, {3, 2}, {3, 3}, {0, 3});
    CHECK_POINTS({0, 0}, {1, 0.1}, {2, 0}, {1.9, 1}, {2, 2}, {1, 1.9}, {0, 2}, {0.1, 1});
}

TEST(corners_on_edges)
{
    CHECK_POINTS({0, 0}, {1, 0}, {2, 0}, {0, 2});
    CHECK_POINTS({0, 0}, {1, 0}, {2, 0}, {3, 0}, {3, 1}, {3, 2}, {3, 3}, {1, 3}, {0, 3}, {0, 1});
    CHECK_POINTS({0, 0}, {1, 0}, {2, 0}, {3, 0}, {0, 3});
    CHECK_POINTS({0, 0}, {4, 0}, {4, 4}, {3, 4}, {3, 1}, {1, 1}, {1, 4}, {0, 4}, {0, 3}, {0, 2});
}

TEST(gear)
{
    static const double turns[4] = {-0.19, 0.19, 0.3, 0.7};
    Outline gear = {0};
    for (size_t i = 0; i < 144; i++) {
        size_t tooth = i / 4;
        double angle = ((double)tooth + turns[i % 4]) * (M_PI / 18), radius = i % 4 < 2 ? 1 : 0.9;
        outline_add(&gear, radius * cos(angle), radius * sin(angle));
    }
    check_everywhere(&gear);
    free(gear.items);
}

TEST(comb_and_spiral)
{
    Outline comb = {0}, spiral = {0};
    for (size_t i = 0; i < 50; i++)
        outline_add(&comb, (double)i, i % 2 ? 10 : 0.5);
    outline_add(&comb, 49, -1);
    outline_add(&comb, 0, -1);
    for (size_t i = 0; i < comb.count / 2; i++) {
        Vector3 swapped = comb.items[i];
        comb.items[i] = comb.items[comb.count - 1 - i];
        comb.items[comb.count - 1 - i] = swapped;
    }
    check_everywhere(&comb);
    const size_t count = 200;
    for (size_t i = 0; i < count; i++) {
        bool outward = i < count / 2;
        double along = (double)(outward ? i : count - 1 - i), angle = along * 0.2;
        double radius = 1 + angle + (outward ? 1.5 : 0);
        outline_add(&spiral, radius * cos(angle), radius * sin(angle));
    }
    check_everywhere(&spiral);
    free(comb.items);
    free(spiral.items);
}

TEST(stars)
{
    for (size_t trial = 0; trial < 200; trial++) {
        Outline star = {0};
        size_t count = 3 + trial;
        for (size_t i = 0; i < count; i++) {
            double angle = 2 * M_PI * ((double)i + random_between(&generator, 0.1, 0.9)) / (double)count;
            double radius = random_between(&generator, 0.05, 1);
            outline_add(&star, radius * cos(angle), radius * sin(angle));
        }
        // with few corners the center may lie outside, where the outline could turn either way
        if (outline_holds(&star, 0, 0)) check_cut(&star);
        free(star.items);
    }
}

// A hole, joined to the outline by an edge that runs to it and back.
TEST(hole)
{
    CHECK_POINTS({0, 0}, {3, 0}, {3, 3}, {0, 3}, {0, 0}, {1, 1}, {1, 2}, {2, 2}, {2, 1}, {1, 1});
}

TEST(repeated_corners)
{
    const Vector3 square[] = {{0, 0, 0}, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {1, 1, 0}, {1, 1, 0}, {0, 1, 0}};
    assert_int_equal(polygon_triangulate(square, 7, &triangles), POLYGON_CUT);
    assert_int_equal(triangles.count, 2);
    const Vector3 spike[] = {{0, 0, 0}, {2, 0, 0}, {4, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
    assert_int_equal(polygon_triangulate(spike, 6, &triangles), POLYGON_CUT);
    assert_int_equal(triangles.count, 2);
}

TEST(not_simple)
{
    const Vector3 line[] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {3, 3, 3}};
    assert_int_equal(polygon_triangulate(line, 3, &triangles), POLYGON_WITHOUT_AREA);
    assert_int_equal(triangles.count, 0);
    assert_int_equal(polygon_triangulate(line, 4, &triangles), POLYGON_WITHOUT_AREA);
    const Vector3 point[] = {{1, 2, 3}, {1, 2, 3}, {1, 2, 3}};
    assert_int_equal(polygon_triangulate(point, 3, &triangles), POLYGON_WITHOUT_AREA);
    const Vector3 crossed[] = {{0, 0, 0}, {4, 4, 0}, {4, 0, 0}, {0, 3, 0}};
    assert_int_equal(polygon_triangulate(crossed, 4, &triangles), POLYGON_CROSSED);
}

// Shewchuk's example (1997, figure 3): points around (0.5, 0.5), a unit in the last place apart, against a
// line through (12, 12) and (24, 24). Their exact sign is that of y - x.
TEST(orientation_is_exact)
{
    const double b[2] = {12, 12}, c[2] = {24, 24};
    for (int x = -64; x < 64; x++) {
        for (int y = -64; y < 64; y++) {
            const double a[2] = {0.5 + x * 0x1p-53, 0.5 + y * 0x1p-53};
            int sign = (a[1] > a[0]) - (a[1] < a[0]);
            assert_int_equal(plane_orientation(a, b, c), sign);
            assert_int_equal(plane_orientation(b, c, a), sign);
            assert_int_equal(plane_orientation(c, b, a), -sign);
        }
    }
}

// Corners whose differences round to one line, or whose products vanish, and corners that are on one.
TEST(area_is_exact)
{
    const Vector3 needles[][3] = {{{0x1p60, 0x1p60, -1}, {0, 0, -1}, {0.25, 0, -1}},
                                  {{0x1p-60, 0, 0}, {1, 1, 0}, {2, 2, 0}},
                                  {{0, 0, 0}, {1e-200, 0, 0}, {0, 1e-200, 0}}};
    for (size_t i = 0; i < COUNT_OF(needles); i++) {
        assert_true(triangle_has_area(needles[i][0], needles[i][1], needles[i][2]));
        assert_int_equal(polygon_triangulate(needles[i], 3, &triangles), POLYGON_CUT);
        assert_int_equal(triangles.count, 1);
    }
    assert_false(triangle_has_area((Vector3){1, 2, 3}, (Vector3){2, 4, 6}, (Vector3){3, 6, 9}));
    assert_false(triangle_has_area((Vector3){0.1, 0.3, 7}, (Vector3){0.1, 0.3, 7}, (Vector3){1, 2, 3}));
    assert_false(triangle_has_area((Vector3){0, 0, 0}, (Vector3){1e-200, 0, 0}, (Vector3){0x1p60, 0, 0}));
}

static int triangles_free(void **state)
{
    (void)state;
    free(triangles.items);
    return 0;
}

TEST_MAIN(NULL, triangles_free)
