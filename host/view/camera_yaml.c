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
    list_write(text, &v.x, 3);
}

// Writes a member of the camera, whose value is a list if `count` is above 1.
static void member_write(Text *text, const char *name, const double *values, size_t count)
{
    const bool is_first = text->items[text->count - 1] == '{';
    text_appendf(text, "%s%s: ", is_first ? "" : ", ", name);
    if (count == 1)
        number_write_yaml(text, values[0]);
    else
        list_write(text, values, count);
}

static void number_write(Text *text, const char *name, double value)
{
    member_write(text, name, &value, 1);
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
    member_write(text, "position", &camera->position.x, 3);
    member_write(text, "look_at", &camera->look_at.x, 3);
    member_write(text, "up", &camera->up.x, 3);
    if (camera->shift[0] != 0 || camera->shift[1] != 0) member_write(text, "shift", camera->shift, 2);
    if (camera->lens.radius > 0) {
        number_write(text, "aperture", 2 * camera->lens.radius);
        if (camera->lens.focus == FOCUS_POINT) member_write(text, "focus", &camera->lens.point.x, 3);
        if (camera->lens.focus == FOCUS_DISTANCE) number_write(text, "focus", camera->lens.distance);
    }
    if (camera->projection == PROJECTION_ORTHOGRAPHIC) {
        number_write(text, "height", 2 * camera->half_tangent);
    } else if (camera->projection == PROJECTION_EQUIRECTANGULAR) {
        text_appendf(text, ", projection: equirectangular");
    } else if (camera->field_axis == FIELD_VERTICAL) {
        number_write(text, "fov", field_of_view(camera->half_tangent));
    } else {
        const double width = 2 * camera->half_tangent;
        number_write(text, "focal_length", 1);
        member_write(text, "frame", (const double[]){width, width / aspect}, 2);
    }
    text_appendf(text, "}\n");
}
