// Records what the first pass of `certified` proves about ray trees, and replays it in the pass that
// re-renders flagged pixels: which object a ray hits first, and which lights the hit sees. Both passes bound
// their distance from the same exact rays, so that what one proves holds in the other. Without a BVH a replay
// would cost as much as it saves.
#ifndef DECISIONS_H
#define DECISIONS_H

#include "shading/bounce.h"

#define HAS_DECISIONS     (IS_CERTIFIED && HAS_BVH && (HAS_REFLECTION || HAS_TRANSMISSION) && !COMPUTE_SIGNATURE)
#define RECORDS_DECISIONS (HAS_DECISIONS && !IS_PIXEL_LIST)
#define REPLAYS_DECISIONS (HAS_DECISIONS && IS_PIXEL_LIST)

#define RECORDED_NODES RECORDED_NODES_OF(HAS_TRANSMISSION)

// The events of a node: two bits for each light, and one for each of its children that is recorded.
enum { LIGHT_IS_SEEN = 1, LIGHT_IS_OCCLUDED = 2, RECORDED_LIGHTS = 14 };
#define HAS_REFLECTED_NODE ((integer)(1 << 28))
#define HAS_REFRACTED_NODE ((integer)(1 << 29))

// The records of a band's samples.
typedef struct {
    global uint *words;
    uint slot_count; // the pixels of a record
    uint first_sample, sample_count;
} Records;

// Returns the records in the buffer of a band's film, given as slot count, first sample, sample count and
// where they begin, in ARENA_UNITs.
static inline Records records_of(global char *film, uint4 records)
{
    return (Records){(global uint *)(film + (size_t)records.w * ARENA_UNIT), records.x, records.y, records.z};
}

// A ray of a tree and its hit.
typedef struct {
    global uint *tree; // the sample's records, or NULL
    uint slot_count;
    uint number;    // the ray's number in the tree
    integer slot;   // each pixel's index in a record
    mask known;     // the lanes with a record; once that is loaded, with a proven hit
    integer object; // where it is known, the id of the object hit, or -1
    integer events;
} TreeNode;

static inline TreeNode tree_root(const Records *records, uint sample, integer slot, mask inside)
{
    TreeNode node = {0, records->slot_count, 0, slot, inside, (integer)(-1), (integer)(0)};
    sample -= records->first_sample;
    if (HAS_DECISIONS && sample < records->sample_count)
        node.tree = records->words + (size_t)sample * RECORDED_NODES * RECORD_WORDS * records->slot_count;
    return node;
}

// Returns a node's record: an object for each slot, 2 more than its id or 0 where it is not known, and then
// the events. Returns NULL if there is none.
static inline global uint *node_record(const TreeNode *node)
{
    if (!node->tree || node->number >= RECORDED_NODES) return 0;
    return node->tree + (size_t)node->number * RECORD_WORDS * node->slot_count;
}

// Sets the numbers of the bounces and, in a replay, the lanes in which they are recorded. Trees are numbered
// breadth first. The bound keeps the numbers of deep bounces, which have no record, from wrapping.
static inline void bounces_set_nodes(Bounces *bounces, const TreeNode *node)
{
    const uint parent = min(node->number, (uint)RECORDED_NODES);
    bounces->reflected.certain.number = HAS_TRANSMISSION ? 2 * parent + 1 : parent + 1;
    bounces->refracted.certain.number = 2 * parent + 2;
    bounces->reflected.certain.known = node->known & ((node->events & HAS_REFLECTED_NODE) != (integer)(0));
    bounces->refracted.certain.known = node->known & ((node->events & HAS_REFRACTED_NODE) != (integer)(0));
}

// Moves on to a bounce's node.
static inline void node_set_bounce(TreeNode *node, const Bounce *bounce)
{
    node->number = bounce->certain.number;
    node->known = bounce->certain.known;
}

// Sets the hit of a packet's rays. `uncertain` marks the lanes where it is not proven.
static inline void node_set_hit(TreeNode *node, const Ray *ray, integer object, mask uncertain)
{
    node->known = ray->active & !uncertain;
    node->object = object;
    node->events = (integer)(0);
}

// Sets the lanes that see a light or that opaque objects hide from it.
static inline void node_set_light(TreeNode *node, uint light, const Ray *shadow_ray,
                                  const Traversal *occlusion)
{
    if (light >= RECORDED_LIGHTS) return;
    const mask seen = occlusion->active;
    mask known = shadow_ray->active & !occlusion->hit.uncertain;
    if (HAS_TRANSMISSION) {
        integer depth = occlusion->optical_depth;
        if (HAS_FILTERS) depth = depth | occlusion->optical_depth_green | occlusion->optical_depth_blue;
        known = known & (!seen | (depth == (integer)(0)));
    }
    const integer event = lanes_select(seen, integer_of(LIGHT_IS_SEEN << 2 * light),
                                       integer_of(LIGHT_IS_OCCLUDED << 2 * light));
    node->events = node->events | lanes_select(known, event, (integer)(0));
}

