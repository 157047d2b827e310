#include "host/view/camera_yaml.h"

#include "host/scene/portable.h"
#include <stdlib.h>

void number_write_yaml(Text *text, double value)
{
    text_appendf(text, "%s", text_number(value, 6).text); // fewer digits would give 5e+01
}

static void list_write(Text *text, const double *values, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        text_appendf(text, "%s", i == 0 ? "[" : ", ");
        number_write_yaml(text, values[i]);
    }
    text_appendf(text, "]");
}

void vector_write_yaml(Text *text, Vector3 v)
{
    list_write(text, (const double[]){v.x, v.y, v.z}, 3);
}

static void vector_write(Text *text, const char *name, Vector3 v)
{
    text_appendf(text, "%s: ", name);
    vector_write_yaml(text, v);
    text_appendf(text, ", ");
}

static void number_write(Text *text, const char *name, double value)
{
    text_appendf(text, "%s: ", name);
    number_write_yaml(text, value);
    text_appendf(text, ", ");
}

// Returns the half tangent of an angle of view, computed as the reader does.
static double half_tangent_of(double degrees)
{
    return portable_tangent(degrees * (M_PI / 360));
}

// Returns the shortest number of degrees that gives the same half_tangent, or the nearest if none does.
static double field_of_view(double half_tangent)
{
    double near = 360 / M_PI * atan(half_tangent);
    for (int digits = 6; digits <= 17; digits++) {
        char word[32];
        snprintf(word, sizeof word, "%.*g", digits, near);
        double degrees = strtod(word, NULL);
        if (half_tangent_of(degrees) == half_tangent) return degrees;
    }
    double below = near, above = near;
    for (int i = 0; i < 8; i++) {
        below = nextafter(below, 0);
        above = nextafter(above, 180);
        if (half_tangent_of(below) == half_tangent) return below;
        if (half_tangent_of(above) == half_tangent) return above;
    }
    return near;
}

void camera_write_yaml(Text *text, const Camera *camera, double aspect)
{
    text_appendf(text, "camera: {");
    vector_write(text, "position", camera->position);
    vector_write(text, "look_at", camera->look_at);
    vector_write(text, "up", camera->up);
    if (camera->shift[0] != 0 || camera->shift[1] != 0) {
        text_appendf(text, "shift: ");
        list_write(text, camera->shift, 2);
        text_appendf(text, ", ");
    }
    if (camera->lens.radius > 0) {
        number_write(text, "aperture", 2 * camera->lens.radius);
        if (camera->lens.focus == FOCUS_POINT) vector_write(text, "focus", camera->lens.point);
        if (camera->lens.focus == FOCUS_DISTANCE) number_write(text, "focus", camera->lens.distance);
    }
    if (camera->projection == PROJECTION_ORTHOGRAPHIC) {
        text_appendf(text, "height: ");
        number_write_yaml(text, 2 * camera->half_tangent);
    } else if (camera->projection == PROJECTION_EQUIRECTANGULAR) {
        text_appendf(text, "projection: equirectangular");
    } else if (camera->field_axis == FIELD_VERTICAL) {
        text_appendf(text, "fov: ");
        number_write_yaml(text, field_of_view(camera->half_tangent));
    } else {
        const double width = 2 * camera->half_tangent;
        text_appendf(text, "focal_length: 1, frame: ");
        list_write(text, (const double[]){width, width / aspect}, 2);
    }
    text_appendf(text, "}\n");
}
