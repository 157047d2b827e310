// Places glTF's nodes in the world, with their meshes, cameras and lights.
#include "host/base/memory.h"
#include "host/import/mesh/gltf.h"
#include "host/import/number.h"
#include "host/scene/polygon.h"
#include "host/scene/portable.h"

#include <stdlib.h>
#include <string.h>

enum { DEPTH_MAX = 1000 };

// Reads the node's matrix, stored by columns, or its translation, rotation (a quaternion) and scale.
static bool transform_read(Gltf *gltf, const GltfItem *node, Affine *affine)
{
    double m[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    double move[3] = {0}, q[4] = {0, 0, 0, 1}, scale[3] = {1, 1, 1};
    if (!gltf_numbers(gltf, node, "matrix", 16, m) || !gltf_numbers(gltf, node, "translation", 3, move) ||
        !gltf_numbers(gltf, node, "rotation", 4, q) || !gltf_numbers(gltf, node, "scale", 3, scale))
        return false;
    if (gltf_member(node, "matrix").json) {
        *affine =
            (Affine){{{m[0], m[4], m[8], m[12]}, {m[1], m[5], m[9], m[13]}, {m[2], m[6], m[10], m[14]}}};
        return true;
    }
    // quaternions in files are unit to the precision of a float
    const double squared = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(squared > 0)) return gltf_fails(gltf, node, "must have a 'rotation' that is not zero");
    const double s = 2 / squared, x = q[0], y = q[1], z = q[2], w = q[3];
    const double turn[3][3] = {{1 - s * (y * y + z * z), s * (x * y - z * w), s * (x * z + y * w)},
                               {s * (x * y + z * w), 1 - s * (x * x + z * z), s * (y * z - x * w)},
                               {s * (x * z - y * w), s * (y * z + x * w), 1 - s * (x * x + y * y)}};
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++)
            affine->rows[row][column] = turn[row][column] * scale[column];
        affine->rows[row][3] = move[row];
    }
    return true;
}

// A primitive's vertices, the first of which gets the index `first` in the draft.
typedef struct {
    GltfNumbers positions, normals, uvs, indices;
    size_t first;
    bool is_mirrored;
} Vertices;

static void vertices_free(Vertices *vertices)
{
    free(vertices->positions.items);
    free(vertices->normals.items);
    free(vertices->uvs.items);
    free(vertices->indices.items);
}

static Vector3 numbers_vector(const GltfNumbers *numbers, size_t row)
{
    const double *values = numbers->items + 3 * row;
    return (Vector3){values[0], values[1], values[2]};
}

// Reads an optional attribute of a primitive. Drops an invalid one with a warning.
static void attribute_read(Gltf *gltf, const GltfItem *attributes, const char *key, size_t width,
                           const GltfNumbers *positions, GltfNumbers *numbers)
{
    gltf->is_optional = true;
    const bool read = gltf_accessor_read(gltf, attributes, key, width, numbers);
    const GltfItem item = gltf_member(attributes, key);
    if (read && numbers->count > 0 && numbers->count != positions->count)
        gltf_fails(gltf, &item, "has %zu elements for %zu positions", numbers->count, positions->count);
    gltf->is_optional = false;
    if (!read || numbers->count != positions->count) numbers->count = 0;
}

static bool primitive_vertices_read(Gltf *gltf, const GltfItem *primitive, const GltfMaterial *material,
                                    Vertices *vertices)
{
    const GltfItem attributes = gltf_object(gltf, primitive, "attributes");
    *vertices = (Vertices){.first = gltf->draft->positions.count};
    if (!gltf_accessor_read(gltf, &attributes, "POSITION", 3, &vertices->positions) ||
        !gltf_accessor_read(gltf, primitive, "indices", 1, &vertices->indices))
        return false;
    char uvs[24];
    snprintf(uvs, sizeof uvs, "TEXCOORD_%zu", material ? material->texture.uv_set : 0);
    attribute_read(gltf, &attributes, "NORMAL", 3, &vertices->positions, &vertices->normals);
    attribute_read(gltf, &attributes, uvs, 2, &vertices->positions, &vertices->uvs);
    for (size_t i = 0; i < vertices->indices.count; i++) {
        const double index = vertices->indices.items[i];
        if (!(index >= 0 && index < (double)vertices->positions.count && index == floor(index)))
            return gltf_fails(gltf, primitive,
                              "names vertex %g (counted from 0) in index %zu, but has only %zu", index, i,
                              vertices->positions.count);
    }
    return vertices->first + vertices->positions.count <= DRAFT_VERTICES_MAX ||
           draft_refuse_vertices(gltf->draft);
}

