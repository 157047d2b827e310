#include "packet.h"

#include <math.h>
#include <stdalign.h>
#include <string.h>

static const int valid_lane = -1; // the value that Embree expects

// Planes are intersected here, before Embree: 16 rays against one plane cost a few instructions and shorten
// tfar. This is faster than two large triangles in its BVH. Hits record plane k as geometry FIRST_PLANE + k.
enum { FIRST_PLANE = 1 << 30 };

typedef struct {
    alignas(64) float x[LANES];
    float y[LANES], z[LANES];
} Vectors;

typedef struct {
    alignas(64) int found[LANES]; // valid_lane or 0
    int geometry[LANES];
    Vectors position, start; // `start` is slightly off the surface, for shadow rays
    Vectors normal;          // shading normal, unit, facing the eye
    Vectors to_eye;          // unit
    Vectors diffuse, color;
    float specular[LANES], shininess[LANES];
} Surfaces;

static void camera_rays(const Renderer *renderer, unsigned left, unsigned top, const float *offset,
                        struct RTCRayHit16 *rays, int *valid)
{
    const Camera *camera = &renderer->description->camera;
    const int width = (int)renderer->width, height = (int)renderer->height;
    const float scale = camera->half_tangent / (float)height;
    FOR_LANES
    {
        int column = (int)left + i % PACKET_SIDE, row = (int)top + i / PACKET_SIDE;
        float x = scale * ((float)(2 * column + 1 - width) + offset[0]);
        float y = scale * ((float)(height - 1 - 2 * row) + offset[1]);
        float direction_x = camera->forward.x + x * camera->right.x + y * camera->up.x;
        float direction_y = camera->forward.y + x * camera->right.y + y * camera->up.y;
        float direction_z = camera->forward.z + x * camera->right.z + y * camera->up.z;
        float inverse_length =
            1 / sqrtf(direction_x * direction_x + direction_y * direction_y + direction_z * direction_z);
        rays->ray.org_x[i] = camera->eye.x;
        rays->ray.org_y[i] = camera->eye.y;
        rays->ray.org_z[i] = camera->eye.z;
        rays->ray.dir_x[i] = inverse_length * direction_x;
        rays->ray.dir_y[i] = inverse_length * direction_y;
        rays->ray.dir_z[i] = inverse_length * direction_z;
        rays->ray.tnear[i] = 0;
        rays->ray.tfar[i] = far_away;
        rays->ray.time[i] = 0;
        rays->ray.mask[i] = ~0U;
        rays->ray.flags[i] = 0;
        rays->hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
        rays->hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
        rays->hit.Ng_x[i] = rays->hit.Ng_y[i] = rays->hit.Ng_z[i] = 0;
        valid[i] = column < width && row < height ? valid_lane : 0;
    }
}

