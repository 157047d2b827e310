#include "host/verify/reference_color.h"

#include "host/compile/camera_basis.h"
#include "host/compile/random_shape.h"
#include <float.h>
#include <math.h>

// The largest distance of a computed point from its surface, relative to the numbers it was computed from.
// It is far above the rounding of quadruple precision and far below that of double.
#define START_PART ((Quad)0x1p-90L)

ReferenceRay reference_camera_ray(const Camera *camera, unsigned width, unsigned height, unsigned column,
                                  unsigned row)
{
    const CameraBasis basis = camera_basis(camera, width, height);
    const Quad x = (Quad)2 * column + 1 - width, y = height - 1 - (Quad)2 * row;
    if (camera->projection == PROJECTION_EQUIRECTANGULAR) {
        const Quad half_turn = QUAD_CALL(acos)(-1), longitude = half_turn * x / width,
                   latitude = half_turn / 2 * y / height;
        const Quad3 right = quad3(vector_normalize(basis.right)), up = quad3(vector_normalize(basis.up));
        const Quad3 level = quad3_add(quad3_scale(quad3(basis.forward), QUAD_CALL(cos)(longitude)),
                                      quad3_scale(right, QUAD_CALL(sin)(longitude)));
        return (ReferenceRay){quad3(camera->position),
                              quad3_add(quad3_scale(level, QUAD_CALL(cos)(latitude)),
                                        quad3_scale(up, QUAD_CALL(sin)(latitude))),
                              0, (Quad)FLT_MAX};
    }
    const Quad3 sideways = quad3_add(quad3_scale(quad3(basis.right), x), quad3_scale(quad3(basis.up), y));
    const Quad3 direction = quad3_add(quad3(basis.middle), sideways);
    return (ReferenceRay){quad3(camera->position), direction, 0, (Quad)FLT_MAX};
}

// A point of a surface, its unit shading and geometric normals, which face the eye, and the unit direction
// to the eye.
typedef struct {
    Quad3 point, normal, geometric, to_eye;
    Quad scale; // the point's distance from the ray's origin
    Quad start; // the surface is at most this far from the point
    Quad3 lift; // from the point to the start of rays to lights
    bool is_lifted;
    bool entering;
    uint32_t index; // of the object
    const Object *object;
    const Material *material;
    Color base;
} ShadedPoint;

static Quad square_of(Quad coordinate, double size, Quad *margin)
{
    const Quad place = coordinate / size;
    *margin = quad_minimum(*margin, 2 * size * quad_absolute(place - QUAD_CALL(round)(place)));
    return QUAD_CALL(floor)(place);
}

// Returns a checker's color. Solids are cut from a checkered block of the world, 1/1024 of a side behind the
// surface so that a face between two cubes has one color. Planes and discs have separate squares.
static Color checker_color(const Object *object, const Material *material, const ReferenceHit *hit,
                           Quad3 point, Quad *margin)
{
    bool flat = object->type == SHAPE_PLANE || object->type == SHAPE_DISC;
    double size = material->checker.size;
    Quad squares;
    if (flat) {
        Vector3 given = object->type == SHAPE_PLANE ? object->as.plane.normal : object->as.disc.normal;
        Quad3 normal = quad3_unit(quad3(given));
        Quad3 along = quad3_perpendicular(normal), across = quad3_cross(normal, along);
        squares = square_of(quad3_dot(point, along), size, margin) +
                  square_of(quad3_dot(point, across), size, margin);
    } else {
        point = quad3_subtract(point, quad3_scale(hit->normal, size / 1024));
        squares = square_of(point.x, size, margin) + square_of(point.y, size, margin) +
                  square_of(point.z, size, margin);
    }
    return material->checker.colors[QUAD_CALL(fmod)(squares, 2) != 0];
}

// Returns 1 within half_angle - penumbra, 0 beyond half_angle, and the smooth step 3 x^2 - 2 x^3 of 1 - cos
// between.
static Quad spot_factor(const Light *light, Quad3 from_light)
{
    const Quad degree = QUAD_CALL(acos)(-1) / 180;
    Quad along = quad3_dot(quad3_unit(quad3(light->direction)), quad3_unit(from_light));
    Quad versine = 1 - along;
    Quad outer = 1 - QUAD_CALL(cos)(light->spot.half_angle * degree);
    Quad inner = 1 - QUAD_CALL(cos)((light->spot.half_angle - light->spot.penumbra) * degree);
    if (versine <= inner) return 1;
    if (versine >= outer) return 0;
    Quad x = (outer - versine) / (outer - inner);
    return x * x * (3 - 2 * x);
}

