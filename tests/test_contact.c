// Tests the box around the points where transparent and opaque objects may touch. A hit outside it is never
// tested for an opaque surface at the same point, so the box must contain all such points and should contain
// little else.
#include "tests/check.h"
#include "tests/scene_reading.h"

#define STAGE                                                                                                \
    "camera: {position: [0, 0, 0], look_at: [0, 0, -1]}\n"                                                   \
    "materials:\n"                                                                                           \
    "  glass: {transmission: 0.75, ior: 1.5}\n"                                                              \
    "  chalk: {color: [1, 1, 1]}\n"                                                                          \
    "objects:\n"
#define FLOOR        "  - plane: {point: [7, -1, 3], normal: [0, 1, 0], material: chalk}\n"
#define GLASS_SPHERE "  - sphere: {center: [0, 0, -4], radius: 1, material: glass}\n"

typedef struct {
    const char *name, *objects;
    bool touch;
    Vector3 low, high; // within a 256th
} Trial;

#define APART                                                                                                \
    false, {0, 0, 0},                                                                                        \
    {                                                                                                        \
        0, 0, 0                                                                                              \
    }
#define WIDE      (2 * 2000 * 0x1p-14)
#define UNBOUNDED ((double)FLT_MAX)

static Trial trials[] = {
    {"sphere on a floor", GLASS_SPHERE FLOOR, true, {-1, -1, -5}, {1, -1, -3}},
    {"sphere over a floor", "  - sphere: {center: [0, 0.125, -4], radius: 1, material: glass}\n" FLOOR,
     APART},
    {"nothing opaque", GLASS_SPHERE, APART},
    {"all opaque", "  - sphere: {center: [0, 0, -4], radius: 1, material: chalk}\n" FLOOR, APART},
    {"next to a box",
     GLASS_SPHERE "  - box: {min: [1, 0, -8], max: [2, 3, -4.5], material: chalk}\n",
     true,
     {1, 0, -5},
     {1, 1, -4.5}},
    {"far from a box and on a floor",
     GLASS_SPHERE FLOOR "  - box: {min: [3, 0, -8], max: [4, 3, -4.5], material: chalk}\n",
     true,
     {-1, -1, -5},
     {1, -1, -3}},
    {"two floors' places are joined",
     GLASS_SPHERE FLOOR "  - plane: {point: [0, 1, 0], normal: [0, -2, 0], material: chalk}\n",
     true,
     {-1, -1, -5},
     {1, 1, -3}},
    // y = x - 0.5 from x = -0.5 to 1 and y = -1 to 0.5
    {"a tilted plane",
     GLASS_SPHERE "  - plane: {point: [0.5, 0, 0], normal: [-1, 1, 0], material: chalk}\n",
     true,
     {-0.5, -1, -5},
     {1, 0.5, -3}},
    {"a tilted plane that passes by",
     GLASS_SPHERE "  - plane: {point: [2.25, 0, 0], normal: [-1, 1, 0], material: chalk}\n", APART},
    {"a disc",
     GLASS_SPHERE "  - disc: {center: [0, -0.5, -4], normal: [0, 1, 0], radius: 0.5, material: chalk}\n",
     true,
     {-0.5, -0.5, -4.5},
     {0.5, -0.5, -3.5}},
    {"a sphere in water",
     "  - plane: {point: [0, 0, 0], normal: [0, 1, 0], material: glass}\n"
     "  - sphere: {center: [0, 0.25, -4], radius: 1, material: chalk}\n",
     true,
     {-1, 0, -5},
     {1, 0, -3}},
    // their errors grow with the distance, where they become indistinguishable
    {"water over a floor",
     FLOOR "  - plane: {point: [0, -0.5, 0], normal: [0, 2, 0], material: glass}\n",
     true,
     {-UNBOUNDED, -UNBOUNDED, -UNBOUNDED},
     {UNBOUNDED, UNBOUNDED, UNBOUNDED}},
    {"an unbounded glass cylinder on a floor",
     FLOOR "  - cylinder: {point: [0, 999, 0], axis: [1, 0, 0.25], radius: 1000, material: glass}\n",
     true,
     {-UNBOUNDED, -UNBOUNDED, -UNBOUNDED},
     {UNBOUNDED, UNBOUNDED, UNBOUNDED}},
    {"a sphere under a wide unbounded cylinder, indistinguishable at numbers so large",
     "  - sphere: {center: [0, -1.03125, -4], radius: 1, material: glass}\n"
     "  - cylinder: {point: [0, 1000, 0], axis: [0, 0, 1], radius: 1000, material: chalk}\n",
     true,
     {-1 - WIDE, -2.03125 - WIDE, -5 - WIDE},
     {1 + WIDE, -0.03125 + WIDE, -3 + WIDE}},
    // sheared by 89 degrees, it may touch what is 2^-14 24 times its coordinates away
    {"a sheared superellipsoid a thousandth over a floor",
     "  - superellipsoid: {center: [0, 0, 0], radii: [0.02, 0.02, 0.02], exponent: 16, material: glass,\n"
     "      transform: {matrix: [[1, 0, 57, 0], [0, 1, 0, -0.979], [0, 0, 1, -1]]}}\n" FLOOR,
     true,
     {-1.1575, -1, -1.02},
     {1.1575, -1, -0.98}},
    {"an unbounded cylinder",
     GLASS_SPHERE "  - cylinder: {point: [0, 0, 0], axis: [1, 0, 0], radius: 1, material: chalk}\n",
     true,
     {-1, -1, -5},
     {1, 1, -3}},
};
enum { TRIAL_COUNT = COUNT_OF(trials) };