// Ends the rays where they hit a plane.
static void planes_intersect(const Description *scene, struct RTCRayHit16 *rays)
{
    for (size_t k = 0; k < scene->plane_count; k++) {
        const Vector point = scene->planes[k].point, normal = scene->planes[k].normal;
        const unsigned geometry = FIRST_PLANE + (unsigned)k;
        FOR_LANES
        {
            float height = normal.x * (point.x - rays->ray.org_x[i]) +
                           normal.y * (point.y - rays->ray.org_y[i]) +
                           normal.z * (point.z - rays->ray.org_z[i]);
            float along =
                normal.x * rays->ray.dir_x[i] + normal.y * rays->ray.dir_y[i] + normal.z * rays->ray.dir_z[i];
            float t = height / along;
            bool nearer = (t > 0) & (t < rays->ray.tfar[i]);
            rays->ray.tfar[i] = nearer ? t : rays->ray.tfar[i];
            rays->hit.geomID[i] = nearer ? geometry : rays->hit.geomID[i];
            rays->hit.Ng_x[i] = nearer ? normal.x : rays->hit.Ng_x[i];
            rays->hit.Ng_y[i] = nearer ? normal.y : rays->hit.Ng_y[i];
            rays->hit.Ng_z[i] = nearer ? normal.z : rays->hit.Ng_z[i];
        }
    }
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
        struct RTCRayHit one = {
            .ray = {.org_x = rays->ray.org_x[i],
                    .org_y = rays->ray.org_y[i],
                    .org_z = rays->ray.org_z[i],
                    .dir_x = rays->ray.dir_x[i],
                    .dir_y = rays->ray.dir_y[i],
                    .dir_z = rays->ray.dir_z[i],
                    .tfar = rays->ray.tfar[i],
                    .mask = ~0U},
            .hit = {.geomID = RTC_INVALID_GEOMETRY_ID, .instID = {RTC_INVALID_GEOMETRY_ID}}};
        rtcIntersect1(renderer->scene, &context, &one);
        if (one.hit.geomID == RTC_INVALID_GEOMETRY_ID) continue;
        rays->ray.tfar[i] = one.ray.tfar;
        rays->hit.geomID[i] = one.hit.geomID;
        rays->hit.primID[i] = one.hit.primID;
        rays->hit.instID[0][i] = one.hit.instID[0];
        rays->hit.u[i] = one.hit.u;
        rays->hit.v[i] = one.hit.v;
        rays->hit.Ng_x[i] = one.hit.Ng_x;
        rays->hit.Ng_y[i] = one.hit.Ng_y;
        rays->hit.Ng_z[i] = one.hit.Ng_z;
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
        struct RTCRay one = {.org_x = rays->org_x[i],
                             .org_y = rays->org_y[i],
                             .org_z = rays->org_z[i],
                             .dir_x = rays->dir_x[i],
                             .dir_y = rays->dir_y[i],
                             .dir_z = rays->dir_z[i],
                             .tfar = rays->tfar[i],
                             .mask = ~0U};
        rtcOccluded1(renderer->scene, &context, &one);
        rays->tfar[i] = one.tfar;
    }
}

// Replaces the triangles' normals at hits of a mesh with normals interpolated between its vertices.
static void mesh_smooth(const Mesh *mesh, unsigned geometry, const struct RTCHit16 *hit, const int *flip,
                        Vectors *normal)
{
    const float *normals = mesh->normals;
    const int *faces = mesh->faces;
    FOR_LANES
    {
        if (hit->geomID[i] != geometry) continue;
        int face = 3 * (int)hit->primID[i];
        int a = 3 * faces[face], b = 3 * faces[face + 1], c = 3 * faces[face + 2];
        float u = hit->u[i], v = hit->v[i], w = 1 - u - v;
        float x = w * normals[a] + u * normals[b] + v * normals[c];
        float y = w * normals[a + 1] + u * normals[b + 1] + v * normals[c + 1];
        float z = w * normals[a + 2] + u * normals[b + 2] + v * normals[c + 2];
        float inverse_length = 1 / sqrtf(x * x + y * y + z * z);
        inverse_length = flip[i] ? -inverse_length : inverse_length;
        normal->x[i] = inverse_length * x;
        normal->y[i] = inverse_length * y;
        normal->z[i] = inverse_length * z;
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
        float u = normal_x[i], v = normal_y[i], w = normal_z[i];
        float x = instances[at] * u + instances[at + 3] * v + instances[at + 6] * w;
        float y = instances[at + 1] * u + instances[at + 4] * v + instances[at + 7] * w;
        float z = instances[at + 2] * u + instances[at + 5] * v + instances[at + 8] * w;
        float inverse_length = 1 / sqrtf(x * x + y * y + z * z);
        normal_x[i] = inverse_length * x;
        normal_y[i] = inverse_length * y;
        normal_z[i] = inverse_length * z;
    }
}

static void normals_face(Vectors *normal, const int *flip)
{
    FOR_LANES
    {
        float x = normal->x[i], y = normal->y[i], z = normal->z[i];
        float inverse_length = 1 / sqrtf(x * x + y * y + z * z);
        inverse_length = flip[i] ? -inverse_length : inverse_length;
        normal->x[i] = inverse_length * x;
        normal->y[i] = inverse_length * y;
        normal->z[i] = inverse_length * z;
    }
}

