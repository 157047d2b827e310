// Checks the BVH's invariants for any boxes.
// run_tests: sanitize-long-only
#include "host/compile/bvh_widen.h"
#include "host/verify/random_shape.h"
#include "tests/check.h"
#include "tests/probe.h"
#include "tests/random_ray.h"
#include "tests/scene_reading.h"

static Random random_state;

typedef struct {
    const Bvh *bvh;
    const Bounds *boxes;
    const uint8_t *types;
    uint8_t *seen;
    unsigned depth;
    unsigned wide_depth;
} TreeCheck;

static void assert_contains(const Bounds *outer, const Bounds *inner)
{
    assert_true(outer->min.x <= inner->min.x && outer->max.x >= inner->max.x);
    assert_true(outer->min.y <= inner->min.y && outer->max.y >= inner->max.y);
    assert_true(outer->min.z <= inner->min.z && outer->max.z >= inner->max.z);
}

static void leaf_check(TreeCheck *check, const BvhChild *leaf)
{
    assert_true(leaf->first + leaf->count <= check->bvh->primitive_count);
    const uint32_t *order = check->bvh->order + leaf->first;
    assert_true(leaf->count <= leaf_size_max(check->bvh->leaves, check->types[order[0]]));
    for (uint32_t i = 0; i < leaf->count; i++) {
        assert_int_equal(check->seen[order[i]]++, 0);
        assert_int_equal(check->types[order[i]], check->types[order[0]]);
        assert_contains(&leaf->box, &check->boxes[order[i]]);
    }
}

static void node_check(TreeCheck *check, uint32_t index, unsigned depth)
{
    assert_true(index < check->bvh->node_count);
    if (depth > check->depth) check->depth = depth;
    for (int side = 0; side < 2; side++) {
        const BvhChild *child = &check->bvh->nodes[index].children[side];
        if (bounds_is_empty(&child->box)) {
            assert_int_equal(check->bvh->node_count, 1);
        } else if (child->count > 0) {
            leaf_check(check, child);
        } else {
            assert_true(child->first > index);
            for (int k = 0; k < 2; k++)
                assert_contains(&child->box, &check->bvh->nodes[child->first].children[k].box);
            node_check(check, child->first, depth + 1);
        }
    }
}

// Checks that every primitive is in exactly one leaf of wide nodes, and every node visited once and not too
// deep.
static void wide_node_check(TreeCheck *check, const BvhWide *wide, unsigned width, uint32_t index,
                            unsigned depth)
{
    assert_true(index < wide->node_count);
    assert_true(depth <= BVH_DEPTH_MAX);
    const BvhWideNode *node = &wide->nodes[index];
    assert_true(node->child_count <= width);
    if (depth > check->wide_depth) check->wide_depth = depth;
    uint32_t next = node->first_node;
    for (unsigned i = 0; i < node->child_count; i++) {
        const BvhChild *child = node->children[i];
        if (child->count > 0) {
            leaf_check(check, child);
            continue;
        }
        assert_true(next > index);
        for (unsigned k = 0; k < wide->nodes[next].child_count; k++)
            assert_contains(&child->box, &wide->nodes[next].children[k]->box);
        check->depth++; // counts nodes here
        wide_node_check(check, wide, width, next++, depth + 1);
    }
}

static void wide_check(const Bvh *bvh, const Bounds *boxes, const uint8_t *types, unsigned width)
{
    BvhWide wide;
    bvh_widen(&wide, bvh, width);
    TreeCheck check = {bvh, boxes, types, memory_allocate_zeroed(bvh->primitive_count, 1), 1, 0};
    wide_node_check(&check, &wide, width, 0, 1);
    for (size_t i = 0; i < bvh->primitive_count; i++)
        assert_int_equal(check.seen[i], 1);
    assert_int_equal(check.depth, wide.node_count);
    assert_int_equal(check.wide_depth, wide.depth);
    free(check.seen);
    bvh_wide_free(&wide);
}

