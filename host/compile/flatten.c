#include "host/compile/flatten.h"

#include "host/base/fault.h"
#include "host/compile/camera_basis.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

// clang-format off
// Of a struct whose uint4 members are those from `first` to `last`, and of one that has none.
#define LAYOUT(Type, first, last)                           \
    {sizeof(Type), offsetof(Type, first) / sizeof(scalar4), \
     (offsetof(Type, last) + sizeof((Type *)0)->last - offsetof(Type, first)) / sizeof(uint4)}
#define LAYOUT_OF_REALS(Type) {sizeof(Type), sizeof(Type) / sizeof(scalar4), 0}

static const FlatLayout layouts[FLAT_COUNT] = {
    [FLAT_HEADER] = LAYOUT(SceneHeader, picture, bounded_counts),
#define SHAPE_LAYOUT(feature, Type, name, names) [FLAT_FIRST_SHAPE + KIND_##feature] = LAYOUT(Type, id, id),
    SHAPE_LIST(SHAPE_LAYOUT)
    [FLAT_TRIANGLE_NORMALS] = LAYOUT_OF_REALS(TriangleNormals),
    [FLAT_TRIANGLE_UVS] = LAYOUT_OF_REALS(TriangleUvs),
    // as the widest; hierarchy.c makes them as wide as the kernel wants them
    [FLAT_NODES] = {BVH_WIDTH_LARGEST / 4 * (BVH_PLANES * sizeof(scalar4) + 2 * sizeof(uint4)),
                    BVH_WIDTH_LARGEST / 4 * BVH_PLANES, BVH_WIDTH_LARGEST / 4 * 2},
    [FLAT_CULL_SPHERES] = LAYOUT_OF_REALS(CullSphere),
    [FLAT_OBJECTS] = LAYOUT(ObjectEntry, kind_index_material, kind_index_material),
    [FLAT_MATERIALS] = LAYOUT(FlatMaterial, optical_depth, image),
    [FLAT_LIGHTS] = LAYOUT(FlatLight, kind, kind),
    [FLAT_TEXTURE_LEVELS] = LAYOUT(TextureLevel, place, place),
    [FLAT_TEXELS] = LAYOUT(Texel, color, color),
};
// clang-format on

static const int kind_of_shape[SHAPE_COUNT] = {
    [SHAPE_SPHERE] = KIND_SPHERES,     [SHAPE_PLANE] = KIND_PLANES,       [SHAPE_DISC] = KIND_DISCS,
    [SHAPE_BOX] = KIND_BOXES,          [SHAPE_CYLINDER] = KIND_CYLINDERS, [SHAPE_CONE] = KIND_CONES,
    [SHAPE_TRIANGLE] = KIND_TRIANGLES, [SHAPE_TORUS] = KIND_TORI,         [SHAPE_MESH] = KIND_TRIANGLES,
};

// What flattening one object needs to know.
typedef struct {
    Vector3 eye;
    bool wide;
} Rounding;

// The volatile keeps the rounding: gcc 12 at -O2 loses a conversion to float and back where stores are
// merged.
static double rounded(const Rounding *rounding, double value)
{
    if (rounding->wide) return value;
    volatile float narrow = (float)value;
    return narrow;
}

static Vector3 vector_rounded(const Rounding *rounding, Vector3 v)
{
    return (Vector3){rounded(rounding, v.x), rounded(rounding, v.y), rounded(rounding, v.z)};
}

static Vector3 point_from_eye(const Rounding *rounding, Vector3 point)
{
    return vector_rounded(rounding, vector_subtract(point, rounding->eye));
}

static scalar4 scalar4_of(Vector3 v, double w)
{
    return (scalar4){v.x, v.y, v.z, w};
}

// The same direction, scaled by a power of two so that its largest component lies in 1/2..1: exact.
static Vector3 axis_scaled(Vector3 axis)
{
    int exponent;
    frexp(vector_largest(axis), &exponent);
    return (Vector3){ldexp(axis.x, -exponent), ldexp(axis.y, -exponent), ldexp(axis.z, -exponent)};
}

