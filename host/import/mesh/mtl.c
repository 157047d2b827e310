// Wavefront MTL (Alias|Wavefront, Advanced Visualizer manual, MTL material format, 1995), as far as glint's
// materials support it (docs/scene-format.md).
#include "host/import/mesh/mtl.h"
#include "host/base/array.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/image/image.h"
#include "host/import/line.h"

#include <stdlib.h>
#include <string.h>

// A number and its place in the file. The value is NAN if it is not given.
typedef struct {
    double value;
    size_t offset;
} MtlNumber;

typedef struct {
    char *path; // NULL: none
    TextureContent content;
    double strength; // -bm of a map of normals or heights
} MtlImage;

typedef struct {
    char *name;
    size_t offset; // of the name in the file
    size_t number; // of the material among those of all files
    Material material;
    MtlImage color_image, opacity_image, normal_image;
    uint32_t scene_index;   // DRAFT_NONE: not in the scene yet
    MtlNumber dissolve;     // d: the opacity
    MtlNumber transparency; // Tr: 1 - d
    Color filter;           // Tf: factors of the transmitted light
    MtlNumber illumination; // illum
} MtlMaterial;

static const char unsupported[] = "is not supported and is ignored";

typedef struct {
    MeshDraft *draft;
    ARRAY_OF(MtlMaterial) materials;
    ARRAY_OF(FileId) files; // that were read
    // of the current file
    const char *path;
    Report report;
    Line line;
    UnusedWords unused;
    size_t first_material;
    bool has_reflection; // whether reflection was warned of
} MtlReader;

// Returns the material that the file's lines describe, or NULL before the first one.
static MtlMaterial *current_material(MtlReader *reader)
{
    return reader->materials.count > reader->first_material
               ? &reader->materials.items[reader->materials.count - 1]
               : NULL;
}

// Sets the opacity of a material after its last line. By the specification, glass has undimmed highlights
// and bends light only with illum 6 and 7. Without illum, Ni alone decides.
static void material_end(MtlReader *reader, MtlMaterial *material)
{
    const double illumination = material->illumination.value, dissolve = material->dissolve.value,
                 transparency = material->transparency.value;
    const bool refracts = illumination == 6 || illumination == 7,
               is_glass = refracts || illumination == 4 || illumination == 9, has_dissolve = !isnan(dissolve),
               has_transparency = !isnan(transparency);
    Material *look = &material->material;
    if (illumination >= 3 && illumination <= 8 && look->specular.largest > 0 && !reader->has_reflection) {
        report_warning(&reader->report, material->illumination.offset,
                       "the reflections of illum 3 to 8 are not shown");
        reader->has_reflection = true;
    }
    if (is_glass && !has_dissolve && !has_transparency)
        report_warning(&reader->report, material->illumination.offset,
                       "illum %g is for glass, but d and Tr are missing; the material is opaque",
                       illumination);
    const size_t last_offset = material->dissolve.offset > material->transparency.offset
                                   ? material->dissolve.offset
                                   : material->transparency.offset;
    if (has_dissolve && has_transparency && fabs(1 - transparency - dissolve) > 1e-3)
        report_warning(&reader->report, last_offset, "Tr %g contradicts d %g (Tr = 1 - d); d is used",
                       transparency, dissolve);
    const double opacity = has_dissolve ? dissolve : has_transparency ? 1 - transparency : 1;
    if (opacity == 1) return;
    const TintedFactor specular = look->specular;
    const double ior = look->ior;
    material_set_opacity(look, opacity);
    look->transmission.largest *= fmin(vector_largest(material->filter), 1);
    look->transmission.tint = color_tint(vector_min(material->filter, vector_all(1)));
    if (is_glass) look->specular = specular;
    if (refracts || isnan(illumination)) look->ior = ior;
}

static void material_start(MtlReader *reader)
{
    const Word name = line_rest(&reader->line);
    MtlMaterial material = {.name = memory_copy_part(name.text, name.length),
                            .offset = name.offset,
                            .number = reader->materials.count,
                            .material = material_default(),
                            .scene_index = DRAFT_NONE,
                            .dissolve = {.value = NAN},
                            .transparency = {.value = NAN},
                            .filter = {1, 1, 1},
                            .illumination = {.value = NAN}};
    material.material.ior = 1;
    array_push(reader->materials, material);
}

// A statement of a material and the member that it sets.
typedef struct Statement Statement;
struct Statement {
    const char *word;
    // Reads the words after the keyword into the target. If they are invalid, warns, keeps the default and
    // returns false. NULL: ignores them.
    bool (*read)(MtlReader *reader, const Statement *statement, void *target);
    size_t target;          // offset in MtlMaterial
    const Range *range;     // of each number
    TextureContent content; // of an image
};