// Checks that every primitive is in exactly one leaf, that all are counted, that leaves have one type, that
// boxes contain everything below them, and that the depth is bounded.
static void tree_check(const Bounds *boxes, const uint8_t *types, size_t count, BvhLeaves leaves)
{
    Bvh bvh;
    Stage *stage = stage_open(false);
    stage_begin(stage, "building", NULL, count + 1);
    stage_set(stage, 1);
    bvh_build(&bvh, boxes, types, count, leaves, stage);
    OwnedText text = {0};
    double seconds;
    stage_write(stage, &text, &seconds);
    assert_string_equal(text_c(&text), "building 100%");
    stage_close(stage);
    TreeCheck check = {&bvh, boxes, types, memory_allocate_zeroed(count, 1), 0, 0};
    node_check(&check, 0, 1);
    for (size_t i = 0; i < count; i++)
        assert_int_equal(check.seen[i], 1);
    assert_true(check.depth <= BVH_DEPTH_MAX);
    assert_int_equal(check.depth, bvh.depth);
    for (unsigned width = BVH_WIDTH_MIN; width <= BVH_WIDTH_MAX; width *= 2)
        wide_check(&bvh, boxes, types, width);
    free(check.seen);
    bvh_free(&bvh);
}

static void trees_check(const Bounds *boxes, const uint8_t *types, size_t count)
{
    static const BvhLeaves leaves[] = {{8, 0, false}, {4, 0, false},  {8, 4, false},
                                       {8, 4, true},  {8, 16, false}, {8, 16, true}};
    for (size_t i = 0; i < COUNT_OF(leaves); i++)
        tree_check(boxes, types, count, leaves[i]);
}

static Bounds cube_around(Vector3 center, double half)
{
    return bounds_around(center, vector_all(half));
}

enum { IDENTICAL, ONE_CENTER, HUGE_AMONG_TINY, MANY_BINADES, NESTED, ON_A_LINE, FLAT, RANDOM, SET_COUNT };

static Bounds box_of_set(int set, size_t index, size_t count)
{
    const Vector3 nothing = {0, 0, 0};
    double part = (double)index / (double)count;
    switch (set) {
    case IDENTICAL:
        return cube_around((Vector3){1, 2, 3}, 0.5);
    case ONE_CENTER:
        return cube_around(nothing, 1 + part);
    case HUGE_AMONG_TINY:
        return index == 0 ? cube_around(nothing, 1e6)
                          : cube_around(random_cube_point(&random_state, 1), 1e-4);
    case MANY_BINADES: {
        double size = exp2(random_between(&random_state, -60, 60));
        return cube_around(random_cube_point(&random_state, size), size / 16);
    }
    case NESTED: // each next to a smaller one, so that a split separates only one
        return cube_around((Vector3){exp2(-100 * part), 0, 0}, exp2(-100 * part) / 64);
    case ON_A_LINE:
        return cube_around((Vector3){part, 0, 0}, 0);
    case FLAT:
        return bounds_around(
            (Vector3){random_between(&random_state, -1, 1), 7, random_between(&random_state, -1, 1)},
            (Vector3){0.01, 0, 0.01});
    default:
        return cube_around(random_cube_point(&random_state, 10), random_between(&random_state, 0, 0.5));
    }
}

TEST(any_boxes_make_a_tree)
{
    static const size_t counts[SET_COUNT] = {65536, 65536, 100001, 50000, 50000, 20000, 20000, 50000};
    for (int set = 0; set < SET_COUNT; set++) {
        size_t count = counts[set];
        OWNED Bounds *boxes = memory_allocate(count, sizeof *boxes);
        OWNED uint8_t *types = memory_allocate_zeroed(count, 1);
        for (size_t i = 0; i < count; i++)
            boxes[i] = box_of_set(set, i, count);
        trees_check(boxes, types, count);
        for (size_t i = 0; i < count; i++)
            types[i] = (uint8_t)(random_bits(&random_state) % TYPE_COUNT);
        trees_check(boxes, types, count);
    }
}

TEST(few_boxes_make_a_tree)
{
    Bounds boxes[20];
    uint8_t types[20];
    for (size_t count = 1; count <= 20; count++) {
        for (size_t i = 0; i < count; i++) {
            boxes[i] = cube_around(random_cube_point(&random_state, 1), 0.1);
            types[i] = (uint8_t)(i % 3);
        }
        trees_check(boxes, types, count);
    }
}

typedef struct {
    double cost; // the area of each leaf's box times the number of its cylinders
    size_t leaf_count;
} CylinderLeaves;

