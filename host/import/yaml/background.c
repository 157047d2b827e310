#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/import/yaml/yaml.h"
#include "host/scene/daylight.h"
#include "host/scene/portable.h"

#include <string.h>

static const Range range_right_angle = {-90, 90, false, "from -90 to 90"};

static bool is_leap(int year)
{
    return year % 4 == 0 && (year % 100 != 0 || year % 400 == 0);
}

// Reads a date such as 2026-06-21 into a double, the days since the epoch.
static bool read_date(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const int lengths[] = {31, 28, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31};
    static const char form[] = "0000-00-00";
    const char *text = yaml_text(&reader->tree, node);
    int parts[3] = {0}, *part = parts; // year, month and day
    bool fits = strlen(text) == strlen(form);
    for (size_t i = 0; fits && form[i]; i++) {
        const bool is_digit = text[i] >= '0' && text[i] <= '9';
        fits = is_digit == (form[i] == '0') && (is_digit || text[i] == form[i]);
        if (is_digit)
            *part = 10 * *part + (text[i] - '0');
        else if (fits)
            part++;
    }
    const int year = parts[0], month = parts[1], day = parts[2];
    fits = fits && month >= 1 && month <= 12 && day >= 1 &&
           day <= lengths[month - 1] + (month == 2 && is_leap(year));
    if (!fits) return expected_report(reader, field->name, "a day such as 2026-06-21", node);
    *(double *)target = days_from_epoch(year, month, day);
    return true;
}

// Reads the sun's direction, or a place and a time.
static bool read_sun(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    typedef struct {
        Sun sun;
        double latitude, longitude, days, hour;
    } SunFields;
    static const Range range_longitude = {-180, 180, false, "from -180 to 180"};
    static const Range range_hour = {-10000, 10000, false, "from -10000 to 10000"};
    enum { FORM_POSITION = FORM_FIRST, FORM_TIME = FORM_SECOND };
    static const Field fields[] = {
        {"elevation", read_number, offsetof(SunFields, sun.position.elevation), REQUIRED | FORM_POSITION,
         &range_right_angle},
        {"azimuth", read_number, offsetof(SunFields, sun.position.azimuth), REQUIRED | FORM_POSITION},
        {"latitude", read_number, offsetof(SunFields, latitude), REQUIRED | FORM_TIME, &range_right_angle},
        {"longitude", read_number, offsetof(SunFields, longitude), REQUIRED | FORM_TIME, &range_longitude},
        {"date", read_date, offsetof(SunFields, days), REQUIRED | FORM_TIME},
        {"hour", read_number, offsetof(SunFields, hour), REQUIRED | FORM_TIME, &range_hour},
        {"angle", read_number, offsetof(SunFields, sun.angle), OPTIONAL, &range_disc_angle},
        {"light", read_boolean, offsetof(SunFields, sun.shines)},
    };
    SunFields read = {.sun.shines = true};
    const Form form = fields_read(reader, node, field->name, fields, COUNT_OF(fields), &read);
    if (!form) return false;
    if (form == FORM_TIME)
        read.sun.position = sun_position(read.latitude, read.longitude, read.days + read.hour / 24);
    read.sun.node = node;
    *(Sun *)target = read.sun;
    return true;
}

