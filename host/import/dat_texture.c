// Reads Tachyon's textures, which are materials, and their names.
#include "host/base/array.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/import/dat.h"

#include <math.h>
#include <search.h>
#include <stdlib.h>
#include <string.h>

Material dat_texture_default(void)
{
    Material material = material_default();
    material.ambient = 0.1;
    material.diffuse = vector_all(0.9);
    material.shininess = 25;
    material.ior = 1;
    return material;
}

// Holds a texture while it is read.
typedef struct {
    double ambient, diffuse, specular, opacity, phong, phong_size;
    Color color;
    bool is_metal;
} Texture;

// Reads a number. Warns and keeps the default if the number is out of range.
static bool texture_factor_read(DatReader *reader, const char *name, const Range *range, double *factor)
{
    double number;
    const size_t offset = value_peek(&reader->line).offset;
    if (!line_number(&reader->line, name, NULL, &number)) return false;
    if (range_holds(range, number))
        *factor = number;
    else
        dat_warn(reader, offset, "'%s' must be %s, not %g; the default is used", name, range->must, number);
    return true;
}

static bool texture_color_read(DatReader *reader, Color *color)
{
    Color read;
    const size_t offset = value_peek(&reader->line).offset;
    if (!line_vector(&reader->line, "color", NULL, &read)) return false;
    if (numbers_are_sound(read))
        *color = read;
    else
        dat_warn(reader, offset, "each number of 'color' must be 0 or more; the default is used");
    return true;
}

static bool phong_read(DatReader *reader, Texture *texture)
{
    const size_t offset = value_peek(&reader->line).offset;
    texture->is_metal = dat_skip(reader, "metal");
    if (texture->is_metal)
        dat_warn(reader, offset, "highlights have the light's color, not that of metal");
    else
        dat_skip(reader, "plastic");
    return texture_factor_read(reader, "phong", &range_not_negative, &texture->phong);
}

static bool transmode_read(DatReader *reader)
{
    const Word mode = value_word(&reader->line);
    if (word_is_in_any_case(mode, "r3d"))
        dat_warn(reader, mode.offset, "'transmode r3d' is ignored; opacity does not depend on the angle");
    return true;
}

static bool outline_read(DatReader *reader, const char *name)
{
    const size_t offset = value_peek(&reader->line).offset;
    double number;
    if (!line_number(&reader->line, name, NULL, &number)) return false;
    if (number != 0) dat_warn(reader, offset, "outlines are not shown");
    return true;
}

// Reads the number of a procedural texture or an image, and its parameters.
static bool function_read(DatReader *reader)
{
    enum { FIRST_IMAGE = 7, LAST = 10 };
    static const Range range_function = {0, LAST, false, "from 0 to 10"};
    static const char *const keywords[] = {"center", "rotate", "scale", "uaxis", "vaxis", "waxis"};
    const size_t offset = value_peek(&reader->line).offset;
    unsigned function;
    if (!line_whole_number(&reader->line, "texfunc", &range_function, &function)) return false;
    if (function > 0) dat_warn(reader, offset, "texfunc %u is not supported; the color is used", function);
    if (function >= FIRST_IMAGE) value_word(&reader->line);
    for (size_t i = 0; i < COUNT_OF(keywords) && function > 0; i++) {
        Vector3 unused;
        if (dat_skip(reader, keywords[i]) && !line_vector(&reader->line, keywords[i], NULL, &unused))
            return false;
    }
    return true;
}

// Converts a texture to a material. Tachyon's highlight is Blinn's, whose angle between the normal and the
// halfway vector is half of Phong's, and cos(a / 2)^n is about cos(a)^(n / 4).
static Material texture_material(const DatReader *reader, const Texture *texture)
{
    Material material = dat_texture_default();
    material.color = texture->color;
    material.ambient = texture->ambient;
    material.diffuse = vector_all(texture->diffuse);
    material.specular.largest = texture->phong;
    if (texture->is_metal) material.specular.largest *= vector_mean(texture->color);
    material.shininess = texture->phong_size / 4;
    material.reflection.largest = texture->specular;
    if (reader->dims_clear && texture->opacity < 1) material_set_opacity(&material, texture->opacity);
    material.transmission.largest = 1 - texture->opacity;
    return material;
}

