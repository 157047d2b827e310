// Evaluates the shading formulas of docs/scene-format.md as written. The kernels (kernels/shading/) compute
// the same in forms suited to float. There 1 minus the cosine of a highlight or of a spot light's cone is
// half the squared difference of two unit vectors, and lights that cannot reach a surface are culled.
#include "host/verify/reference_shading.h"

#include <float.h>
#include <math.h>

const Material *reference_material(const Scene *scene, size_t object)
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
    const Quad side = quad3_dot(normals[0], surface->geometric) < 0 ? -1 : 1;
    const Quad3 across = quad3_triangle_normal(vertices[0], vertices[1], vertices[2]);
    const Quad squared = quad3_dot(across, across);
    for (int i = 0; i < 3; i++) {
        const Quad3 next = vertices[(i + 1) % 3], last = vertices[(i + 2) % 3];
        const Quad3 part = quad3_triangle_normal(next, last, surface->point);
        const Quad3 normal = quad3_scale(normals[i], side);
        const Quad weight = quad3_dot(across, part) / squared;
        const Quad height = quad3_dot(quad3_subtract(vertices[i], surface->point), normal);
        agrees = agrees && quad3_dot(normal, surface->geometric) > 0;
        if (height > 0) surface->lift = quad3_add(surface->lift, quad3_scale(normal, weight * height));
    }
    surface->is_lifted = agrees;
    if (!agrees) surface->lift = (Quad3){0, 0, 0};
}

Quad3 random_offset(Random *random, double size)
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

ShadedPoint shaded_point(const ReferenceScene *world, const ReferenceRay *ray, ReferenceHit *hit, double blur,
                         Random *random)
{
    const Scene *scene = &world->scene;
    const Object *object = &scene->objects.items[hit->object];
    const Material *material = reference_material(scene, hit->object);
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
    margin_reduce(margin, 2 * height * surface->scale);
    bool sinks = height <= 0;
    if (sinks && surface->is_lifted) {
        ReferenceRay whole = *shadow;
        whole.tmin = -shadow->tmin;
        const ReferenceHit self_hit = reference_hit_object(surface->object, &whole);
        margin_reduce(margin, self_hit.margin);
        sinks = self_hit.found;
    }
    Color passed = sinks ? material_passing(surface->material) : vector_all(1);
    for (size_t i = 0; i < scene->objects.count; i++) {
        const ReferenceHit blocker = reference_scene_hit_object(world, i, shadow, surface->index);
        margin_reduce(margin, blocker.margin);
        if (blocker.found) passed = vector_multiply(passed, material_passing(reference_material(scene, i)));
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
    margin_reduce(&sum->margin, 2 * facing * surface->scale);
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
        vector_scale(tint_factors(material->specular.tint),
                     (double)(strength * highlight) * material->specular.largest));
    sum->color = vector_add(sum->color, vector_multiply(vector_multiply(light->color, passed), reflected));
    return strength > 0 && vector_largest(passed) > 0;
}

ReferenceColor shaded_color(const ReferenceScene *world, const ShadedPoint *surface, double margin,
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

Color reference_background(const Scene *scene, Quad3 direction)
{
    if (vector_is_zero(scene->sky.up)) return scene->background;
    const double height = (double)quad3_dot(quad3_unit(direction), quad3_unit(quad3(scene->sky.up)));
    const Color farthest = height > 0 ? scene->sky.zenith : scene->sky.nadir;
    return vector_add(scene->background,
                      vector_scale(vector_subtract(farthest, scene->background), fabs(height)));
}
