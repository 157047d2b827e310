#include "host/base/array.h"
#include "host/verify/rays.h"

// Members that a row does not name are 0.
#pragma GCC diagnostic ignored "-Wmissing-field-initializers"

// clang-format off
#define LIMITS(...)           &(const VerifyLimits){__VA_ARGS__}
#define ULPS(b, c, d)         LIMITS(.ulps = {0, b, c, d})
#define BY_NUMBERS(case_rays) .rays = (case_rays), .ray_count = COUNT_OF(case_rays)
#define X                     {1, 0, 0}
#define Y                     {0, 1, 0}
#define Z                     {0, 0, 1}
// clang-format on

#define UNIT_SPHERE       "  - sphere: {center: [0, 0, 0], radius: 1}\n"
#define CUBE              "  - box: {min: [-1, -1, -1], max: [1, 1, 1]}\n"
#define ROUND_TABLE       "  - disc: {center: [10, 20, 30], normal: [1, 1, 1], radius: 2}\n"
#define INFINITE_CYLINDER "  - cylinder: {point: [0, 0, 0], axis: [0, 0, 1], radius: 1}\n"
#define BOWL              "  - paraboloid: {apex: [0, 0, 0], axis: [0, 0, 1], radius: 1, height: 1}\n"
#define RING              "  - torus: {center: [0, 0, 0], axis: [0, 0, 1], major: 1, minor: 0.25}\n"

static const VerifyRay s1[] = {
    {{0.6, 0, -100}, Z}, {{0.6, 0, -1000}, Z}, {{0.6, 0, -4096}, Z},
    {{0.6, 0, -1e4}, Z}, {{0.6, 0, -1e5}, Z},  {{0.6, 0, -1e6}, Z},
};
static const VerifyRay s3[] = {
    {{0}, {0.059844605775539746, 0.039896403850359835, 0.9974100962589958}},
    {{0}, {0.05985454414658938, 0.0398963800343872, 0.9974095008596798}},
    {{0}, {0.05986249483061362, 0.039896360978782124, 0.9974090244695529}},
    {{0}, {0.05986428373294903, 0.039896356690924686, 0.9974089172731171}},
    {{0}, {0.05986468126672301, 0.03989635573805019, 0.9974088934512548}},
};
// Limits by slope. At tier B the eye's height may be off by 0.25.
#define S4_LIMITS(slope, strict) LIMITS(.ulps = {0, 0, strict, strict}, .within[TIER_B] = 0.25 / (slope))
static const VerifyRay s4[] = {
    {{0, 1, 0}, {0, -1, 0}, .limits = S4_LIMITS(1, 8)},
    {{0, 1, 0}, {0.8660254037844386, -0.5, 0}, .limits = S4_LIMITS(0.5, 8)},
    {{0, 1, 0}, {0.99498743710662, -0.1, 0}, .limits = S4_LIMITS(0.1, 8)},
    {{0, 1, 0}, {0.9999499987499375, -0.01, 0}, .limits = S4_LIMITS(0.01, 8)},
    {{0, 1, 0}, {0.999997999998, -0.002, 0}, .limits = S4_LIMITS(0.002, 16)},
    {{0, 1, 0}, {0.9999989917994918, -0.00142, 0}, .limits = S4_LIMITS(0.00142, 16)},
    {{0, 1, 0}, {0.999999005949506, -0.00141, 0}, .limits = S4_LIMITS(0.00141, 16)},
};
static const VerifyRay s5[] = {
    {{1 - 0x1p-20, 0, -5}, Z, .exact_tiers = "BCD", .limits = ULPS(16, 0, 0)},
    {{1 - 0x1p-24, 0, -5}, Z, .exact_tiers = "CD"},
    {{1, 0, -5}, Z},
    {{1 + 0x1p-23, 0, -5}, Z, .exact_tiers = "CD"},
};
static const VerifyRay s6[] = {{{0.5, 0, 0}, X}, {{0.999999, 0, 0}, X}, {{0.999999, 0, 0}, Y}};
static const VerifyRay p1[] = {
    {{0, 1.7, 0}, {0, -0x1p-1, 1}},  {{0, 1.7, 0}, {0, -0x1p-10, 1}}, {{0, 1.7, 0}, {0, -0x1p-16, 1}},
    {{0, 1.7, 0}, {0, -0x1p-20, 1}}, {{0, 1.7, 0}, {0, -0x1p-23, 1}}, {{0, 1.7, 0}, {0, 0x1p-1, 1}},
    {{0, 1.7, 0}, {0, 0x1p-10, 1}},  {{0, 1.7, 0}, {0, 0x1p-16, 1}},  {{0, 1.7, 0}, {0, 0x1p-20, 1}},
    {{0, 1.7, 0}, {0, 0x1p-23, 1}},  {{0, 1.7, 0}, {0, 0.0, 1}},      {{0, 1.7, 0}, {0, -0.0, 1}},
};
static const VerifyRay p3[] = {
    {{5, 20, 35}, {1, -1, 0}}, {{12, 18, 30}, {-1, 1, 0}}, {{10, 15, 35}, {0, 1, -1}}};
