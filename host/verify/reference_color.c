// Follows a ray and its reflections and refractions.
#include "host/verify/reference_color.h"

#include "host/verify/reference_shading.h"
#include <float.h>
#include <math.h>

// The absorption of light per length in the body around a ray and in the one around that.
typedef struct {
    Color density, outer;
} ReferenceMedium;

// A ray of a tree, the object that it leaves, and the part of its light that reaches the eye.
typedef struct {
    ReferenceRay ray;
    uint32_t left; // UINT32_MAX for the eye
    Color weight;
    ReferenceMedium medium;
} PathRay;

// The state that all rays of a tree share.
typedef struct {
    const ReferenceScene *world;
    double min_contribution;
    double blur;
    Random random;
    Color sum;
    uint32_t object;    // the first hit's, UINT32_MAX before it
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
    const double largest = vector_largest(weight), weight_min = tree->min_contribution;
    if (largest <= 0 || weight_min <= 0) return largest > 0;
    // weights are computed in double
    if (fabs(largest - weight_min) <= 0x1p-40 * weight_min) tree->margin = 0;
    return largest >= weight_min;
}

// Returns the nearest hit of a ray. An opaque surface that coincides with a transparent one covers it.
static ReferenceHit path_hit(const ReferenceScene *world, const PathRay *path)
{
    const Scene *scene = &world->scene;
    const ReferenceRay *ray = &path->ray;
    const ReferenceHit first = reference_scene_hit(world, ray, path->left);
    if (!first.found || reference_material(scene, first.object)->transmission.largest <= 0) return first;
    const Quad length = quad3_length(ray->direction), reach = START_PART * first.t * length;
    const ReferenceRay inward = {reference_point(ray, first.t), quad3_scale(first.normal, -1), -reach, reach};
    const Quad depth = 2 * reach / (first.cosine * length);
    const ReferenceRay around = {ray->origin, ray->direction, first.t - depth, first.t + depth};
    ReferenceHit hit = first;
    for (size_t i = 0; i < scene->objects.count; i++) {
        if (reference_material(scene, i)->transmission.largest > 0) continue;
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
    const Color color = reference_background(scene, path->ray.direction);
    tree->sum = vector_add(tree->sum, vector_multiply(color, weight));
    margin_reduce(&tree->margin, margin);
    tree->has_texture = tree->has_texture || scene->sky.texture > 0;
    signature_add(tree, UINT32_MAX, 0);
}

static void add_surface(PathTree *tree, const ShadedPoint *surface, Color weight, Quad margin)
{
    if (tree->object == UINT32_MAX) {
        tree->object = surface->index;
        tree->distance = (double)surface->scale;
    }
    const ReferenceColor shaded = shaded_color(tree->world, surface, (double)margin, tree->shadows);
    tree->shadows = NULL;
    tree->sum = vector_add(tree->sum, vector_multiply(shaded.color, weight));
    margin_reduce(&tree->margin, shaded.margin);
    tree->has_texture = tree->has_texture || surface->material->image.texture > 0;
}

// Returns the direction of the reflected ray. Directions are unit vectors, and normals are on the ray's side.
static Quad3 reference_reflect(Quad3 direction, Quad3 normal)
{
    return quad3_subtract(direction, quad3_scale(normal, 2 * quad3_dot(direction, normal)));
}

// Sets *refracted to the direction of the refracted ray, by Snell's law. The sine behind the surface is `eta`
// times that in front of it. Returns false if it exceeds 1. Reduces the margin to the squared cosine behind
// the surface, which is negative then.
static bool reference_refract(Quad3 direction, Quad3 normal, Quad eta, Quad3 *refracted, double *margin)
{
    Quad cosine = -quad3_dot(direction, normal);
    Quad squared = 1 - eta * eta * (1 - cosine * cosine);
    margin_reduce(margin, squared);
    if (squared < 0) return false;
    *refracted =
        quad3_add(quad3_scale(direction, eta), quad3_scale(normal, eta * cosine - quad_root(squared)));
    return true;
}

// Returns the part of unpolarized light that a body of this index reflects (Fresnel).
static Quad reference_reflectance(Quad cosine, Quad ior, bool entering)
{
    const Quad eta = entering ? 1 / ior : ior, squared = 1 - eta * eta * (1 - cosine * cosine);
    if (squared <= 0) return 1;
    const Quad behind = QUAD_CALL(sqrt)(squared), near = entering ? 1 : ior, far = entering ? ior : 1;
    const Quad across = (near * cosine - far * behind) / (near * cosine + far * behind),
               along = (near * behind - far * cosine) / (near * behind + far * cosine);
    return (across * across + along * along) / 2;
}

// Returns the part of unpolarized light that a conductor of index n + i k reflects. With the index m, M = m^2
// and q^2 = M - sine^2, the amplitude is (c - q) / (c + q) across the plane of incidence and (M c - q) / (M c
// + q) along it.
static double reference_conductor_reflectance(Quad cosine, double n, double k)
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

// Returns whether a bounced ray stays on its side of the surface, that of the normal or the other. If a
// smooth triangle's shading normal sends it to the wrong side, the geometric normal is used instead.
static bool is_on_side(Quad3 direction, const ShadedPoint *surface, int side, double *margin)
{
    if (surface->object->type != SHAPE_TRIANGLE || !surface->object->as.triangle.smooth) return true;
    const Quad height = side * quad3_dot(quad3_unit(direction), surface->geometric);
    margin_reduce(margin, height);
    return height > 0;
}

static Quad3 direction_reflect(const ShadedPoint *surface, Quad3 direction, double *margin)
{
    const Quad3 reflected = reference_reflect(direction, surface->normal);
    return is_on_side(reflected, surface, 1, margin) ? reflected
                                                     : reference_reflect(direction, surface->geometric);
}

// Returns false at total reflection.
static bool direction_refract(const ShadedPoint *surface, Quad3 direction, Quad3 *refracted, double *margin)
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
    double transmission = material->transmission.largest, part = is_total;
    if (material->fresnel && !is_total)
        part = (double)reference_reflectance(cosine, material->ior, surface->entering || transmission == 0);
    *reflected = factor_color(material->reflection);
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
    *refracted = vector_scale(tint_factors(material->transmission.tint), transmission);
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
    const bool is_total = material->transmission.largest > 0 &&
                          !direction_refract(surface, direction, &refracted.ray.direction, &tree->margin);
    Color reflected_part, refracted_part;
    surface_split(surface, is_total, &reflected_part, &refracted_part);
    reflected.weight = weights_multiply(path->weight, reflected_part);
    refracted.weight = weights_multiply(path->weight, refracted_part);
    const bool reflects = contributes(tree, reflected.weight), refracts = contributes(tree, refracted.weight);
    signature_add(tree, surface->index,
                  (reflects ? PATH_REFLECTED : 0u) | (refracts ? PATH_REFRACTED : 0u) |
                      (reflects && is_total ? PATH_TOTAL_REFLECTION : 0u));
    if (reflects) {
        reflected.ray.direction = direction_reflect(surface, direction, &tree->margin);
        add_path(tree, &reflected, bounces_left - 1);
    }
    if (!refracts) return;
    refracted.medium = surface->entering ? (ReferenceMedium){material->absorption, path->medium.density}
                                         : (ReferenceMedium){.density = path->medium.outer};
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
    const ShadedPoint surface = shaded_point(tree->world, &path->ray, &hit, tree->blur, &tree->random);
    PathRay arriving = *path;
    // a surface that is reached from within defines the medium
    if (surface.material->transmission.largest > 0 && !surface.entering)
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
