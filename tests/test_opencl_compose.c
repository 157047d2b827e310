// Tests the composed kernel text, its hash, whether event times are trusted, and work-groups cut to fit, all
// without a device.
#include "host/opencl/capture.h"
#include "host/opencl/compose.h"
#include "tests/check.h"
#include "tests/child.h"

static const EmbeddedFile files[] = {
    {"root.cl", "// root\n#include \"a.h\"\n  #  include \"kernels/b.h\" // again\n#include \"a.h\"\nlast"},
    {"a.h", "first of a\n#include \"b.h\"\nlast of a\n"},
    {"b.h", "#include <stdint.h>\n#include \"a.h\"\n// #include \"none.h\"\n#included \"x\"\nb\n"},
    {"lost.cl", "#include \"gone.h\"\n"},
    {NULL, NULL},
};

TEST(each_include_once)
{
    OWNED char *text = kernel_compose(files, "root.cl", "#define X 1");
    assert_string_equal(text, "#line 1 \"prelude\"\n#define X 1\n"
                              "#line 1 \"root.cl\"\n// root\n"
                              "#line 1 \"a.h\"\nfirst of a\n"
                              "#line 1 \"b.h\"\n#include <stdint.h>\n"
                              "\n#line 3 \"b.h\"\n// #include \"none.h\"\n#included \"x\"\nb\n"
                              "#line 3 \"a.h\"\nlast of a\n"
                              "#line 3 \"root.cl\"\n"
                              "\n#line 4 \"root.cl\"\n"
                              "\n#line 5 \"root.cl\"\nlast\n");
}

static void compose_root(void *root)
{
    free(kernel_compose(files, root, ""));
}

TEST(missing_files)
{
    char lost[] = "lost.cl", root[] = "root";
    assert_non_null(strstr(child_run(compose_root, lost, sizeof lost).errors, "kernel file gone.h is not"));
    assert_non_null(strstr(child_run(compose_root, root, sizeof root).errors, "kernel file root is not"));
}

TEST(every_embedded_file_composes)
{
    for (const EmbeddedFile *file = kernel_files; file->name; file++) {
        OWNED char *text = kernel_compose(kernel_files, file->name, "");
        if (!text) fail_msg("%s", file->name);
        assert_null(strstr(text ? text : "", "\n#include \""));
    }
}

TEST(event_times)
{
    static const struct {
        cl_ulong start, end;
        double host, resolution, seconds;
        bool trusted;
    } cases[] = {
        {2000, 1002000, 2e-3, 1e-9, 1e-3, true},    // within what the host saw
        {0, 0, 2e-3, 1e-9, 0, false},               // a runtime that reports zeros
        {5, 6, 2e-3, 0, 1e-9, false},               // one that counts its events
        {0, 5000, 2e-3, 1e-9, 0, false},            // one that forgets the start
        {5000, 4000, 2e-3, 1e-9, 0, false},         // end before start
        {5000, 5000, 2e-3, 1e-9, 0, false},         // no time at all
        {2000, 1002000, 0.995e-3, 0, 1e-3, true},   // 0.5 % longer
        {2000, 1002000, 0.98e-3, 0, 1e-3, false},   // 2 % longer
        {2000, 1002000, 0.98e-3, 1e-4, 1e-3, true}, // the same with a coarse timer
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        LaunchTime time =
            launch_time_classify(cases[i].start, cases[i].end, cases[i].host, cases[i].resolution);
        assert_float_equal(time.event_seconds, cases[i].seconds, 1e-12);
        assert_int_equal(!time.fault, cases[i].trusted);
        assert_true(time.host_seconds == cases[i].host);
    }
}

TEST(work_groups_fit)
{
    static const struct {
        size_t preferred[2], largest, sides[2], fit[2];
    } cases[] = {
        {{8, 8}, 64, {64, 64}, {8, 8}},  {{8, 8}, SIZE_MAX, {SIZE_MAX, SIZE_MAX}, {8, 8}},
        {{8, 8}, 63, {64, 64}, {8, 4}},  {{8, 8}, 16, {64, 64}, {4, 4}},
        {{8, 8}, 3, {64, 64}, {2, 1}},   {{8, 8}, 1, {1, 1}, {1, 1}},
        {{8, 8}, 64, {64, 1}, {8, 1}},   {{8, 8}, 64, {5, 64}, {4, 8}},
        {{64, 1}, 48, {64, 1}, {32, 1}}, {{1, 1}, 1, {1, 1}, {1, 1}},
    };
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        size_t sides[2] = {cases[i].preferred[0], cases[i].preferred[1]};
        work_group_fit(sides, 2, cases[i].largest, cases[i].sides);
        assert_int_equal(sides[0], cases[i].fit[0]);
        assert_int_equal(sides[1], cases[i].fit[1]);
    }
}

// A kernel may have the address of a released one whose argument had another type.
TEST(captured_arguments_are_replaced)
{
    OWNED char *kernel = malloc(1);
    const int number = 7;
    cl_mem buffer = NULL;
    Compute compute = {0};
    capture_argument(&compute, (cl_kernel)kernel, 3, false, sizeof number, &number);
    capture_argument(&compute, (cl_kernel)kernel, 3, true, sizeof buffer, &buffer);
    assert_int_equal(compute.captured.count, 1);
    assert_true(compute.captured.items[0].is_buffer);
    assert_int_equal(compute.captured.items[0].value.count, sizeof buffer);
    capture_close(&compute);
}

TEST_MAIN(NULL, NULL)
