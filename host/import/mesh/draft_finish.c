// Turns a draft into a mesh. Checks it, cuts its polygons into triangles, places it in the world and makes
// one vertex for each combination of position, normal and texture coordinates.
#include "host/base/memory.h"
#include "host/import/line.h"
#include "host/import/mesh/draft.h"
#include "host/import/number.h"
#include "host/scene/affine.h"
#include "host/scene/polygon.h"

#include <stdlib.h>
#include <string.h>

enum { TRIANGLES_MAX = 1 << 28 };

// Cutting a polygon takes time proportional to the square of its corners, some 30 s for this sum.
static const size_t squared_corners_max = (size_t)1 << 31;

static bool indices_are_sound(MeshDraft *draft)
{
    for (DraftPart part = 0; part < DRAFT_PART_COUNT; part++) {
        const DraftPlace *needed = &draft->needed[part];
        const size_t count = draft_part_count(draft, part);
        if (needed->index > count)
            return draft_fails(
                draft, needed->offset, "a face names %s %zu (counted from %zu), but the file has only %zu",
                draft_part_names[part], needed->index - 1 + draft->first_index, draft->first_index, count);
    }
    return true;
}

static int places_compare(const void *a, const void *b)
{
    const DraftPlace *first = a, *second = b;
    return (first->index > second->index) - (first->index < second->index);
}

static bool position_fails(MeshDraft *draft, uint32_t position)
{
    const DraftPlace wanted = {.index = position};
    const DraftPlace *place =
        draft->unread.count > 0
            ? bsearch(&wanted, draft->unread.items, draft->unread.count, sizeof wanted, places_compare)
            : NULL;
    if (!place)
        return draft_refuse(draft,
                            "vertex %zu (counted from %zu) has a coordinate that is not a number of at most "
                            "%g in magnitude",
                            position + draft->first_index, draft->first_index, NUMBER_MAX);
    Line line = line_first_of_mesh(&draft->report);
    line.at = line.text + place->offset;
    const Word word = line_word(&line);
    if (word.length == 0) return draft_fails(draft, place->offset, "a coordinate of the vertex is missing");
    return draft_fails(draft, place->offset,
                       "a coordinate must be a number of at most %g in magnitude, not '%.*s'", NUMBER_MAX,
                       WORD_TEXT(word));
}

// Checks the positions that faces use.
static bool positions_are_sound(MeshDraft *draft)
{
    bool all = true;
    for (size_t i = 0; i < draft->positions.count; i++)
        all &= vector_is_within(draft->positions.items[i], NUMBER_MAX);
    const DraftIndices *corners = &draft->corners[DRAFT_POSITION];
    for (size_t i = 0; i < corners->count && !all; i++)
        if (!vector_is_within(draft->positions.items[corners->items[i]], NUMBER_MAX))
            return position_fails(draft, corners->items[i]);
    return true;
}

// Replaces texture coordinates that are not numbers with 0 and removes normals that are not numbers.
static void parts_repair(MeshDraft *draft)
{
    size_t uv_count = 0, normal_count = 0;
    for (size_t i = 0; i < draft->uvs.count; i++) {
        double *uv = draft->uvs.items[i];
        if (vector_is_within((Vector3){uv[0], uv[1], 0}, NUMBER_MAX)) continue;
        uv[0] = uv[1] = 0;
        uv_count++;
    }
    for (size_t i = 0; i < draft->normals.count; i++) {
        if (vector_is_within(draft->normals.items[i], NUMBER_MAX)) continue;
        draft->normals.items[i] = (Vector3){0, 0, 0};
        normal_count++;
    }
    if (uv_count > 0)
        draft_warn(draft, "%zu texture coordinate%s %s not finite or too large and %s read as 0", uv_count,
                   text_plural(uv_count), text_is_are(uv_count), text_is_are(uv_count));
    if (normal_count > 0)
        draft_warn(draft, "%zu normal%s %s not finite or too large and %s ignored", normal_count,
                   text_plural(normal_count), text_is_are(normal_count), text_is_are(normal_count));
}

