// Tests the choice among fabricated devices, and the list of the real ones.
#include "host/opencl/device.h"
#include "tests/check.h"
#include "tests/child.h"
#include "tests/files.h"

static Device fabricated(unsigned index, cl_device_type type, const char *name, const char *platform)
{
    return (Device){
        .index = index,
        .type = type,
        .name = (char *)(uintptr_t)name,
        .platform_name = (char *)(uintptr_t)platform,
        .board = (char *)(uintptr_t) "",
        .pci = (char *)(uintptr_t) "",
        .uuid = (char *)(uintptr_t) "",
        .available = true,
        .compiler = true,
        .little_endian = true,
        .native_float_width = 8,
        .native_double_width = 4,
        .fp64 = true,
    };
}

typedef struct {
    Device items[6];
    DeviceList list;
} Machine;

// Makes a CPU, an accelerator, a GPU without a compiler, two usable GPUs, and a CPU of another make.
static void machine_fill(Machine *machine)
{
    Device *items = machine->items;
    items[0] = fabricated(0, CL_DEVICE_TYPE_CPU, "pthread-haswell-avx512", "Portable Computing Language");
    items[1] = fabricated(1, CL_DEVICE_TYPE_ACCELERATOR, "Tile Board", "Acme");
    items[2] = fabricated(2, CL_DEVICE_TYPE_GPU, "Iris Mute", "Acme");
    items[2].compiler = false;
    items[3] = fabricated(3, CL_DEVICE_TYPE_GPU, "Force RTX 3090", "Vendor CUDA");
    items[4] = fabricated(4, CL_DEVICE_TYPE_GPU, "Force RTX 3090", "Vendor CUDA");
    items[4].same_name_index = 1;
    items[4].pci = (char *)(uintptr_t) "0000:65:00.0";
    items[4].uuid = (char *)(uintptr_t) "00112233445566778899aabbccddeeff";
    items[4].board = (char *)(uintptr_t) "Lodestar 7";
    items[5] = fabricated(5, CL_DEVICE_TYPE_CPU, "Xeon", "Acme");
    machine->list = (DeviceList){.items = items, .count = 6, .platform_count = 3};
}

TEST(choice)
{
    static const struct {
        const char *selector;
        int index;
    } cases[] = {
        {NULL, 3},
        {"gpu", 3},
        {"GPU", 3},
        {"cpu", 0},
        {"Cpu", 0},
        {"0", 0},
        {"4", 4},
        {"5", 5},
        {"3090", 3},
        {"force", 3},
        {"haswell", 0},
        {"portable", 0},
        {"XEON", 5},
        {"tile", 1},
        {"acme", 5},
        {"2", -1},
        {"mute", -1},
        {"nonsense", -1},
        {"6", -1},
        {"512", 0},
        {"12", -1},
        {"51", -1},
        {"309", -1},
        {"-1", -1},
        {"00", 0},
        {"0x0", -1},
        {"99999999999999999999999", -1},
        {"0000:65:00.0", 4},
        {"65:00.0", 4},
        {"65:00", -1},
        {":65:00.0", -1},
        {"", -1},
        {"lodestar", 4},
        {"00112233445566778899AABBCCDDEEFF", 4},
        {"00112233445566778899aabbccddeef", -1},
    };
    Machine machine = {0};
    machine_fill(&machine);
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        OwnedMessageList messages = {0};
        const Device *device = device_choose(&machine.list, cases[i].selector, &messages);
        int index = device ? (int)device->index : -1;
        if (index != cases[i].index)
            print_error("selector %s\n", cases[i].selector ? cases[i].selector : "NULL");
        assert_int_equal(index, cases[i].index);
        assert_int_equal(message_count(&messages, MESSAGE_ERROR), index < 0);
        if (index < 0) {
            assert_non_null(
                strstr(messages.items[0].text, cases[i].selector ? cases[i].selector : "no usable"));
            assert_non_null(strstr(messages.items[0].text, "2 (Iris Mute, gpu, unusable: no compiler)"));
        }
    }
}

