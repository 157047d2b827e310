// Wavefront MTL (Alias|Wavefront, Advanced Visualizer manual, MTL material format, 1995), as far as glint's
// materials support it (docs/scene-format.md).
#include "host/import/mesh/mtl.h"
#include "host/base/array.h"
#include "host/base/file.h"
#include "host/base/memory.h"
#include "host/image/image.h"
#include "host/import/mesh/scan.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

typedef struct {
    char *name;
    Material material;
    char *image;           // of map_Kd, or NULL
    char *opacity_image;   // of map_d, or NULL
    char *normal_image;    // of norm or map_Bump, or NULL
    bool has_bumps;        // normal_image is that of map_Bump
    uint32_t scene_index;  // DRAFT_NONE: not in the scene yet
    double dissolve;       // d: the opacity; NAN: not given
    double transparency;   // Tr: 1 - d; NAN: not given
    size_t opacity_offset; // of the last d or Tr
    Color filter;          // Tf: factors of the transmitted light
    double illumination;   // illum; NAN: not given
    size_t illumination_offset;
} MtlMaterial;

typedef struct {
    MeshDraft *draft;
    ARRAY_OF(MtlMaterial) materials;
    ARRAY_OF(struct stat) files; // that were read
    // of the current file
    const char *path;
    Report report;
    Scan scan;
    UnusedWords unused;
    size_t first_material;
    bool has_reflection; // whether reflection was warned of
} MtlReader;

static MtlMaterial *material_of(MtlReader *reader)
{
    return reader->materials.count > reader->first_material
               ? &reader->materials.items[reader->materials.count - 1]
               : NULL;
}

// Sets the opacity of a material after its last line. By the specification, glass has undimmed highlights
// and bends light only with illum 6 and 7. Without illum, Ni alone decides.
static void material_end(MtlReader *reader, MtlMaterial *material)
{
    const double illumination = material->illumination;
    const bool refracts = illumination == 6 || illumination == 7,
               is_glass = refracts || illumination == 4 || illumination == 9,
               has_dissolve = !isnan(material->dissolve), has_transparency = !isnan(material->transparency);
    Material *look = &material->material;
    if (illumination >= 3 && illumination <= 8 && look->specular > 0 && !reader->has_reflection) {
        report_warning(&reader->report, material->illumination_offset,
                       "the reflections of illum 3 to 8 are not shown");
        reader->has_reflection = true;
    }
    if (is_glass && !has_dissolve && !has_transparency)
        report_warning(&reader->report, material->illumination_offset,
                       "illum %g is for glass, but d and Tr are missing: opaque", illumination);
    if (has_dissolve && has_transparency && fabs(1 - material->transparency - material->dissolve) > 1e-3)
        report_warning(&reader->report, material->opacity_offset,
                       "Tr %g does not fit d %g, which it subtracts from 1: d is used",
                       material->transparency, material->dissolve);
    const double opacity = has_dissolve       ? material->dissolve
                           : has_transparency ? 1 - material->transparency
                                              : 1;
    if (opacity == 1) return;
    const double specular = look->specular, ior = look->ior;
    material_set_opacity(look, opacity);
    look->transmission *= fmin(vector_largest(material->filter), 1);
    look->transmission_tint = color_tint(vector_min(material->filter, vector_all(1)));
    if (is_glass) look->specular = specular;
    if (refracts || isnan(illumination)) look->ior = ior;
}

static void name_read(MtlReader *reader, MtlMaterial *previous)
{
    if (previous) material_end(reader, previous);
    const Word name = scan_rest(&reader->scan);
    MtlMaterial material = {.name = memory_copy_part(name.text, name.length),
                            .material = material_default(),
                            .scene_index = DRAFT_NONE,
                            .dissolve = NAN,
                            .transparency = NAN,
                            .filter = {1, 1, 1},
                            .illumination = NAN};
    material.material.ior = 1;
    array_push(reader->materials, material);
}

// Reads a number. Returns false with a warning if it is not a number in the range.
static bool number_of_line(MtlReader *reader, const Range *range, double *value)
{
    double number;
    scan_more(&reader->scan);
    const size_t offset = scan_offset(&reader->scan);
    if (scan_number(&reader->scan, &number) != NUMBER_READ) {
        report_warning(&reader->report, offset, "no number up to %g: the default is used", NUMBER_MAX);
        return false;
    }
    if (!range_holds(range, number)) {
        report_warning(&reader->report, offset, "must be %s, not %g: the default is used", range->must,
                       number);
        return false;
    }
    *value = number;
    return true;
}