// Collects the corners after polygons are cut into triangles.
typedef struct {
    MeshDraft *draft;
    DraftIndices corners[DRAFT_PART_COUNT];
    size_t run; // the next one of the materials
    ARRAY_OF(Vector3) polygon;
    PolygonTriangles cut;
} Cutter;

static void corner_copy(Cutter *cutter, size_t corner)
{
    for (int part = 0; part < DRAFT_PART_COUNT; part++)
        if (cutter->draft->corners[part].count > 0)
            array_push(cutter->corners[part], cutter->draft->corners[part].items[corner]);
}

// Copies a range of corners that belong to triangles, and shifts the runs of materials that begin there by
// the same amount.
static void triangles_copy(Cutter *cutter, size_t first, size_t end)
{
    const size_t shift = cutter->corners[DRAFT_POSITION].count - first;
    for (; cutter->run < cutter->draft->materials.count; cutter->run++) {
        DraftMaterialRun *run = &cutter->draft->materials.items[cutter->run];
        if (run->first_corner > end) break;
        run->first_corner += shift;
    }
    for (int part = 0; part < DRAFT_PART_COUNT && end > first; part++) {
        const DraftIndices *from = &cutter->draft->corners[part];
        DraftIndices *to = &cutter->corners[part];
        if (from->count == 0) continue;
        array_reserve(*to, end - first);
        memcpy(to->items + to->count, from->items + first, (end - first) * sizeof *from->items);
        to->count += end - first;
    }
}

// Triangulates a polygon from its second corner, so that a convex quadrilateral is cut by the diagonal from
// its first corner, as in a fan. A polygon without area becomes a fan.
static void polygon_cut(Cutter *cutter, size_t first, size_t count)
{
    const MeshDraft *draft = cutter->draft;
    cutter->polygon.count = 0;
    for (size_t i = 0; i < count; i++) {
        const uint32_t position = draft->corners[DRAFT_POSITION].items[first + (i + 1) % count];
        array_push(cutter->polygon, draft->positions.items[position]);
    }
    const PolygonStatus status = polygon_triangulate(cutter->polygon.items, count, &cutter->cut);
    cutter->draft->crossed_count += status == POLYGON_CROSSED;
    for (size_t i = 0; i + 2 < count && status == POLYGON_WITHOUT_AREA; i++) {
        corner_copy(cutter, first);
        corner_copy(cutter, first + i + 1);
        corner_copy(cutter, first + i + 2);
    }
    for (size_t i = 0; i < cutter->cut.count; i++)
        for (int k = 0; k < 3; k++)
            corner_copy(cutter, first + (cutter->cut.items[i][k] + 1) % count);
}

static void polygons_cut(MeshDraft *draft)
{
    if (draft->polygons.count == 0) return;
    Cutter cutter = {.draft = draft};
    size_t at = 0;
    for (size_t i = 0; i < draft->polygons.count; i++) {
        const DraftPolygon *polygon = &draft->polygons.items[i];
        triangles_copy(&cutter, at, polygon->first_corner);
        polygon_cut(&cutter, polygon->first_corner, polygon->corner_count);
        at = polygon->first_corner + polygon->corner_count;
    }
    triangles_copy(&cutter, at, draft->corners[DRAFT_POSITION].count);
    for (int part = 0; part < DRAFT_PART_COUNT; part++) {
        free(draft->corners[part].items);
        draft->corners[part] = cutter.corners[part];
    }
    free(cutter.polygon.items);
    free(cutter.cut.items);
}

// Returns whether a triangle has an area before the transform, whose rounding could create one.
static bool corners_have_area(const MeshDraft *draft, const uint32_t *corners)
{
    const Vector3 *positions = draft->positions.items;
    return triangle_has_area(positions[corners[0]], positions[corners[1]], positions[corners[2]]);
}

