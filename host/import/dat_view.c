// Reads Tachyon's cameras and lights.
#include "host/base/array.h"
#include "host/import/dat.h"

bool dat_resolution(DatReader *reader)
{
    return line_is_first(&reader->line, &reader->has_resolution, "resolution") &&
           line_whole_number(&reader->line, "width", &range_pixels, &reader->scene->width) &&
           line_whole_number(&reader->line, "height", &range_pixels, &reader->scene->height);
}

// Holds the values of a camera's block.
typedef struct {
    double zoom, aspect, frustum[4]; // frustum: left, right, bottom, top at a distance of 1
    bool has_frustum;
    Vector3 center, view, up;
} CameraBlock;

static bool projection_read(DatReader *reader)
{
    double unused;
    if (!dat_skip(reader, "projection")) return true;
    const Word name = value_word(&reader->line);
    if (word_is_in_any_case(name, "orthographic")) {
        reader->scene->camera.projection = PROJECTION_ORTHOGRAPHIC;
    } else if (word_is_in_any_case(name, "perspective_dof")) {
        report_warning(&reader->report, name.offset, "depth of field is not shown; everything is in focus");
        return dat_number(reader, "focallength", &unused) && dat_number(reader, "aperture", &unused);
    } else if (word_is_in_any_case(name, "fisheye")) {
        report_warning(&reader->report, name.offset,
                       "the fisheye projection is not supported; perspective is used");
    } else if (!word_is_in_any_case(name, "perspective")) {
        return report_error(&reader->report, name.offset, "unknown projection '%.*s'", WORD_TEXT(name));
    }
    return true;
}

// Reads a camera's block. Skips the rays per pixel and their depth, which glint's command line sets.
static bool camera_block_read(DatReader *reader, CameraBlock *block)
{
    double unused;
    if (!projection_read(reader) || !dat_expect(reader, "zoom") ||
        !line_number(&reader->line, "zoom", &range_positive, &block->zoom) ||
        !dat_expect(reader, "aspectratio"))
        return false;
    const size_t offset = value_peek(&reader->line).offset;
    if (!line_number(&reader->line, "aspectratio", &range_positive, &block->aspect)) return false;
    if (block->aspect != 1)
        report_warning(&reader->report, offset, "'aspectratio' is ignored; pixels are square");
    if (!dat_number(reader, "antialiasing", &unused) || !dat_number(reader, "raydepth", &unused) ||
        !dat_vector(reader, "center", &block->center) || !dat_vector(reader, "viewdir", &block->view) ||
        !dat_vector(reader, "updir", &block->up))
        return false;
    block->has_frustum = dat_skip(reader, "frustum");
    for (int i = 0; i < 4 && block->has_frustum; i++)
        if (!line_number(&reader->line, "frustum", NULL, &block->frustum[i])) return false;
    return dat_expect(reader, "end_camera");
}

bool dat_camera(DatReader *reader)
{
    const size_t offset = reader->line.start;
    CameraBlock block;
    if (!line_is_first(&reader->line, &reader->has_camera, "camera") || !camera_block_read(reader, &block))
        return false;
    if (vector_is_zero(block.view))
        return report_error(&reader->report, offset, "'viewdir' must not be zero");
    double height = 1 / block.zoom;
    if (block.has_frustum) {
        const double *f = block.frustum;
        height = f[3] - f[2];
        if (!(f[1] > f[0] && height > 0))
            return report_error(&reader->report, offset,
                                "'frustum' must be left, right, bottom and top, in ascending pairs");
        reader->scene->camera.shift[0] = (f[0] + f[1]) / 2 / height;
        reader->scene->camera.shift[1] = (f[2] + f[3]) / 2 / height;
        reader->scene->camera.frame_aspect = (f[1] - f[0]) / height;
    }
    Camera *camera = &reader->scene->camera;
    camera_look_along(camera, block.center, vector_normalize(block.view));
    camera->up = block.up;
    camera->field_axis = FIELD_VERTICAL;
    camera->half_tangent = height / 2;
    return true;
}

bool dat_background(DatReader *reader)
{
    return line_vector(&reader->line, "background", &range_not_negative, &reader->scene->background);
}

static bool fading_read(DatReader *reader, Light *light)
{
    static const char *const names[] = {"constant", "linear", "quadratic"};
    const size_t offset = value_peek(&reader->line).offset;
    if (!dat_skip(reader, "attenuation")) return true;
    double sum = 0;
    for (int i = 0; i < 3; i++) {
        if (!dat_number(reader, names[i], &light->fading[i])) return false;
        sum = light->fading[i] < 0 ? -INFINITY : sum + light->fading[i];
    }
    return sum > 0 || report_error(&reader->report, offset,
                                   "the numbers of 'attenuation' must be 0 or more, and one must be above 0");
}

static bool light_end(DatReader *reader, Light light)
{
    const size_t offset = value_peek(&reader->line).offset;
    if (!dat_expect(reader, "color") || !line_vector(&reader->line, "color", NULL, &light.color))
        return false;
    if (!numbers_are_sound(light.color))
        return report_error(&reader->report, offset, "each number of 'color' must be 0 or more");
    if (light.type != LIGHT_POINT && vector_is_zero(light.direction))
        return report_error(&reader->report, offset, "'direction' must not be zero");
    light_fold_fading(&light);
    array_push(reader->scene->lights, light);
    return true;
}

static bool light_place_read(DatReader *reader, Light *light)
{
    double radius;
    if (!dat_vector(reader, "center", &light->position)) return false;
    const size_t offset = value_peek(&reader->line).offset;
    if (!dat_number(reader, "rad", &radius)) return false;
    if (radius > 0) dat_warn(reader, offset, "the radius of lights is ignored; they are not visible");
    return true;
}

bool dat_light(DatReader *reader)
{
    Light light = {.type = LIGHT_POINT};
    return light_place_read(reader, &light) && fading_read(reader, &light) && light_end(reader, light);
}

bool dat_directional_light(DatReader *reader)
{
    Light light = {.type = LIGHT_DIRECTIONAL};
    return dat_vector(reader, "direction", &light.direction) && light_end(reader, light);
}

bool dat_spotlight(DatReader *reader)
{
    Light light = {.type = LIGHT_SPOT};
    double start;
    if (!light_place_read(reader, &light) || !dat_vector(reader, "direction", &light.direction) ||
        !dat_number(reader, "falloff_start", &start) || !dat_expect(reader, "falloff_end") ||
        !line_number(&reader->line, "falloff_end", &range_half_turn, &light.spot.half_angle))
        return false;
    light.spot.penumbra = light.spot.half_angle - fmin(fmax(start, 0), light.spot.half_angle);
    return fading_read(reader, &light) && light_end(reader, light);
}