static inline void words_store(integer values, global uint *words)
{
    IntegerLanes lanes = {values};
    for (uint lane = 0; lane < LANES; lane++)
        words[lane] = (uint)lanes.each[lane];
}

// Stores a node's record. The slots of a packet are consecutive.
static inline void node_store(TreeNode *node, const Bounces *bounces)
{
    global uint *record = node_record(node);
    if (!record) return;
    const integer none = (integer)(0);
    if (bounces->reflected.certain.number < RECORDED_NODES)
        node->events |= lanes_select(bounce_is_active(&bounces->reflected), HAS_REFLECTED_NODE, none);
    if (HAS_TRANSMISSION && bounces->refracted.certain.number < RECORDED_NODES)
        node->events |= lanes_select(bounce_is_active(&bounces->refracted), HAS_REFRACTED_NODE, none);
    const IntegerLanes slot = {node->slot};
    record += (uint)slot.each[0];
    words_store(lanes_select(node->known, node->object + (integer)(2), none), record);
    words_store(node->events, record + node->slot_count);
}

// Loads the record of a node in the lanes that are known.
static inline void node_load(TreeNode *node)
{
    global const uint *record = node_record(node);
    if (!record) node->known = mask_none();
    if (!lanes_any(node->known)) return;
    const IntegerLanes slot = {node->slot}, known = {node->known};
    IntegerLanes object, events;
    for (uint lane = 0; lane < LANES; lane++) {
        const uint index = (uint)slot.each[lane];
        object.each[lane] = known.each[lane] ? record[index] : 0;
        events.each[lane] = known.each[lane] ? record[node->slot_count + index] : 0;
    }
    node->known = object.all != (integer)(0);
    node->object = object.all - (integer)(2);
    node->events = events.all;
}

// The hits of a packet that are replayed, and its active rays.
typedef struct {
    mask active, lanes;
    Hit hit;
} Replay;

// Loads a node's record and intersects each ray with the object that it is known to hit. Until replay_end,
// rays whose hits are thereby decided are inactive.
static OUT_OF_LINE void replay_begin(Replay *replay, const Scene *scene, TreeNode *node, Ray *ray)
{
    node_load(node);
    replay->active = ray->active;
    replay->lanes = ray->active & node->known;
    if (!lanes_any(replay->lanes)) return;
    Traversal traversal;
    ray->active = mask_none();
    traversal_begin(&traversal, scene, ray, CLOSEST_HIT, 0);
    ray_prepare(ray);
    traversal.active = replay->lanes;
    integer pending = lanes_select(replay->lanes & (node->object >= (integer)(0)), node->object, NO_OBJECT);
    for (scalar_integer id; (id = lanes_smallest(pending)) != INT_MAX;) {
        ray->active = pending == (integer)(id);
        intersect_object(&traversal, scene, ray, scene->objects[id].type_index_material);
        pending = lanes_select(ray->active, NO_OBJECT, pending);
    }
    traversal_classify(&traversal);
    replay->hit = traversal.hit;
    replay->lanes = replay->lanes & !replay->hit.uncertain & (replay->hit.object == node->object);
    ray->active = replay->active & !replay->lanes;
}

// Adds the replayed hits to those of the rays that were traced.
static inline void replay_end(const Replay *replay, Ray *ray, Hit *hit)
{
    ray->active = replay->active;
    if (!lanes_any(replay->lanes)) return;
    real_replace(&hit->t, replay->lanes, replay->hit.t);
    real_replace(&hit->low, replay->lanes, replay->hit.low);
    real_replace(&hit->high, replay->lanes, replay->hit.high);
    hit->object = lanes_select(replay->lanes, replay->hit.object, hit->object);
    hit->uncertain = hit->uncertain & !replay->lanes;
}

// Deactivates the shadow rays whose answer is known. Returns the lanes that are known to see the light.
static inline mask replay_light(const TreeNode *node, uint light, Ray *shadow_ray)
{
    if (light >= RECORDED_LIGHTS) return mask_none();
    const integer none = (integer)(0);
    const mask known = shadow_ray->active & node->known,
               seen = known & ((node->events & integer_of(LIGHT_IS_SEEN << 2 * light)) != none),
               occluded = known & ((node->events & integer_of(LIGHT_IS_OCCLUDED << 2 * light)) != none);
    shadow_ray->active = shadow_ray->active & !(seen | occluded);
    return seen;
}

#endif
