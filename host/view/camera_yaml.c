#include "host/view/camera_yaml.h"

#include "host/scene/portable.h"

#include <stdlib.h>

// Uses the fewest digits that read back as the same number.
void number_write_yaml(Text *text, double value)
{
    char word[32];
    int digits = 6; // fewer would give 5e+01
    do
        snprintf(word, sizeof word, "%.*g", digits, value);
    while (digits++ < 17 && strtod(word, NULL) != value);
    text_appendf(text, "%s", word);
}

void vector_write_yaml(Text *text, Vector3 v)
{
    text_appendf(text, "[");
    number_write_yaml(text, v.x);
    text_appendf(text, ", ");
    number_write_yaml(text, v.y);
    text_appendf(text, ", ");
    number_write_yaml(text, v.z);
    text_appendf(text, "]");
}

static void vector_write(Text *text, const char *name, Vector3 v)
{
    text_appendf(text, "%s: ", name);
    vector_write_yaml(text, v);
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
        text_appendf(text, "shift: [");
        number_write_yaml(text, camera->shift[0]);
        text_appendf(text, ", ");
        number_write_yaml(text, camera->shift[1]);
        text_appendf(text, "], ");
    }
    if (camera->lens_radius > 0) {
        text_appendf(text, "aperture: ");
        number_write_yaml(text, 2 * camera->lens_radius);
        text_appendf(text, ", ");
        if (camera->has_focus) vector_write(text, "focus", camera->focus);
    }
    if (camera->lens_radius > 0 && camera->focal_distance > 0) {
        text_appendf(text, "focus: ");
        number_write_yaml(text, camera->focal_distance);
        text_appendf(text, ", ");
    }
    if (camera->orthographic) {
        text_appendf(text, "height: ");
        number_write_yaml(text, 2 * camera->half_tangent);
    } else if (camera->equirectangular) {
        text_appendf(text, "projection: equirectangular");
    } else if (camera->field_axis == FIELD_VERTICAL) {
        text_appendf(text, "fov: ");
        number_write_yaml(text, field_of_view(camera->half_tangent));
    } else {
        double width = 2 * camera->half_tangent;
        text_appendf(text, "focal_length: 1, frame: [");
        number_write_yaml(text, width);
        text_appendf(text, ", ");
        number_write_yaml(text, width / aspect);
        text_appendf(text, "]");
    }
    text_appendf(text, "}\n");
}