// Sets the start of shadow rays above a smooth triangle whose normals are all on one side. The point moves,
// by each vertex's weight, along that vertex's normal up to its tangent plane
// (kernels/shapes/triangle_normals.h).
static void surface_lift(ShadedPoint *surface)
{
    const Object *object = surface->object;
    if (object->type != SHAPE_TRIANGLE || !object->as.triangle.smooth) return;
    Quad3 vertices[3], normals[3];
    bool agrees = true;
    for (int i = 0; i < 3; i++) {
        vertices[i] = quad3(object->as.triangle.vertices[i]);
        normals[i] = quad3_unit(quad3(object->as.triangle.normals[i]));
    }
    if (quad3_dot(normals[0], surface->geometric) < 0)
        for (int i = 0; i < 3; i++)
            normals[i] = quad3_scale(normals[i], -1);
    const Quad3 across =
        quad3_cross(quad3_subtract(vertices[1], vertices[0]), quad3_subtract(vertices[2], vertices[0]));
    const Quad squared = quad3_dot(across, across);
    for (int i = 0; i < 3; i++) {
        const Quad3 next = vertices[(i + 1) % 3], last = vertices[(i + 2) % 3];
        const Quad3 part = quad3_cross(quad3_subtract(last, next), quad3_subtract(surface->point, next));
        const Quad weight = quad3_dot(across, part) / squared;
        const Quad height = quad3_dot(quad3_subtract(vertices[i], surface->point), normals[i]);
        agrees = agrees && quad3_dot(normals[i], surface->geometric) > 0;
        if (height > 0) surface->lift = quad3_add(surface->lift, quad3_scale(normals[i], weight * height));
    }
    surface->is_lifted = agrees;
    if (!agrees) surface->lift = (Quad3){0, 0, 0};
}

// Returns whether the light reaches the surface.
static bool add_light(const ReferenceScene *world, const Light *light, const ShadedPoint *surface,
                      ReferenceColor *sum)
{
    const Scene *scene = &world->scene;
    const Material *material = surface->material;
    Color base = surface->base;
    bool directional = light->type == LIGHT_DIRECTIONAL;
    Quad3 to_light_unnormalized = directional ? quad3_scale(quad3(light->direction), -1)
                                              : quad3_subtract(quad3(light->position), surface->point);
    Quad3 to_light = quad3_unit(to_light_unnormalized);
    Quad facing = quad3_dot(surface->normal, to_light);
    sum->margin = fmin(sum->margin, (double)(2 * quad_absolute(facing) * surface->scale));
    if (facing <= 0) return false;

    const Quad3 way =
        directional ? to_light_unnormalized : quad3_subtract(to_light_unnormalized, surface->lift);
    const Quad start = surface->start / quad3_length(way);
    ReferenceRay shadow = {quad3_add(surface->point, surface->lift), way, start,
                           directional ? (Quad)LDBL_MAX : 1};
    Quad strength =
        light->type == LIGHT_SPOT ? spot_factor(light, quad3_scale(to_light_unnormalized, -1)) : 1;
    if (light_fades(light)) {
        const Quad distance = quad3_length(to_light_unnormalized);
        strength /= light->fading[0] + distance * (light->fading[1] + distance * light->fading[2]);
    }
    // a light before the shading normal but behind the surface, unless the lifted ray passes over its rim
    const Quad height = quad3_dot(surface->geometric, quad3_unit(way));
    sum->margin = fmin(sum->margin, (double)(2 * quad_absolute(height) * surface->scale));
    bool sinks = height <= 0;
    if (sinks && surface->is_lifted) {
        ReferenceRay whole = shadow;
        whole.tmin = -start;
        const ReferenceHit own = reference_hit_object(surface->object, &whole);
        sum->margin = fmin(sum->margin, (double)own.margin);
        sinks = own.found;
    }
    Color passed = sinks ? material_passing(material) : vector_all(1);
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        const Material *medium = &scene->materials.items[object->material];
        ReferenceHit blocker = reference_scene_hit_object(world, i, &shadow, surface->index);
        sum->margin = fmin(sum->margin, (double)blocker.margin);
        if (blocker.found) passed = vector_multiply(passed, material_passing(medium));
    }
    double diffuse = (double)(strength * facing);
    Quad highlight_part =
        reference_highlight(surface->normal, to_light, surface->to_eye, material->shininess);
    const Color highlight = vector_scale(tint_factors(material->specular_tint),
                                         (double)(strength * highlight_part) * material->specular);
    const Color reflected =
        vector_add(vector_scale(vector_multiply(material->diffuse, base), diffuse), highlight);
    sum->color = vector_add(sum->color, vector_multiply(vector_multiply(light->color, passed), reflected));
    return strength > 0 && vector_largest(passed) > 0;
}

