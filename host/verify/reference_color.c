#include "host/verify/reference_color.h"

#include "host/compile/random_shape.h"
#include "host/verify/reference_optics.h"
#include <float.h>
#include <math.h>

// The largest distance of a computed point from its surface, relative to the numbers it was computed from.
// It is far above the rounding of quadruple precision and far below that of double.
#define START_PART ((Quad)0x1p-90L)

typedef struct {
    Quad3 point;
    Quad3 normal, geometric; // unit, facing the eye
    Quad3 to_eye;            // unit
    Quad scale;              // the point's distance from the ray's origin
    Quad start;              // the surface is at most this far from the point
    Quad3 lift;              // from the point to the start of rays to lights
    bool is_lifted;
    bool entering;
    uint32_t index; // of the object
    const Object *object;
    const Material *material;
    Color base;
} ShadedPoint;

static const Material *object_material(const Scene *scene, size_t object)
{
    return &scene->materials.items[scene->objects.items[object].material];
}

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
    const Material *material = object_material(scene, hit->object);
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

// Returns the part of a light's color that a spot's cone and fading leave at a point.
static Quad light_strength(const Light *light, Quad3 to_light)
{
    const Quad strength = light->type == LIGHT_SPOT ? spot_factor(light, quad3_scale(to_light, -1)) : 1;
    if (!light_fades(light)) return strength;
    const Quad distance = quad3_length(to_light);
    return strength / (light->fading[0] + distance * (light->fading[1] + distance * light->fading[2]));
}

// Returns the part of a light's color that the objects on the way to it pass.
static Color light_passed(const ReferenceScene *world, const ShadedPoint *surface, const ReferenceRay *shadow,
                          double *margin)
{
    const Scene *scene = &world->scene;
    // a light before the shading normal but behind the surface, unless the lifted ray passes over its rim
    const Quad height = quad3_dot(surface->geometric, quad3_unit(shadow->direction));
    *margin = fmin(*margin, (double)(2 * quad_absolute(height) * surface->scale));
    bool sinks = height <= 0;
    if (sinks && surface->is_lifted) {
        ReferenceRay whole = *shadow;
        whole.tmin = -shadow->tmin;
        const ReferenceHit own = reference_hit_object(surface->object, &whole);
        *margin = fmin(*margin, (double)own.margin);
        sinks = own.found;
    }
    Color passed = sinks ? material_passing(surface->material) : vector_all(1);
    for (size_t i = 0; i < scene->objects.count; i++) {
        const ReferenceHit blocker = reference_scene_hit_object(world, i, shadow, surface->index);
        *margin = fmin(*margin, (double)blocker.margin);
        if (blocker.found) passed = vector_multiply(passed, material_passing(object_material(scene, i)));
    }
    return passed;
}

// Adds a light's share of the color. Returns whether the light reaches the surface.
static bool add_light(const ReferenceScene *world, const Light *light, const ShadedPoint *surface,
                      ReferenceColor *sum)
{
    const Material *material = surface->material;
    const bool directional = light->type == LIGHT_DIRECTIONAL;
    const Quad3 way = directional ? quad3_scale(quad3(light->direction), -1)
                                  : quad3_subtract(quad3(light->position), surface->point);
    const Quad3 to_light = quad3_unit(way);
    const Quad facing = quad3_dot(surface->normal, to_light);
    sum->margin = fmin(sum->margin, (double)(2 * quad_absolute(facing) * surface->scale));
    if (facing <= 0) return false;

    const Quad3 lifted_way = directional ? way : quad3_subtract(way, surface->lift);
    const ReferenceRay shadow = {quad3_add(surface->point, surface->lift), lifted_way,
                                 surface->start / quad3_length(lifted_way), directional ? (Quad)LDBL_MAX : 1};
    const Color passed = light_passed(world, surface, &shadow, &sum->margin);
    const Quad strength = light_strength(light, way);
    const Quad highlight =
        reference_highlight(surface->normal, to_light, surface->to_eye, material->shininess);
    const Color reflected = vector_add(
        vector_scale(vector_multiply(material->diffuse, surface->base), (double)(strength * facing)),
        vector_scale(tint_factors(material->specular_tint),
                     (double)(strength * highlight) * material->specular));
    sum->color = vector_add(sum->color, vector_multiply(vector_multiply(light->color, passed), reflected));
    return strength > 0 && vector_largest(passed) > 0;
}

