// The exit status of glint certify where an image is wrong: one object is changed in what was rendered.
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/cli/commands.h"
#include "host/render/renderer.h"
#include "tests/child.h"
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { COLUMN = 7, ROW = 5 };

typedef struct {
    const char *precision;
    uint32_t doubt; // of the wrong pixel
    bool is_right;
} Case;

static Case wrong;

bool __real_renderer_render_film(Renderer *renderer, unsigned aovs, Film *film);
bool __wrap_renderer_render_film(Renderer *renderer, unsigned aovs, Film *film);
bool __wrap_renderer_render_film(Renderer *renderer, unsigned aovs, Film *film)
{
    const bool rendered = __real_renderer_render_film(renderer, aovs, film);
    if (!rendered || wrong.is_right) return rendered;
    const size_t pixel = (size_t)ROW * film->width + COLUMN;
    film->object[pixel]++;
    film->doubt[pixel] = wrong.doubt;
    return true;
}

static void certify(void *context)
{
    wrong = *(const Case *)context;
    const char *const texts[] = {"certify", "scenes/spheres16.yaml", "--size",        "12x8",  "--pixels",
                                 "96",      "--precision",           wrong.precision, "--json"};
    enum { COUNT = sizeof texts / sizeof *texts };
    char *arguments[COUNT + 1] = {NULL};
    for (int i = 0; i < COUNT; i++)
        arguments[i] = memory_copy_text(texts[i]);
    const int status = command_certify(COUNT, arguments);
    for (int i = 0; i < COUNT; i++)
        free(arguments[i]);
    exit(status);
}

static void test_status(void **state)
{
    (void)state;
    const Case fails = {"single,certified", 0, false};
    const Case passing[] = {{"certified", DOUBT_UNDECIDED, false}, // it says so itself
                            {"single", 0, false},                  // which promises nothing
                            {"certified", 0, true}};
    Case one = {"certified", 0, true};
    if (child_run(certify, &one, sizeof one).status == EXIT_USER) skip(); // no fp64
    one = fails;
    const ChildEnd end = child_run(certify, &one, sizeof one);
    assert_int_equal(end.status, EXIT_CHECK);
    assert_non_null(strstr(end.errors, "glint certify: certified is wrong at 1 "));
    assert_non_null(strstr(end.errors, " at 7,5:"));
    for (size_t i = 0; i < sizeof passing / sizeof *passing; i++) {
        one = passing[i];
        assert_int_equal(child_run(certify, &one, sizeof one).status, EXIT_DONE);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_status)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
