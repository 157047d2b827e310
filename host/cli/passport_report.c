#include "host/cli/passport_report.h"

#include "host/base/memory.h"
#include "host/cli/report_json.h"
#include "host/render/arithmetic.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static void properties_json(Json *json, const Passport *passport)
{
    json_begin_array(json, "properties");
    for (Property property = 0; property < PROPERTY_COUNT; property++) {
        OwnedText what = {0};
        const Finding finding = passport_finding(passport, property, &what);
        json_addf(json, "{name %s finding %s value %s}", property_names[property], finding_names[finding],
                  text_c(&what));
    }
    json_end(json);
}

void passports_json(Json *json, const Device *device)
{
    json_begin_array(json, "passports");
    for (size_t i = 0; i < passport_count(device); i++) {
        const Passport *passport = passport_at(device, i);
        const RoundedResults *quotients = &passport->quotients, *roots = &passport->roots;
        json_begin_object(json, NULL);
        json_addf(json, "precision %s lanes %u thorough %d uses_fma %d fma_cost %g",
                  passport_mode_names[passport->mode], passport->lanes, passport->is_thorough,
                  passport->uses_fma, passport->fma_is_fused ? passport->fma_cost : NAN);
        json_addf(json, "division {largest_ulp %g count %zu wrong %zu exhaustive %d}", quotients->largest_ulp,
                  quotients->count, quotients->wrong_count, quotients->is_exhaustive);
        json_addf(json, "square_root {largest_ulp %g count %zu wrong %zu exhaustive %d}", roots->largest_ulp,
                  roots->count, roots->wrong_count, roots->is_exhaustive);
        json_addf(json, "build_ms %g probe_ms %g", 1e3 * passport->build_seconds, 1e3 * passport->seconds);
        properties_json(json, passport);
        json_end(json);
    }
    json_end(json);
}

void passports_refusals_json(Json *json, const Device *device)
{
    json_begin_array(json, "refused");
    for (Precision precision = 0; precision < PRECISION_COUNT; precision++) {
        OwnedText why = {0};
        if (arithmetic_refuses(device, precision, &why))
            json_addf(json, "{precision %s reason %s}", precision_names[precision], text_c(&why));
    }
    json_end(json);
}

// Returns what a passport finds about a property. The caller frees it.
static Text finding_text(const Passport *passport, Property property)
{
    static const char *const marks[] = {
        [FINDING_SOUND] = "", [FINDING_UNUSUAL] = "unusual: ", [FINDING_BROKEN] = "BROKEN: "};
    OwnedText what = {0};
    Text text = {0};
    const Finding finding = passport_finding(passport, property, &what);
    text_appendf(&text, "%s%s", marks[finding], text_c(&what));
    return text;
}

// Prints each finding about a property once, with its first precision unless all precisions share it.
static void property_print(const Device *device, Property property)
{
    const size_t count = passport_count(device);
    OWNED Text *findings = memory_allocate_zeroed(count, sizeof *findings);
    bool are_alike = true;
    for (size_t i = 0; i < count; i++) {
        findings[i] = finding_text(passport_at(device, i), property);
        are_alike = are_alike && strcmp(text_c(&findings[i]), text_c(&findings[0])) == 0;
    }
    for (size_t i = 0; i < count; i++) {
        bool is_printed = false;
        for (size_t j = 0; j < i; j++)
            is_printed = is_printed || strcmp(text_c(&findings[j]), text_c(&findings[i])) == 0;
        if (is_printed) continue;
        printf("  %-12s  ", i == 0 ? property_names[property] : "");
        if (!are_alike) printf("%s: ", passport_mode_names[passport_at(device, i)->mode]);
        printf("%s\n", text_c(&findings[i]));
    }
    for (size_t i = 0; i < count; i++)
        text_free(&findings[i]);
}

void passports_print(const Device *device)
{
    if (passport_count(device) == 0) return;
    printf("\narithmetic of %u, %s, at", device->index, device->name);
    double seconds = 0;
    for (size_t i = 0; i < passport_count(device); i++) {
        const Passport *passport = passport_at(device, i);
        printf("%s %s (%u lane%s)", i ? "," : "", passport_mode_names[passport->mode], passport->lanes,
               text_plural(passport->lanes));
        seconds += passport->seconds;
    }
    printf(", measured in %.2f s\n", seconds);
    for (Property property = 0; property < PROPERTY_COUNT; property++)
        property_print(device, property);
    for (Precision precision = 0; precision < PRECISION_COUNT; precision++) {
        OwnedText why = {0};
        if (arithmetic_refuses(device, precision, &why))
            printf("  precision %s is refused: %s\n", precision_names[precision], text_c(&why));
    }
}

void passports_remark(const Device *device, FILE *stream)
{
    OwnedText text = {0};
    if (passports_abnormal(device, &text)) fprintf(stream, "%s\n", text_c(&text));
}

void device_heading_print(const Device *device, FILE *stream)
{
    fprintf(stream, "%s, %s %s\n", device->name, device->platform_name, device->driver);
    passports_remark(device, stream);
}
