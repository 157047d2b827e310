// glint devices lists every device of every platform with the properties that matter for tracing, and the
// passports of their arithmetic.
#include "host/base/exit_status.h"
#include "host/base/json.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/open_device.h"
#include "host/cli/passport_report.h"
#include "host/cli/report_json.h"
#include "host/opencl/device.h"
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>

typedef struct {
    CommonOptions common;
    bool probes;
} DevicesOptions;

static const Option command_options[] = {
    {"probe", NULL, "measure the arithmetic now", option_flag, offsetof(DevicesOptions, probes)}};

static const ResultTable devices_table = {
    .command = "devices",
    .rows = "devices",
    .names = {"device=index"},
    .values = {"name", "default", "type", "units", "MHz=clock_mhz", "lanes", "fp64", "fma",
               "exact div=correctly_rounded_divide_sqrt", "memory=memory_bytes",
               "buffer=largest_buffer_bytes", "platform", "driver", "board", "PCI=pci"},
    .extras = {"twin", "unusable because=unusable_because", "uuid", "vendor", "version"},
    .is_one_table = true,
};

static const CommandLine command_line = {
    .command = "devices",
    .usage = "usage: glint devices [OPTIONS]\n\n"
             "Lists every OpenCL device of every platform. Then prints what the arithmetic of each device\n"
             "really does, if that was measured.\n",
    .groups = {OPTIONS(command_options), OPTIONS(keep_kernels_option), REPORT_OPTIONS}};

static void device_json(Json *json, const Device *device, bool is_default)
{
    const char *why;
    const bool is_usable = device_usable(device, &why);
    json_begin_object(json, NULL);
    json_addf(json, "index %u twin %u default %d usable %d", device->index, device->same_name_index,
              is_default, is_usable);
    json_text(json, "unusable_because", why);
    json_text(json, "name", device->name);
    device_identity_json(json, device);
    json_addf(json,
              "type %s profile %s vendor %s platform %s platform_version %s version %s driver %s "
              "units %u clock_mhz %u lanes %u native_float_width %u native_double_width %u",
              device_type_name(device->type), device->embedded_profile ? "embedded" : "full", device->vendor,
              device->platform_name, device->platform_version, device->version, device->driver,
              device->compute_units, device->clock_mhz, device_lanes(device, false, 0),
              device->native_float_width, device->native_double_width);
    json_addf(json,
              "fp64 %d denormals %d fma %d correctly_rounded_divide_sqrt %d compiler %d address_bits %u",
              device->fp64, device->denormals, device->fma_in_hardware, device->correctly_rounded,
              device->compiler, device->address_bits);
    json_addf(json,
              "memory_bytes %" PRIu64 " largest_buffer_bytes %" PRIu64 " local_memory_bytes %" PRIu64
              " largest_work_group %zu timer_resolution_seconds %g",
              device->memory_bytes, device->largest_buffer_bytes, device->local_memory_bytes,
              device->largest_work_group, device->timer_resolution_seconds);
    passports_json(json, device);
    passports_refusals_json(json, device);
    json_end(json);
}

static Json *devices_json(const DeviceList *list, const Device *chosen)
{
    Json *json = report_json_open(1, NULL);
    json_addf(json, "platforms %u platforms_without_device %u", list->platform_count,
              list->empty_platform_count);
    json_begin_array(json, "devices");
    for (size_t i = 0; i < list->count; i++)
        device_json(json, &list->items[i], &list->items[i] == chosen);
    json_end(json);
    return json;
}

static void device_notes(const void *context, size_t index, Text *notes)
{
    const Device *device = &((const DeviceList *)context)->items[index];
    const char *why;
    if (device->same_name_index > 0) text_appendf(notes, "    twin %u\n", device->same_name_index);
    if (!device_usable(device, &why)) text_appendf(notes, "    unusable: %s\n", why);
}

// Prints and writes the report as the options ask. Returns false with a message if the file cannot be
// written.
static bool devices_print(const DeviceList *list, const Device *chosen, const ReportOptions *report)
{
    const bool is_written = report_output(devices_json(list, chosen), report, device_notes, list);
    if (!report_has_text(report)) return is_written;
    if (list->empty_platform_count > 0)
        printf("%u of %u platforms have no device\n", list->empty_platform_count, list->platform_count);
    for (size_t i = 0; i < list->count; i++)
        passports_print(&list->items[i]);
    return is_written;
}

// Measures the passports of the usable devices, or loads them from the cache. Returns false if a device
// failed.
static bool passports_find(const DeviceList *list, bool probes)
{
    bool is_done = true;
    for (size_t i = 0; i < list->count; i++) {
        const Device *device = &list->items[i];
        if (!device_usable(device, NULL)) continue;
        if (!probes) {
            passports_recall(device);
            continue;
        }
        Compute compute;
        compute_open(&compute, device);
        if (!passports_measure(&compute)) {
            OWNED char *failure = compute_failure_text(&compute);
            stderr_print("%s", failure);
            is_done = false;
        }
        compute_close(&compute);
    }
    return is_done;
}

int command_devices(int argument_count, char **arguments)
{
    DevicesOptions options = {.common.report.table = &devices_table};
    const int status = command_line_read(&command_line, &options, argument_count, arguments);
    if (status != OPTIONS_READ) return status;

    DeviceList list;
    device_list_open(&list, &device_warnings);
    for (size_t i = 0; i < list.count; i++)
        list.items[i].kernel_folder = options.common.driver.kernel_folder;
    OwnedMessageList messages = {0};
    const Device *chosen = device_choose(&list, device_selector(NULL), &messages);
    const bool is_probed = passports_find(&list, options.probes);
    const bool is_written = devices_print(&list, chosen, &options.common.report);
    OWNED char *failure = device_list_failure_text(&list);
    if (chosen && failure) message_warning(&messages, "%s", failure);
    message_list_print(&messages, stderr);
    const bool is_chosen = chosen != NULL;
    device_list_close(&list);
    if (!is_written) return EXIT_USER;
    return !is_probed ? EXIT_MACHINE : is_chosen ? EXIT_DONE : failure ? EXIT_MACHINE : EXIT_USER;
}