static CylinderLeaves cylinder_leaves(const Bounds *boxes, const uint8_t *types, size_t count,
                                      BvhLeaves leaves)
{
    CylinderLeaves found = {0};
    Bvh bvh;
    bvh_build(&bvh, boxes, types, count, leaves, NULL);
    for (size_t i = 0; i < 2 * bvh.node_count; i++) {
        const BvhChild *child = &bvh.nodes[i / 2].children[i % 2];
        if (child->count == 0 || bvh.types[child->first] != TYPE_CYLINDERS) continue;
        found.cost += child->count * bounds_half_area(child->box);
        found.leaf_count++;
    }
    bvh_free(&bvh);
    return found;
}

// Blocks of spheres barely change the leaves of the cylinders among them.
TEST(blocks_keep_other_leaves)
{
    enum { COUNT = 8000 };
    static Bounds boxes[COUNT];
    static uint8_t types[COUNT];
    for (size_t part = 2; part <= 32; part *= 2) { // one primitive in `part` is a cylinder
        for (size_t i = 0; i < COUNT; i++) {
            boxes[i] =
                cube_around(random_cube_point(&random_state, 10), random_between(&random_state, 0, 0.5));
            types[i] = i % part == 0 ? TYPE_CYLINDERS : TYPE_SPHERES;
        }
        const CylinderLeaves without = cylinder_leaves(boxes, types, COUNT, (BvhLeaves){8});
        for (int counts_blocks = 0; counts_blocks < 2; counts_blocks++) {
            const CylinderLeaves with =
                cylinder_leaves(boxes, types, COUNT, (BvhLeaves){8, 16, counts_blocks});
            assert_true(with.cost <= 1.2 * without.cost);
            assert_true((double)with.leaf_count <= 1.2 * (double)without.leaf_count);
        }
    }
}

// Next to a town of size 2, the slack of its boxes must not be that of a planet.
TEST(planets_stay_outside_the_tree)
{
    static const struct {
        double radii[2]; // of planets
        uint32_t in_tree;
    } skies[] = {{{0.5, 15.9}, 2}, {{0.5, 16.1}, 1}, {{17, 18}, 2}, {{17, 600}, 0}};
    enum { HOUSES = 30 };
    for (size_t i = 0; i < COUNT_OF(skies); i++) {
        OwnedText text = {0};
        text_appendf(&text, "camera: {position: [0, 1, -9], look_at: [0, 0, 0]}\nobjects:\n");
        for (size_t k = 0; k < 2; k++)
            text_appendf(&text, "  - sphere: {center: [0, %g, 0], radius: %g}\n", -skies[i].radii[k],
                         skies[i].radii[k]);
        for (int k = 0; k < HOUSES; k++)
            text_appendf(&text, "  - sphere: {center: [%g, 0.1, 0], radius: 0.1}\n",
                         0.9 * (2.0 * k / (HOUSES - 1) - 1));
        OwnedScene scene = scene_of_text("town.yaml", text_c(&text));
        const CompileSettings settings = {.width = 9, .height = 9, .sample_count = 1, .lanes = 8};
        OwnedCompiledScene compiled = scene_compiled(&scene, &settings);
        assert_int_equal(compiled.bvh_counts[TYPE_SPHERES], HOUSES + skies[i].in_tree);
        // the first two objects, the larger one last
        const ObjectEntry *entries = compiled.arrays[FLAT_OBJECTS].items;
        for (uint32_t k = 0; k < 2; k++)
            assert_int_equal(entries[k].type_index_material.y < HOUSES + skies[i].in_tree,
                             k < skies[i].in_tree);
    }
}

// Triangles without area are points, here all the same one. They stay in the tree, and the planet out of it.
TEST(points_make_a_tree)
{
    enum { POINTS = 100000 };
    OwnedScene scene = scene_of_text("points.yaml", "camera: {position: [0, 1, -9], look_at: [0, 0, 0]}\n"
                                                    "objects:\n"
                                                    "  - sphere: {center: [0, -3, 0], radius: 2}\n");
    for (int i = 0; i < POINTS; i++)
        array_push(scene.objects, ((Object){.type = SHAPE_TRIANGLE}));
    const CompileSettings settings = {.width = 9, .height = 9, .sample_count = 1, .lanes = 8};
    OwnedCompiledScene compiled = scene_compiled(&scene, &settings);
    assert_int_equal(compiled.bvh_counts[TYPE_TRIANGLES], POINTS);
    assert_int_equal(compiled.bvh_counts[TYPE_SPHERES], 0);
}

TEST_MAIN(NULL, NULL)