// A plane's normal, of any length, and one over that length.
static scalar4 plane_normal(const Rounding *rounding, Vector3 normal)
{
    Vector3 scaled = vector_rounded(rounding, axis_scaled(normal));
    return scalar4_of(scaled, 1 / vector_length(scaled));
}

// The first axis of the squares on a plane: the world axis least aligned with the normal, laid into the
// plane.
static Vector3 grid_axis(Vector3 unit_normal)
{
    Vector3 axis = vector_least_aligned_axis(unit_normal);
    Vector3 across = vector_subtract(axis, vector_scale(unit_normal, vector_dot(axis, unit_normal)));
    return vector_normalize(across);
}

// Squares along one direction: how many per unit, and where the eye stands among them. A whole number of
// pairs is left out, which keeps the bits far from the origin.
static scalar4 grid_of(const Rounding *rounding, Vector3 direction, double size)
{
    double phase = fmod(vector_dot(rounding->eye, direction) / size, 2);
    return scalar4_of(vector_scale(direction, 1 / size), phase);
}

static void grid_flatten(const Rounding *rounding, Vector3 normal, const Material *material, scalar4 *u,
                         scalar4 *v)
{
    if (!material->checker) return;
    Vector3 unit = vector_normalize(normal);
    Vector3 across = grid_axis(unit);
    *u = grid_of(rounding, across, material->checker_size);
    *v = grid_of(rounding, vector_cross(unit, across), material->checker_size);
}

static Revolution revolution_flatten(const Rounding *rounding, Vector3 from, Vector3 whole_axis,
                                     double radius_from, double radius_to, double endless_slope, bool finite,
                                     bool caps)
{
    Vector3 base = point_from_eye(rounding, from);
    Vector3 axis = whole_axis;
    if (finite) axis = vector_subtract(point_from_eye(rounding, vector_add(from, whole_axis)), base);
    Vector3 scaled = vector_rounded(rounding, axis_scaled(axis));
    double length = vector_length(scaled);
    double radius = rounded(rounding, radius_from);
    double slope = finite ? (rounded(rounding, radius_to) - radius) / vector_length(axis) : endless_slope;
    return (Revolution){
        .base_radius = scalar4_of(base, radius * length),
        .axis_slope = scalar4_of(scaled, slope),
        .range = {finite ? vector_dot(axis, scaled) : 0, length, vector_dot(scaled, scaled), 0},
        .id.y = (finite ? REVOLUTION_FINITE : 0u) | (finite && caps ? REVOLUTION_CAPPED : 0u),
    };
}

// a b - c d to 1.5 ulp (Kahan's; Jeannerod, Louvet, Muller, Further analysis of Kahan's algorithm for the
// accurate computation of 2x2 determinants, Mathematics of Computation 82, 2013).
static double product_difference(double a, double b, double c, double d)
{
    double cd = c * d;
    return fma(a, b, -cd) + fma(-c, d, cd);
}

static Vector3 cross_product(Vector3 a, Vector3 b)
{
    return (Vector3){product_difference(a.y, b.z, a.z, b.y), product_difference(a.z, b.x, a.x, b.z),
                     product_difference(a.x, b.y, a.y, b.x)};
}

static bool has_area(Vector3 a, Vector3 b, Vector3 c)
{
    return !vector_is_zero(vector_cross(vector_subtract(b, a), vector_subtract(c, a)));
}

// One without area shrinks to a point, which no ray meets: the kernels turn vertices, and what was a line
// could then have an area. One that loses its area in rounding stays: it fills what its neighbors have left
// open.
static Triangle corners_flatten(const Rounding *rounding, Vector3 a, Vector3 b, Vector3 c)
{
    if (!has_area(a, b, c)) b = c = a;
    Vector3 seen_a = point_from_eye(rounding, a), seen_b = point_from_eye(rounding, b),
            seen_c = point_from_eye(rounding, c);
    Vector3 ab = vector_subtract(seen_b, seen_a), ac = vector_subtract(seen_c, seen_a);
    if (rounding->wide) { // what a float can be has products that double can hold
        ab = axis_scaled(ab);
        ac = axis_scaled(ac);
    }
    Vector3 normal = vector_rounded(rounding, axis_scaled(cross_product(ab, ac)));
    return (Triangle){
        scalar4_of(seen_a, normal.x), scalar4_of(seen_b, normal.y), scalar4_of(seen_c, normal.z), {0}};
}