// Adds the vertices, transformed to the world. v points downward in glTF and upward in glint.
static void primitive_vertices_add(MeshDraft *draft, const Vertices *vertices, const GltfMaterial *material,
                                   const Affine *affine)
{
    static const double plain[2][3] = {{1, 0, 0}, {0, 1, 0}};
    const double(*rows)[3] = material ? material->texture.uv_rows : plain;
    const Affine for_normals = affine_for_normals(affine);
    if (vertices->normals.count > 0) draft_share_part(draft, DRAFT_NORMAL);
    if (vertices->uvs.count > 0) draft_share_part(draft, DRAFT_UV);
    for (size_t i = 0; i < vertices->positions.count; i++)
        array_push(draft->positions, affine_point(affine, numbers_vector(&vertices->positions, i)));
    for (size_t i = 0; i < vertices->normals.count; i++) {
        const Vector3 normal = affine_direction(&for_normals, numbers_vector(&vertices->normals, i));
        array_push(draft->normals, vector_normalize(normal));
    }
    for (size_t i = 0; i < vertices->uvs.count; i++) {
        const double *uv = vertices->uvs.items + 2 * i;
        draft_add_uv(draft, rows[0][0] * uv[0] + rows[0][1] * uv[1] + rows[0][2],
                     1 - (rows[1][0] * uv[0] + rows[1][1] * uv[1] + rows[1][2]));
    }
}

// Adds a triangle. Collapses it to a point if it has no area before the node's transform, whose rounding
// could create one.
static void triangle_add(MeshDraft *draft, const Vertices *vertices, size_t a, size_t b, size_t c)
{
    size_t corners[3] = {a, vertices->is_mirrored ? c : b, vertices->is_mirrored ? b : c};
    for (int i = 0; i < 3 && vertices->indices.count > 0; i++)
        corners[i] = (size_t)vertices->indices.items[corners[i]];
    const GltfNumbers *positions = &vertices->positions;
    const bool has_area =
        triangle_has_area(numbers_vector(positions, corners[0]), numbers_vector(positions, corners[1]),
                          numbers_vector(positions, corners[2]));
    for (int i = 0; i < 3; i++)
        array_push(draft->corners[DRAFT_POSITION], (uint32_t)(vertices->first + corners[has_area ? i : 0]));
    draft_end_face(draft, 0);
}

enum { MODE_TRIANGLES = 4, MODE_STRIP, MODE_FAN };

static void triangles_add(Gltf *gltf, const GltfItem *primitive, const Vertices *vertices, size_t mode)
{
    const size_t count = vertices->indices.count > 0 ? vertices->indices.count : vertices->positions.count;
    if (mode == MODE_TRIANGLES ? count % 3 > 0 : count == 1 || count == 2)
        gltf_warn_once(gltf, primitive, "vertices that complete no triangle are not shown");
    for (size_t i = 0; i + 2 < count; i += mode == MODE_TRIANGLES ? 3 : 1) {
        const size_t odd = mode == MODE_STRIP ? i & 1 : 0;
        triangle_add(gltf->draft, vertices, mode == MODE_FAN ? 0 : i, i + 1 + odd, i + 2 - odd);
    }
}

static bool gltf_primitive_add(Gltf *gltf, const GltfItem *primitive, const Affine *affine)
{
    MeshDraft *draft = gltf->draft;
    size_t mode = MODE_TRIANGLES;
    if (!gltf_integer(gltf, primitive, "mode", 0, MODE_FAN, &mode)) return false;
    const GltfItem attributes = gltf_object(gltf, primitive, "attributes"),
                   colors = gltf_member(&attributes, "COLOR_0"), targets = gltf_member(primitive, "targets");
    if (mode < MODE_TRIANGLES || !gltf_member(&attributes, "POSITION").json) {
        gltf_warn_once(gltf, primitive,
                       mode < MODE_TRIANGLES ? "points and lines are not shown"
                                             : "primitives without 'POSITION' are not shown");
        return true;
    }
    if (colors.json) gltf_warn_once(gltf, &colors, draft_colors);
    if (targets.json) gltf_warn_once(gltf, &targets, draft_morphs);
    GltfMaterial *material = draft->import->own_materials ? gltf_material(gltf, primitive) : NULL;
    Vertices vertices;
    const bool read = primitive_vertices_read(gltf, primitive, material, &vertices);
    if (read && material) {
        const bool has_texture = material->texture.number > 0 || material->normals.number > 0,
                   has_uvs = vertices.uvs.count > 0;
        const uint32_t index = gltf_material_index(gltf, material, has_texture && has_uvs);
        if (has_texture && !has_uvs) gltf_warn_once(gltf, primitive, draft_no_uvs);
        array_push(draft->materials, ((DraftMaterialRun){draft->face_start, index}));
    }
    if (read) {
        vertices.is_mirrored = affine_determinant(affine) < 0;
        primitive_vertices_add(draft, &vertices, material, affine);
        triangles_add(gltf, primitive, &vertices, mode);
    }
    vertices_free(&vertices);
    return read;
}