static Bounds contact_of(const Scene *scene)
{
    const CompileSettings settings = {
        .width = 1, .height = 1, .sample_count = 1, .extra_features = FEATURE_TRANSMISSION};
    OwnedCompiledScene compiled = scene_compiled(scene, &settings);
    const SceneHeader *header = compiled.arrays[FLAT_HEADER].items;
    Bounds contact = {vector3_of(&header->contact_low), vector3_of(&header->contact_high)};
    return contact;
}

// Checks that a value is at a bound or beyond it by no more than a 256th.
static void check_beyond(const char *name, double value, double bound)
{
    if (fabs(bound) == UNBOUNDED) {
        assert_true(value >= fabs(bound));
    } else if (!(value >= bound && value <= bound + 0x1p-8)) {
        fail_msg("%s: reaches %.9g, not %g", name, value, bound);
    }
}

static void holds_where_they_touch(void **state)
{
    const Trial *trial = *state;
    OwnedScene scene = scene_of_text("contact.yaml", formatted(STAGE "%s", trial->objects));
    Bounds contact = contact_of(&scene);
    assert_int_equal(bounds_is_empty(&contact), !trial->touch);
    if (trial->touch) {
        check_beyond(trial->name, -contact.min.x, -trial->low.x);
        check_beyond(trial->name, -contact.min.y, -trial->low.y);
        check_beyond(trial->name, -contact.min.z, -trial->low.z);
        check_beyond(trial->name, contact.max.x, trial->high.x);
        check_beyond(trial->name, contact.max.y, trial->high.y);
        check_beyond(trial->name, contact.max.z, trial->high.z);
    }
}

// With enough pairs, all opaque objects count as one box, which is unbounded if many of them are.
TEST(many_pairs_hold_as_much)
{
    enum { SPHERE_COUNT = 1500 };
    for (int unbounded = 0; unbounded <= 1; unbounded++) {
        OwnedText text = {0};
        text_appendf(&text, STAGE);
        for (int i = 0; i < SPHERE_COUNT; i++) {
            text_appendf(&text, "  - sphere: {center: [%d, 0, -4], radius: 0.5, material: glass}\n", 4 * i);
            if (unbounded)
                text_appendf(&text, "  - plane: {point: [0, %d, 0], normal: [0, 1, 0], material: chalk}\n",
                             -8 - i);
            else
                text_appendf(&text, "  - sphere: {center: [%d, 1, -4], radius: 0.5, material: chalk}\n",
                             4 * i);
        }
        OwnedScene scene = scene_of_text("contact.yaml", text_c(&text));
        Bounds contact = contact_of(&scene);
        if (unbounded) {
            assert_true(contact.max.y >= UNBOUNDED && contact.min.y <= -UNBOUNDED);
        } else {
            double reach = 4.0 * (SPHERE_COUNT - 1) + 0.5;
            assert_true(contact.min.x <= -0.5 && contact.max.x >= reach);
            // the scene's size is what nearness goes by
            assert_true(contact.min.y <= 0.5 && contact.min.y >= 0.5 - reach * 0x1p-12);
            assert_true(contact.max.y >= 0.5 && contact.max.y <= 0.5 + reach * 0x1p-12);
        }
    }
}

int main(int argument_count, char **arguments)
{
    for (size_t i = 0; i < TRIAL_COUNT; i++)
        test_register(&(struct CMUnitTest){trials[i].name, holds_where_they_touch, NULL, NULL, &trials[i]});
    return tests_run(argument_count, arguments, NULL, NULL);
}