// Reverses the winding after a mirroring transform, which keeps the triangles' outer side. Collapses
// degenerate triangles to a point, which no ray hits.
static void triangles_orient(MeshDraft *draft, bool mirrored)
{
    const DraftIndices *positions = &draft->corners[DRAFT_POSITION];
    for (size_t i = 0; i < positions->count; i += 3) {
        const bool has_area = corners_have_area(draft, positions->items + i);
        for (int part = 0; part < DRAFT_PART_COUNT && (mirrored || !has_area); part++) {
            if (draft->corners[part].count == 0) continue;
            uint32_t *corners = draft->corners[part].items + i;
            const uint32_t second = has_area ? corners[2] : corners[0],
                           third = has_area ? corners[1] : corners[0];
            corners[1] = second;
            corners[2] = third;
        }
    }
}

static void vectors_transform(MeshDraft *draft, const Affine *affine)
{
    const Affine for_normals = affine_for_normals(affine);
    for (size_t i = 0; i < draft->positions.count; i++)
        draft->positions.items[i] = affine_point(affine, draft->positions.items[i]);
    for (size_t i = 0; i < draft->normals.count; i++) {
        const Vector3 normal = vector_normalize(affine_direction(&for_normals, draft->normals.items[i]));
        draft->normals.items[i] = vector_is_within(normal, NUMBER_MAX) ? normal : (Vector3){0, 0, 0};
    }
}

// A vertex of the mesh in a linked list of all vertices with the same position.
typedef struct {
    uint32_t uv, normal, next;
} Combination;

typedef struct {
    MeshDraft *draft;
    uint32_t *first; // vertex of each position; DRAFT_NONE: none yet
    ARRAY_OF(Combination) combinations;
    size_t capacity;
    Mesh *mesh;
} Combiner;

static uint32_t part_of_corner(const MeshDraft *draft, DraftPart part, size_t corner)
{
    return draft->corners[part].count > 0 ? draft->corners[part].items[corner]
           : draft->is_shared[part]       ? draft->corners[DRAFT_POSITION].items[corner]
                                          : DRAFT_NONE;
}

static uint32_t combination_add(Combiner *combiner, uint32_t position, Combination added)
{
    const MeshDraft *draft = combiner->draft;
    Mesh *mesh = combiner->mesh;
    const uint32_t index = (uint32_t)combiner->combinations.count;
    array_push(combiner->combinations, added);
    if (combiner->capacity < combiner->combinations.capacity) {
        combiner->capacity = combiner->combinations.capacity;
        mesh->vertices = memory_resize(mesh->vertices, combiner->capacity, sizeof *mesh->vertices);
        if (draft_has(draft, DRAFT_NORMAL))
            mesh->normals = memory_resize(mesh->normals, combiner->capacity, sizeof *mesh->normals);
        if (draft_has(draft, DRAFT_UV))
            mesh->uvs = memory_resize(mesh->uvs, combiner->capacity, sizeof *mesh->uvs);
    }
    mesh->vertices[index] = draft->positions.items[position];
    if (mesh->normals)
        mesh->normals[index] =
            added.normal == DRAFT_NONE ? (Vector3){0, 0, 0} : draft->normals.items[added.normal];
    static const double no_uv[2] = {0, 0};
    if (mesh->uvs)
        memcpy(mesh->uvs[index], added.uv == DRAFT_NONE ? no_uv : draft->uvs.items[added.uv], sizeof no_uv);
    return index;
}

// Returns the vertex of a corner. Compares only the latest combinations, because a position may have many in
// a hostile file; mesh_join_vertices joins the remainder.
static uint32_t vertex_of_corner(Combiner *combiner, size_t corner)
{
    enum { COMPARED_MAX = 64 };
    const MeshDraft *draft = combiner->draft;
    const uint32_t position = draft->corners[DRAFT_POSITION].items[corner];
    Combination wanted = {part_of_corner(draft, DRAFT_UV, corner),
                          part_of_corner(draft, DRAFT_NORMAL, corner), combiner->first[position]};
    uint32_t at = wanted.next;
    for (int compared = 0; at != DRAFT_NONE && compared < COMPARED_MAX; compared++) {
        const Combination *known = &combiner->combinations.items[at];
        if (known->uv == wanted.uv && known->normal == wanted.normal) return at;
        at = known->next;
    }
    return combiner->first[position] = combination_add(combiner, position, wanted);
}

