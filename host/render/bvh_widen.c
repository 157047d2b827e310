#include "host/render/bvh_widen.h"

#include "host/base/fault.h"
#include <float.h>
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

// The least cost of a binary node's subtree where it may take 1 .. width places in the wide node above it;
// entry 0 is unused. In one place it is a wide node of its own.
typedef float Costs[BVH_WIDTH_LARGEST + 1];

typedef struct {
    const Bvh *bvh;
    Costs *costs;
    unsigned width;
} Widening;

static bool child_is_empty(const BvhChild *child)
{
    return child->box.low[0] > child->box.high[0];
}

static bool child_is_node(const BvhChild *child)
{
    return child->count == 0 && !child_is_empty(child);
}

static double box_half_area(const BvhBox *box)
{
    double x = box->high[0] - box->low[0], y = box->high[1] - box->low[1], z = box->high[2] - box->low[2];
    return x * y + y * z + z * x;
}

// The cost of a leaf is the same wherever it hangs.
static const float *child_costs(const Widening *widening, const BvhChild *child)
{
    static const Costs leaf = {0};
    return child_is_node(child) ? widening->costs[child->first] : leaf;
}

// How many of the places the first of two children best takes.
static unsigned places_share(const float *first, const float *second, unsigned places)
{
    unsigned best = 1;
    for (unsigned k = 2; k < places; k++)
        if (first[k] + second[places - k] < first[best] + second[places - best]) best = k;
    return best;
}

static double node_half_area(const BvhNodeBuild *node)
{
    BvhBox box = node->children[0].box;
    for (int axis = 0; axis < 3; axis++) {
        box.low[axis] = fmin(box.low[axis], node->children[1].box.low[axis]);
        box.high[axis] = fmax(box.high[axis], node->children[1].box.high[axis]);
    }
    return box_half_area(&box);
}

// From the leaves up: children come after their parent.
static void costs_find(Widening *widening)
{
    const Bvh *bvh = widening->bvh;
    double root_area = node_half_area(&bvh->nodes[0]);
    double scale = root_area >= DBL_MIN && root_area <= DBL_MAX ? 1 / root_area : 0;
    for (size_t i = bvh->node_count; i-- > 0;) {
        const BvhNodeBuild *node = &bvh->nodes[i];
        const float *first = child_costs(widening, &node->children[0]);
        const float *second = child_costs(widening, &node->children[1]);
        float *costs = widening->costs[i];
        for (unsigned places = 2; places <= widening->width; places++) {
            unsigned share = places_share(first, second, places);
            costs[places] = first[share] + second[places - share];
        }
        // a node costs something even where its area is nothing
        costs[1] = costs[widening->width] + (float)(node_half_area(node) * scale) + 0x1p-24f;
        for (unsigned places = 2; places <= widening->width; places++)
            costs[places] = fminf(costs[places], costs[1]);
    }
}

static void child_gather(const Widening *widening, const BvhChild *child, unsigned places, BvhWideNode *wide);

static void children_gather(const Widening *widening, uint32_t node, unsigned places, BvhWideNode *wide)
{
    const BvhChild *children = widening->bvh->nodes[node].children;
    unsigned share =
        places_share(child_costs(widening, &children[0]), child_costs(widening, &children[1]), places);
    child_gather(widening, &children[0], share, wide);
    child_gather(widening, &children[1], places - share, wide);
}

static void child_gather(const Widening *widening, const BvhChild *child, unsigned places, BvhWideNode *wide)
{
    if (child_is_empty(child)) return;
    const float *costs = child_costs(widening, child);
    if (child_is_node(child) && costs[places] < costs[1])
        children_gather(widening, child->first, places, wide);
    else
        wide->children[wide->child_count++] = child;
}

void bvh_widen(BvhWide *wide, const Bvh *bvh, unsigned width)
{
    if (width < 2 || width > BVH_WIDTH_LARGEST) fault("a node of %u children", width);
    Widening widening = {bvh, memory_allocate(bvh->node_count, sizeof(Costs)), width};
    costs_find(&widening);
    uint32_t *roots = memory_allocate(bvh->node_count, sizeof *roots);
    *wide = (BvhWide){memory_allocate(bvh->node_count, sizeof *wide->nodes), 1};
    roots[0] = 0;
    for (size_t i = 0; i < wide->node_count; i++) {
        BvhWideNode *node = &wide->nodes[i];
        *node = (BvhWideNode){.first_node = (uint32_t)wide->node_count};
        children_gather(&widening, roots[i], width, node);
        for (unsigned k = 0; k < node->child_count; k++)
            if (child_is_node(node->children[k])) roots[wide->node_count++] = node->children[k]->first;
    }
    free(roots);
    free(widening.costs);
}

void bvh_wide_free(BvhWide *wide)
{
    free(wide->nodes);
    *wide = (BvhWide){0};
}
