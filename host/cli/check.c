// glint check reads a scene and reports its contents. It needs no device.
#include "host/base/exit_status.h"
#include "host/base/file.h"
#include "host/base/json.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/options.h"
#include "host/cli/report_json.h"
#include "host/compile/compile.h"
#include "host/compile/features.h"
#include "host/compile/scene_bounds.h"
#include "host/import/load.h"
#include "host/import/report.h"
#include "host/scene/describe.h"
#include <ctype.h>
#include <inttypes.h>
#include <stdio.h>

typedef struct {
    CommonOptions common;
    CommandOperands scenes;
    uint32_t object; // UINT32_MAX if not given
} CheckOptions;

static const Option command_options[] = {
    {"object", "ID", "print one object and its line; IDs are those of glint trace", option_count,
     offsetof(CheckOptions, object), NUMBERS(0, UINT32_MAX - 1)}};

static bool prints_json(const CheckOptions *options)
{
    return options->common.report.format == FORMAT_JSON;
}

static const char *options_check(void *check_options)
{
    const CheckOptions *options = check_options;
    if (prints_json(options) && options->object != UINT32_MAX)
        return "--object cannot be combined with --json";
    if (options->scenes.count > 1 && (prints_json(options) || options->object != UINT32_MAX))
        return "--json and --object take one scene, but several are given";
    return NULL;
}

static const CommandLine command_line = {
    .command = "check",
    .usage = "usage: glint check SCENE... [OPTIONS]\n\n"
             "Reports a scene's objects, lights, materials, bounds and kernel features, and warns of what is "
             "ignored. For\nseveral scenes it prints one line each.\n",
    .groups = {OPTIONS(command_options), OPTION(report_options[REPORT_JSON]), OPTIONS(set_options),
               OPTION(common_options[COMMON_LENIENT]), OPTIONS(max_pixels_option)},
    OPERANDS(SCENES, CheckOptions, scenes),
    .check = options_check};

typedef struct {
    size_t shapes[SHAPE_COUNT], mesh_triangle_count;
    SceneExtent extent;
    FeatureSet features;
} SceneFacts;

static SceneFacts facts_of(const Scene *scene)
{
    SceneFacts facts = {0};
    for (size_t i = 0; i < scene->objects.count; i++) {
        const Object *object = &scene->objects.items[i];
        facts.shapes[object_shape(object)]++;
        if (object->type == SHAPE_MESH) facts.mesh_triangle_count += object_primitive_count(scene, object);
    }
    facts.extent = scene_extent(scene);
    facts.features = features_of(scene);
    return facts;
}

// Returns a feature's name as text: SPOT_LIGHTS becomes "spot lights".
static void feature_name_write(char *target, size_t size, const char *name)
{
    size_t i = 0;
    for (; name[i] != '\0' && i + 1 < size; i++)
        target[i] = name[i] == '_' ? ' ' : (char)tolower((unsigned char)name[i]);
    target[i] = '\0';
}

static void text_print(const char *path, const Scene *scene, const SceneFacts *facts)
{
    printf("%s\n  objects    %zu", path, scene->objects.count);
    const char *separator = ": ";
    for (size_t type = 0; type < SHAPE_COUNT; type++) {
        if (facts->shapes[type] == 0) continue;
        printf("%s%zu %s", separator, facts->shapes[type], shape_names[type]);
        separator = ", ";
    }
    if (facts->mesh_triangle_count > 0)
        printf(" (of %zu triangle%s)", facts->mesh_triangle_count, text_plural(facts->mesh_triangle_count));
    printf("\n  lights     %zu\n  materials  %zu\n  bounds     ", scene->lights.count,
           scene->materials.count);
    Vector3 low = facts->extent.bounds.min, high = facts->extent.bounds.max;
    if (bounds_is_empty(&facts->extent.bounds))
        printf("none");
    else
        printf("%g %g %g to %g %g %g", low.x, low.y, low.z, high.x, high.y, high.z);
    if (facts->extent.unbounded_count > 0)
        printf(", plus %zu unbounded object%s", facts->extent.unbounded_count,
               text_plural(facts->extent.unbounded_count));
    if (scene->animation.frame_count > 0) printf("\n  frames     %" PRIu32, scene->animation.frame_count);
    if (scene->animation.frame_rate > 0) printf("\n  fps        %g", scene->animation.frame_rate);
    printf("\n  features  %s", facts->features ? "" : " none");
    for (unsigned i = 0; i < FEATURE_COUNT; i++) {
        if (!(facts->features >> i & 1)) continue;
        char name[64];
        feature_name_write(name, sizeof name, feature_names[i]);
        printf(" %s%s", name, facts->features >> i >> 1 ? "," : "");
    }
    printf("\n");
}