// Sets the camera, which is optional and looks along the node's -z axis. +y is up.
static void camera_add(Gltf *gltf, const GltfItem *camera, const Affine *affine)
{
    MeshView *view = gltf->draft->import->view;
    double angle = 0, aspect = 0, half_width = 0, half_height = 0;
    if (view->has_camera) {
        gltf_warn_once(gltf, camera, draft_cameras);
        return;
    }
    const GltfItem perspective = gltf_object(gltf, camera, "perspective"),
                   flat = gltf_object(gltf, camera, "orthographic");
    const bool is_sound = gltf_numbers(gltf, &perspective, "yfov", 1, &angle) &&
                          gltf_numbers(gltf, &perspective, "aspectRatio", 1, &aspect) &&
                          gltf_numbers(gltf, &flat, "xmag", 1, &half_width) &&
                          gltf_numbers(gltf, &flat, "ymag", 1, &half_height);
    if (is_sound && !(angle > 0 && angle < M_PI) && !(half_height > 0))
        gltf_fails(gltf, camera, "needs a 'yfov' between 0 and pi or a positive 'ymag'");
    else if (is_sound) {
        view->camera = (Camera){.up = affine_direction(affine, (Vector3){0, 1, 0}),
                                .field_axis = FIELD_VERTICAL,
                                .half_tangent = portable_tangent(angle / 2),
                                .frame_aspect = fmax(aspect, 0)};
        camera_look_along(&view->camera, affine_point(affine, (Vector3){0, 0, 0}),
                          vector_normalize(affine_direction(affine, (Vector3){0, 0, -1})));
        if (flat.json) {
            view->camera.projection = PROJECTION_ORTHOGRAPHIC;
            view->camera.half_tangent = half_height;
            view->camera.frame_aspect = fmax(half_width / half_height, 0);
        }
        view->has_camera = true;
    }
}

// Returns false with a warning if a member of an optional item has a number below 0.
static bool not_negative(Gltf *gltf, const GltfItem *item, const char *key, size_t count,
                         const double *values)
{
    const GltfItem member = gltf_member(item, key);
    for (size_t i = 0; i < count; i++)
        if (values[i] < 0) return gltf_fails(gltf, &member, "must be 0 or more, not %g", values[i]);
    return true;
}

// Adds a light, which is optional.
static void light_add(Gltf *gltf, const GltfItem *light, const Affine *affine)
{
    const GltfItem type = gltf_member(light, "type"), cone = gltf_object(gltf, light, "spot");
    const char *name = json_string_value(type.json);
    double color[3] = {1, 1, 1}, intensity = 1, inner = 0, outer = M_PI / 4;
    const bool is_sun = name && strcmp(name, "directional") == 0, is_spot = name && strcmp(name, "spot") == 0;
    if (!is_sun && !is_spot && !(name && strcmp(name, "point") == 0))
        gltf_fails(gltf, &type, "must be directional, point or spot");
    else if (gltf_numbers(gltf, light, "color", 3, color) &&
             gltf_numbers(gltf, light, "intensity", 1, &intensity) &&
             not_negative(gltf, light, "color", 3, color) &&
             not_negative(gltf, light, "intensity", 1, &intensity) &&
             gltf_numbers(gltf, &cone, "innerConeAngle", 1, &inner) &&
             gltf_numbers(gltf, &cone, "outerConeAngle", 1, &outer)) {
        outer = fmin(fmax(outer, 1e-3), M_PI / 2);
        inner = fmin(fmax(inner, 0), outer);
        // a white surface reflects 1 / pi of the illuminance
        const double part = intensity / M_PI;
        const Light added = {.type = is_sun    ? LIGHT_DIRECTIONAL
                                     : is_spot ? LIGHT_SPOT
                                               : LIGHT_POINT,
                             .color = {color[0] * part, color[1] * part, color[2] * part},
                             .position = affine_point(affine, (Vector3){0, 0, 0}),
                             .direction = vector_normalize(affine_direction(affine, (Vector3){0, 0, -1})),
                             .spot.half_angle = outer * (180 / M_PI),
                             .spot.penumbra = (outer - inner) * (180 / M_PI),
                             .fading = {0, 0, 1}};
        array_push(gltf->draft->import->view->lights, added);
    }
}

