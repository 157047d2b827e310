#include "packet.h"

#include <stdalign.h>

static const int valid_lane = -1; // the value that Embree expects

// Planes are intersected here, before Embree: 16 rays against one plane cost a few instructions and shorten
// tfar. This is faster than two large triangles in its BVH. Hits record plane k as geometry FIRST_PLANE + k.
enum { FIRST_PLANE = 1 << 30 };

#define VECTORS(name) float name##_x[LANES], name##_y[LANES], name##_z[LANES]

typedef struct {
    alignas(64) int found[LANES]; // valid_lane or 0
    int geometry[LANES];
    VECTORS(position);
    VECTORS(start);  // slightly off the surface, for shadow rays
    VECTORS(normal); // shading normal, unit, facing the eye
    VECTORS(to_eye); // unit
    VECTORS(diffuse);
    VECTORS(color);
    float specular[LANES], shininess[LANES];
} Surfaces;

static void camera_rays(const Renderer *renderer, unsigned left, unsigned top, const float *offset,
                        struct RTCRayHit16 *rays, int *valid)
{
    const Camera camera = *renderer->description->camera;
    const int width = (int)renderer->width, height = (int)renderer->height;
    const float scale = camera.half_tangent / (float)height;
    FOR_LANES
    {
        int column = (int)left + i % PACKET_SIDE, row = (int)top + i / PACKET_SIDE;
        float x = scale * ((float)(2 * column + 1 - width) + offset[0]);
        float y = scale * ((float)(height - 1 - 2 * row) + offset[1]);
        Vector across = vector_add(vector_scale(x, camera.right), vector_scale(y, camera.up));
        SET(rays->ray.org_, camera.eye);
        SET(rays->ray.dir_, vector_unit(vector_add(camera.forward, across)));
        SET(rays->hit.Ng_, ((Vector){0, 0, 0}));
        rays->ray.tnear[i] = rays->ray.time[i] = 0;
        rays->ray.tfar[i] = far_away;
        rays->ray.mask[i] = ~0U;
        rays->ray.flags[i] = 0;
        rays->hit.geomID[i] = rays->hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        valid[i] = column < width && row < height ? valid_lane : 0;
    }
}

// Ends the rays where they hit a plane.
static void planes_intersect(const Description *scene, struct RTCRayHit16 *rays)
{
    for (size_t k = 0; k < scene->plane_count; k++) {
        const Plane plane = scene->planes[k];
        const unsigned geometry = FIRST_PLANE + (unsigned)k;
        FOR_LANES
        {
            float height = vector_dot(plane.normal, vector_subtract(plane.point, GET(rays->ray.org_)));
            float t = height / vector_dot(plane.normal, GET(rays->ray.dir_));
            bool nearer = (t > 0) & (t < rays->ray.tfar[i]);
            rays->ray.tfar[i] = nearer ? t : rays->ray.tfar[i];
            rays->hit.geomID[i] = nearer ? geometry : rays->hit.geomID[i];
            SET(rays->hit.Ng_, nearer ? plane.normal : GET(rays->hit.Ng_));
        }
    }
}

static struct RTCRay ray_of(const struct RTCRay16 *rays, int i)
{
    return (struct RTCRay){.org_x = rays->org_x[i],
                           .org_y = rays->org_y[i],
                           .org_z = rays->org_z[i],
                           .dir_x = rays->dir_x[i],
                           .dir_y = rays->dir_y[i],
                           .dir_z = rays->dir_z[i],
                           .tfar = rays->tfar[i],
                           .mask = ~0U};
}

static void rays_intersect(const Renderer *renderer, const int *valid, struct RTCRayHit16 *rays)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = renderer->coherence;
    if (!renderer->one_by_one) {
        rtcIntersect16(valid, renderer->scene, &context, rays);
        return;
    }
    for (int i = 0; i < LANES; i++) {
        if (!valid[i]) continue;
        struct RTCRayHit one = {ray_of(&rays->ray, i),
                                {.geomID = RTC_INVALID_GEOMETRY_ID, .instID = {RTC_INVALID_GEOMETRY_ID}}};
        rtcIntersect1(renderer->scene, &context, &one);
        if (one.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
        rays->ray.tfar[i] = one.ray.tfar;
        rays->hit.geomID[i] = one.hit.geomID;
        rays->hit.primID[i] = one.hit.primID;
        rays->hit.instID[0][i] = one.hit.instID[0];
        rays->hit.u[i] = one.hit.u;
        rays->hit.v[i] = one.hit.v;
        SET(rays->hit.Ng_, ((Vector){one.hit.Ng_x, one.hit.Ng_y, one.hit.Ng_z}));
    }
}