static Sphere sphere_flatten(const Rounding *rounding, const Object *object)
{
    return (Sphere){
        .center_radius =
            scalar4_of(point_from_eye(rounding, object->as.sphere.center), object->as.sphere.radius),
        .id.y = object->as.sphere.only_inside ? ONLY_INSIDE : 0u,
    };
}

static Plane plane_flatten(const Rounding *rounding, const Object *object, const Material *material)
{
    const Vector3 normal = object->as.plane.normal;
    Plane plane = {.point = scalar4_of(point_from_eye(rounding, object->as.plane.point), 0),
                   .normal = plane_normal(rounding, normal)};
    grid_flatten(rounding, normal, material, &plane.grid_u, &plane.grid_v);
    return plane;
}

static Disc disc_flatten(const Rounding *rounding, const Object *object, const Material *material)
{
    const Vector3 normal = object->as.disc.normal;
    Disc disc = {.center_radius =
                     scalar4_of(point_from_eye(rounding, object->as.disc.center), object->as.disc.radius),
                 .normal = plane_normal(rounding, normal)};
    grid_flatten(rounding, normal, material, &disc.grid_u, &disc.grid_v);
    return disc;
}

static Box box_flatten(const Rounding *rounding, const Object *object)
{
    return (Box){.low = scalar4_of(point_from_eye(rounding, object->as.box.min), 0),
                 .high = scalar4_of(point_from_eye(rounding, object->as.box.max), 0)};
}

static Cylinder cylinder_flatten(const Rounding *rounding, const Object *object)
{
    const double radius = object->as.cylinder.radius;
    Cylinder cylinder =
        revolution_flatten(rounding, object->as.cylinder.from, object->as.cylinder.axis, radius, radius, 0,
                           object->as.cylinder.finite, object->as.cylinder.caps);
    if (object->as.cylinder.only_inside) cylinder.id.y |= ONLY_INSIDE;
    return cylinder;
}

static Cone cone_flatten(const Rounding *rounding, const Object *object)
{
    const bool finite = object->as.cone.finite;
    const double *radius = object->as.cone.radius;
    Cone cone =
        revolution_flatten(rounding, object->as.cone.from, object->as.cone.axis, finite ? radius[0] : 0,
                           radius[1], object->as.cone.slope, finite, object->as.cone.caps);
    if (object->as.cone.only_inside) cone.id.y |= ONLY_INSIDE;
    return cone;
}

static Triangle triangle_flatten(const Rounding *rounding, const Object *object)
{
    const Vector3 *vertices = object->as.triangle.vertices;
    return corners_flatten(rounding, vertices[0], vertices[1], vertices[2]);
}

static Torus torus_flatten(const Rounding *rounding, const Object *object)
{
    return (Torus){
        .center_major = scalar4_of(point_from_eye(rounding, object->as.torus.center), object->as.torus.major),
        .axis_minor = scalar4_of(vector_normalize(object->as.torus.axis), object->as.torus.minor),
    };
}

static void object_flatten(const Rounding *rounding, const Object *object, const Material *material,
                           void *target)
{
    switch (object->kind) {
    case SHAPE_SPHERE:
        *(Sphere *)target = sphere_flatten(rounding, object);
        break;
    case SHAPE_PLANE:
        *(Plane *)target = plane_flatten(rounding, object, material);
        break;
    case SHAPE_DISC:
        *(Disc *)target = disc_flatten(rounding, object, material);
        break;
    case SHAPE_BOX:
        *(Box *)target = box_flatten(rounding, object);
        break;
    case SHAPE_CYLINDER:
        *(Cylinder *)target = cylinder_flatten(rounding, object);
        break;
    case SHAPE_CONE:
        *(Cone *)target = cone_flatten(rounding, object);
        break;
    case SHAPE_TRIANGLE:
        *(Triangle *)target = triangle_flatten(rounding, object);
        break;
    case SHAPE_TORUS:
        *(Torus *)target = torus_flatten(rounding, object);
        break;
    case SHAPE_MESH:
    case SHAPE_COUNT:
        break;
    }
}