// Returns a surface's color. Sets `shadows`, unless NULL, to whether each light fails to reach the surface.
static ReferenceColor surface_color(const ReferenceScene *world, const ShadedPoint *surface, double margin,
                                    bool *shadows)
{
    const Scene *scene = &world->scene;
    const Color ambient = vector_multiply(scene->ambient, surface->base);
    ReferenceColor sum = {
        vector_add(vector_scale(ambient, surface->material->ambient), surface->material->emission), margin};
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

// The medium of a ray: how strongly the body around it, and the one around that, absorb light.
typedef struct {
    Color density, outer;
} Medium;

// A ray of a tree, the object that it leaves, and the part of its light that reaches the eye.
typedef struct {
    ReferenceRay ray;
    uint32_t left; // UINT32_MAX: none
    Color weight;
    Medium medium;
} PathRay;

// The state that all rays of a tree share.
typedef struct {
    const ReferenceScene *world;
    double min_contribution;
    double blur;
    Random random;
    Color sum;
    uint32_t object;    // of the first hit, UINT32_MAX before it
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

// Returns the nearest hit of a ray. An opaque surface that coincides with a transparent one covers it.
static ReferenceHit path_hit(const ReferenceScene *world, const PathRay *path)
{
    const Scene *scene = &world->scene;
    const ReferenceRay *ray = &path->ray;
    const ReferenceHit first = reference_scene_hit(world, ray, path->left);
    if (!first.found || object_material(scene, first.object)->transmission <= 0) return first;
    const Quad length = quad3_length(ray->direction), reach = START_PART * first.t * length;
    const ReferenceRay inward = {reference_point(ray, first.t), quad3_scale(first.normal, -1), -reach, reach};
    const Quad depth = 2 * reach / (first.cosine * length);
    const ReferenceRay around = {ray->origin, ray->direction, first.t - depth, first.t + depth};
    ReferenceHit hit = first;
    for (size_t i = 0; i < scene->objects.count; i++) {
        if (object_material(scene, i)->transmission > 0) continue;
        if (!reference_scene_hit_object(world, i, &inward, UINT32_MAX).found) continue;
        ReferenceHit opaque = reference_scene_hit_object(world, i, &around, UINT32_MAX);
        if (!opaque.found || (hit.object != first.object && opaque.t >= hit.t)) continue;
        opaque.margin = quad_minimum(opaque.margin, hit.margin);
        opaque.object = (uint32_t)i;
        hit = opaque;
    }
    return hit;
}

static void add_background(PathTree *tree, const PathRay *path, Quad margin)
{
    const Scene *scene = &tree->world->scene;
    const Color weight = weight_left(path->weight, path->medium.density, INFINITY);
    const Color color = background_color(scene, path->ray.direction);
    tree->sum = vector_add(tree->sum, vector_multiply(color, weight));
    tree->margin = fmin(tree->margin, (double)margin);
    tree->has_texture = tree->has_texture || scene->sky.texture > 0;
    signature_add(tree, UINT32_MAX, 0);
}

static void add_surface(PathTree *tree, const ShadedPoint *surface, Color weight, Quad margin)
{
    if (tree->object == UINT32_MAX) {
        tree->object = surface->index;
        tree->distance = (double)surface->scale;
    }
    const ReferenceColor own = surface_color(tree->world, surface, (double)margin, tree->shadows);
    tree->shadows = NULL;
    tree->sum = vector_add(tree->sum, vector_multiply(own.color, weight));
    tree->margin = fmin(tree->margin, own.margin);
    tree->has_texture = tree->has_texture || surface->material->image.texture > 0;
}

// Returns whether a bounced ray stays on its side of the surface, that of the normal or the other. If a
// smooth triangle's shading normal sends it to the wrong side, the geometric normal is used instead.
static bool is_on_side(Quad3 direction, const ShadedPoint *surface, int side, double *margin)
{
    if (surface->object->type != SHAPE_TRIANGLE || !surface->object->as.triangle.smooth) return true;
    const Quad height = side * quad3_dot(quad3_unit(direction), surface->geometric);
    *margin = fmin(*margin, (double)quad_absolute(height));
    return height > 0;
}

static Quad3 surface_reflect(const ShadedPoint *surface, Quad3 direction, double *margin)
{
    const Quad3 reflected = reference_reflect(direction, surface->normal);
    return is_on_side(reflected, surface, 1, margin) ? reflected
                                                     : reference_reflect(direction, surface->geometric);
}

// Returns false at total reflection.
static bool surface_refract(const ShadedPoint *surface, Quad3 direction, Quad3 *refracted, double *margin)
{
    const Quad ior = surface->material->ior, eta = surface->entering ? 1 / ior : ior;
    if (!reference_refract(direction, surface->normal, eta, refracted, margin)) return false;
    return is_on_side(*refracted, surface, -1, margin) ||
           reference_refract(direction, surface->geometric, eta, refracted, margin);
}

// Sets the parts of a ray's light that its reflected and its refracted ray carry.
static void surface_split(const ShadedPoint *surface, bool is_total, Color *reflected, Color *refracted)
{
    const Material *material = surface->material;
    const Quad cosine = quad3_dot(surface->to_eye, surface->normal);
    double transmission = material->transmission, part = is_total;
    if (material->fresnel && !is_total)
        part = (double)reference_reflectance(cosine, material->ior, surface->entering || transmission == 0);
    *reflected = vector_scale(tint_factors(material->reflection_tint), material->reflection);
    if (transmission > 0) {
        *reflected = vector_add(*reflected, vector_all(part * transmission));
        transmission -= part * transmission;
    } else if (material->fresnel) {
        *reflected = vector_scale(*reflected, part);
    }
    if (material->conductor.n.x > 0) {
        const Color n = material->conductor.n, k = material->conductor.k;
        const Color metal = {reference_conductor_reflectance(cosine, n.x, k.x),
                             reference_conductor_reflectance(cosine, n.y, k.y),
                             reference_conductor_reflectance(cosine, n.z, k.z)};
        *reflected = vector_multiply(*reflected, metal);
    }
    *refracted = vector_scale(tint_factors(material->transmission_tint), transmission);
}

static void add_path(PathTree *tree, const PathRay *path, unsigned bounces_left);

static void add_bounces(PathTree *tree, const PathRay *path, const ShadedPoint *surface,
                        unsigned bounces_left)
{
    const Material *material = surface->material;
    const Quad3 direction = quad3_scale(surface->to_eye, -1);
    PathRay refracted = {{surface->point, direction, surface->start, (Quad)LDBL_MAX},
                         surface->index,
                         path->weight,
                         path->medium};
    PathRay reflected = refracted;
    const bool is_total = material->transmission > 0 &&
                          !surface_refract(surface, direction, &refracted.ray.direction, &tree->margin);
    Color reflected_part, refracted_part;
    surface_split(surface, is_total, &reflected_part, &refracted_part);
    reflected.weight = weights_multiply(path->weight, reflected_part);
    refracted.weight = weights_multiply(path->weight, refracted_part);
    const bool reflects = contributes(tree, reflected.weight), refracts = contributes(tree, refracted.weight);
    signature_add(tree, surface->index,
                  (reflects ? PATH_REFLECTED : 0u) | (refracts ? PATH_REFRACTED : 0u) |
                      (reflects && is_total ? PATH_TOTAL_REFLECTION : 0u));
    if (reflects) {
        reflected.ray.direction = surface_reflect(surface, direction, &tree->margin);
        add_path(tree, &reflected, bounces_left - 1);
    }
    if (!refracts) return;
    refracted.medium = surface->entering ? (Medium){material->absorption, path->medium.density}
                                         : (Medium){.density = path->medium.outer};
    add_path(tree, &refracted, bounces_left - 1);
}

// Adds the light that comes along a ray from its nearest surface, lit and then reflecting and refracting.
static void add_path(PathTree *tree, const PathRay *path, unsigned bounces_left)
{
    ReferenceHit hit = path_hit(tree->world, path);
    if (!hit.found) {
        add_background(tree, path, hit.margin);
        return;
    }
    const ShadedPoint surface = surface_at(tree->world, &path->ray, &hit, tree->blur, &tree->random);
    PathRay arriving = *path;
    // a surface that is reached from within defines the medium
    if (surface.material->transmission > 0 && !surface.entering)
        arriving.medium.density = surface.material->absorption;
    arriving.weight = weight_left(path->weight, arriving.medium.density, (double)surface.scale);
    add_surface(tree, &surface, arriving.weight, hit.margin);
    if (bounces_left == 0)
        signature_add(tree, surface.index, 0);
    else
        add_bounces(tree, &arriving, &surface, bounces_left);
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
    PathRay first = {.ray = *ray, .left = UINT32_MAX, .weight = vector_all(1)};
    Quad3 turn = random_offset(&tree.random, path->blur * (double)quad3_length(ray->direction));
    first.ray.direction = quad3_add(first.ray.direction, turn);
    add_path(&tree, &first, path->bounce_count);
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
