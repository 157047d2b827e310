// Tests the exit status of glint certify for a wrong image. One pixel of the rendered image is changed, or
// the rendered scene differs from the certified one in what only a mirror shows.
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/cli/commands.h"
#include "host/render/renderer.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/film.h"

enum { COLUMN = 7, ROW = 5 };

typedef enum { NOTHING, AN_OBJECT, A_COLOR, THE_CHECKER, A_SHADOW } Change;

typedef struct {
    const char *precision;
    Change change;
    uint32_t flag; // of the pixel
} Case;

static Case wrong;

bool __real_renderer_render_film(Renderer *renderer, unsigned aovs, Film *film);
bool __wrap_renderer_render_film(Renderer *renderer, unsigned aovs, Film *film);
bool __wrap_renderer_render_film(Renderer *renderer, unsigned aovs, Film *film)
{
    const bool rendered = __real_renderer_render_film(renderer, aovs, film);
    const size_t pixel = (size_t)ROW * film->width + COLUMN;
    if (!rendered || (wrong.change != AN_OBJECT && wrong.change != A_COLOR)) return rendered;
    film->object[pixel] += wrong.change == AN_OBJECT;
    if (wrong.change == A_COLOR) film->color[3 * pixel + 1] += 0x1p-7;
    film->flag[pixel] = wrong.flag;
    return true;
}

Renderer *__real_renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                               MessageList *messages);
Renderer *__wrap_renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                               MessageList *messages);
Renderer *__wrap_renderer_open(Compute *compute, const Scene *scene, const RenderSettings *settings,
                               MessageList *messages)
{
    static Scene changed; // which the renderer may refer to
    free(changed.materials.items);
    changed = *scene;
    const size_t count = scene->materials.count;
    changed.materials.items = memory_allocate(count, sizeof *changed.materials.items);
    memcpy(changed.materials.items, scene->materials.items, count * sizeof *changed.materials.items);
    for (size_t i = 0; i < count && wrong.change == THE_CHECKER; i++)
        changed.materials.items[i].checker.size *= 1.5;
    changed.objects.count -= wrong.change == A_SHADOW; // the last is the disc
    RenderSettings shared = *settings;
    shared.extra_features = film_features(settings->precision);
    return __real_renderer_open(compute, &changed, &shared, messages);
}

static void certify(void *context)
{
    wrong = *(const Case *)context;
    const char *const scene =
        wrong.change < THE_CHECKER ? "scenes/spheres16.yaml" : "tests/scenes/mirrored-floor.yaml";
    const char *const texts[] = {"certify", scene,         "--size",        "12x8",  "--pixels",
                                 "96",      "--precision", wrong.precision, "--json"};
    enum { COUNT = COUNT_OF(texts) };
    char *arguments[COUNT + 1] = {NULL};
    for (int i = 0; i < COUNT; i++)
        arguments[i] = memory_copy_text(texts[i]);
    const int status = command_certify(COUNT, arguments);
    for (int i = 0; i < COUNT; i++)
        free(arguments[i]);
    exit(status);
}

TEST(status)
{
    const Case fails[] = {{"single,certified", AN_OBJECT, 0}, {"certified", A_COLOR, 0}};
    const Case mirrored[] = {{"certified", THE_CHECKER, 0}, {"certified", A_SHADOW, 0}};
    const Case passing[] = {{"certified", AN_OBJECT, FLAG_UNCERTIFIED}, // it reports so itself
                            {"certified", A_COLOR, FLAG_UNCERTIFIED},
                            {"single", AN_OBJECT, 0}, // which promises nothing
                            {"certified", NOTHING, 0}};
    Case one = {"certified", NOTHING, 0};
    const ChildEnd first = child_run(certify, &one, sizeof one);
    if (strstr(first.errors, "64-bit") || strstr(first.errors, "lacks arithmetic")) {
        print_message("%s", first.errors);
        skip();
    }
    for (size_t i = 0; i < COUNT_OF(fails); i++) {
        one = fails[i];
        const ChildEnd end = child_run(certify, &one, sizeof one);
        assert_int_equal(end.status, EXIT_CHECK);
        assert_non_null(strstr(end.errors, "glint: certified is wrong at 1 "));
        assert_non_null(strstr(end.errors, " at 7,5:"));
    }
    for (size_t i = 0; i < COUNT_OF(mirrored); i++) {
        one = mirrored[i];
        const ChildEnd end = child_run(certify, &one, sizeof one);
        assert_int_equal(end.status, EXIT_CHECK);
        assert_non_null(strstr(end.errors, "glint: certified is wrong at "));
    }
    for (size_t i = 0; i < COUNT_OF(passing); i++) {
        one = passing[i];
        assert_int_equal(child_run(certify, &one, sizeof one).status, EXIT_DONE);
    }
}

TEST_MAIN(NULL, NULL)