static FlatArray array_make(FlatLayout layout, size_t count)
{
    size_t size = count * layout.size;
    FlatArray array = {aligned_alloc(64, (size + 127) / 64 * 64), count, layout};
    if (!array.items) fault("out of memory for %zu flat structs", count);
    memset(array.items, 0, size);
    return array;
}

FlatArray flat_array_make(size_t kind, size_t count)
{
    return array_make(layouts[kind], count);
}

FlatArray flat_nodes_make(size_t count, unsigned width)
{
    const FlatLayout widest = layouts[FLAT_NODES];
    const unsigned parts = BVH_WIDTH_LARGEST / width;
    return array_make(
        (FlatLayout){widest.size / parts, widest.scalar4_count / parts, widest.uint4_count / parts}, count);
}

void *flat_array_at(const FlatArray *array, size_t index)
{
    return (char *)array->items + index * array->layout.size;
}

// A shape's struct has its id in its first uint4, right behind its scalar4 members.
static uint32_t *flat_id_at(const FlatArray *array, size_t index)
{
    size_t offset = array->layout.scalar4_count * sizeof(scalar4);
    return (uint32_t *)(void *)((char *)flat_array_at(array, index) + offset);
}

uint32_t flat_id(const FlatArray *array, size_t index)
{
    return *flat_id_at(array, index);
}

// The arrays of shapes on their way.
typedef struct {
    CompiledScene *flat;
    const Scene *scene;
    const Rounding *rounding;
    size_t counts[KIND_COUNT], normals_count, primitive_count; // so far
} Filling;

// Where the next primitive of a kind goes. It gets its id by primitive_end.
static void *primitive_begin(const Filling *filling, int kind)
{
    return flat_array_at(&filling->flat->arrays[FLAT_FIRST_SHAPE + kind], filling->counts[kind]);
}

static void primitive_end(Filling *filling, int kind, uint32_t material)
{
    uint32_t id = (uint32_t)filling->primitive_count++, index = (uint32_t)filling->counts[kind]++;
    *flat_id_at(&filling->flat->arrays[FLAT_FIRST_SHAPE + kind], index) = id;
    ObjectEntry *entries = filling->flat->arrays[FLAT_OBJECTS].items;
    entries[id].kind_index_material = (uint4){(uint32_t)kind, index, material, 0};
}

// What a triangle's id.y holds; a triangle with a vertex without a normal is flat.
static uint32_t normals_flatten(Filling *filling, Vector3 a, Vector3 b, Vector3 c)
{
    if (vector_is_zero(a) || vector_is_zero(b) || vector_is_zero(c)) return 0;
    TriangleNormals *normals = filling->flat->arrays[FLAT_TRIANGLE_NORMALS].items;
    normals[filling->normals_count++] =
        (TriangleNormals){scalar4_of(a, 0), scalar4_of(b, 0), scalar4_of(c, 0)};
    return (uint32_t)filling->normals_count;
}

static void mesh_flatten(Filling *filling, const Object *object)
{
    const Mesh *mesh = &filling->scene->meshes.items[object->as.mesh.index];
    const Vector3 *vertices = mesh->vertices, *normals = mesh->normals;
    for (size_t i = 0; i < mesh->triangle_count; i++) {
        const uint32_t *corners = mesh->triangles[i];
        Triangle *triangle = primitive_begin(filling, KIND_TRIANGLES);
        *triangle = corners_flatten(filling->rounding, vertices[corners[0]], vertices[corners[1]],
                                    vertices[corners[2]]);
        if (normals)
            triangle->id.y =
                normals_flatten(filling, normals[corners[0]], normals[corners[1]], normals[corners[2]]);
        primitive_end(filling, KIND_TRIANGLES, mesh->materials ? mesh->materials[i] : object->material);
    }
}

