// Tests what glint report leaves out of its files.
#include "host/cli/report_scrub.h"
#include "tests/check.h"
#include <sys/utsname.h>

TEST(texts_are_scrubbed)
{
    static const struct {
        const char *text, *scrubbed;
    } rows[] = {
        {"in /home/ann/scenes/a.yaml", "in ~/scenes/a.yaml"},
        {"/home/anna/x/a.cl:3:1: error", "PATH/a.cl:3:1: error"},
        {"\"/home/ann\"", "\"~\""},
        {"-I/home/ann/include -I/usr/include/CL/cl.h", "-I~/include -IPATH/cl.h"},
        {"a\\n/var/log/x/y.log", "a\\nPATH/y.log"},
        {"/srv/here/verify.json", "./verify.json"},
        {"/home/bob", "PATH"},
        {"/home/bob.smith", "PATH"},
        {"/usr/lib/pocl/libpocl.so.2", "PATH/libpocl.so.2"},
        {"OCL_ICD_VENDORS=/etc/OpenCL/vendors/pocl.icd", "OCL_ICD_VENDORS=PATH/pocl.icd"},
        {"\"/srv/müller/a.yaml\" /home/annü/x/a.yaml /ärger/ö/a.cl", "\"PATH/a.yaml\" PATH/a.yaml PATH/a.cl"},
        {"in ‘/srv/x/a.yaml’ as ‘annuser’", "in ‘PATH/a.yaml’ as ‘USER’"},
        {"annuser@box", "USER@box"},
        {"annuser-2 annusers annuser_x annuser", "annuser-2 annusers annuser_x USER"},
        {"a / b, 3/4, and/or, https://glint.example/x, // x",
         "a / b, 3/4, and/or, https://glint.example/x, // x"},
        {"kernels/0123.cl", "kernels/0123.cl"},
        {"", ""},
    };
    setenv("HOME", "/home/ann/", true);
    setenv("USER", "annuser", true);
    setenv("LOGNAME", "annuser", true);
    Scrubber scrubber = scrubber_open("/srv/here");
    for (size_t i = 0; i < COUNT_OF(rows); i++) {
        OwnedText text = {0};
        text_append(&text, rows[i].text, strlen(rows[i].text));
        OwnedText scrubbed = scrub(&scrubber, &text);
        assert_string_equal(text_c(&scrubbed), rows[i].scrubbed);
    }
    scrubber_close(&scrubber);
}

TEST(host_is_scrubbed)
{
    struct utsname host;
    assert_int_equal(uname(&host), 0);
    if (strlen(host.nodename) < 2 || strcmp(host.nodename, "localhost") == 0) skip();
    Scrubber scrubber = scrubber_open("/srv/here");
    OwnedText text = {0};
    text_appendf(&text, "\"name\": \"%s\", 3.1+%s", host.nodename, host.nodename);
    OwnedText scrubbed = scrub(&scrubber, &text);
    OWNED char *expected = text_format("\"name\": \"HOST\", 3.1+%s", host.nodename);
    assert_string_equal(text_c(&scrubbed), expected);
    scrubber_close(&scrubber);
}

TEST_MAIN(NULL, NULL)