// Finds the rays that hit something and the materials they hit, 0 on a miss. Returns whether any ray hits.
static bool surfaces_find(const Description *scene, const int *valid, const struct RTCHit16 *hit,
                          Surfaces *surfaces, int *material)
{
    FOR_LANES
    {
        surfaces->found[i] = hit->geomID[i] != RTC_INVALID_GEOMETRY_ID ? valid[i] : 0;
        surfaces->geometry[i] = (int)hit->geomID[i];
        material[i] = 0;
    }
    if (scene->sphere_count > 0) {
        const int *sphere_materials = scene->sphere_materials;
        FOR_LANES
        {
            if (hit->geomID[i] == 0) material[i] = sphere_materials[(int)hit->primID[i]];
        }
    }
    for (size_t k = 0; k < scene->mesh_count; k++) {
        const unsigned geometry = mesh_geometry(scene, k);
        const int of_mesh = scene->meshes[k].material;
        FOR_LANES material[i] = hit->geomID[i] == geometry ? of_mesh : material[i];
    }
    for (size_t k = 0; k < scene->plane_count; k++) {
        const unsigned geometry = FIRST_PLANE + (unsigned)k;
        const int of_plane = scene->planes[k].material;
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
    Vectors outward;
    alignas(64) int flip[LANES];
    FOR_LANES
    {
        outward.x[i] = hit->Ng_x[i];
        outward.y[i] = hit->Ng_y[i];
        outward.z[i] = hit->Ng_z[i];
        flip[i] =
            outward.x[i] * ray->dir_x[i] + outward.y[i] * ray->dir_y[i] + outward.z[i] * ray->dir_z[i] > 0;
    }
    normals_face(&outward, flip);
    surfaces->normal = outward;
    for (size_t k = 0; k < scene->mesh_count; k++) {
        if (!scene->meshes[k].normals) continue;
        Vectors *normal = &surfaces->normal;
        mesh_smooth(&scene->meshes[k], mesh_geometry(scene, k), hit, flip, normal);
        mesh_turn(scene, k, hit, normal->x, normal->y, normal->z);
    }
    const Vector eye = scene->camera.eye;
    FOR_LANES
    {
        // Shadow rays start some rounding errors of a coordinate off the surface, so that it does not shade
        // itself.
        const float roundings = 0x1p-18F;
        float t = ray->tfar[i];
        float x = ray->org_x[i] + t * ray->dir_x[i], y = ray->org_y[i] + t * ray->dir_y[i],
              z = ray->org_z[i] + t * ray->dir_z[i];
        float off = roundings * fmaxf(t, fmaxf(fabsf(eye.x), fmaxf(fabsf(eye.y), fabsf(eye.z))));
        surfaces->position.x[i] = x;
        surfaces->position.y[i] = y;
        surfaces->position.z[i] = z;
        surfaces->start.x[i] = x + off * outward.x[i];
        surfaces->start.y[i] = y + off * outward.y[i];
        surfaces->start.z[i] = z + off * outward.z[i];
        surfaces->to_eye.x[i] = -ray->dir_x[i];
        surfaces->to_eye.y[i] = -ray->dir_y[i];
        surfaces->to_eye.z[i] = -ray->dir_z[i];
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

static void surfaces_color(const Description *scene, const int *material, Surfaces *surfaces)
{
    const float *table = scene->materials;
    if (all_equal(material)) {
        const float *entry = table + (size_t)MATERIAL_PARTS * (size_t)material[0];
        FOR_LANES
        {
            surfaces->color.x[i] = entry[MATERIAL_AMBIENT];
            surfaces->color.y[i] = entry[MATERIAL_AMBIENT + 1];
            surfaces->color.z[i] = entry[MATERIAL_AMBIENT + 2];
            surfaces->diffuse.x[i] = entry[MATERIAL_DIFFUSE];
            surfaces->diffuse.y[i] = entry[MATERIAL_DIFFUSE + 1];
            surfaces->diffuse.z[i] = entry[MATERIAL_DIFFUSE + 2];
            surfaces->specular[i] = entry[MATERIAL_SPECULAR];
            surfaces->shininess[i] = entry[MATERIAL_SHININESS];
        }
    } else {
        FOR_LANES
        {
            int entry = MATERIAL_PARTS * material[i];
            surfaces->color.x[i] = table[entry + MATERIAL_AMBIENT];
            surfaces->color.y[i] = table[entry + MATERIAL_AMBIENT + 1];
            surfaces->color.z[i] = table[entry + MATERIAL_AMBIENT + 2];
            surfaces->diffuse.x[i] = table[entry + MATERIAL_DIFFUSE];
            surfaces->diffuse.y[i] = table[entry + MATERIAL_DIFFUSE + 1];
            surfaces->diffuse.z[i] = table[entry + MATERIAL_DIFFUSE + 2];
            surfaces->specular[i] = table[entry + MATERIAL_SPECULAR];
            surfaces->shininess[i] = table[entry + MATERIAL_SHININESS];
        }
    }
    const Vector background = scene->background;
    FOR_LANES
    {
        surfaces->color.x[i] = surfaces->found[i] ? surfaces->color.x[i] : background.x;
        surfaces->color.y[i] = surfaces->found[i] ? surfaces->color.y[i] : background.y;
        surfaces->color.z[i] = surfaces->found[i] ? surfaces->color.z[i] : background.z;
    }
}

// Clears the lanes of `lit` for which a plane lies between the surface and the light.
static void planes_occlude(const Description *scene, const Surfaces *surfaces, const Light *light, int *lit)
{
    const Vector place = light->position;
    const float near = light->is_directional ? 0 : 1;
    for (size_t k = 0; k < scene->plane_count; k++) {
        Vector point = scene->planes[k].point, normal = scene->planes[k].normal;
        const int geometry = FIRST_PLANE + (int)k;
        float light_height = normal.x * (place.x - near * point.x) + normal.y * (place.y - near * point.y) +
                             normal.z * (place.z - near * point.z);
        FOR_LANES
        {
            float height = normal.x * (surfaces->start.x[i] - point.x) +
                           normal.y * (surfaces->start.y[i] - point.y) +
                           normal.z * (surfaces->start.z[i] - point.z);
            bool between = (surfaces->geometry[i] != geometry) & (height * light_height < 0);
            lit[i] = between ? 0 : lit[i];
        }
    }
}

static void light_add(const Renderer *renderer, const Light *light, Surfaces *surfaces)
{
    const Vector place = light->position;
    const float near = light->is_directional ? 0 : 1;
    const Vectors *normal = &surfaces->normal, *to_eye = &surfaces->to_eye;
    alignas(64) int lit[LANES];
    alignas(64) float facing[LANES];
    alignas(64) float distance[LANES];
    Vectors to_light;
    FOR_LANES
    {
        float x = place.x - near * surfaces->position.x[i], y = place.y - near * surfaces->position.y[i],
              z = place.z - near * surfaces->position.z[i];
        float squared = x * x + y * y + z * z, inverse_length = 1 / sqrtf(squared);
        distance[i] = light->is_directional ? far_away : squared * inverse_length;
        to_light.x[i] = inverse_length * x;
        to_light.y[i] = inverse_length * y;
        to_light.z[i] = inverse_length * z;
        facing[i] =
            normal->x[i] * to_light.x[i] + normal->y[i] * to_light.y[i] + normal->z[i] * to_light.z[i];
        lit[i] = facing[i] > 0 ? surfaces->found[i] : 0;
    }
    planes_occlude(renderer->description, surfaces, light, lit);
    if (!lanes_any(lit)) return;

    struct RTCRay16 shadow;
    FOR_LANES
    {
        shadow.org_x[i] = surfaces->start.x[i];
        shadow.org_y[i] = surfaces->start.y[i];
        shadow.org_z[i] = surfaces->start.z[i];
        shadow.dir_x[i] = to_light.x[i];
        shadow.dir_y[i] = to_light.y[i];
        shadow.dir_z[i] = to_light.z[i];
        shadow.tnear[i] = 0;
        shadow.tfar[i] = distance[i];
        shadow.time[i] = 0;
        shadow.mask[i] = ~0U;
        shadow.flags[i] = 0;
    }
    rays_occlude(renderer, lit, &shadow);

    FOR_LANES lit[i] = shadow.tfar[i] < 0 ? 0 : lit[i];
    alignas(64) int shiny[LANES];
    alignas(64) float highlight[LANES];
    FOR_LANES
    {
        highlight[i] = 0;
        shiny[i] = surfaces->specular[i] > 0 ? lit[i] : 0;
    }
    if (lanes_any(shiny)) {
        FOR_LANES
        {
            float twice = 2 * facing[i];
            float cosine = (twice * normal->x[i] - to_light.x[i]) * to_eye->x[i] +
                           (twice * normal->y[i] - to_light.y[i]) * to_eye->y[i] +
                           (twice * normal->z[i] - to_light.z[i]) * to_eye->z[i];
            float exponent = surfaces->shininess[i] * log2f(fmaxf(cosine, 1e-20F));
            highlight[i] =
                surfaces->specular[i] * exp2f(fmaxf(exponent, -100)); // powers that underflow are slow
        }
    }
    const Vector color = light->color;
    FOR_LANES
    {
        float diffuse = lit[i] ? facing[i] : 0, specular = lit[i] ? highlight[i] : 0;
        surfaces->color.x[i] += color.x * (diffuse * surfaces->diffuse.x[i] + specular);
        surfaces->color.y[i] += color.y * (diffuse * surfaces->diffuse.y[i] + specular);
        surfaces->color.z[i] += color.z * (diffuse * surfaces->diffuse.z[i] + specular);
    }
}

static void film_store(const Renderer *renderer, unsigned left, unsigned top, const Vectors *color)
{
    for (unsigned i = 0; i < LANES; i++) {
        unsigned x = left + i % PACKET_SIDE, y = top + i / PACKET_SIDE;
        if (x >= renderer->width || y >= renderer->height) continue;
        float *pixel = renderer->film + 3 * ((size_t)y * renderer->width + x);
        pixel[0] = color->x[i];
        pixel[1] = color->y[i];
        pixel[2] = color->z[i];
    }
}

static void sample_add(const Renderer *renderer, unsigned x, unsigned y, const float *offset, Vectors *sum)
{
    const Description *scene = renderer->description;
    struct RTCRayHit16 rays;
    alignas(64) int valid[LANES];
    camera_rays(renderer, x, y, offset, &rays, valid);
    planes_intersect(scene, &rays);
    rays_intersect(renderer, valid, &rays);

    Surfaces surfaces;
    alignas(64) int material[LANES];
    bool any = surfaces_find(scene, valid, &rays.hit, &surfaces, material);
    surfaces_color(scene, material, &surfaces);
    if (any) {
        surfaces_place(scene, &rays, &surfaces);
        for (size_t i = 0; i < scene->light_count; i++)
            light_add(renderer, &scene->lights[i], &surfaces);
    }
    const float weight = 1 / (float)renderer->samples;
    FOR_LANES
    {
        sum->x[i] += weight * surfaces.color.x[i];
        sum->y[i] += weight * surfaces.color.y[i];
        sum->z[i] += weight * surfaces.color.z[i];
    }
}

void packet_render(const Renderer *renderer, unsigned x, unsigned y)
{
    Vectors color = {.x = {0}, .y = {0}, .z = {0}};
    for (unsigned i = 0; i < renderer->samples; i++)
        sample_add(renderer, x, y, renderer->offsets + 2 * (size_t)i, &color);
    film_store(renderer, x, y, &color);
}