static void arrays_make(CompiledScene *flat, const Scene *scene)
{
    size_t counts[KIND_COUNT] = {0}, normals_count = 0;
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        size_t count = object_primitive_count(scene, object);
        counts[kind_of_shape[object->kind]] += count;
        bool smooth = object->kind == SHAPE_MESH
                          ? scene->meshes.items[object->as.mesh.index].normals != NULL
                          : object->kind == SHAPE_TRIANGLE && object->as.triangle.smooth;
        if (smooth) normals_count += count;
    }
    for (size_t kind = 0; kind < KIND_COUNT; kind++)
        flat->arrays[FLAT_FIRST_SHAPE + kind] = flat_array_make(FLAT_FIRST_SHAPE + kind, counts[kind]);
    flat->arrays[FLAT_TRIANGLE_NORMALS] = flat_array_make(FLAT_TRIANGLE_NORMALS, normals_count);
    flat->arrays[FLAT_OBJECTS] = flat_array_make(FLAT_OBJECTS, scene_primitive_count(scene));
}

static void objects_flatten(CompiledScene *flat, const Scene *scene, const Rounding *rounding)
{
    arrays_make(flat, scene);
    Filling filling = {.flat = flat, .scene = scene, .rounding = rounding};
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (object->kind == SHAPE_MESH) {
            mesh_flatten(&filling, object);
            continue;
        }
        int kind = kind_of_shape[object->kind];
        void *primitive = primitive_begin(&filling, kind);
        object_flatten(rounding, object, &scene->materials.items[object->material], primitive);
        if (object->kind == SHAPE_TRIANGLE && object->as.triangle.smooth) {
            const Vector3 *normals = object->as.triangle.normals;
            ((Triangle *)primitive)->id.y =
                normals_flatten(&filling, vector_normalize(normals[0]), vector_normalize(normals[1]),
                                vector_normalize(normals[2]));
        }
        primitive_end(&filling, kind, object->material);
    }
    flat->arrays[FLAT_TRIANGLE_NORMALS].count = filling.normals_count;
}

static uint4 optical_depth_of(double transmission)
{
    double log2_loss = transmission > 0 ? -log2(transmission) : INFINITY;
    if (log2_loss >= 127) return (uint4){OPAQUE, 0, 0, 0};
    uint64_t fine = (uint64_t)llround(ldexp(log2_loss, 48));
    return (uint4){(uint32_t)llround(ldexp(log2_loss, 24)), (uint32_t)fine, (uint32_t)(fine >> 32), 0};
}

static void materials_flatten(CompiledScene *flat, const Scene *scene, const Rounding *rounding)
{
    flat->arrays[FLAT_MATERIALS] = flat_array_make(FLAT_MATERIALS, scene->materials.count);
    FlatMaterial *materials = flat->arrays[FLAT_MATERIALS].items;
    for (size_t i = 0; i < scene->materials.count; i++) {
        const Material *material = &scene->materials.items[i];
        double size = material->checker_size;
        Vector3 eye = rounding->eye;
        materials[i] = (FlatMaterial){
            .color = scalar4_of(material->checker ? material->checker_colors[0] : material->color,
                                material->ambient),
            .diffuse = scalar4_of(material->diffuse, material->specular),
            .other_color = scalar4_of(material->checker_colors[1], material->shininess),
            .reflection_transmission_ior = {material->reflection, material->transmission, material->ior, 0},
            .optical_depth = optical_depth_of(material->full_shadow ? 0 : material->transmission),
        };
        if (material->checker)
            materials[i].grid =
                (scalar4){fmod(eye.x / size, 2), fmod(eye.y / size, 2), fmod(eye.z / size, 2), 1 / size};
    }
}

// 1 - cos of an angle in degrees, without cancellation.
static double versine(double degrees)
{
    double half = sin(degrees * (M_PI / 360));
    return 2 * half * half;
}

