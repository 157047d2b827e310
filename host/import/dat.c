// `.dat`, the scenes of the Tachyon ray tracer (John E. Stone, Tachyon documentation, "Scene description
// files"): case-insensitive keywords and their values, separated by whitespace. docs/scene-format.md lists
// what is read and how it maps to glint.
#include "host/import/dat.h"
#include "host/base/array.h"
#include "host/base/memory.h"
#include "host/base/text.h"

#include <search.h>
#include <stdlib.h>
#include <string.h>

bool dat_skip(DatReader *reader, const char *keyword)
{
    const bool is_next = word_is_in_any_case(value_peek(&reader->line), keyword);
    if (is_next) value_word(&reader->line);
    return is_next;
}

void dat_warn(DatReader *reader, size_t offset, const char *format, ...)
{
    OWNED char *text = NULL;
    ARGUMENTS_FORMAT(text, format);
    if (!report_repeats(&reader->report, MESSAGE_WARNING, NULL, 0, text))
        report_warning(&reader->report, offset, "%s", text);
}

bool dat_expect(DatReader *reader, const char *keyword)
{
    const Word word = value_peek(&reader->line);
    if (dat_skip(reader, keyword)) return true;
    if (!word.length) return report_error(&reader->report, word.offset, "'%s' is missing", keyword);
    return report_error(&reader->report, word.offset, "'%s' is missing before '%.*s'", keyword,
                        WORD_TEXT(word));
}

bool dat_number(DatReader *reader, const char *keyword, double *value)
{
    return dat_expect(reader, keyword) && line_number(&reader->line, keyword, NULL, value);
}

bool dat_coordinates(DatReader *reader, const char *name, Vector3 *vector)
{
    if (!line_vector(&reader->line, name, NULL, vector)) return false;
    vector->z = -vector->z;
    return true;
}

bool dat_vector(DatReader *reader, const char *keyword, Vector3 *vector)
{
    return dat_expect(reader, keyword) && dat_coordinates(reader, keyword, vector);
}

static bool occlusion_read(DatReader *reader)
{
    Vector3 unused;
    double number;
    dat_warn(reader, value_peek(&reader->line).offset, "ambient occlusion is not shown");
    return dat_expect(reader, "ambient_color") &&
           line_vector(&reader->line, "ambient_color", NULL, &unused) &&
           dat_number(reader, "rescale_direct", &number) && dat_number(reader, "samples", &number);
}

static bool shader_mode_read(DatReader *reader)
{
    double unused;
    const Word quality = value_word(&reader->line);
    reader->last_colored = (ColoredMaterial){0}; // its texture's text may have another meaning from now on
    if (!word_is_in_any_case(quality, "full"))
        dat_warn(reader, quality.offset,
                 "shader mode '%.*s' omits effects such as shadows; the scene is rendered with all of them",
                 WORD_TEXT(quality));
    while (!dat_skip(reader, "end_shader_mode")) {
        const Line before = reader->line;
        const Word word = value_word(&reader->line);
        bool read = true;
        if (word_is_in_any_case(word, "trans_vmd"))
            reader->dims_clear = true;
        else if (word_is_in_any_case(word, "trans_orig"))
            reader->dims_clear = false;
        else if (word_is_in_any_case(word, "trans_raster3d"))
            dat_warn(reader, word.offset,
                     "'trans_raster3d' is ignored; opacity does not depend on the angle");
        else if (word_is_in_any_case(word, "shadow_filter_off"))
            dat_warn(reader, word.offset, "'shadow_filter_off' is ignored; transparent objects cast shadows");
        else if (word_is_in_any_case(word, "trans_max_surfaces"))
            read = line_number(&reader->line, "trans_max_surfaces", NULL, &unused);
        else if (word_is_in_any_case(word, "ambient_occlusion"))
            read = occlusion_read(reader);
        else if (!word_is_in_any_case(word, "fog_vmd") && !word_is_in_any_case(word, "shadow_filter_on")) {
            reader->line = before;
            read = dat_expect(reader, "end_shader_mode");
        }
        if (!read) return false;
    }
    return true;
}