// Reads a color from three numbers, or from one for all channels.
static bool color_of_line(MtlReader *reader, Color *color)
{
    double numbers[3];
    int count = 0;
    do
        if (!number_of_line(reader, &range_not_negative, &numbers[count])) return false;
    while (++count < 3 && scan_more(&reader->scan));
    if (count == 1) numbers[1] = numbers[0];
    if (count < 3) numbers[2] = numbers[1];
    *color = (Color){numbers[0], numbers[1], numbers[2]};
    return true;
}

static void diffuse_read(MtlReader *reader, MtlMaterial *material)
{
    color_of_line(reader, &material->material.color);
}

// Reads the specular color and keeps only its strength, because highlights have the light's color.
static void specular_read(MtlReader *reader, MtlMaterial *material)
{
    Color color;
    if (color_of_line(reader, &color)) material->material.specular = (color.x + color.y + color.z) / 3;
}

static void emission_read(MtlReader *reader, MtlMaterial *material)
{
    color_of_line(reader, &material->material.emission);
}

static void filter_read(MtlReader *reader, MtlMaterial *material)
{
    color_of_line(reader, &material->filter);
}

static void shininess_read(MtlReader *reader, MtlMaterial *material)
{
    number_of_line(reader, &range_not_negative, &material->material.shininess);
}

static void ior_read(MtlReader *reader, MtlMaterial *material)
{
    number_of_line(reader, &range_positive, &material->material.ior);
}

static void transparency_read(MtlReader *reader, MtlMaterial *material)
{
    scan_more(&reader->scan);
    material->opacity_offset = scan_offset(&reader->scan);
    number_of_line(reader, &range_unit, &material->transparency);
}

static void dissolve_read(MtlReader *reader, MtlMaterial *material)
{
    Scan ahead = reader->scan;
    const Word word = scan_word(&ahead);
    material->opacity_offset = word.offset;
    if (word_is(word, "-halo")) {
        unused_record(&reader->unused, &reader->report, word, "is not used");
        reader->scan = ahead;
    }
    number_of_line(reader, &range_unit, &material->dissolve);
}

static void illumination_read(MtlReader *reader, MtlMaterial *material)
{
    static const Range range_illumination = {0, 10, false, "from 0 to 10"};
    scan_more(&reader->scan);
    material->illumination_offset = scan_offset(&reader->scan);
    number_of_line(reader, &range_illumination, &material->illumination);
}

// Reads a texture's option, which starts with `-` and has up to three numbers or one word. Stores the value
// of -bm in *multiplier unless `multiplier` is NULL, and skips other options. Sets *is_used to whether it
// stored the value.
static bool texture_option_read(Scan *scan, double *multiplier, bool *is_used)
{
    Scan ahead = *scan;
    const Word word = scan_word(&ahead);
    double number;
    if (word.length < 2 || word.text[0] != '-') return false;
    *scan = ahead;
    int count = 0;
    *is_used =
        multiplier && word_is(word, "-bm") && scan_more(scan) && scan_number(scan, multiplier) == NUMBER_READ;
    if (*is_used) return true;
    while (count < 3 && scan_more(scan) && scan_number(scan, &number) == NUMBER_READ)
        count++;
    if (count == 0) scan_word(scan);
    return true;
}

// Reads the name of an image. `otherwise` describes its replacement if it cannot be read. `multiplier`
// receives the value of -bm and may be NULL.
static void image_read_name(MtlReader *reader, const char *otherwise, char **image, double *multiplier)
{
    scan_more(&reader->scan);
    const size_t offset = scan_offset(&reader->scan);
    bool has_options = false, is_used;
    while (texture_option_read(&reader->scan, multiplier, &is_used))
        has_options |= !is_used;
    if (has_options) report_warning(&reader->report, offset, "options of textures are not used");
    const Word name = scan_rest(&reader->scan);
    bool is_moved;
    char *path = draft_find_file(reader->path, name.text, name.length, &is_moved);
    if (is_moved)
        report_warning(&reader->report, name.offset, "no '%.*s': '%s' is used", word_shown(name), name.text,
                       path);
    const SceneOptions *options = reader->draft->import->options;
    if (options && options->file_named) options->file_named(options->context, path);
    free(*image);
    *image = NULL;
    const char *obstacle = file_obstacle(path);
    if (obstacle)
        report_warning(&reader->report, name.offset, "cannot read '%s': %s: %s", path, obstacle, otherwise);
    else if (!image_is_known(path))
        report_warning(&reader->report, name.offset, "'%s' is not a PNG, JPEG, PPM or EXR: %s", path,
                       otherwise);
    else
        *image = memory_copy_text(path);
    free(path);
}

static void texture_read(MtlReader *reader, MtlMaterial *material)
{
    image_read_name(reader, texture_fallback(TEXTURE_COLORS), &material->image, NULL);
}