static bool mtl_factor_read(MtlReader *reader, const Statement *statement, void *target)
{
    const Range *range = statement->range;
    double number;
    const size_t offset = line_word_offset(&reader->line);
    const bool is_number = line_try_number(&reader->line, &number) == NUMBER_READ;
    if (!is_number)
        report_warning(&reader->report, offset,
                       "'%s' must be a number of at most %g in magnitude; the default is used",
                       statement->word, NUMBER_MAX);
    else if (!range_holds(range, number))
        report_warning(&reader->report, offset, "'%s' must be %s, not %g; the default is used",
                       statement->word, range->must, number);
    else
        *(double *)target = number;
    return is_number && range_holds(range, number);
}

// Reads a factor and its place into an MtlNumber.
static bool placed_factor_read(MtlReader *reader, const Statement *statement, void *target)
{
    MtlNumber *number = target;
    number->offset = line_word_offset(&reader->line);
    return mtl_factor_read(reader, statement, &number->value);
}

static bool dissolve_read(MtlReader *reader, const Statement *statement, void *target)
{
    MtlNumber *number = target;
    Line ahead = reader->line;
    const Word word = line_word(&ahead);
    number->offset = word.offset;
    if (word_is(word, "-halo")) {
        unused_record(&reader->unused, &reader->report, word, unsupported);
        reader->line = ahead;
    }
    return mtl_factor_read(reader, statement, &number->value);
}

// Reads a color from three numbers, or from one for all channels.
static bool mtl_color_read(MtlReader *reader, const Statement *statement, void *target)
{
    double numbers[3];
    int count = 0;
    do
        if (!mtl_factor_read(reader, statement, &numbers[count])) return false;
    while (++count < 3 && line_has_word(&reader->line));
    if (count == 1) numbers[1] = numbers[0];
    if (count < 3) numbers[2] = numbers[1];
    *(Color *)target = (Color){numbers[0], numbers[1], numbers[2]};
    return true;
}

// Reads a color and keeps only its strength, because highlights have the light's color.
static bool strength_read(MtlReader *reader, const Statement *statement, void *target)
{
    Color color;
    if (!mtl_color_read(reader, statement, &color)) return false;
    *(double *)target = vector_mean(color);
    return true;
}

// Reads a texture's option, which starts with `-` and has up to three numbers or one word. Stores the value
// of -bm in *multiplier unless `multiplier` is NULL, and skips other options. Sets *is_used to whether it
// stored the value.
static bool texture_option_read(Line *line, double *multiplier, bool *is_used)
{
    Line ahead = *line;
    const Word word = line_word(&ahead);
    double unused[3];
    if (word.length < 2 || word.text[0] != '-') return false;
    *line = ahead;
    *is_used = multiplier && word_is(word, "-bm") && line_try_number(line, multiplier) == NUMBER_READ;
    if (*is_used) return true;
    if (line_try_numbers(line, unused, 3) == 0) line_word(line);
    return true;
}

// Reads the name of an image.
static bool mtl_texture_read(MtlReader *reader, const Statement *statement, void *target)
{
    MtlImage *image = target;
    const bool has_normals = statement->content == TEXTURE_NORMALS || statement->content == TEXTURE_BUMPS;
    const size_t offset = line_word_offset(&reader->line);
    if (has_normals && image->path)
        report_warning(&reader->report, offset, "a second normal or height map replaces the first");
    free(image->path);
    *image = (MtlImage){.content = statement->content, .strength = 1};
    bool has_options = false, is_used;
    while (texture_option_read(&reader->line, has_normals ? &image->strength : NULL, &is_used))
        has_options |= !is_used;
    if (has_options) report_warning(&reader->report, offset, "the options of textures are ignored");
    const Word name = line_rest(&reader->line);
    bool is_moved;
    OWNED char *path = draft_find_file(reader->path, name.text, name.length, &is_moved);
    if (is_moved) report_warning(&reader->report, name.offset, DRAFT_MOVED_FILE, WORD_TEXT(name), path);
    scene_file_named(reader->draft->import->options, path);
    OWNED char *obstacle = texture_obstacle(path, statement->content);
    if (obstacle)
        report_warning(&reader->report, name.offset, "%s", obstacle);
    else
        image->path = memory_release(&path);
    return !obstacle;
}

static const Range range_illumination = {0, 10, false, "from 0 to 10"};

#define LOOK(member) offsetof(MtlMaterial, material.member)

