#include "tests/scene_reading.h"
#include "host/import/load.h"
#include "tests/check.h"
#include "tests/files.h"

bool scene_read_text(Scene *scene, const char *name, const Text *text, bool lenient, MessageList *messages)
{
    Source source = {.file = name, .bytes = text_c(text), .length = text->count};
    SceneOptions options = {.lenient = lenient};
    const char *ending = strrchr(name, '.');
    if (!strcmp(ending, ".rt")) return scene_read_rt(scene, &source, &options, messages);
    if (!strcmp(ending, ".cfg")) return scene_read_cfg(scene, &source, messages);
    if (!strcmp(ending, ".nff")) return scene_read_nff(scene, &source, messages);
    if (!strcmp(ending, ".dat")) return scene_read_dat(scene, &source, &options, messages);
    return scene_read_yaml(scene, &source, &options, messages);
}

bool scene_read_set(Scene *scene, const char *name, const Text *text, const char *const *overrides,
                    size_t count, MessageList *messages)
{
    const Source source = {.file = name, .bytes = text_c(text), .length = text->count};
    const SceneOptions options = {.overrides = overrides, .override_count = count, .override_name = "--set"};
    return scene_read_yaml(scene, &source, &options, messages);
}

Text text_with_line_ends(const char *text, int ends)
{
    const char *line_end = (const char *const[]){"\n", "\r\n", "\r"}[ends];
    Text changed = {0};
    for (const char *at = text; *at; at++)
        text_append(&changed, *at == '\n' ? line_end : at, *at == '\n' ? strlen(line_end) : 1);
    return changed;
}

void message_describe(Text *description, const Message *message)
{
    if (message->file && !strcmp(message->file, "--set")) text_appendf(description, "--set:");
    if (message->line) text_appendf(description, "%u:%u: ", message->line, message->column);
    text_appendf(description, "%s: %s\n", message->severity == MESSAGE_ERROR ? "error" : "warning",
                 message->text);
}

Text scene_messages(const char *name, const char *text, bool lenient)
{
    Text source = {0}, described = {0};
    text_append(&source, text, strlen(text));
    OwnedMessageList messages = {0};
    OwnedScene scene;
    bool read = scene_read_text(&scene, name, &source, lenient, &messages);
    assert_int_equal(read, message_count(&messages, MESSAGE_ERROR) == 0);
    for (size_t i = 0; i < messages.count; i++)
        message_describe(&described, &messages.items[i]);
    text_free(&source);
    return described;
}

Scene scene_of_file(const char *path)
{
    MessageList messages = {0};
    SceneOptions options = {0};
    Scene scene;
    bool read = scene_load(&scene, path, &options, &messages);
    message_list_print(&messages, stderr);
    assert_true(read);
    assert_int_equal(messages.count, 0);
    return scene;
}

Scene scene_of_text(const char *name, const char *text)
{
    OwnedText source = {0};
    text_append(&source, text, strlen(text));
    OwnedMessageList messages = {0};
    Scene scene;
    bool read = scene_read_text(&scene, name, &source, false, &messages);
    if (!read) message_list_print(&messages, stderr);
    assert_true(read);
    return scene;
}

size_t exact_scenes_read(ExactScene scenes[EXACT_SCENES_MAX])
{
    static const char path[] = "tests/exact_scenes.txt", start_mark[] = "#### start",
                      scene_mark[] = "#### scene ";
    static Text table;
    table = file_text(path);
    OwnedText start = {0};
    Text *text = &start;
    size_t count = 0;
    for (char *line = strtok(table.items, "\n"); line; line = strtok(NULL, "\n")) {
        if (strcmp(line, start_mark) == 0) {
            text_free(&start);
            text = &start;
        } else if (strncmp(line, scene_mark, strlen(scene_mark)) == 0) {
            assert_true(count < EXACT_SCENES_MAX);
            ExactScene *scene = &scenes[count++];
            *scene = (ExactScene){0};
            char *name = NULL;
            scene->bounce_count = (unsigned)strtoul(line + strlen(scene_mark), &name, 10);
            scene->name = name + 1;
            text = &scene->text;
            text_append(text, text_c(&start), start.count);
        } else {
            text_appendf(text, "%s\n", line);
        }
    }
    return count;
}

CompiledScene scene_compiled(const Scene *scene, const CompileSettings *settings)
{
    CompiledScene compiled;
    MessageList messages = {0};
    const bool done = scene_compile(&compiled, scene, settings, &messages);
    message_list_print(&messages, stderr);
    assert_true(done);
    assert_int_equal(messages.count, 0);
    return compiled;
}

Scene complete;

int complete_open(const char *path)
{
    complete = scene_of_file(path);
    return 0;
}

int complete_close(void **state)
{
    (void)state;
    scene_free(&complete);
    return 0;
}

const Material *material_of(const Object *object)
{
    return &complete.materials.items[object->material];
}

// How many numbers and then flags a shape has in Object.as. The assertions notice further numbers, and flags
// that do not fit in the padding.
#define SHAPE_MEMBERS(SHAPE)                                                                                 \
    SHAPE(SPHERE, sphere, 4, 1)                                                                              \
    SHAPE(PLANE, plane, 6, 0)                                                                                \
    SHAPE(DISC, disc, 7, 0)                                                                                  \
    SHAPE(BOX, box, 6, 0)                                                                                    \
    SHAPE(CYLINDER, cylinder, 7, 3)                                                                          \
    SHAPE(CONE, cone, 9, 3)                                                                                  \
    SHAPE(TRIANGLE, triangle, 18, 1)
#define SHAPE_ASSERT(NAME, name, numbers, flags)                                                             \
    _Static_assert(sizeof((Object *)0)->as.name - (numbers) * sizeof(double) - (flags) < sizeof(double),     \
                   #name " has other members");
#define SHAPE_ROW(NAME, name, numbers, flags) [SHAPE_##NAME] = {numbers, flags},
SHAPE_MEMBERS(SHAPE_ASSERT)

static const struct {
    size_t numbers, flags;
} shape_members[] = {SHAPE_MEMBERS(SHAPE_ROW)};

void check_shapes(const Object *objects, const Object *expected, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const ShapeType type = expected[i].type;
        assert_int_equal(objects[i].type, type);
        assert_true(type < COUNT_OF(shape_members));
        const double *numbers = (const double *)&objects[i].as, *others = (const double *)&expected[i].as;
        for (size_t k = 0; k < shape_members[type].numbers; k++)
            if (!(fabs(numbers[k] - others[k]) <= 1e-14 * fmax(1, fabs(others[k]))))
                fail_msg("object %zu, number %zu: %.17g, not %.17g", i, k, numbers[k], others[k]);
        const size_t end = shape_members[type].numbers;
        assert_memory_equal(numbers + end, others + end, shape_members[type].flags);
    }
}

void check_near(double value, double expected, double tolerance, const char *file, int line)
{
    if (fabs(value - expected) <= tolerance) return;
    print_error("%.17g, expected %.17g\n", value, expected);
    _fail(file, line);
}

void check_number(double value, double expected, const char *file, int line)
{
    check_near(value, expected, 1e-14 * fmax(1, fabs(expected)), file, line);
}

void check_vector(Vector3 vector, Vector3 expected, const char *file, int line)
{
    check_number(vector.x, expected.x, file, line);
    check_number(vector.y, expected.y, file, line);
    check_number(vector.z, expected.z, file, line);
}