static void opacity_texture_read(MtlReader *reader, MtlMaterial *material)
{
    image_read_name(reader, "nothing is cut out", &material->opacity_image, NULL);
}

static void normal_texture_read(MtlReader *reader, MtlMaterial *material)
{
    scan_more(&reader->scan);
    if (material->normal_image)
        report_warning(&reader->report, scan_offset(&reader->scan),
                       "a second map of normals or heights: it replaces the first");
    material->material.normal_strength = 1;
    image_read_name(reader, texture_fallback(TEXTURE_NORMALS), &material->normal_image,
                    &material->material.normal_strength);
    material->has_bumps = false;
}

static void bump_texture_read(MtlReader *reader, MtlMaterial *material)
{
    normal_texture_read(reader, material);
    material->has_bumps = true;
}

static void nothing_read(MtlReader *reader, MtlMaterial *material)
{
    (void)reader;
    (void)material;
}

static const struct {
    const char *word;
    void (*read)(MtlReader *reader, MtlMaterial *material);
} statements[] = {
    {"newmtl", name_read},
    {"Kd", diffuse_read},
    {"Ks", specular_read},
    {"Ns", shininess_read},
    {"Ni", ior_read},
    {"Tr", transparency_read},
    {"d", dissolve_read},
    {"map_Kd", texture_read},
    {"Ka", nothing_read},
    {"illum", illumination_read},
    {"Ke", emission_read},
    {"Tf", filter_read},
    {"map_d", opacity_texture_read},
    {"norm", normal_texture_read},
    {"map_Bump", bump_texture_read},
    {"map_bump", bump_texture_read},
    {"bump", bump_texture_read},
};

static void line_read(MtlReader *reader)
{
    const Word word = scan_word(&reader->scan);
    MtlMaterial *material = material_of(reader);
    if (word.length == 0) return;
    for (size_t i = 0; i < COUNT_OF(statements); i++) {
        if (!word_is(word, statements[i].word)) continue;
        if (i > 0 && !material)
            report_warning(&reader->report, word.offset, "a line before the first newmtl is not used");
        else
            statements[i].read(reader, material);
        return;
    }
    unused_record(&reader->unused, &reader->report, word, "is not used");
}

// Returns whether the file was read under any name.
static bool file_was_read(const MtlReader *reader, const struct stat *file)
{
    for (size_t i = 0; i < reader->files.count; i++)
        if (reader->files.items[i].st_dev == file->st_dev && reader->files.items[i].st_ino == file->st_ino)
            return true;
    return false;
}

// Reads an MTL file unless it was read before.
static bool library_read(MtlReader *reader, const char *path)
{
    struct stat file = {0};
    if (stat(path, &file) == 0 && file_was_read(reader, &file)) return true;
    const SceneOptions *options = reader->draft->import->options;
    if (options && options->file_named) options->file_named(options->context, path);
    Text text = {0};
    MessageList ignored = {0}, messages = {0};
    const bool is_there = !file_obstacle(path) && text_read_file(&text, path, &ignored);
    if (is_there) {
        array_push(reader->files, file);
        const Source source = {.file = path, .bytes = text_c(&text), .length = text.count};
        reader->path = path;
        reader->report = report_open(&source, &messages);
        reader->scan = (Scan){source.bytes, source.bytes + source.length, source.bytes};
        reader->unused.count = 0;
        reader->has_reflection = false;
        reader->first_material = reader->materials.count;
        if (scan_is_text(&reader->scan, &reader->report)) {
            do
                line_read(reader);
            while (scan_line(&reader->scan));
            MtlMaterial *last = material_of(reader);
            if (last) material_end(reader, last);
        }
        report_include(reader->draft->import->report, &reader->report);
    }
    message_list_free(&ignored);
    text_free(&text);
    return is_there;
}

static bool library_of_word_read(MtlReader *reader, Word name)
{
    MeshDraft *draft = reader->draft;
    bool is_moved;
    char *path = draft_find_file(draft->import->path, name.text, name.length, &is_moved);
    const bool read = library_read(reader, path);
    if (is_moved && read)
        report_warning(&draft->report, name.offset, "no '%.*s': '%s' is used", word_shown(name), name.text,
                       path);
    free(path);
    return read;
}

// Reads the files of a line, which is one name with blanks or several names.
static bool libraries_of_line_read(MtlReader *reader, Word line)
{
    bool read = library_of_word_read(reader, line);
    if (read || !memchr(line.text, ' ', line.length)) return read;
    Scan scan = {line.text, line.text + line.length, line.text - line.offset};
    for (Word word = scan_word(&scan); word.length > 0 && word.text < scan.end; word = scan_word(&scan))
        if (!library_of_word_read(reader, word)) return false;
    return true;
}