static const Statement statements[] = {
    {"Kd", mtl_color_read, LOOK(color), &range_not_negative},
    {"Ks", strength_read, LOOK(specular.largest), &range_not_negative},
    {"Ns", mtl_factor_read, LOOK(shininess), &range_not_negative},
    {"Ni", mtl_factor_read, LOOK(ior), &range_positive},
    {"Tr", placed_factor_read, offsetof(MtlMaterial, transparency), &range_unit},
    {"d", dissolve_read, offsetof(MtlMaterial, dissolve), &range_unit},
    {"Ka"},
    {"illum", placed_factor_read, offsetof(MtlMaterial, illumination), &range_illumination},
    {"Ke", mtl_color_read, LOOK(emission), &range_not_negative},
    {"Tf", mtl_color_read, offsetof(MtlMaterial, filter), &range_not_negative},
    {"map_Kd", mtl_texture_read, offsetof(MtlMaterial, color_image), NULL, TEXTURE_COLORS},
    {"map_d", mtl_texture_read, offsetof(MtlMaterial, opacity_image), NULL, TEXTURE_OPACITY},
    {"norm", mtl_texture_read, offsetof(MtlMaterial, normal_image), NULL, TEXTURE_NORMALS},
    {"map_Bump", mtl_texture_read, offsetof(MtlMaterial, normal_image), NULL, TEXTURE_BUMPS},
    {"map_bump", mtl_texture_read, offsetof(MtlMaterial, normal_image), NULL, TEXTURE_BUMPS},
    {"bump", mtl_texture_read, offsetof(MtlMaterial, normal_image), NULL, TEXTURE_BUMPS},
};

static void mtl_line_read(MtlReader *reader)
{
    const Word word = line_word(&reader->line);
    MtlMaterial *material = current_material(reader);
    if (word.length == 0) return;
    if (word_is(word, "newmtl")) {
        if (material) material_end(reader, material);
        material_start(reader);
        return;
    }
    for (const Statement *statement = statements; statement < statements + COUNT_OF(statements);
         statement++) {
        if (!word_is(word, statement->word)) continue;
        if (!material)
            report_warning(&reader->report, word.offset, "a line before the first newmtl is ignored");
        else if (statement->read)
            statement->read(reader, statement, (char *)material + statement->target);
        return;
    }
    unused_record(&reader->unused, &reader->report, word, unsupported);
}

// Orders materials of one name as their files do.
static int materials_compare(const void *a, const void *b)
{
    const MtlMaterial *first = a, *second = b;
    const int order = strcmp(first->name, second->name);
    return order != 0 ? order : (first->number > second->number) - (first->number < second->number);
}

// Sorts the materials by name and warns of those of the current file whose name an earlier one has.
static void materials_sort(MtlReader *reader)
{
    if (reader->materials.count == 0) return;
    qsort(reader->materials.items, reader->materials.count, sizeof(MtlMaterial), materials_compare);
    for (size_t i = 1; i < reader->materials.count; i++) {
        const MtlMaterial *material = &reader->materials.items[i];
        if (material->number >= reader->first_material && strcmp(material->name, material[-1].name) == 0)
            report_warning(&reader->report, material->offset,
                           "material '%.40s' is given twice; the last one is used", material->name);
    }
}

// Returns the last material of a name, or NULL if there is none.
static MtlMaterial *material_named(const MtlReader *reader, Word name)
{
    size_t low = 0, high = reader->materials.count;
    MtlMaterial *found = NULL;
    while (low < high) {
        const size_t middle = low + (high - low) / 2;
        MtlMaterial *material = &reader->materials.items[middle];
        const int order = strncmp(material->name, name.text, name.length);
        const bool is_longer = order == 0 && material->name[name.length] != '\0';
        if (order == 0 && !is_longer) found = material;
        if (order > 0 || is_longer)
            high = middle;
        else
            low = middle + 1;
    }
    return found;
}

// Reads an MTL file unless it was read before, under whatever name.
static bool library_read(MtlReader *reader, const char *path)
{
    const FileId file = file_id(path);
    for (size_t i = 0; i < reader->files.count; i++)
        if (file_is_same(reader->files.items[i], file)) return true;
    scene_file_named(reader->draft->import->options, path);
    OwnedText text = {0};
    if (file_obstacle(path) || !text_read_file(&text, path, NULL)) return false;
    MessageList messages = {0};
    array_push(reader->files, file);
    const Source source = {.file = path, .bytes = text_c(&text), .length = text.count};
    reader->path = path;
    reader->report = report_open(&source, &messages);
    reader->line = line_first_of_mesh(&reader->report);
    reader->unused.count = 0;
    reader->has_reflection = false;
    reader->first_material = reader->materials.count;
    if (line_is_text(&reader->line)) {
        do
            mtl_line_read(reader);
        while (line_next(&reader->line));
        MtlMaterial *last = current_material(reader);
        if (last) material_end(reader, last);
        materials_sort(reader);
    }
    report_include(reader->draft->import->report, &reader->report);
    return true;
}

static bool library_of_word_read(MtlReader *reader, Word name)
{
    MeshDraft *draft = reader->draft;
    bool is_moved;
    OWNED char *path = draft_find_file(draft->import->path, name.text, name.length, &is_moved);
    const bool read = library_read(reader, path);
    if (is_moved && read)
        report_warning(&draft->report, name.offset, DRAFT_MOVED_FILE, WORD_TEXT(name), path);
    return read;
}