static const VerifyRay p4[] = {
    {{1, 0, -5}, Z},
    {{-1, 0, -5}, Z},
    {{1, 1, -5}, Z},
    {{-1, -1, -5}, Z},
    {{0, 0, -5}, Z},
    {{1 + 0x1p-23, 0, -5}, Z},
    {{1, 0, -5}, {-0.0, -0.0, 1}},
    {{-1, 0, -5}, {-0.0, -0.0, 1}},
    {{1, 1, -5}, {-0.0, -0.0, 1}},
    {{-1, -1, -5}, {-0.0, -0.0, 1}},
    {{0, 0, -5}, {-0.0, -0.0, 1}},
    {{1 + 0x1p-23, 0, -5}, {-0.0, -0.0, 1}},
    {{1, 0, 0}, Z},
    {{1, 0, 0}, {-0.0, -0.0, 1}},
};
static const VerifyRay p6[] = {
    {{0.5, 0.5, 10}, {0, 0, -1}},
    {{0.5, 0.5, 10}, {0, 0, -1}, 9.9999995},
    {{0.5, 0.5, 10}, {0.01, 0.02, -1}},
    {{0.5, 0.5, 10}, {0.01, 0.02, -1}, 9.9999995},
};
static const VerifyRay c1_infinite[] = {
    {{0.5, 0, -3}, Z}, {{2, 0, -3}, Z}, {{1, 0, -3}, Z, .exact_tiers = ""}};
static const VerifyRay c1_capped[] = {
    {{0.5, 0, -3}, Z},
    {{0.5, 0, -3}, Z, 4},
    {{2, 0, -3}, Z},
    {{2, 0, -3}, Z, 4},
    {{1, 0, -3}, Z, .exact_tiers = ""},
};
static const VerifyRay c2[] = {
    {{0, 0, 0}, {0x1p-10, 0, 1}},    {{0, 0, 0}, {0x1p-12, 0, 1}},    {{0, 0, 0}, {0x1p-16, 0, 1}},
    {{0, 0, 0}, {0x1p-20, 0, 1}},    {{0.25, 0, 0}, {0x1p-10, 0, 1}}, {{0.25, 0, 0}, {0x1p-12, 0, 1}},
    {{0.25, 0, 0}, {0x1p-16, 0, 1}}, {{0.25, 0, 0}, {0x1p-20, 0, 1}},
};
static const VerifyRay c3[] = {{{0, 5e-4, -10}, Z}};
static const VerifyRay c5[] = {
    {{-1e3, 0.5, 0}, X}, {{-1e3, 0.99, 0}, X}, {{-1e3, 0.99999, 0}, X}, {{-1e3, 1.00001, 0}, X},
    {{-1e5, 0.5, 0}, X}, {{-1e5, 0.99, 0}, X}, {{-1e5, 0.99999, 0}, X}, {{-1e5, 1.00001, 0}, X},
};
static const VerifyRay c6[] = {
    {{5, 0, 0}, {-1, 0, 0}, .exact_tiers = ""},
    {{5, 0, 0x1p-20}, {-1, 0, 0}},
    {{5, 0, -0x1p-20}, {-1, 0, 0}},
    {{0, 0, -5}, Z},
    {{5, 0x1p-20, 0x1p-20}, {-1, 0, 0}},
};
static const VerifyRay c7_along[] = {
    {{3, 0.5, 1}, {-1, 0, 1}},
    {{3, 0.5, 1}, {-1, 0, 1 + 0x1p-23}},
    {{3, 0.5, 1}, {-1, 0, 1 - 0x1p-24}},
};
static const VerifyRay c7_nappes[] = {{{5, 0, -2}, {-1, 0, 0}}, {{5, 0, 2}, {-1, 0, 0}}};
static const VerifyRay t1[] = {
    {{0.9, 0, -1000}, Z},
    {{300, 400, -866}, {-0.2991972384477888, -0.39982994385684106, 0.8663815721151116}},
};
static const VerifyRay t2[] = {
    {{0, 0, 10}, {0, 0, -1}},
    {{0.74, 0, 10}, {0, 0, -1}},
    {{0.76, 0, 10}, {0, 0, -1}},
    {{0.75, 0, 10}, {0, 0, -1}, .exact_tiers = ""},
};
static const VerifyRay t3[] = {
    {{-5, 0, 0}, X}, {{-1, 0, 0}, X},    {{0, 0, 0}, X},     {{-5, 0.75, 0}, X}, {{-5, 1.25, 0}, X},
    {{-5, 1, 0}, X}, {{-5, 0, 0}, X, 4}, {{-5, 0, 0}, X, 5}, {{-5, 0, 0}, X, 6},
};
static const VerifyRay t4[] = {
    {{-5, 0, 0.25}, X, .tangent_t = 4},
    {{-5, 0, 0.25 - 0x1p-26}, X, .tangent_t = 4},
    {{-5, 0, 0.25 + 0x1p-25}, X, .exact_tiers = ""},
};
static const VerifyRay t5[] = {{{1.0005, 0, -10}, Z}, {{1.0009, 0, -10}, Z}, {{1.0011, 0, -10}, Z}};
static const VerifyRay t6[] = {{{160.371250, -6.351337, -0.000241}, {0.852793, -0.522249, -0.000020}}};
static const VerifyRay q1[] = {
    {{0.3, 0.2, -100}, Z},  {{0.3, 0.2, -1e4}, Z},  {{0.3, 0.2, -1e6}, Z},
    {{-100, 0.2, 0.5}, X},  {{-1e4, 0.2, 0.5}, X},  {{-1e6, 0.2, 0.5}, X},
    {{-100, 0.75, 0.5}, X}, {{-1e4, 0.75, 0.5}, X}, {{0.3, 0.2, 1e4}, {0, 0, -1}},
};
static const VerifyRay q2[] = {
    {{0, 0, -5}, Z},
    {{0.5, 0, -3}, Z},
    {{2, 1, -3}, Z},
    {{0.5, 0, -3}, {0x1p-12, 0, 1}},
    {{0.5, 0, -3}, {0x1p-20, 0, 1}},
    {{0.5, 0, -3}, {-0.0, -0.0, 1}},
    {{0, 0, 5}, {0, 0, -1}},
    {{0.5, 0, 5}, {0x1p-20, 0, -1}},
};
static const VerifyRay q3[] = {
    {{0, 0, 0.5}, X},
    {{0, 0, 0.5}, Z},
    {{0, 0, 0.5}, {0, 0, -1}},
    {{0.3, 0.2, 0.9}, {1, 2, -3}},
    {{0, 0, 0x1p-20}, X},
    {{0, 0, 0x1p-20}, {0, 0, -1}},
    {{0.5, 0, 0.25 + 0x1p-20}, X},
    {{0.5, 0, 0.25 + 0x1p-20}, {-1, 0, 0}},
};
static const VerifyRay m3[] = {{{2e-4 / 3, 2e-4 / 3, -1}, Z}};
static const VerifyRay m4[] = {{{0.5, 3e-7, 1}, {0, 0, -1}}, {{0.5, 3e-7, 1e3}, {0, 0, -1}}};
static const VerifyRay m5[] = {
    {{-1081.47925, 99.9999542, 87.7701111}, {-32.1072998, -183.355865, -144.607635}}};

