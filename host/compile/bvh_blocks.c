// Lays out the leaves of triangles and spheres for kernels with several lanes, one row for each coordinate.
#include "host/base/parallel.h"
#include "host/compile/bvh_nodes.h"
#include <float.h>
#include <math.h>

// One block of FLAT_SPHERE_BLOCKS.
typedef struct {
    double *rows;
    uint32_t *ids, *indices;
    size_t width;
} FlatSphereBlock;

static FlatSphereBlock sphere_block_at(const CompiledScene *compiled, size_t block)
{
    const FlatArray *blocks = &compiled->arrays[FLAT_SPHERE_BLOCKS];
    const size_t width = 4 * blocks->layout.scalar4_count / SPHERE_ROWS;
    double *rows = flat_array_at(blocks, block);
    uint32_t *ids = (void *)(rows + SPHERE_ROWS * width);
    return (FlatSphereBlock){rows, ids, ids + width, width};
}

// Returns whether a child is a leaf that kernels with several lanes read as a block.
static bool is_block(uint32_t child_type)
{
    const unsigned type = leaf_type(child_type);
    return leaf_count(child_type) > 0 && type_has_blocks(type);
}

// Returns the index of a block's first primitive, to be read or set.
static uint32_t *block_first_index(const CompiledScene *compiled, unsigned type, size_t block)
{
    if (type == TYPE_SPHERES) return sphere_block_at(compiled, block).indices;
    return (uint32_t *)compiled->arrays[FLAT_BLOCK_TRIANGLES].items + block;
}

void blocks_place(CompiledScene *compiled, unsigned width, bool is_double)
{
    const FlatArray *nodes = &compiled->arrays[FLAT_NODES];
    size_t counts[TYPE_COUNT] = {0};
    for (size_t i = 0; i < nodes->count; i++)
        for (unsigned k = 0; k < width; k++) {
            const uint32_t child_type = flat_node_at(nodes, i).child_type[k];
            if (is_block(child_type)) counts[leaf_type(child_type)]++;
        }
    flat_wide_array_renew(compiled, FLAT_TRIANGLE_BLOCKS, counts[TYPE_TRIANGLES], width, !is_double);
    flat_wide_array_renew(compiled, FLAT_SPHERE_BLOCKS, counts[TYPE_SPHERES], width, false);
    flat_array_renew(compiled, FLAT_BLOCK_TRIANGLES, (counts[TYPE_TRIANGLES] + 3) / 4);
    uint32_t next[TYPE_COUNT] = {0};
    for (size_t i = 0; i < nodes->count; i++) {
        const FlatNode node = flat_node_at(nodes, i);
        for (unsigned k = 0; k < width; k++) {
            if (!is_block(node.child_type[k])) continue;
            const unsigned type = leaf_type(node.child_type[k]);
            *block_first_index(compiled, type, next[type]) = node.child_index[k];
            node.child_index[k] = next[type]++;
        }
    }
}

static size_t blocks_count(const CompiledScene *compiled)
{
    return compiled->arrays[FLAT_TRIANGLE_BLOCKS].count + compiled->arrays[FLAT_SPHERE_BLOCKS].count;
}

size_t leaf_first(const CompiledScene *compiled, const FlatNode *node, unsigned child)
{
    const size_t index = node->child_index[child];
    if (blocks_count(compiled) == 0 || !is_block(node->child_type[child])) return index;
    return *block_first_index(compiled, leaf_type(node->child_type[child]), index);
}

static void triangle_block_fill(const CompiledScene *compiled, size_t block, unsigned count)
{
    const FlatArray *blocks = &compiled->arrays[FLAT_TRIANGLE_BLOCKS],
                    *triangles = &compiled->arrays[FLAT_FIRST_SHAPE + TYPE_TRIANGLES];
    // floats are narrowed here because the blocks of a million triangles take 130 MB as doubles
    const bool is_double = blocks->layout.scalar4_count > 0;
    const size_t width = 4 * (blocks->layout.scalar4_count + blocks->layout.uint4_count) / BLOCK_ROWS;
    const size_t first = *block_first_index(compiled, TYPE_TRIANGLES, block);
    void *rows = flat_array_at(blocks, block);
    for (size_t lane = 0; lane < width; lane++) {
        const Triangle *triangle = flat_array_at(triangles, first + (lane < count ? lane : 0));
        const double vertices[BLOCK_ROWS] = {triangle->a.x, triangle->a.y, triangle->a.z,
                                             triangle->b.x, triangle->b.y, triangle->b.z,
                                             triangle->c.x, triangle->c.y, triangle->c.z};
        for (size_t row = 0; row < BLOCK_ROWS; row++)
            if (is_double)
                ((double *)rows)[row * width + lane] = vertices[row];
            else
                ((float *)rows)[row * width + lane] = (float)vertices[row];
    }
}

static void sphere_block_fill(const CompiledScene *compiled, size_t index, unsigned count)
{
    const FlatSphereBlock block = sphere_block_at(compiled, index);
    for (unsigned lane = 0; lane < block.width; lane++) {
        block.indices[lane] = block.indices[0] + (lane < count ? lane : 0);
        const Sphere *sphere =
            flat_array_at(&compiled->arrays[FLAT_FIRST_SHAPE + TYPE_SPHERES], block.indices[lane]);
        block.rows[lane] = sphere->center_radius.x;
        block.rows[block.width + lane] = sphere->center_radius.y;
        block.rows[2 * block.width + lane] = sphere->center_radius.z;
        // never rejected with HAS_POWER
        block.rows[3 * block.width + lane] =
            fmax(sphere->center_radius.w, sphere->id.y & HAS_POWER ? FLT_MAX : 0);
        block.ids[lane] = sphere->id.x | (sphere->id.y != 0 ? SPHERE_HAS_FLAGS : 0);
    }
}

static void nodes_fill_blocks(void *context, size_t begin, size_t end)
{
    const CompiledScene *compiled = context;
    for (size_t i = begin; i < end; i++) {
        const FlatNode node = flat_node_at(&compiled->arrays[FLAT_NODES], i);
        for (unsigned k = 0; k < node.width; k++) {
            if (!is_block(node.child_type[k])) continue;
            const unsigned type = leaf_type(node.child_type[k]), count = leaf_count(node.child_type[k]);
            if (type == TYPE_SPHERES)
                sphere_block_fill(compiled, node.child_index[k], count);
            else
                triangle_block_fill(compiled, node.child_index[k], count);
        }
    }
}

void blocks_fill(CompiledScene *compiled)
{
    if (blocks_count(compiled) == 0) return;
    compiled->changed[FLAT_TRIANGLE_BLOCKS] = compiled->changed[FLAT_SPHERE_BLOCKS] = true;
    parallel_run(compiled->arrays[FLAT_NODES].count, FLAT_RANGE_MIN / 16, nodes_fill_blocks, compiled);
}
