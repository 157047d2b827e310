// Reads scenes from texts and files, for the tests of the readers.
#pragma once

#include "host/base/text.h"
#include "host/compile/compile.h"
#include "host/scene/scene.h"

// Reads with the reader for the ending of `name`.
bool scene_read_text(Scene *scene, const char *name, const Text *text, bool lenient, MessageList *messages);
// Reads a YAML scene with values that replace its own.
bool scene_read_set(Scene *scene, const char *name, const Text *text, const char *const *overrides,
                    size_t count, MessageList *messages);

// Returns a text with \n, \r\n or \r at the ends of its lines, for `ends` from 0 to 2.
Text text_with_line_ends(const char *text, int ends);

// Describes a message as tests write it: `line:column: severity: text`, or only the severity and text if it
// has no place. A place in a --set is `--set:line:column`.
void message_describe(Text *description, const Message *message);

// Returns all messages that a text gets, one per line. Fails the test if they disagree with whether the scene
// was read.
Text scene_messages(const char *name, const char *text, bool lenient);

// Returns a scene that must be read with no messages. `name` is relative to the repository.
Scene scene_of_file(const char *path);
// Returns the scene of a text, which may get warnings.
Scene scene_of_text(const char *name, const char *text);

// A scene of tests/exact_scenes.txt, with its number of bounces in a row.
typedef struct {
    const char *name;
    unsigned bounce_count;
    Text text;
} ExactScene;

enum { EXACT_SCENES_MAX = 32 };

// Reads the whole table and returns the number of scenes. They are never freed.
size_t exact_scenes_read(ExactScene scenes[EXACT_SCENES_MAX]);

// Returns the flat arrays of a scene, which must be compiled with no messages.
CompiledScene scene_compiled(const Scene *scene, const CompileSettings *settings);

// A scene that uses every feature of its format, shared by the tests of a group.
extern Scene complete;
int complete_open(const char *path);
int complete_close(void **state);
// Returns the material of an object of that scene.
const Material *material_of(const Object *object);

// Compares the shapes of objects, all of whose values count. Numbers may differ by the rounding of a few
// operations.
void check_shapes(const Object *objects, const Object *expected, size_t count);

void check_number(double value, double expected, const char *file, int line);
void check_near(double value, double expected, double tolerance, const char *file, int line);
void check_vector(Vector3 vector, Vector3 expected, const char *file, int line);

#define assert_near(value, expected, tolerance) check_near(value, expected, tolerance, __FILE__, __LINE__)

// Compares numbers, which may differ by the rounding of a few operations.
#define assert_number(value, expected)    check_number(value, expected, __FILE__, __LINE__)
#define assert_vector(vector, ex, ey, ez) check_vector(vector, (Vector3){ex, ey, ez}, __FILE__, __LINE__)

#define assert_messages(name, text, expected)                                                                \
    do {                                                                                                     \
        Text messages_got = scene_messages(name, text, false);                                               \
        assert_string_equal(text_c(&messages_got), expected);                                                \
        text_free(&messages_got);                                                                            \
    } while (0)