// Sets tfar < 0 for occluded rays (Embree's convention).
static void rays_occlude(const Renderer *renderer, const int *valid, struct RTCRay16 *rays)
{
    struct RTCIntersectContext context;
    rtcInitIntersectContext(&context);
    context.flags = renderer->coherence;
    if (!renderer->one_by_one) {
        rtcOccluded16(valid, renderer->scene, &context, rays);
        return;
    }
    for (int i = 0; i < LANES; i++) {
        if (!valid[i]) continue;
        struct RTCRay one = ray_of(rays, i);
        rtcOccluded1(renderer->scene, &context, &one);
        rays->tfar[i] = one.tfar;
    }
}

// Replaces the triangles' normals at hits of a mesh with normals interpolated between its vertices.
static void mesh_smooth(const Mesh *mesh, unsigned geometry, const struct RTCHit16 *hit, const int *flip,
                        Surfaces *surfaces)
{
    const float *normals = mesh->normals;
    const int *faces = mesh->faces;
    FOR_LANES
    {
        if (hit->geomID[i] != geometry) continue;
        int face = 3 * (int)hit->primID[i];
        float u = hit->u[i], v = hit->v[i];
        Vector a = vector_scale(1 - u - v, vector_at(normals, 3 * faces[face]));
        Vector b = vector_scale(u, vector_at(normals, 3 * faces[face + 1]));
        Vector c = vector_scale(v, vector_at(normals, 3 * faces[face + 2]));
        Vector outward = vector_unit(vector_add(vector_add(a, b), c));
        SET(surfaces->normal_, vector_scale(flip[i] ? -1 : 1, outward));
    }
}

// Transforms the normals of hits on the mesh's instances from its space to the scene's and normalizes them.
static void mesh_turn(const Description *scene, size_t k, const struct RTCHit16 *hit, float *normal_x,
                      float *normal_y, float *normal_z)
{
    const Mesh *mesh = &scene->meshes[k];
    if (mesh->instance_count == 0) return;
    const unsigned geometry = mesh_geometry(scene, k), first = instance_geometry(scene, mesh, 0);
    const float *instances = mesh->instances;
    FOR_LANES
    {
        if (hit->geomID[i] != geometry) continue;
        int at = INSTANCE_PARTS * (int)(hit->instID[0][i] - first);
        Vector x = vector_scale(normal_x[i], vector_at(instances, at));
        Vector y = vector_scale(normal_y[i], vector_at(instances, at + 3));
        Vector z = vector_scale(normal_z[i], vector_at(instances, at + 6));
        SET(normal_, vector_unit(vector_add(vector_add(x, y), z)));
    }
}

// Finds the rays that hit something and the materials they hit, 0 on a miss. Returns whether any ray hits.
static bool surfaces_find(const Description *scene, const int *valid, const struct RTCHit16 *hit,
                          Surfaces *surfaces, int *material)
{
    const int *sphere_materials = scene->sphere_materials;
    FOR_LANES
    {
        surfaces->found[i] = hit->geomID[i] != RTC_INVALID_GEOMETRY_ID ? valid[i] : 0;
        surfaces->geometry[i] = (int)hit->geomID[i];
        material[i] = 0;
    }
    if (scene->sphere_count > 0) FOR_LANES
        {
            if (hit->geomID[i] == 0) material[i] = sphere_materials[(int)hit->primID[i]];
        }
    for (size_t k = 0; k < scene->mesh_count; k++) {
        const unsigned geometry = mesh_geometry(scene, k);
        const int of_mesh = scene->mesh_materials[k];
        FOR_LANES material[i] = hit->geomID[i] == geometry ? of_mesh : material[i];
    }
    for (size_t k = 0; k < scene->plane_count; k++) {
        const unsigned geometry = FIRST_PLANE + (unsigned)k;
        const int of_plane = scene->plane_materials[k];
        FOR_LANES material[i] = hit->geomID[i] == geometry ? of_plane : material[i];
    }
    return lanes_any(surfaces->found);
}