TEST(choice_falls_back)
{
    Machine machine = {0};
    machine_fill(&machine);
    OwnedMessageList messages = {0};
    machine.list.count = 3;
    assert_int_equal(device_choose(&machine.list, NULL, &messages)->index, 0);
    machine.items[0].available = false;
    assert_int_equal(device_choose(&machine.list, NULL, &messages)->index, 1);
    machine.items[1].little_endian = false;
    assert_null(device_choose(&machine.list, NULL, &messages));
    assert_non_null(strstr(messages.items[0].text, "unusable: big-endian"));
    machine.list.count = 0;
    assert_null(device_choose(&machine.list, NULL, &messages));
    assert_non_null(strstr(messages.items[1].text, "pocl-opencl-icd"));
    assert_non_null(strstr(messages.items[1].text, "set HOME, XDG_CACHE_HOME or POCL_CACHE_DIR"));
    machine.list.platform_count = 0;
    assert_null(device_choose(&machine.list, NULL, &messages));
    assert_non_null(strstr(messages.items[2].text, "pocl-opencl-icd"));
    assert_null(strstr(messages.items[2].text, "HOME"));
}

TEST(lanes)
{
    static const unsigned cases[][2] = {{1, 1}, {2, 1}, {3, 1}, {4, 4}, {8, 8}, {12, 8}, {16, 16}, {64, 16}};
    Device device = fabricated(0, CL_DEVICE_TYPE_CPU, "", "");
    for (size_t i = 0; i < COUNT_OF(cases); i++) {
        device.native_float_width = cases[i][0];
        device.native_double_width = cases[i][0] / 2;
        assert_int_equal(device_lanes(&device, false, 0), cases[i][1]);
        device.native_double_width = cases[i][0];
        assert_int_equal(device_lanes(&device, true, 0), cases[i][1]);
        const unsigned widest = cases[i][0] > 1 ? cases[i][1] : 16; // scalar devices have no limit
        assert_int_equal(device_lanes(&device, true, 16), widest);
        assert_int_equal(device_lanes(&device, false, 4), widest < 4 ? widest : 4);
        assert_int_equal(device_lanes(&device, false, 1), 1);
    }
    device.type = CL_DEVICE_TYPE_GPU;
    assert_int_equal(device_lanes(&device, false, 0), 1);
    assert_int_equal(device_lanes(&device, false, 16), 16);
}

TEST(selector)
{
    unsetenv("GLINT_DEVICE");
    assert_null(device_selector(NULL));
    setenv("GLINT_DEVICE", "", 1);
    assert_null(device_selector(NULL));
    setenv("GLINT_DEVICE", "cpu", 1);
    assert_string_equal(device_selector(NULL), "cpu");
    assert_string_equal(device_selector("gpu"), "gpu");
    unsetenv("GLINT_DEVICE");
}

typedef struct {
    size_t count;
    bool sound;
} ListFacts;

static void list_look(void *result)
{
    ListFacts *facts = result;
    DeviceList list;
    device_list_open(&list, NULL);
    facts->count = list.count;
    facts->sound = list.empty_platform_count <= list.platform_count;
    for (size_t i = 0; i < list.count; i++) {
        const Device *device = &list.items[i];
        unsigned same_name_count = 0;
        for (size_t j = 0; j < i; j++)
            same_name_count +=
                list.items[j].platform == device->platform && strcmp(list.items[j].name, device->name) == 0;
        facts->sound &= device->index == i && device->name[0] != '\0' && device->platform_name[0] != '\0' &&
                        device->compute_units > 0 && device->native_float_width > 0 &&
                        (device->native_double_width > 0) == device->fp64 && device->memory_bytes > 0 &&
                        device->same_name_index == same_name_count;
    }
    device_list_close(&list);
    device_list_close(&list); // a second close does nothing
}

TEST(list_of_this_machine)
{
    ListFacts facts = {0};
    assert_int_equal(child_run(list_look, &facts, sizeof facts).status, 0);
    assert_true(facts.count > 0);
    assert_true(facts.sound);
}

TEST(list_without_platforms)
{
    const char *before = getenv("OCL_ICD_VENDORS");
    OWNED char *kept = before ? strdup(before) : NULL;
    char *empty = scratch_open();
    setenv("OCL_ICD_VENDORS", empty, 1);
    ListFacts facts = {.count = 99};
    assert_int_equal(child_run(list_look, &facts, sizeof facts).status, 0);
    assert_int_equal(facts.count, 0);
    assert_true(facts.sound);
    unsetenv("OCL_ICD_VENDORS");
    if (kept) setenv("OCL_ICD_VENDORS", kept, 1);
    scratch_close(empty);
}

TEST_MAIN(NULL, NULL)