// Skips all that follows.
static bool scene_end(DatReader *reader)
{
    reader->line.at = reader->line.end;
    return true;
}

static bool nothing_read(DatReader *reader)
{
    (void)reader;
    return true;
}

// Each `read` reads the words after its keyword. Reports the first error and returns false. Keywords with a
// NULL `read` are not shown, and words after them could look like another statement.
static const struct {
    const char *keyword;
    bool (*read)(DatReader *reader);
    int hidden_words;
} statements[] = {
    {"begin_scene", nothing_read, 0},
    {"resolution", dat_resolution, 0},
    {"shader_mode", shader_mode_read, 0},
    {"camera", dat_camera, 0},
    {"background", dat_background, 0},
    {"light", dat_light, 0},
    {"directional_light", dat_directional_light, 0},
    {"spotlight", dat_spotlight, 0},
    {"texdef", dat_texture_definition, 0},
    {"texalias", dat_texture_alias, 0},
    {"sphere", dat_sphere, 0},
    {"plane", dat_plane, 0},
    {"cylinder", dat_cylinder, 0},
    {"fcylinder", dat_finite_cylinder, 0},
    {"polycylinder", dat_polycylinder, 0},
    {"ring", dat_ring, 0},
    {"box", dat_box, 0},
    {"tri", dat_triangle, 0},
    {"stri", dat_smooth_triangle, 0},
    {"vcstri", dat_colored_triangle, 0},
    {"vertexarray", dat_vertex_array, 0},
    {"end_clipgroup", nothing_read, 0},
    {"end_scene", scene_end, 0},
    {"background_gradient", NULL, 0},
    {"fog", NULL, 0},
    {"imagedef", NULL, 4},
    {"include", NULL, 1},
    {"mgffile", NULL, 1},
    {"scalarvol", NULL, 0},
    {"scape", NULL, 0},
    {"sky_light", NULL, 0},
    {"start_clipgroup", NULL, 0},
    {"tpolyfile", NULL, 0},
};

enum { STATEMENT_COUNT = COUNT_OF(statements) };

static size_t statement_find(Word word)
{
    size_t index = 0;
    while (index < STATEMENT_COUNT && !word_is_in_any_case(word, statements[index].keyword))
        index++;
    return index;
}

// Skips the rest of a statement, up to the next one.
static void statement_skip(DatReader *reader)
{
    for (Word word = value_peek(&reader->line); word.length; word = value_peek(&reader->line)) {
        if (statement_find(word) < STATEMENT_COUNT) return;
        value_word(&reader->line);
    }
}

static void statement_read(void *context)
{
    DatReader *reader = context;
    const Word word = value_word(&reader->line);
    const size_t index = statement_find(word);
    if (index == STATEMENT_COUNT) {
        report_error(&reader->report, word.offset, "unknown statement '%.*s'", WORD_TEXT(word));
    } else if (statements[index].read) {
        if (statements[index].read(reader)) return;
    } else {
        dat_warn(reader, word.offset, "'%s' is not shown", statements[index].keyword);
        for (int i = 0; i < statements[index].hidden_words; i++)
            value_word(&reader->line);
    }
    statement_skip(reader);
}

bool scene_read_dat(Scene *scene, const Source *source, const SceneOptions *options, MessageList *messages)
{
    *scene = (Scene){.color_meaning = COLORS_DISPLAY, .ambient = {1, 1, 1}};
    DatReader reader = {.report = report_open(source, messages), .scene = scene};
    reader.line = line_first(&reader.report, '#');
    reader.line.spans_lines = true;
    if (line_is_text(&reader.line)) {
        if (!word_is_in_any_case(value_peek(&reader.line), "begin_scene"))
            report_error(&reader.report, value_peek(&reader.line).offset,
                         "the scene must start with 'begin_scene'");
        line_elements(&reader.line, scene, statement_read, &reader);
        if (!reader.has_camera && !report_is_full(&reader.report))
            report_error(&reader.report, source->length,
                         "the scene has no camera; a block 'camera' adds one");
    }
    tdestroy(reader.textures, free);
    return scene_finish(scene, &reader.report, options);
}