static Quad3 random_offset(Random *random, double size)
{
    return quad3(vector_scale(random_in_sphere(random), size));
}

// Returns the magnitude of the numbers that decide whether a hit point is on its surface.
static Quad hit_magnitude(const ReferenceScene *world, const ReferenceHit *hit, Quad3 point, Quad distance)
{
    const double radius = world->spheres ? world->spheres[hit->object].radius : INFINITY;
    Quad magnitude = distance + quad3_length(point);
    if (hit->curvature_radius < LDBL_MAX) magnitude += hit->curvature_radius;
    return isfinite(radius) ? magnitude + radius : magnitude;
}

// Returns the surface that a ray hit, moved along itself and turned by up to `blur`.
static ShadedPoint surface_at(const ReferenceScene *world, const ReferenceRay *ray, ReferenceHit *hit,
                              double blur, Random *random)
{
    const Scene *scene = &world->scene;
    const Object *object = &scene->objects.items[hit->object];
    const Material *material = &scene->materials.items[object->material];
    Quad length = quad3_length(ray->direction);
    ShadedPoint surface = {.point = reference_point(ray, hit->t),
                           .normal = hit->shading_normal,
                           .geometric = hit->normal,
                           .to_eye = quad3_scale(ray->direction, -1 / length),
                           .scale = hit->t * length,
                           .entering = hit->entering,
                           .index = hit->object,
                           .object = object,
                           .material = material,
                           .base = material->color};
    surface.start = START_PART * hit_magnitude(world, hit, surface.point, surface.scale);
    if (blur > 0) {
        Quad size =
            surface.scale + quad3_length(quad3_subtract(surface.point, quad3(scene->camera.position)));
        Quad3 offset = random_offset(random, blur * (double)size);
        Quad away = quad3_dot(offset, hit->normal);
        surface.point = quad3_add(surface.point, quad3_subtract(offset, quad3_scale(hit->normal, away)));
        surface.normal = quad3_unit(quad3_add(surface.normal, random_offset(random, blur)));
        surface.start += blur * size;
    }
    surface_lift(&surface);
    if (material->checker.is_on)
        surface.base = checker_color(object, material, hit, surface.point, &hit->margin);
    return surface;
}

// Returns a surface's color. Sets `shadows`, unless NULL, to whether each light fails to reach the surface.
static ReferenceColor surface_color(const ReferenceScene *world, const ShadedPoint *surface, double margin,
                                    bool *shadows)
{
    const Scene *scene = &world->scene;
    Color base = surface->base;
    Color ambient = {scene->ambient.x * base.x, scene->ambient.y * base.y, scene->ambient.z * base.z};
    const Color own =
        vector_add(vector_scale(ambient, surface->material->ambient), surface->material->emission);
    ReferenceColor sum = {own, margin};
    for (size_t i = 0; i < scene->lights.count; i++) {
        const bool is_lit = add_light(world, &scene->lights.items[i], surface, &sum);
        if (shadows) shadows[i] = !is_lit;
    }
    return sum;
}

// Returns the background in a direction of any length.
static Color background_color(const Scene *scene, Quad3 direction)
{
    if (vector_is_zero(scene->sky.up)) return scene->background;
    const double height = (double)quad3_dot(quad3_unit(direction), quad3_unit(quad3(scene->sky.up)));
    const Color farthest = height > 0 ? scene->sky.zenith : scene->sky.nadir;
    return vector_add(scene->background,
                      vector_scale(vector_subtract(farthest, scene->background), fabs(height)));
}

