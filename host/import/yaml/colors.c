// Reads the colors of YAML scenes, which are linear numbers, sRGB in hexadecimal, or names.
#include "host/base/array.h"
#include "host/image/srgb.h"
#include "host/import/yaml/fields.h"

#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <strings.h>

// The 16 names of HTML 4.01, section 6.5, and some of CSS Color Module Level 4, section 6.1.
static const struct {
    const char *name;
    uint32_t rgb;
} named_colors[] = {
    {"aqua", 0x00FFFF},   {"black", 0x000000},   {"blue", 0x0000FF},  {"brown", 0xA52A2A},
    {"cyan", 0x00FFFF},   {"fuchsia", 0xFF00FF}, {"gold", 0xFFD700},  {"gray", 0x808080},
    {"green", 0x008000},  {"grey", 0x808080},    {"lime", 0x00FF00},  {"magenta", 0xFF00FF},
    {"maroon", 0x800000}, {"navy", 0x000080},    {"olive", 0x808000}, {"orange", 0xFFA500},
    {"pink", 0xFFC0CB},   {"purple", 0x800080},  {"red", 0xFF0000},   {"silver", 0xC0C0C0},
    {"teal", 0x008080},   {"violet", 0xEE82EE},  {"white", 0xFFFFFF}, {"yellow", 0xFFFF00},
};

enum { NAMED_COUNT = COUNT_OF(named_colors) };

// Returns the linear value of an 8-bit channel. Rounds to float, so that the last bits of the host's pow()
// do not matter, since no value lies within a relative 2e-10 of the middle between two floats.
static double channel_decode(uint32_t value)
{
    return (double)(float)srgb_decode((value & 255) / 255.0);
}

static Color color_of_srgb(uint32_t rgb)
{
    return (Color){channel_decode(rgb >> 16), channel_decode(rgb >> 8), channel_decode(rgb)};
}

// Reads the digits of #rgb or #rrggbb. Returns false if the text is neither.
static bool hex_read(const char *digits, uint32_t *rgb)
{
    const size_t length = strlen(digits);
    if ((length != 3 && length != 6) || digits[strspn(digits, "0123456789abcdefABCDEF")] != '\0')
        return false;
    const unsigned repeats = length == 3 ? 2 : 1;
    *rgb = 0;
    for (const char *at = digits; *at; at++)
        for (unsigned i = 0; i < repeats; i++)
            *rgb = *rgb << 4 | (uint32_t)(*at <= '9' ? *at - '0' : (*at & 15) + 9);
    return true;
}

static bool color_name_read(const char *name, uint32_t *rgb)
{
    for (size_t i = 0; i < NAMED_COUNT; i++)
        if (!strcasecmp(name, named_colors[i].name)) {
            *rgb = named_colors[i].rgb;
            return true;
        }
    return false;
}

static bool srgb_read(const char *text, uint32_t *rgb)
{
    return text[0] == '#' ? hex_read(text + 1, rgb) : color_name_read(text, rgb);
}

bool is_color_text(const char *text)
{
    uint32_t rgb;
    return srgb_read(text, &rgb);
}

static bool not_a_color_report(YamlReader *reader, const Field *field, const YamlNode *node)
{
    const char *expected = "a color, such as [1, 0.2, 0], 0.5, '#ff8000' or red", *names[NAMED_COUNT];
    if (node->type != YAML_SCALAR) return expected_report(reader, field->name, expected, node);
    const char *text = yaml_text(&reader->tree, node);
    for (size_t i = 0; i < NAMED_COUNT; i++)
        names[i] = named_colors[i].name;
    const char *nearest = strlen(text) <= WORD_SHOWN ? text_nearest(text, names, NAMED_COUNT) : NULL;
    if (nearest)
        return report_error(&reader->report, node->offset,
                            "'%s' must be a color, not '%s'; did you mean '%s'?", field->name, text, nearest);
    // `color: #ff8000` ends before its comment.
    if (text[0] == '\0') expected = "a color (one that begins with # needs quotes, '#ff8000')";
    return expected_report(reader, field->name, expected, node);
}

// Returns whether a number of the file, without its sign, is written like a display value, with only digits
// and at most 255.
static bool is_display_value(const char *text, double value)
{
    return text[strspn(text, "0123456789")] == '\0' && value <= 255;
}

// Returns false with an error if the three values (one if the node is a scalar) are whole numbers from 0 to
// 255 and one exceeds `most`, which is unlikely for a linear color.
static bool color_is_linear(YamlReader *reader, const Field *field, const YamlNode *node, double most,
                            const Color *color)
{
    const double values[] = {color->x, color->y, color->z};
    double largest = 0;
    const YamlNode *item = node->type == YAML_SCALAR ? node : yaml_first(&reader->tree, node);
    for (size_t i = 0; i < 3; i++) {
        if (!is_display_value(yaml_text(&reader->tree, item), values[i])) return true;
        if (values[i] > largest) largest = values[i];
        if (node->type != YAML_SCALAR) item = yaml_next(&reader->tree, item);
    }
    if (largest <= most) return true;
    const uint32_t rgb = (uint32_t)values[0] << 16 | (uint32_t)values[1] << 8 | (uint32_t)values[2];
    const Color linear = color_of_srgb(rgb);
    return report_error(
        &reader->report, node->offset,
        "'%s' is linear, and 1 is full; for values from 0 to 255, write '#%06x' or [%.4g, %.4g, %.4g]",
        field->name, (unsigned)rgb, linear.x, linear.y, linear.z);
}

static bool color_read(YamlReader *reader, const Field *field, const YamlNode *node, double most,
                       Color *color)
{
    Field channels = *field;
    channels.range = &range_not_negative;
    if (node->type == YAML_SEQUENCE)
        return read_vector(reader, &channels, node, color) &&
               color_is_linear(reader, field, node, most, color);
    if (node->type == YAML_MAPPING) return not_a_color_report(reader, field, node);
    const char *text = yaml_text(&reader->tree, node);
    uint32_t rgb;
    if (srgb_read(text, &rgb)) {
        *color = color_of_srgb(rgb);
        return true;
    }
    double gray;
    if (number_read(text, strlen(text), &gray) == NUMBER_MALFORMED)
        return not_a_color_report(reader, field, node);
    if (!read_number(reader, &channels, node, &gray)) return false;
    *color = (Color){gray, gray, gray};
    return color_is_linear(reader, field, node, most, color);
}

bool read_color(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    return color_read(reader, field, node, 1, target);
}

bool read_strength(YamlReader *reader, const Field *field, const YamlNode *node, void *target)
{
    return color_read(reader, field, node, 31, target);
}
