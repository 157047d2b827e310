// Checks of instances that share a mesh.
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/scene/mesh.h"
#include "host/scene/object_transform.h"
#include "host/verify/checks.h"
#include "host/verify/families.h"
#include <stdlib.h>

enum { HALF_SIDE = 4, SIDE = 2 * HALF_SIDE, BALL_TRIANGLES = 6 * SIDE * SIDE * 2 };

// Returns a point of a cube's face, moved to the unit sphere. Faces share the points of their common edge.
static Vector3 ball_point(int face, int column, int row)
{
    const double across = column - HALF_SIDE, along = row - HALF_SIDE,
                 out = face % 2 ? -HALF_SIDE : HALF_SIDE;
    const Vector3 points[] = {{out, across, along}, {across, out, along}, {across, along, out}};
    return vector_normalize(points[face / 2]);
}

// Returns a closed mesh around the origin, which is not the center of its box.
static Mesh ball_make(void)
{
    Mesh mesh = {.vertices = memory_allocate(3 * (size_t)BALL_TRIANGLES, sizeof *mesh.vertices),
                 .triangles = memory_allocate(BALL_TRIANGLES, sizeof *mesh.triangles)};
    for (int face = 0; face < 6; face++)
        for (int i = 0; i < 2 * SIDE * SIDE; i++) {
            const int column = i / 2 % SIDE, row = i / 2 / SIDE, half = i % 2;
            const Vector3 corners[] = {ball_point(face, column, row),
                                       ball_point(face, column + 1, row + half),
                                       ball_point(face, column + 1 - half, row + 1)};
            for (int k = 0; k < 3; k++) {
                mesh.triangles[mesh.triangle_count][k] = (uint32_t)mesh.vertex_count;
                mesh.vertices[mesh.vertex_count++] =
                    corners[k].y > 0 ? vector_scale(corners[k], 1.25) : corners[k];
            }
            mesh.triangle_count++;
        }
    mesh.bounds = mesh_vertex_bounds(&mesh);
    return mesh;
}

// Returns the distance of a point from the plane of an instance's triangle, positive inside the ball.
static double height_within(const Scene *scene, size_t part, Quad3 point)
{
    const MeshTriangle triangle = mesh_triangle_at(scene->meshes.items, scene->objects.items, part);
    const Quad3 a = quad3(triangle.vertices[0]),
                normal = quad3_unit(
                    quad3_triangle_normal(a, quad3(triangle.vertices[1]), quad3(triangle.vertices[2])));
    const Vector3 center = affine_point(&scene->objects.items[0].as.mesh.transform, (Vector3){0, 0, 0});
    const Quad height = quad3_dot(normal, quad3_subtract(point, a)),
               inside = quad3_dot(normal, quad3_subtract(quad3(center), a));
    return (double)(inside < 0 ? -height : height);
}

static void check_hit(VerifyRun *run, const Scene *scene, const TraceRay *ray, const TraceHit *hit,
                      double size)
{
    if (!verify_is_hit(hit)) {
        run->result->leaks++;
        return;
    }
    const ReferenceRay exact = verify_reference_ray(ray);
    // 32 u of the numbers times the transform's condition, at most 3 here
    const double bound = 96 * verify_roundoff(run) * (vector_length(ray->origin) + hit->t + size);
    if (run->tier == TIER_A) return;
    run->result->off_surface += fabs(height_within(scene, hit->object, quad3(hit->position))) > bound;
    run->result->wrong += fabs(height_within(scene, hit->object, reference_point(&exact, hit->t))) > bound;
    run->result->leaks += height_within(scene, hit->object, quad3(hit->reflected_origin)) <= 0;
}

// Checks that no ray from inside an instance of a ball leaves it, directly or after reflections.
void verify_instances(VerifyRun *run)
{
    enum { COUNT = 1 << 14 };
    const Affine mirror_and_shear = {{{-1, 0.5, 0, 4}, {0, 1, 0.3, -2}, {0.2, 0, 0.8, 1}}};
    const struct {
        Affine transform;
        double size;
    } placed[] = {
        {affine_of_steps(vector_all(100), (Vector3){20, 130, 50}, (Vector3){1e7, -2e6, 3e6}), 125},
        {mirror_and_shear, 2},
        {affine_of_steps(vector_all(1e-6), (Vector3){70, -20, 10}, (Vector3){3e-6, 1e-6, 0}), 1.25e-6},
    };
    TraceRay *rays = verify_allocate(run, COUNT, sizeof *rays);
    for (size_t which = 0; which < COUNT_OF(placed); which++) {
        Scene *scene = verify_empty_scene(run);
        const Mesh mesh = ball_make();
        array_push(scene->meshes, mesh);
        const Material material = material_default();
        scene_add_object(scene,
                         (Object){.type = SHAPE_MESH,
                                  .as.mesh = {.is_instance = true, .transform = placed[which].transform}},
                         &material);
        for (uint64_t i = 0; i < COUNT; i++) {
            const Vector3 from = vector_scale(sample_in_cube(73, which * COUNT + i, 0), 0.3);
            rays[i] = verify_ray(run, affine_point(&placed[which].transform, from),
                                 sample_unit_vector(73, which * COUNT + i, 3));
        }
        for (int bounce = 0; bounce < 3; bounce++) {
            const TraceHit *hits = verify_trace(run, scene, true, rays, COUNT);
            for (size_t i = 0; i < COUNT; i++) {
                check_hit(run, scene, &rays[i], &hits[i], placed[which].size);
                if (verify_is_hit(&hits[i]))
                    rays[i] = verify_ray(run, hits[i].reflected_origin, hits[i].reflected_direction);
            }
        }
    }
}