// Combines the corners into vertices. Uses the positions as vertices if all parts share their indices.
static void corners_combine(MeshDraft *draft, Mesh *mesh)
{
    DraftIndices *corners = &draft->corners[DRAFT_POSITION];
    mesh->triangle_count = corners->count / 3;
    if (draft->corners[DRAFT_UV].count == 0 && draft->corners[DRAFT_NORMAL].count == 0) {
        mesh->vertices = draft->positions.items;
        mesh->vertex_count = draft->positions.count;
        draft->positions.items = NULL;
        if (draft->is_shared[DRAFT_NORMAL]) {
            mesh->normals = draft->normals.items;
            draft->normals.items = NULL;
        }
        if (draft->is_shared[DRAFT_UV]) {
            mesh->uvs = draft->uvs.items;
            draft->uvs.items = NULL;
        }
    } else {
        Combiner combiner = {.draft = draft, .mesh = mesh};
        combiner.first = memory_allocate(draft->positions.count, sizeof *combiner.first);
        memset(combiner.first, 0xff, draft->positions.count * sizeof *combiner.first);
        for (size_t i = 0; i < corners->count; i++)
            corners->items[i] = vertex_of_corner(&combiner, i);
        mesh->vertex_count = combiner.combinations.count;
        free(combiner.first);
        free(combiner.combinations.items);
    }
    mesh->triangles = memory_resize(corners->items, mesh->triangle_count, sizeof *mesh->triangles);
    corners->items = NULL;
}

static void materials_expand(const MeshDraft *draft, Mesh *mesh)
{
    if (draft->materials.count == 0) return;
    mesh->materials = memory_allocate(mesh->triangle_count, sizeof *mesh->materials);
    for (size_t i = 0; i < draft->materials.count; i++) {
        const size_t end = i + 1 < draft->materials.count ? draft->materials.items[i + 1].first_corner / 3
                                                          : mesh->triangle_count;
        for (size_t k = draft->materials.items[i].first_corner / 3; k < end; k++)
            mesh->materials[k] = draft->materials.items[i].material;
    }
}

static bool triangles_fit(MeshDraft *draft)
{
    size_t corner_count = draft->corners[DRAFT_POSITION].count, squared_corners = 0;
    for (size_t i = 0; i < draft->polygons.count; i++) {
        const size_t count = draft->polygons.items[i].corner_count;
        corner_count += 2 * count - 6; // n - 2 triangles in place of n corners
        squared_corners += count * count;
    }
    if (squared_corners > squared_corners_max)
        return draft_refuse(
            draft,
            "the polygons have too many corners; the sum of their squared counts is %zu, but at "
            "most %zu is supported",
            squared_corners, squared_corners_max);
    if (corner_count == 0) return draft_refuse(draft, "the mesh has no triangles");
    return corner_count / 3 <= TRIANGLES_MAX ||
           draft_refuse(draft, "the mesh has %zu triangles; at most %d are supported", corner_count / 3,
                        TRIANGLES_MAX);
}

bool draft_check(MeshDraft *draft)
{
    if (draft->import->smoothing == SMOOTH_NEVER) {
        draft->corners[DRAFT_NORMAL].count = 0;
        draft->is_shared[DRAFT_NORMAL] = false;
    }
    return indices_are_sound(draft) && positions_are_sound(draft) && triangles_fit(draft);
}

void draft_finish(MeshDraft *draft, Mesh *mesh)
{
    *mesh = (Mesh){0};
    parts_repair(draft);
    polygons_cut(draft);
    const Affine *affine = &draft->import->transform;
    triangles_orient(draft, affine_determinant(affine) < 0);
    vectors_transform(draft, affine);
    corners_combine(draft, mesh);
    materials_expand(draft, mesh);
}