// Adds the node's camera and light, or warns about them if the file is a mesh of another scene.
static void gltf_view_add(Gltf *gltf, const GltfItem *node, const Affine *affine)
{
    gltf->is_optional = true;
    const GltfItem extension = gltf_extension(gltf, node, "KHR_lights_punctual"), root = gltf_root(gltf),
                   all = gltf_extension(gltf, &root, "KHR_lights_punctual"),
                   lights = gltf_array(gltf, &all, "lights");
    size_t camera = SIZE_MAX, light = SIZE_MAX;
    gltf_index(gltf, node, "camera", "cameras", &camera);
    const size_t light_count = json_array_size(lights.json);
    if (extension.json && light_count > 0)
        gltf_integer(gltf, &extension, "light", 0, light_count - 1, &light);
    else if (extension.json && !lights.is_wrong)
        gltf_fails(gltf, &extension, "refers to lights, which the file lacks");
    if ((camera != SIZE_MAX || light != SIZE_MAX) && !gltf->draft->import->view) {
        gltf_warn_once(gltf, node, draft_view);
    } else {
        const GltfItem camera_item = gltf_entry(gltf, "cameras", camera),
                       light_item = gltf_element(gltf, &lights, light);
        if (camera != SIZE_MAX) camera_add(gltf, &camera_item, affine);
        if (light != SIZE_MAX) light_add(gltf, &light_item, affine);
    }
    gltf->is_optional = false;
}

static bool gltf_node_add(Gltf *gltf, size_t index, const Affine *parent, unsigned depth)
{
    const GltfItem node = gltf_entry(gltf, "nodes", index), children = gltf_array(gltf, &node, "children"),
                   skin = gltf_member(&node, "skin");
    if (gltf->is_visited[index])
        return gltf_fails(gltf, &node,
                          "is reached twice; a node may have one parent and must not contain itself");
    if (depth > DEPTH_MAX) return gltf_fails(gltf, &node, "lies more than %d nodes deep", DEPTH_MAX);
    gltf->is_visited[index] = true;
    Affine local, affine;
    if (!transform_read(gltf, &node, &local)) return false;
    affine = affine_multiply(parent, &local);
    if (skin.json) gltf_warn_once(gltf, &skin, draft_skins);
    gltf_view_add(gltf, &node, &affine);
    size_t mesh_index = SIZE_MAX;
    if (!gltf_index(gltf, &node, "mesh", "meshes", &mesh_index)) return false;
    const GltfItem mesh = gltf_entry(gltf, "meshes", mesh_index),
                   primitives = gltf_array(gltf, &mesh, "primitives");
    for (size_t i = 0; i < json_array_size(primitives.json); i++) {
        const GltfItem primitive = gltf_element(gltf, &primitives, i);
        if (!gltf_primitive_add(gltf, &primitive, &affine)) return false;
    }
    for (size_t i = 0; i < json_array_size(children.json); i++) {
        size_t child;
        if (!gltf_element_index(gltf, &children, i, "nodes", &child) ||
            !gltf_node_add(gltf, child, &affine, depth + 1))
            return false;
    }
    return true;
}

// Adds all root nodes of a file that has no scenes.
static bool roots_add(Gltf *gltf, const Affine *affine)
{
    const size_t count = gltf_count(gltf, "nodes");
    OWNED bool *is_child = memory_allocate_zeroed(count, sizeof *is_child);
    for (size_t i = 0; i < count; i++) {
        const GltfItem node = gltf_entry(gltf, "nodes", i), children = gltf_array(gltf, &node, "children");
        for (size_t k = 0; k < json_array_size(children.json); k++) {
            size_t child;
            if (!gltf_element_index(gltf, &children, k, "nodes", &child)) return false;
            is_child[child] = true;
        }
    }
    for (size_t i = 0; i < count; i++)
        if (!is_child[i] && !gltf_node_add(gltf, i, affine, 0)) return false;
    return true;
}

bool gltf_scene_read(Gltf *gltf)
{
    const GltfItem root = gltf_root(gltf);
    const size_t count = gltf_count(gltf, "scenes");
    size_t index = 0;
    if (count == 0) {
        if (!roots_add(gltf, &affine_identity)) return false;
    } else {
        if (!gltf_index(gltf, &root, "scene", "scenes", &index)) return false;
        const GltfItem scene = gltf_entry(gltf, "scenes", index), nodes = gltf_array(gltf, &scene, "nodes");
        if (count > 1) gltf_warn_once(gltf, &scene, "only this scene is shown");
        for (size_t i = 0; i < json_array_size(nodes.json); i++) {
            size_t node;
            if (!gltf_element_index(gltf, &nodes, i, "nodes", &node) ||
                !gltf_node_add(gltf, node, &affine_identity, 0))
                return false;
        }
    }
    draft_fill_parts(gltf->draft);
    return true;
}
