#include "host/api/handles.h"

// The caller's arrays as a film, and its progress function.
typedef struct {
    Film film;
    Vector3 eye;
    GlintProgress progress;
    void *context;
    bool is_stopped;
} Rendering;

static unsigned layers_set(Film *film, const GlintImage *image)
{
    film->color = image->color;
    film->t = image->t;
    film->normal = image->normal;
    film->position = image->position;
    film->object = image->object;
    film->shadow = image->shadow;
    film->flag = image->flag;
    film->coverage = image->coverage;
    film->backdrop = image->backdrop;
    unsigned aovs = 0;
    for (Layer layer = 0; layer < LAYER_COUNT; layer++)
        if (layer != LAYER_COLOR && film->layers[layer]) aovs |= 1U << layer;
    return aovs;
}

// Converts a band's positions from relative to the eye to the scene's coordinates.
static void positions_move(const Rendering *rendering, const Film *band)
{
    const Film *film = &rendering->film;
    const double eye[3] = {rendering->eye.x, rendering->eye.y, rendering->eye.z};
    double *positions = film->position ? film->position + 3 * (size_t)band->first_row * band->width : NULL;
    for (size_t i = 0; positions && i < film_pixel_count(band); i++) {
        double *position = positions + 3 * i;
        const bool is_hit = position[0] != 0 || position[1] != 0 || position[2] != 0;
        for (size_t axis = 0; is_hit && axis < 3; axis++)
            position[axis] += eye[axis];
    }
}

static bool band_receive(void *context, const Film *band)
{
    Rendering *rendering = context;
    film_copy_band(&rendering->film, band);
    positions_move(rendering, band);
    const double fraction_done = (double)(band->first_row + band->height) / rendering->film.height;
    rendering->is_stopped =
        rendering->progress && rendering->progress(rendering->context, fraction_done) != 0;
    return !rendering->is_stopped;
}

// Sets the settings. Returns false with a message if the image is too large or a setting is wrong.
static bool settings_read(RenderSettings *settings, const GlintRenderSettings *given, const Scene *scene,
                          MessageList *messages)
{
    uint32_t width = given->width, height = given->height;
    if ((width == 0) != (height == 0))
        return message_error(messages, "an image needs both width and height, or neither, not %u x %u", width,
                             height);
    scene_choose_image_size(scene, &width, &height);
    if (width > IMAGE_SIDE_MAX || height > IMAGE_SIDE_MAX)
        return message_error(messages, "an image may have at most %d pixels per side, not %u x %u",
                             IMAGE_SIDE_MAX, width, height);
    if (given->samples > SAMPLES_MAX)
        return message_error(messages, "a pixel may have at most %d samples, not %u", SAMPLES_MAX,
                             given->samples);
    Precision precision;
    if (!precision_read(&precision, given->precision, messages)) return false;
    *settings = settings_of_image(width, height, precision);
    if (given->samples > 0) settings->sample_count = given->samples;
    if (!(given->min_contribution >= 0 && given->min_contribution <= 1))
        return message_error(messages, "min_contribution is %g; expected 0 to 1", given->min_contribution);
    settings->bounce_count = given->bounces;
    settings->min_contribution = given->min_contribution;
    settings->lanes = given->lanes;
    settings->shift_to_eye = true;
    return true;
}

GlintStatus glint_render(GlintDevice *device, const GlintScene *scene, const GlintRenderSettings *settings,
                         GlintImage *image, char **messages)
{
    MessageList list = {0};
    GlintRenderSettings given;
    GlintImage arrays;
    RenderSettings render_settings;
    if (!struct_read(&given, sizeof given, settings, "GlintRenderSettings", &list) ||
        !struct_read(&arrays, sizeof arrays, image, "GlintImage", &list) ||
        !settings_read(&render_settings, &given, &scene->scene, &list))
        return call_end(&list, NULL, GLINT_WRONG_INPUT, messages);
    Rendering rendering = {
        .eye = scene->scene.camera.position, .progress = given.progress, .context = given.context};
    rendering.film = (Film){.width = render_settings.width,
                            .height = render_settings.height,
                            .light_count = (uint32_t)scene->scene.lights.count,
                            .real_size = sizeof(double)};
    const unsigned aovs = layers_set(&rendering.film, &arrays);
    if (!arrays.color) {
        message_error(&list, "GlintImage.color must not be NULL");
        return call_end(&list, NULL, GLINT_WRONG_INPUT, messages);
    }
    pthread_mutex_lock(&device->mutex);
    Renderer *renderer = device_renderer(device, &scene->scene, &render_settings, &list);
    if (renderer) renderer_render(renderer, aovs, band_receive, &rendering);
    const GlintStatus status = !renderer              ? GLINT_WRONG_INPUT
                               : rendering.is_stopped ? GLINT_STOPPED
                                                      : GLINT_DONE;
    renderer_close(renderer);
    const GlintStatus ended = call_end(&list, device, status, messages);
    pthread_mutex_unlock(&device->mutex);
    return ended;
}