static void lights_flatten(CompiledScene *flat, const Scene *scene, const Rounding *rounding)
{
    static const uint32_t kinds[] = {
        [LIGHT_POINT] = LIGHT_KIND_POINT,
        [LIGHT_DIRECTIONAL] = LIGHT_KIND_DIRECTIONAL,
        [LIGHT_SPOT] = LIGHT_KIND_SPOT,
    };
    flat->arrays[FLAT_LIGHTS] = flat_array_make(FLAT_LIGHTS, scene->lights.count);
    FlatLight *lights = flat->arrays[FLAT_LIGHTS].items;
    for (size_t i = 0; i < scene->lights.count; i++) {
        const Light *light = &scene->lights.items[i];
        lights[i] = (FlatLight){.color = scalar4_of(light->color, 0), .kind.x = kinds[light->kind]};
        if (light->kind != LIGHT_DIRECTIONAL)
            lights[i].position = scalar4_of(point_from_eye(rounding, light->position), 0);
        if (light->kind != LIGHT_POINT)
            lights[i].direction = scalar4_of(vector_normalize(light->direction), 0);
        if (light->kind == LIGHT_SPOT) {
            double outer = versine(light->angle), inner = versine(light->angle - light->penumbra);
            lights[i].cone = (scalar4){outer, inner, outer > inner ? 1 / (outer - inner) : 0, 0};
        }
    }
}

static void header_flatten(CompiledScene *flat, const Scene *scene, const FlattenSettings *settings)
{
    flat->arrays[FLAT_HEADER] = flat_array_make(FLAT_HEADER, 1);
    SceneHeader *header = flat->arrays[FLAT_HEADER].items;
    CameraBasis basis = camera_basis(&scene->camera, settings->width, settings->height);
    *header = (SceneHeader){
        .background = scalar4_of(scene->background, 0),
        .ambient = scalar4_of(scene->ambient, 0),
        .forward = scalar4_of(basis.forward, 0),
        .right = scalar4_of(basis.right, 0),
        .up = scalar4_of(basis.up, 0),
        .bounces.x = settings->bounce_count,
        .picture = {settings->width, settings->height, settings->sample_count, (uint32_t)scene->lights.count},
    };
    uint32_t counts[4 * sizeof header->counts / sizeof *header->counts] = {0};
    _Static_assert(KIND_COUNT <= sizeof counts / sizeof *counts, "a kind without a place in SceneHeader");
    for (size_t kind = 0; kind < KIND_COUNT; kind++)
        counts[kind] = (uint32_t)flat->arrays[FLAT_FIRST_SHAPE + kind].count;
    memcpy(header->counts, counts, sizeof counts);
}

void flatten(CompiledScene *flat, const Scene *scene, const FlattenSettings *settings)
{
    *flat = (CompiledScene){0};
    Rounding rounding = {.wide = settings->wide};
    if (settings->shift_to_eye) rounding.eye = scene->camera.position;
    objects_flatten(flat, scene, &rounding);
    materials_flatten(flat, scene, &rounding);
    lights_flatten(flat, scene, &rounding);
    header_flatten(flat, scene, settings);
    flat->arrays[FLAT_NODES] = flat_array_make(FLAT_NODES, 1); // leads nowhere: a kernel may ask it
}

void compiled_scene_free(CompiledScene *flat)
{
    for (size_t kind = 0; kind < FLAT_COUNT; kind++)
        free(flat->arrays[kind].items);
    *flat = (CompiledScene){0};
}

size_t flat_array_size(const FlatArray *array, bool wide)
{
    const FlatLayout *layout = &array->layout;
    size_t size =
        wide ? layout->size : 4 * sizeof(float) * layout->scalar4_count + sizeof(uint4) * layout->uint4_count;
    return array->count * size;
}

void flat_array_write(const FlatArray *array, bool wide, void *target)
{
    const FlatLayout *layout = &array->layout;
    if (wide) {
        memcpy(target, array->items, flat_array_size(array, wide));
        return;
    }
    char *out = target;
    for (size_t i = 0; i < array->count; i++) {
        const double *numbers = flat_array_at(array, i);
        float *narrow = (float *)(void *)out;
        for (size_t k = 0; k < 4 * layout->scalar4_count; k++)
            narrow[k] = (float)numbers[k];
        out += 4 * sizeof(float) * layout->scalar4_count;
        memcpy(out, numbers + 4 * layout->scalar4_count, sizeof(uint4) * layout->uint4_count);
        out += sizeof(uint4) * layout->uint4_count;
    }
}