static void surfaces_place(const Description *scene, struct RTCRayHit16 *rays, Surfaces *surfaces)
{
    const struct RTCRay16 *ray = &rays->ray;
    struct RTCHit16 *hit = &rays->hit;
    for (size_t k = 0; k < scene->mesh_count; k++)
        mesh_turn(scene, k, hit, hit->Ng_x, hit->Ng_y, hit->Ng_z);
    const Vector eye = scene->camera->eye;
    alignas(64) int flip[LANES];
    FOR_LANES
    {
        // Shadow rays start some rounding errors of a coordinate off the surface, so that it does not shade
        // itself.
        const float roundings = 0x1p-18F;
        float t = ray->tfar[i];
        float off = roundings * fmaxf(t, fmaxf(fabsf(eye.x), fmaxf(fabsf(eye.y), fabsf(eye.z))));
        flip[i] = vector_dot(GET(hit->Ng_), GET(ray->dir_)) > 0;
        Vector facing = vector_scale(flip[i] ? -1 : 1, vector_unit(GET(hit->Ng_)));
        Vector position = vector_add(GET(ray->org_), vector_scale(t, GET(ray->dir_)));
        SET(surfaces->position_, position);
        SET(surfaces->start_, vector_add(position, vector_scale(off, facing)));
        SET(surfaces->normal_, facing);
        SET(surfaces->to_eye_, vector_scale(-1, GET(ray->dir_)));
    }
    for (size_t k = 0; k < scene->mesh_count; k++) {
        if (scene->meshes[k].normal_count == 0) continue;
        mesh_smooth(&scene->meshes[k], mesh_geometry(scene, k), hit, flip, surfaces);
        mesh_turn(scene, k, hit, surfaces->normal_x, surfaces->normal_y, surfaces->normal_z);
    }
}

// Returns whether all lanes have one material, as most packets do; gathers from tables are then avoided.
static bool all_equal(const int *numbers)
{
    int different = 0;
    for (int i = 0; i < LANES; i++)
        different |= numbers[i] ^ numbers[0];
    return different == 0;
}

static inline __attribute__((always_inline)) void
materials_read(const Description *scene, const int *material, bool is_one, Surfaces *surfaces)
{
    const float *table = scene->materials;
    const Vector background = scene->camera->background;
    FOR_LANES
    {
        const int entry = MATERIAL_PARTS * material[is_one ? 0 : i];
        Vector ambient = vector_at(table, entry + MATERIAL_AMBIENT);
        SET(surfaces->color_, surfaces->found[i] ? ambient : background);
        SET(surfaces->diffuse_, vector_at(table, entry + MATERIAL_DIFFUSE));
        surfaces->specular[i] = table[entry + MATERIAL_SPECULAR];
        surfaces->shininess[i] = table[entry + MATERIAL_SHININESS];
    }
}

// Clears the lanes of `lit` for which a plane lies between the surface and the light.
static void planes_occlude(const Description *scene, const Surfaces *surfaces, const Light *light, int *lit)
{
    for (size_t k = 0; k < scene->plane_count; k++) {
        const Plane plane = scene->planes[k];
        const int geometry = FIRST_PLANE + (int)k;
        const Vector to_light = vector_subtract(light->position, vector_scale(light->nearness, plane.point));
        const float light_height = vector_dot(plane.normal, to_light);
        FOR_LANES
        {
            float height = vector_dot(plane.normal, vector_subtract(GET(surfaces->start_), plane.point));
            bool between = (surfaces->geometry[i] != geometry) & (height * light_height < 0);
            lit[i] = between ? 0 : lit[i];
        }
    }
}