bool read_background(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    static const Range range_turbidity = {TURBIDITY_MIN, TURBIDITY_MAX, false, "from 2 to 10"};
    enum { FORM_COLORS = FORM_FIRST, FORM_IMAGE = FORM_SECOND, FORM_SUN = FORM_THIRD };
    static const Field fields[] = {
        {"horizon", read_strength, offsetof(Background, horizon), REQUIRED | FORM_COLORS},
        {"zenith", read_strength, offsetof(Background, zenith), REQUIRED | FORM_COLORS},
        {"nadir", read_strength, offsetof(Background, nadir), FORM_COLORS},
        {"image", read_texture, offsetof(Background, texture), REQUIRED | FORM_IMAGE},
        {"sun", read_sun, offsetof(Background, sun), REQUIRED | FORM_SUN},
        {"turbidity", read_number, offsetof(Background, turbidity), FORM_SUN, &range_turbidity},
        {"ground", read_color, offsetof(Background, ground), FORM_SUN},
        {"intensity", read_number, offsetof(Background, intensity), FORM_IMAGE | FORM_SUN,
         &range_not_negative},
        {"turn", read_number, offsetof(Background, turn), FORM_IMAGE | FORM_SUN},
        {"up", read_direction, offsetof(Background, up)},
        {"light", read_boolean, offsetof(Background, is_light)},
    };
    Background *background = target;
    if (node->type != YAML_MAPPING) return read_strength(reader, field, node, &background->horizon);
    background->up = (Vector3){0, 1, 0};
    background->nadir = vector_all(NAN);
    background->intensity = 1;
    background->turbidity = 3;
    background->ground = vector_all(0.2);
    if (!fields_read(reader, node, field->name, fields, COUNT_OF(fields), background)) return false;
    if (isnan(background->nadir.x)) background->nadir = background->horizon;
    return true;
}

// Returns the mean of the colors over all directions.
static Color background_mean(const Background *background)
{
    if (vector_is_zero(background->up) || background->is_light) return vector_all(0);
    const Color poles = vector_add(background->zenith, background->nadir);
    return vector_add(vector_scale(background->horizon, 0.5), vector_scale(poles, 0.25));
}

// Adds the light of the sun. `forward` is the horizontal direction towards it.
static void sun_add(Scene *scene, const Background *background, Vector3 forward, Vector3 up)
{
    const double elevation = background->sun.position.elevation * (M_PI / 180);
    const Vector3 to_sun = vector_add(vector_scale(forward, portable_cosine(elevation)),
                                      vector_scale(up, portable_sine(elevation)));
    const Color color = sun_color(background->sun.position.elevation, background->turbidity);
    Light light = {.type = LIGHT_DIRECTIONAL,
                   .color = vector_scale(color, background->intensity),
                   .direction = vector_scale(to_sun, -1)};
    light_set_angle(&light, background->sun.angle);
    array_push(scene->lights, light);
}

void yaml_set_background(YamlReader *reader, const Background *background, Color ambient)
{
    Scene *scene = reader->scene;
    const bool has_ambient = !isnan(ambient.x), has_sun = background->sun.node != NULL;
    scene->background = background->horizon;
    scene->sky.up = background->up;
    scene->sky.zenith = background->zenith;
    scene->sky.nadir = background->nadir;
    scene->ambient = has_ambient ? ambient : background_mean(background);
    scene->sky.is_light = background->is_light;
    if (vector_is_zero(background->up) || reader->report.error_count > 0) return;
    // -z, or -x if -z is parallel to `up`
    const Vector3 up = vector_normalize(background->up);
    Vector3 right = vector_cross((Vector3){0, 0, -1}, up);
    if (vector_length(right) < 1e-6) right = vector_cross((Vector3){-1, 0, 0}, up);
    const double turn = has_sun ? background->turn - background->sun.position.azimuth : background->turn;
    scene->sky.forward = vector_turned(vector_cross(up, right), up, turn);
    if (background->texture == 0 && !has_sun) return;
    scene->sky.texture = background->texture;
    scene->sky.is_ambient = !has_ambient && !background->is_light;
    scene->sky.intensity = background->intensity;
    if (!has_sun) return;
    const SceneTexture sky = {.path = memory_copy_text("the sky"),
                              .offset = background->sun.node->offset,
                              .image = daylight_image(background->sun.position.elevation,
                                                      background->turbidity, background->ground)};
    array_push(scene->textures, sky);
    scene->sky.texture = (uint32_t)scene->textures.count;
    if (background->sun.shines) sun_add(scene, background, scene->sky.forward, up);
}