ReferenceColor reference_color(const Scene *scene, const ReferenceRay *ray)
{
    ReferenceHit hit = reference_hit(scene, ray);
    if (!hit.found) return (ReferenceColor){background_color(scene, ray->direction), (double)hit.margin};
    const ReferenceScene world = {*scene, NULL};
    ShadedPoint surface = surface_at(&world, ray, &hit, 0, NULL);
    return surface_color(&world, &surface, (double)hit.margin, NULL);
}

// Refracts by Snell's law: sine behind = eta * sine in front. Returns false if that exceeds 1.
static bool refract(Quad3 direction, Quad3 normal, Quad eta, Quad3 *refracted, double *margin)
{
    Quad cosine = -quad3_dot(direction, normal);
    Quad squared = 1 - eta * eta * (1 - cosine * cosine);
    *margin = fmin(*margin, (double)quad_absolute(squared));
    if (squared < 0) return false;
    *refracted =
        quad3_add(quad3_scale(direction, eta), quad3_scale(normal, eta * cosine - quad_root(squared)));
    return true;
}

static Quad3 reflect(Quad3 direction, Quad3 normal)
{
    return quad3_subtract(direction, quad3_scale(normal, 2 * quad3_dot(direction, normal)));
}

// Returns whether a bounced ray stays on its side of the surface, that of the normal or the other. If a
// smooth triangle's shading normal sends it to the wrong side, the geometric normal is used instead.
static bool is_on_side(Quad3 direction, Quad3 normal, int side, double *margin)
{
    const Quad height = side * quad3_dot(quad3_unit(direction), normal);
    *margin = fmin(*margin, (double)quad_absolute(height));
    return height > 0;
}

// Replaces a hit on a transparent surface by one on an opaque surface that coincides with it.
static void hit_record_opaque(const ReferenceScene *world, const ReferenceRay *ray, ReferenceHit *hit)
{
    const Scene *scene = &world->scene;
    Quad length = quad3_length(ray->direction), reach = START_PART * hit->t * length;
    const ReferenceHit transparent = *hit;
    const ReferenceRay inward = {reference_point(ray, hit->t), quad3_scale(hit->normal, -1), -reach, reach};
    ReferenceRay around = *ray;
    around.tmin = hit->t - 2 * reach / (hit->cosine * length);
    around.tmax = hit->t + 2 * reach / (hit->cosine * length);
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        if (scene->materials.items[object->material].transmission > 0) continue;
        if (!reference_scene_hit_object(world, i, &inward, UINT32_MAX).found) continue;
        ReferenceHit opaque = reference_scene_hit_object(world, i, &around, UINT32_MAX);
        if (!opaque.found || (hit->object != transparent.object && opaque.t >= hit->t)) continue;
        opaque.margin = quad_minimum(opaque.margin, hit->margin);
        *hit = opaque;
        hit->object = (uint32_t)i;
    }
}

// The state that all rays of a tree share.
typedef struct {
    const ReferenceScene *world;
    double min_contribution;
    double blur;
    Random random;
    Color sum;
    bool has_first;
    uint32_t object;    // the object of the first hit
    double distance;    // to the first hit
    uint32_t signature; // see kernels/types.h
    double margin;
    bool has_texture;
    bool *shadows; // at the first surface, or NULL
} PathTree;

static void signature_add(PathTree *tree, uint32_t object, uint32_t events)
{
    tree->signature = (tree->signature ^ ((object + 1) * PATH_EVENTS + events)) * PATH_FACTOR;
}

// Returns the part of unpolarized light that a body of this index reflects, by Fresnel's equations.
static Quad reflectance(Quad cosine, Quad ior, bool entering)
{
    const Quad eta = entering ? 1 / ior : ior, squared = 1 - eta * eta * (1 - cosine * cosine);
    if (squared <= 0) return 1;
    const Quad behind = QUAD_CALL(sqrt)(squared), near = entering ? 1 : ior, far = entering ? ior : 1;
    const Quad across = (near * cosine - far * behind) / (near * cosine + far * behind),
               along = (near * behind - far * cosine) / (near * behind + far * cosine);
    return (across * across + along * along) / 2;
}

