#include "host/view/pixel_facts.h"

#include "host/base/text.h"
#include "host/scene/describe.h"
#include <math.h>

enum { LINES_MAX = 24 };

typedef struct {
    const PixelView *view;
    Text text;
    unsigned line_count;
} PathText;

// A ray with a name and its share of the pixel's color.
typedef struct {
    const char *name;
    double weight;
    unsigned depth;
    TraceRay ray;
} Branch;

static void branch_write(PathText *tree, const Branch *branch);

// Writes the secondary rays of a hit (kernels/shading/bounce.h). At total internal reflection or by
// Fresnel's equations, the reflected one carries what is not transmitted. Without transmission, Fresnel's
// equations leave its part unknown.
static void branches_write(PathText *tree, const Branch *branch, const Material *material,
                           const TraceHit *hit)
{
    const bool is_total = material->transmission.largest > 0 && hit->transmission == 0;
    const double kept =
        is_total || material->fresnel ? material->transmission.largest - hit->transmission : 0;
    const Branch reflected = {is_total ? "totally reflected" : "reflected",
                              branch->weight * (material->reflection.largest + kept),
                              branch->depth + 1,
                              {hit->reflected_origin, hit->reflected_direction, 0, INFINITY}};
    const Branch refracted = {"refracted",
                              branch->weight * hit->transmission,
                              branch->depth + 1,
                              {hit->refracted_origin, hit->refracted_direction, 0, INFINITY}};
    branch_write(tree, &reflected);
    branch_write(tree, &refracted);
}

static void branch_write(PathText *tree, const Branch *branch)
{
    const PixelView *view = tree->view;
    TraceHit hit;
    if (branch->weight <= 0 || branch->weight < view->settings->min_contribution ||
        branch->depth > view->settings->bounce_count || tree->line_count > LINES_MAX)
        return;
    if (tree->line_count++ == LINES_MAX) {
        text_appendf(&tree->text, "and more\n");
        return;
    }
    if (!renderer_trace(view->renderer, &branch->ray, 1, &hit)) return;
    text_appendf(&tree->text, "%*s", 2 * (int)branch->depth, "");
    if (branch->depth > 0) text_appendf(&tree->text, "%s, %.3g: ", branch->name, branch->weight);
    size_t primitive;
    const Object *object = scene_find_object(view->scene, hit.object, &primitive);
    object_describe(&tree->text, view->scene, view->scene_path, hit.object);
    if (!object) {
        text_appendf(&tree->text, "\n");
        return;
    }
    text_appendf(&tree->text, ", t %.6g\n", hit.t);
    if (branch->depth == 0) {
        const Vector3 point = vector_add(hit.position, view->scene->camera.position);
        text_appendf(&tree->text, "  at %.6g %.6g %.6g, normal %.4g %.4g %.4g\n", point.x, point.y, point.z,
                     hit.normal.x, hit.normal.y, hit.normal.z);
    }
    const uint32_t material = object_material(view->scene, object, primitive);
    branches_write(tree, branch, &view->scene->materials.items[material], &hit);
}

char *pixel_facts(const PixelView *view, uint32_t x, uint32_t y)
{
    PathText tree = {.view = view};
    const CameraRay ray = camera_ray(&view->scene->camera, view->size, x, y);
    const Vector3 origin = vector_subtract(ray.origin, view->scene->camera.position); // as seen from the eye
    const Branch first = {NULL, 1, 0, {origin, ray.direction, 0, INFINITY}};
    text_appendf(&tree.text, "pixel %u,%u: ", x, y);
    branch_write(&tree, &first);
    return tree.text.items;
}