// Reads the value after a keyword. Reports an error and returns false if it is invalid.
static bool texture_key_read(DatReader *reader, Word word, Texture *texture)
{
    const struct {
        const char *name;
        const Range *range;
        double *value;
    } factors[] = {{"ambient", &range_not_negative, &texture->ambient},
                   {"diffuse", &range_not_negative, &texture->diffuse},
                   {"specular", &range_unit, &texture->specular},
                   {"opacity", &range_unit, &texture->opacity},
                   {"phong_size", &range_not_negative, &texture->phong_size}};
    for (size_t i = 0; i < COUNT_OF(factors); i++)
        if (word_is_in_any_case(word, factors[i].name))
            return texture_factor_read(reader, factors[i].name, factors[i].range, factors[i].value);
    if (word_is_in_any_case(word, "phong")) return phong_read(reader, texture);
    if (word_is_in_any_case(word, "color")) return texture_color_read(reader, &texture->color);
    if (word_is_in_any_case(word, "transmode")) return transmode_read(reader);
    if (word_is_in_any_case(word, "outline")) return outline_read(reader, "outline");
    if (word_is_in_any_case(word, "outline_width")) return outline_read(reader, "outline_width");
    if (!word.length) return report_error(&reader->report, word.offset, "the texture lacks its 'texfunc'");
    return report_error(&reader->report, word.offset, "unknown texture key '%.*s'", WORD_TEXT(word));
}

bool dat_texture_body(DatReader *reader, Material *material)
{
    Texture texture = {.ambient = 0.1, .diffuse = 0.9, .opacity = 1, .phong_size = 100, .color = {1, 1, 1}};
    Word word = value_word(&reader->line);
    while (!word_is_in_any_case(word, "texfunc") && !word_is_in_any_case(word, "vcst")) {
        if (!texture_key_read(reader, word, &texture)) return false;
        word = value_word(&reader->line);
    }
    *material = texture_material(reader, &texture);
    return word_is_in_any_case(word, "vcst") || function_read(reader);
}

typedef struct {
    Word name;
    uint32_t material; // of the scene
} NamedTexture;

static int named_textures_compare(const void *a, const void *b)
{
    const Word *first = &((const NamedTexture *)a)->name, *second = &((const NamedTexture *)b)->name;
    if (first->length != second->length) return first->length < second->length ? -1 : 1;
    return memcmp(first->text, second->text, first->length);
}

// Adds a texture, which replaces any earlier texture of the same name.
static void named_texture_add(DatReader *reader, Word name, uint32_t material)
{
    NamedTexture *added = memory_allocate(1, sizeof *added);
    *added = (NamedTexture){name, material};
    NamedTexture **known = tsearch(added, &reader->textures, named_textures_compare);
    if (!known) fault("out of memory: reading %s%s", reader->report.source->file, fault_limits());
    if (*known == added) return;
    (*known)->material = material;
    free(added);
}

static uint32_t named_texture_find(DatReader *reader, Word name)
{
    NamedTexture **known = tfind(&(NamedTexture){.name = name}, &reader->textures, named_textures_compare);
    if (known) return (*known)->material;
    dat_warn(reader, name.offset, "unknown texture '%.*s'; white is used", WORD_TEXT(name));
    const Material white = dat_texture_default();
    const uint32_t material = scene_add_material(reader->scene, &white, "");
    named_texture_add(reader, name, material);
    return material;
}

bool dat_texture(DatReader *reader, uint32_t *material)
{
    const Word word = value_word(&reader->line);
    if (!word.length) return report_error(&reader->report, word.offset, "the object's texture is missing");
    if (!word_is_in_any_case(word, "texture")) {
        *material = named_texture_find(reader, word);
        return true;
    }
    Material read;
    if (!dat_texture_body(reader, &read)) return false;
    *material = scene_add_material(reader->scene, &read, "");
    return true;
}

bool dat_texture_definition(DatReader *reader)
{
    const Word name = value_word(&reader->line);
    dat_skip(reader, "texture");
    Material material;
    if (!dat_texture_body(reader, &material)) return false;
    named_texture_add(reader, name, scene_add_material(reader->scene, &material, ""));
    return true;
}

bool dat_texture_alias(DatReader *reader)
{
    const Word name = value_word(&reader->line), other = value_word(&reader->line);
    named_texture_add(reader, name, named_texture_find(reader, other));
    return true;
}