// Returns the part of unpolarized light that a conductor of index m reflects. The amplitude, with M = m^2
// and q^2 = M - sine^2, is (c - q) / (c + q) across the plane of incidence and (M c - q) / (M c + q) along
// it.
static double conductor_reflectance(Quad cosine, double n, double k)
{
    const Quad real = (Quad)n * n - (Quad)k * k, imaginary = 2 * (Quad)n * k;
    const Quad difference = real - (1 - cosine * cosine);
    const Quad size = QUAD_CALL(sqrt)(difference * difference + imaginary * imaginary);
    const Quad q_real = QUAD_CALL(sqrt)((size + difference) / 2),
               q_imaginary = QUAD_CALL(sqrt)((size - difference) / 2);
    Quad sum = 0;
    for (int along = 0; along < 2; along++) {
        const Quad a = along ? real * cosine : cosine, b = along ? imaginary * cosine : 0;
        sum += ((a - q_real) * (a - q_real) + (b - q_imaginary) * (b - q_imaginary)) /
               ((a + q_real) * (a + q_real) + (b + q_imaginary) * (b + q_imaginary));
    }
    return (double)(sum / 2);
}

// The medium of a ray: how strongly the body around it, and the one around that, absorb light.
typedef struct {
    Color density, outer;
} Medium;

static double channel_left(double density, double length)
{
    return density > 0 ? fmax(exp(-density * length), DBL_MIN) : 1;
}

static double part_of_weight(double weight, double part)
{
    return weight > 0 && part > 0 ? fmax(weight * part, DBL_MIN) : 0;
}

// Returns the product of two weights. Underflow does not make a channel 0, so it does not end a path.
static Color weights_multiply(Color a, Color b)
{
    return (Color){part_of_weight(a.x, b.x), part_of_weight(a.y, b.y), part_of_weight(a.z, b.z)};
}

static Color weight_left(Color weight, Color density, double length)
{
    const Color left = {channel_left(density.x, length), channel_left(density.y, length),
                        channel_left(density.z, length)};
    return weights_multiply(weight, left);
}

// Returns whether a ray of this weight counts.
static bool contributes(PathTree *tree, Color weight)
{
    const double largest = vector_largest(weight), least = tree->min_contribution;
    if (largest <= 0 || least <= 0) return largest > 0;
    // weights are computed in double
    if (fabs(largest - least) <= 0x1p-40 * least) tree->margin = 0;
    return largest >= least;
}