static void light_add(const Renderer *renderer, const Light *light, Surfaces *surfaces)
{
    const Vector place = light->position, color = light->color;
    const float nearness = light->nearness;
    alignas(64) int lit[LANES];
    alignas(64) float facing[LANES];
    struct RTCRay16 shadow;
    FOR_LANES
    {
        Vector to_light = vector_subtract(place, vector_scale(nearness, GET(surfaces->position_)));
        float squared = vector_dot(to_light, to_light), inverse_length = 1 / sqrtf(squared);
        SET(shadow.org_, GET(surfaces->start_));
        SET(shadow.dir_, vector_scale(inverse_length, to_light));
        shadow.tnear[i] = shadow.time[i] = 0;
        shadow.tfar[i] = nearness > 0 ? squared * inverse_length : far_away;
        shadow.mask[i] = ~0U;
        shadow.flags[i] = 0;
        facing[i] = vector_dot(GET(surfaces->normal_), GET(shadow.dir_));
        lit[i] = facing[i] > 0 ? surfaces->found[i] : 0;
    }
    planes_occlude(renderer->description, surfaces, light, lit);
    if (!lanes_any(lit)) return;
    rays_occlude(renderer, lit, &shadow);

    alignas(64) int shiny[LANES];
    alignas(64) float highlight[LANES];
    FOR_LANES
    {
        lit[i] = shadow.tfar[i] < 0 ? 0 : lit[i];
        highlight[i] = 0;
        shiny[i] = surfaces->specular[i] > 0 ? lit[i] : 0;
    }
    if (lanes_any(shiny)) FOR_LANES
        {
            Vector mirrored = vector_scale(2 * facing[i], GET(surfaces->normal_));
            float cosine = vector_dot(vector_subtract(mirrored, GET(shadow.dir_)), GET(surfaces->to_eye_));
            float exponent = surfaces->shininess[i] * log2f(fmaxf(cosine, 1e-20F));
            highlight[i] =
                surfaces->specular[i] * exp2f(fmaxf(exponent, -100)); // powers that underflow are slow
        }
    FOR_LANES
    {
        float diffuse = lit[i] ? facing[i] : 0, specular = lit[i] ? highlight[i] : 0;
        Vector part = vector_scale(diffuse, GET(surfaces->diffuse_));
        Vector light_part = {color.x * (part.x + specular), color.y * (part.y + specular),
                             color.z * (part.z + specular)};
        SET(surfaces->color_, vector_add(GET(surfaces->color_), light_part));
    }
}

void packet_render(const Renderer *renderer, unsigned left, unsigned top)
{
    const Description *scene = renderer->description;
    const float weight = 1 / (float)renderer->samples;
    alignas(64) float sum_x[LANES] = {0}, sum_y[LANES] = {0}, sum_z[LANES] = {0};
    for (size_t sample = 0; sample < renderer->samples; sample++) {
        struct RTCRayHit16 rays;
        Surfaces surfaces;
        alignas(64) int valid[LANES], material[LANES];
        camera_rays(renderer, left, top, renderer->offsets + 2 * sample, &rays, valid);
        planes_intersect(scene, &rays);
        rays_intersect(renderer, valid, &rays);
        bool any = surfaces_find(scene, valid, &rays.hit, &surfaces, material);
        if (all_equal(material))
            materials_read(scene, material, true, &surfaces);
        else
            materials_read(scene, material, false, &surfaces);
        if (any) {
            surfaces_place(scene, &rays, &surfaces);
            for (size_t i = 0; i < scene->light_count; i++)
                light_add(renderer, &scene->lights[i], &surfaces);
        }
        FOR_LANES SET(sum_, vector_add(GET(sum_), vector_scale(weight, GET(surfaces.color_))));
    }
    for (unsigned i = 0; i < LANES; i++) {
        unsigned x = left + i % PACKET_SIDE, y = top + i / PACKET_SIDE;
        if (x >= renderer->width || y >= renderer->height) continue;
        float *pixel = renderer->film + 3 * ((size_t)y * renderer->width + x);
        pixel[0] = sum_x[i];
        pixel[1] = sum_y[i];
        pixel[2] = sum_z[i];
    }
}