enum { CHECKED = 1000, CHECKED_IN_MESH = 60 };

const VerifyRays verify_rays[] = {
    {"S1", UNIT_SPHERE, BY_NUMBERS(s1), .exact_tiers = "ABCD",
     .limits = LIMITS(.ulps = {0, 4, 2, 2}, .within[TIER_A] = 0.4)},
    {"S3", "  - sphere: {center: [0.3, 0.2, 5], radius: 0.0001}\n", BY_NUMBERS(s3)},
    {"S4", "  - sphere: {center: [0, -1000000, 0], radius: 1000000}\n", BY_NUMBERS(s4)},
    {"S5", UNIT_SPHERE, BY_NUMBERS(s5)},
    {"S6", UNIT_SPHERE, BY_NUMBERS(s6)},
    {"P1", "  - plane: {point: [0, 0, 0], normal: [0, 1, 0]}\n", BY_NUMBERS(p1), .exact_tiers = "ABCD",
     .limits = ULPS(4, 4, 4)},
    {"P3", ROUND_TABLE, .family = family_disc_rim, .ray_count = 100000, .checked_count = CHECKED},
    {"P3", ROUND_TABLE, BY_NUMBERS(p3)},
    {"P4", CUBE, BY_NUMBERS(p4), .exact_tiers = "ABCD",
     .limits = LIMITS(.ulps = {EXACTLY, EXACTLY, EXACTLY, EXACTLY})},
    {"P5", CUBE, .family = family_in_room, .ray_count = 1000000, .checked_count = CHECKED, .closed = true,
     .exact_tiers = "ABCD"},
    {"P5", .scene_make = scene_triangle_room, .family = family_in_room, .ray_count = 1000000,
     .checked_count = CHECKED_IN_MESH, .closed = true, .exact_tiers = "ABCD"},
    {"P6", "  - box: {min: [0, 0, 0], max: [1, 1, 1e-06]}\n", BY_NUMBERS(p6), .exact_tiers = "ABCD"},
    {"C1", INFINITE_CYLINDER, BY_NUMBERS(c1_infinite), .exact_tiers = "ABCD"},
    {"C1", "  - cylinder: {from: [0, 0, 0], to: [0, 0, 2], radius: 1}\n", BY_NUMBERS(c1_capped),
     .exact_tiers = "ABCD", .limits = ULPS(EXACTLY, EXACTLY, EXACTLY)},
    {"C2", INFINITE_CYLINDER, BY_NUMBERS(c2), .exact_tiers = "ABCD", .limits = ULPS(4, 4, 4)},
    {"C3", "  - cylinder: {from: [-10000, 0, 0], to: [10000, 0, 0], radius: 0.001}\n", BY_NUMBERS(c3),
     .exact_tiers = "BCD"},
    {"C4",
     "  - cylinder: {from: [5, 5, 5], to: [5.666666666666667, 6.333333333333333, 6.333333333333333], "
     "radius: 1}\n",
     .family = family_cylinder_rim, .ray_count = 1000000, .checked_count = CHECKED, .closed = true,
     .exact_tiers = "ABCD"},
    {"C5", INFINITE_CYLINDER, BY_NUMBERS(c5), .exact_tiers = "BCD"},
    {"C6", "  - cone: {from: [0, 0, 0], to: [0, 0, 10], radius: [0, 5]}\n", BY_NUMBERS(c6),
     .exact_tiers = "BCD"},
    {"C7", "  - cone: {from: [0, 0, 0], to: [0, 0, 10], radius: [0, 10]}\n", BY_NUMBERS(c7_along),
     .exact_tiers = "BCD", .limits = ULPS(4, 4, 4)},
    {"C7", "  - cone: {from: [0, 0, 0], to: [0, 0, 10], radius: [0, 5]}\n", BY_NUMBERS(c7_nappes),
     .exact_tiers = "ABCD", .limits = ULPS(4, 4, 4)},
    {"T1", RING, BY_NUMBERS(t1), .exact_tiers = "BCD"},
    {"T2", RING, BY_NUMBERS(t2), .exact_tiers = "BCD"},
    {"T2", RING, .family = family_along_torus_axis, .ray_count = 10000, .checked_count = CHECKED},
    {"T3", RING, BY_NUMBERS(t3)},
    {"T3", RING, .family = family_across_torus, .ray_count = 10000, .checked_count = CHECKED},
    {"T4", RING, BY_NUMBERS(t4), .exact_tiers = "BCD", .limits = LIMITS(.within = {0, 4e-4, 4e-4, 4e-4})},
    {"T5", "  - torus: {center: [0, 0, 0], axis: [0, 0, 1], major: 1, minor: 0.001}\n", BY_NUMBERS(t5)},
    {"T6", "  - torus: {center: [0, 0, 0], axis: [0, 0, 1], major: 143, minor: 113.2}\n", BY_NUMBERS(t6),
     .exact_tiers = "BCD", .limits = LIMITS(.ulps = {0, 16, 16, 0}, .within[TIER_D] = 1e-12)},
    {"Q1", BOWL, BY_NUMBERS(q1), .exact_tiers = "BCD", .limits = ULPS(4, 4, 4)},
    {"Q2", "  - paraboloid: {apex: [0, 0, 0], axis: [0, 0, 1], focal_length: 0.25}\n", BY_NUMBERS(q2),
     .exact_tiers = "ABCD", .limits = ULPS(4, 4, 4)},
    {"Q3", BOWL, BY_NUMBERS(q3), .exact_tiers = "ABCD"},
    {"M1", .scene_make = scene_icosphere, .family = family_from_within, .ray_count = 1000000,
     .checked_count = CHECKED_IN_MESH, .closed = true, .exact_tiers = "ABCD"},
    {"M3", "  - triangle: {vertices: [[0, 0, 0], [0.0002, 0, 0], [0, 0.0002, 0]]}\n", BY_NUMBERS(m3),
     .exact_tiers = "ABCD"},
    {"M4", "  - triangle: {vertices: [[0, 0, 0], [1, 0, 0], [0.5, 1e-06, 0]]}\n", BY_NUMBERS(m4)},
    {"M4", "  - triangle: {vertices: [[1, 2, 3], [8.5, 5.7, -4.5], [7.5, 5.8, -3.6]]}\n",
     .family = family_near_sliver, .ray_count = 100000, .checked_count = CHECKED},
    {"M5",
     "  - triangle: {vertices: [[-1113.45459, -79.049614, -56.2431908], [-1113.45459, -87.0922699, "
     "-56.2431908], [-1113.45459, -79.2090149, -56.2431908]]}\n",
     BY_NUMBERS(m5), .exact_tiers = "ABCD"},
};
const size_t verify_rays_count = COUNT_OF(verify_rays);