// Reads the MTL file that has the OBJ file's name, in place of a missing one.
static bool fallback_read(MtlReader *reader)
{
    const char *obj_path = reader->draft->import->path;
    char *path = text_format("%.*smtl", (int)(strlen(obj_path) - strlen("obj")), obj_path);
    const bool read = library_read(reader, path);
    free(path);
    return read;
}

static bool libraries_read(MtlReader *reader, const ObjMaterials *materials)
{
    for (size_t i = 0; i < materials->libraries.count; i++) {
        const Word name = materials->libraries.items[i];
        if (libraries_of_line_read(reader, name) || fallback_read(reader)) continue;
        report_warning(&reader->draft->report, name.offset,
                       "the material file '%.*s' cannot be read: the default material is used",
                       word_shown(name), name.text);
        return false;
    }
    return true;
}

static int materials_compare(const void *a, const void *b)
{
    return strcmp(((const MtlMaterial *)a)->name, ((const MtlMaterial *)b)->name);
}

static int name_compare(const void *name, const void *material)
{
    const Word *word = name;
    const MtlMaterial *other = material;
    const int order = strncmp(word->text, other->name, word->length);
    return order != 0 ? order : other->name[word->length] == '\0' ? 0 : -1;
}

// Adds an image to the scene. Returns 0 with a warning if it cannot be used.
static uint32_t image_add(MeshDraft *draft, const MtlMaterial *material, const char *image,
                          TextureContent content)
{
    if (!draft_has(draft, DRAFT_UV)) {
        draft_warn(draft, "no texture coordinates for the image '%s' of material '%.40s'", image,
                   material->name);
        return 0;
    }
    const uint32_t texture = scene_add_texture(draft->scene, image, NULL, content, draft->import->offset);
    if (texture == 0)
        draft_warn(draft, "too many images in one scene: that of material '%.40s' is not used",
                   material->name);
    return texture;
}

// Sets the textures. Multiplies the image by the diffuse color, as MTL defines. Cuts out the parts that the
// opacity image would blend, by its alpha or, as MTL defines, its luminance.
static void textures_use(MeshDraft *draft, MtlMaterial *material)
{
    Material *look = &material->material;
    const bool is_one_file =
        material->image && material->opacity_image && strcmp(material->image, material->opacity_image) == 0;
    if (material->image)
        look->texture =
            image_add(draft, material, material->image, is_one_file ? TEXTURE_OPACITY : TEXTURE_COLORS);
    if (look->texture > 0) {
        look->diffuse = (Color){look->diffuse.x * look->color.x, look->diffuse.y * look->color.y,
                                look->diffuse.z * look->color.z};
        look->ambient *= (look->color.x + look->color.y + look->color.z) / 3;
    }
    if (material->normal_image)
        look->normal_texture = image_add(draft, material, material->normal_image,
                                         material->has_bumps ? TEXTURE_BUMPS : TEXTURE_NORMALS);
    if (material->opacity_image)
        look->cutout_texture = image_add(draft, material, material->opacity_image, TEXTURE_OPACITY);
    if (look->cutout_texture == 0) return;
    look->cutout = CUTOUT_OF_BLENDED;
    look->cutout_blends = true;
}

static uint32_t material_use(MeshDraft *draft, MtlMaterial *material)
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
    if (reader.materials.count > 0)
        qsort(reader.materials.items, reader.materials.count, sizeof(MtlMaterial), materials_compare);
    MtlMaterial otherwise = {.name = "", .material = material_default(), .scene_index = DRAFT_NONE};
    if (materials->used.count > 0 && materials->used.items[0].first_corner > 0)
        array_push(draft->materials, ((DraftMaterialRun){0, material_use(draft, &otherwise)}));
    UnusedWords unknown = {0};
    for (size_t i = 0; i < materials->used.count; i++) {
        const ObjMaterial *used = &materials->used.items[i];
        MtlMaterial *material = reader.materials.count > 0
                                    ? bsearch(&used->name, reader.materials.items, reader.materials.count,
                                              sizeof(MtlMaterial), name_compare)
                                    : NULL;
        if (!material && all_read)
            unused_record(&unknown, &draft->report, used->name,
                          "is in no material file: the default is used");
        array_push(
            draft->materials,
            ((DraftMaterialRun){used->first_corner, material_use(draft, material ? material : &otherwise)}));
    }
    for (size_t i = 0; i < reader.materials.count; i++) {
        free(reader.materials.items[i].name);
        free(reader.materials.items[i].image);
        free(reader.materials.items[i].opacity_image);
        free(reader.materials.items[i].normal_image);
    }
    free(reader.materials.items);
    free(reader.files.items);
}