// Reads the files of a line, which is one name with blanks or several names.
static bool libraries_of_line_read(MtlReader *reader, Word names)
{
    bool read = library_of_word_read(reader, names);
    if (read || !memchr(names.text, ' ', names.length)) return read;
    Line line = line_first_of_mesh(&reader->draft->report);
    line.at = names.text;
    for (Word word = line_word(&line); word.length > 0 && word.text < names.text + names.length;
         word = line_word(&line))
        if (!library_of_word_read(reader, word)) return false;
    return true;
}

// Reads the MTL file that has the OBJ file's name, in place of a missing one.
static bool fallback_read(MtlReader *reader)
{
    const char *obj_path = reader->draft->import->path;
    OWNED char *path = text_format("%.*smtl", (int)(strlen(obj_path) - strlen("obj")), obj_path);
    return library_read(reader, path);
}

static bool libraries_read(MtlReader *reader, const ObjMaterials *materials)
{
    for (size_t i = 0; i < materials->libraries.count; i++) {
        const Word name = materials->libraries.items[i];
        if (libraries_of_line_read(reader, name) || fallback_read(reader)) continue;
        report_warning(&reader->draft->report, name.offset,
                       "the material file '%.*s' cannot be read; the default material is used",
                       WORD_TEXT(name));
        return false;
    }
    return true;
}

// Adds an image to the scene. Returns 0 if there is none, or with a warning if it cannot be used.
static uint32_t mtl_image_add(MeshDraft *draft, const MtlMaterial *material, const MtlImage *image)
{
    if (!image->path) return 0;
    if (!draft_has(draft, DRAFT_UV)) {
        draft_warn(draft, "the mesh has no texture coordinates for the image '%s' of material '%.40s'; %s",
                   image->path, material->name, texture_fallback(image->content));
        return 0;
    }
    return draft_add_checked_texture(draft, image->path, image->content, material->name);
}

// Sets the textures. Multiplies the image by the diffuse color, as MTL defines. Cuts out the parts that the
// opacity image would blend, by its alpha or, as MTL defines, its luminance.
static void textures_use(MeshDraft *draft, MtlMaterial *material)
{
    Material *look = &material->material;
    MtlImage *color = &material->color_image;
    const MtlImage *opacity = &material->opacity_image;
    if (color->path && opacity->path && strcmp(color->path, opacity->path) == 0)
        color->content = TEXTURE_OPACITY;
    look->image.texture = mtl_image_add(draft, material, color);
    if (look->image.texture > 0) {
        look->diffuse = vector_multiply(look->diffuse, look->color);
        look->ambient *= vector_mean(look->color);
    }
    look->normal_map.texture = mtl_image_add(draft, material, &material->normal_image);
    if (look->normal_map.texture > 0) look->normal_map.strength = material->normal_image.strength;
    look->cutout.texture = mtl_image_add(draft, material, opacity);
    if (look->cutout.texture == 0) return;
    look->cutout.threshold = CUTOUT_OF_BLENDED;
    look->cutout.blends = true;
}

static uint32_t mtl_material_add(MeshDraft *draft, MtlMaterial *material)
{
    if (material->scene_index == DRAFT_NONE) {
        textures_use(draft, material);
        material->scene_index = scene_add_material(draft->scene, &material->material, material->name);
    }
    return material->scene_index;
}

void obj_materials_read(MeshDraft *draft, const ObjMaterials *materials)
{
    MtlReader reader = {.draft = draft};
    const bool all_read = libraries_read(&reader, materials);
    MtlMaterial otherwise = {.name = "", .material = material_default(), .scene_index = DRAFT_NONE};
    if (materials->used.count > 0 && materials->used.items[0].first_corner > 0)
        array_push(draft->materials, ((DraftMaterialRun){0, mtl_material_add(draft, &otherwise)}));
    UnusedWords unknown = {0};
    for (size_t i = 0; i < materials->used.count; i++) {
        const ObjMaterial *used = &materials->used.items[i];
        MtlMaterial *material = material_named(&reader, used->name);
        if (!material && all_read)
            unused_record(&unknown, &draft->report, used->name,
                          "is in no material file; the default material is used");
        array_push(draft->materials,
                   ((DraftMaterialRun){used->first_corner,
                                       mtl_material_add(draft, material ? material : &otherwise)}));
    }
    for (size_t i = 0; i < reader.materials.count; i++) {
        MtlMaterial *material = &reader.materials.items[i];
        free(material->name);
        free(material->color_image.path);
        free(material->opacity_image.path);
        free(material->normal_image.path);
    }
    free(reader.materials.items);
    free(reader.files.items);
}