static void messages_json(Json *json, const char *key, MessageSeverity severity, const MessageList *messages)
{
    json_begin_array(json, key);
    for (size_t i = 0; i < messages->count; i++) {
        const Message *message = &messages->items[i];
        if (message->severity == severity)
            json_addf(json, "{file %s line %u column %u text %s}", message->file, message->line,
                      message->column, message->text);
    }
    json_end(json);
}

static void facts_json(Json *json, const Scene *scene)
{
    const SceneFacts facts = facts_of(scene);
    const Vector3 low = facts.extent.bounds.min, high = facts.extent.bounds.max;
    json_count(json, "objects", scene->objects.count);
    json_begin_object(json, "shapes");
    for (size_t type = 0; type < SHAPE_COUNT; type++)
        if (type != SHAPE_OVAL) json_count(json, shape_names[type], facts.shapes[type]);
    json_end(json);
    json_addf(json, "mesh_triangles %zu unbounded %zu lights %zu materials %zu frames %u fps %g",
              facts.mesh_triangle_count, facts.extent.unbounded_count, scene->lights.count,
              scene->materials.count, scene->animation.frame_count, scene->animation.frame_rate);
    if (bounds_is_empty(&facts.extent.bounds))
        json_none(json, "bounds");
    else
        json_addf(json, "bounds {min [%g %g %g] max [%g %g %g]}", low.x, low.y, low.z, high.x, high.y,
                  high.z);
    json_begin_array(json, "features");
    for (unsigned i = 0; i < FEATURE_COUNT; i++)
        if (facts.features >> i & 1) json_text(json, NULL, feature_names[i]);
    json_end(json);
}

static void json_report(const char *path, const Scene *scene, bool loaded, const MessageList *messages)
{
    Json *json = report_json_open(1, NULL);
    json_addf(json, "scene %s valid %d", path, loaded);
    if (loaded) facts_json(json, scene);
    messages_json(json, "warnings", MESSAGE_WARNING, messages);
    messages_json(json, "errors", MESSAGE_ERROR, messages);
    json_print(json, stdout);
}

// Returns whether the scene fits the default precision of glint render.
static bool scene_renders(const Scene *scene, MessageList *messages)
{
    const CompileSettings settings = {.width = 1,
                                      .height = 1,
                                      .sample_count = 1,
                                      .precision = PRECISION_SINGLE,
                                      .lanes = 1,
                                      .bvh = BVH_OFF,
                                      .shift_to_eye = true};
    OwnedCompiledScene compiled = {0};
    return scene_compile(&compiled, scene, &settings, messages);
}

static bool object_print(const Scene *scene, const char *path, uint32_t id)
{
    size_t primitive;
    if (!scene_find_object(scene, id, &primitive)) {
        stderr_print("--object: there is no object %u; the scene has %zu", id, scene_primitive_count(scene));
        return false;
    }
    OwnedText text = {0};
    object_describe(&text, scene, path, id);
    printf("%s\n", text_c(&text));
    return true;
}

// Prints a scene's line in the report of several.
static void line_print(const char *path, const Scene *scene, bool loaded, const MessageList *messages)
{
    const size_t errors = message_count(messages, MESSAGE_ERROR),
                 warnings = message_count(messages, MESSAGE_WARNING);
    if (loaded)
        printf("%s: %zu object%s, %zu light%s, %zu material%s", path, scene->objects.count,
               text_plural(scene->objects.count), scene->lights.count, text_plural(scene->lights.count),
               scene->materials.count, text_plural(scene->materials.count));
    else
        printf("%s: %zu error%s", path, errors, text_plural(errors));
    if (warnings > 0) printf(", %zu warning%s", warnings, text_plural(warnings));
    printf("\n");
}

// Reports a scene. Returns false, with messages printed, if it is not valid.
static bool scene_check(const CheckOptions *options, const char *path)
{
    OwnedScene scene = {0};
    OwnedMessageList messages = {0};
    const SceneOptions scene_options = scene_options_of(&options->common);
    const bool loaded =
        scene_load(&scene, path, &scene_options, &messages) && scene_renders(&scene, &messages);
    if (prints_json(options)) {
        json_report(path, &scene, loaded, &messages);
        return loaded;
    }
    if (options->scenes.count > 1) line_print(path, &scene, loaded, &messages);
    messages_print(&messages, path);
    if (!loaded || options->scenes.count > 1) return loaded;
    if (options->object != UINT32_MAX) return object_print(&scene, path, options->object);
    const SceneFacts facts = facts_of(&scene);
    text_print(path, &scene, &facts);
    return true;
}

int command_check(int argument_count, char **arguments)
{
    CheckOptions options = {.object = UINT32_MAX};
    int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;
    status = EXIT_DONE;
    for (size_t i = 0; i < options.scenes.count; i++)
        if (!scene_check(&options, options.scenes.items[i])) status = EXIT_USER;
    return status;
}