static void add_path(PathTree *tree, const ReferenceRay *ray, uint32_t left, Color weight, Medium medium,
                     unsigned bounces_left)
{
    const Scene *scene = &tree->world->scene;
    ReferenceHit hit = reference_scene_hit(tree->world, ray, left);
    if (!hit.found) {
        tree->has_first = true;
        tree->margin = fmin(tree->margin, (double)hit.margin);
        tree->has_texture = tree->has_texture || scene->sky.texture > 0;
        weight = weight_left(weight, medium.density, INFINITY);
        tree->sum = vector_add(tree->sum, vector_multiply(background_color(scene, ray->direction), weight));
        signature_add(tree, UINT32_MAX, 0);
        return;
    }
    if (scene->materials.items[scene->objects.items[hit.object].material].transmission > 0)
        hit_record_opaque(tree->world, ray, &hit);
    if (!tree->has_first) {
        tree->object = hit.object;
        tree->distance = (double)(hit.t * quad3_length(ray->direction));
    }
    tree->has_first = true;
    ShadedPoint surface = surface_at(tree->world, ray, &hit, tree->blur, &tree->random);
    const Material *material = surface.material;
    // a surface that is reached from within defines the medium
    if (material->transmission > 0 && !surface.entering) medium.density = material->absorption;
    weight = weight_left(weight, medium.density, (double)surface.scale);
    const ReferenceColor own = surface_color(tree->world, &surface, (double)hit.margin, tree->shadows);
    tree->shadows = NULL;
    tree->sum = vector_add(tree->sum, vector_multiply(own.color, weight));
    tree->margin = fmin(tree->margin, own.margin);
    tree->has_texture = tree->has_texture || material->image.texture > 0;
    if (bounces_left == 0) {
        signature_add(tree, hit.object, 0);
        return;
    }

    Quad3 direction = quad3_scale(surface.to_eye, -1);
    double reflection = material->reflection, transmission = material->transmission;
    Color reflected_weight = vector_scale(tint_factors(material->reflection_tint), reflection);
    ReferenceRay refracted = {surface.point, direction, surface.start, (Quad)LDBL_MAX}, reflected = refracted;
    Quad eta = surface.entering ? 1 / (Quad)material->ior : material->ior;
    const bool is_smooth = surface.object->type == SHAPE_TRIANGLE && surface.object->as.triangle.smooth;
    bool is_total = false;
    if (transmission > 0) {
        is_total = !refract(direction, surface.normal, eta, &refracted.direction, &tree->margin);
        if (is_smooth && !is_total && !is_on_side(refracted.direction, surface.geometric, -1, &tree->margin))
            is_total = !refract(direction, surface.geometric, eta, &refracted.direction, &tree->margin);
        reflection += is_total ? transmission : 0;
        if (is_total) reflected_weight = vector_add(reflected_weight, vector_all(transmission));
        transmission = is_total ? 0 : transmission;
    }
    if (material->fresnel && !is_total) {
        const double part = (double)reflectance(-quad3_dot(direction, surface.normal), (Quad)material->ior,
                                                surface.entering || material->transmission == 0);
        if (transmission > 0) {
            reflection += part * transmission;
            reflected_weight = vector_add(reflected_weight, vector_all(part * transmission));
            transmission -= part * transmission;
        } else {
            reflection *= part;
            reflected_weight = vector_scale(reflected_weight, part);
        }
    }
    if (material->conductor.n.x > 0) {
        const Color n = material->conductor.n, k = material->conductor.k;
        const Quad cosine = -quad3_dot(direction, surface.normal);
        const Color part = {conductor_reflectance(cosine, n.x, k.x), conductor_reflectance(cosine, n.y, k.y),
                            conductor_reflectance(cosine, n.z, k.z)};
        reflected_weight = vector_multiply(reflected_weight, part);
    }
    reflected_weight = weights_multiply(weight, reflected_weight);
    const Color refracted_weight =
        weights_multiply(weight, vector_scale(tint_factors(material->transmission_tint), transmission));
    const bool reflects = reflection > 0 && contributes(tree, reflected_weight),
               refracts = transmission > 0 && contributes(tree, refracted_weight);
    signature_add(tree, hit.object,
                  (reflects ? PATH_REFLECTED : 0u) | (refracts ? PATH_REFRACTED : 0u) |
                      (reflects && is_total ? PATH_TOTAL_REFLECTION : 0u));
    reflected.direction = reflect(direction, surface.normal);
    if (reflects && is_smooth && !is_on_side(reflected.direction, surface.geometric, 1, &tree->margin))
        reflected.direction = reflect(direction, surface.geometric);
    const Medium behind =
        surface.entering ? (Medium){material->absorption, medium.density} : (Medium){.density = medium.outer};
    if (reflects) add_path(tree, &reflected, hit.object, reflected_weight, medium, bounces_left - 1);
    if (refracts) add_path(tree, &refracted, hit.object, refracted_weight, behind, bounces_left - 1);
}

bool reference_is_uncertain(const ReferencePixel *pixel)
{
    return pixel->margin < 0x1p-80;
}

ReferencePixel reference_pixel(const ReferenceScene *scene, const ReferenceRay *ray,
                               const ReferencePath *path, bool *shadows)
{
    PathTree tree = {.world = scene,
                     .min_contribution = path->min_contribution,
                     .blur = path->blur,
                     .random = {path->seed},
                     .object = UINT32_MAX,
                     .signature = PATH_START,
                     .margin = INFINITY};
    tree.shadows = shadows;
    ReferenceRay first = *ray;
    Quad3 turn = random_offset(&tree.random, path->blur * (double)quad3_length(ray->direction));
    first.direction = quad3_add(first.direction, turn);
    add_path(&tree, &first, UINT32_MAX, vector_all(1), (Medium){0}, path->bounce_count);
    const double size = vector_length(quad3_rounded(ray->origin)) + tree.distance;
    return (ReferencePixel){.object = tree.object,
                            .path = tree.signature,
                            .color = tree.sum,
                            .margin = size > 0 ? tree.margin / size : tree.margin,
                            .has_texture = tree.has_texture};
}

Color reference_path_color(const Scene *scene, const ReferenceRay *ray, const ReferencePath *path)
{
    return reference_pixel(&(ReferenceScene){*scene, NULL}, ray, path, NULL).color;
}
