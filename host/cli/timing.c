#include "host/cli/timing.h"

#include "host/cli/options.h"
#include "host/cli/passport_report.h"
#include "host/cli/report_json.h"
#include "host/cli/timing_trace.h"
#include <inttypes.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

// Sums over launches, by events where they are trusted, and by the host's clock.
typedef struct {
    double event_seconds, host_seconds;
    size_t count, untrusted_count;
} LaunchSum;

static LaunchSum launches_sum(const NamedLaunch *launches, size_t count)
{
    LaunchSum sum = {.count = count};
    for (size_t i = 0; i < count; i++) {
        sum.host_seconds += launches[i].time.host_seconds;
        if (!launches[i].time.fault)
            sum.event_seconds += launches[i].time.event_seconds;
        else
            sum.untrusted_count++;
    }
    return sum;
}

// Returns how long a command waited before it ran, or 0 for a usual wait. After a long wait the driver has
// done something else, such as compiling.
static double launch_delay(const LaunchTime *time)
{
    double delay = time->fault ? 0 : time->host_seconds - time->event_seconds;
    return delay > 0.02 && delay > time->event_seconds ? delay : 0;
}

static void line_print(const char *what, double seconds, const char *remark)
{
    fprintf(stderr, "  %-10s %10.3f ms%s%s\n", what, 1e3 * seconds, remark[0] ? "  " : "", remark);
}

static void launches_print(const char *what, const NamedLaunch *launches, size_t count)
{
    enum { SHOWN_MAX = 12 };
    LaunchSum sum = launches_sum(launches, count);
    char remark[160];
    const char *plural = text_plural(count);
    if (sum.untrusted_count)
        snprintf(remark, sizeof remark, "%zu command%s, by the host's clock", count, plural);
    else
        snprintf(remark, sizeof remark, "%zu command%s, by the device's clock; %.3f ms by the host's", count,
                 plural, 1e3 * sum.host_seconds);
    line_print(what, sum.untrusted_count ? sum.host_seconds : sum.event_seconds, remark);
    for (size_t i = 0; i < count && i < SHOWN_MAX; i++) {
        const LaunchTime *time = &launches[i].time;
        if (time->fault)
            fprintf(stderr, "    %-9s %9.3f ms  by the host's clock: %s\n", launches[i].name,
                    1e3 * time->host_seconds, time->fault);
        else
            fprintf(stderr, "    %-9s %9.3f ms  host %.3f ms\n", launches[i].name, 1e3 * time->event_seconds,
                    1e3 * time->host_seconds);
        if (launch_delay(time) > 0)
            fprintf(stderr, "              %.3f ms passed before it ran: the driver %s\n",
                    1e3 * launch_delay(time),
                    i == 0 ? "finishes its build at the first launch" : "or another program kept the device");
    }
    if (count > SHOWN_MAX) fprintf(stderr, "    … and %zu more\n", count - SHOWN_MAX);
    if (sum.untrusted_count)
        fprintf(
            stderr,
            "    event times of %zu of %zu commands disagree with the host's clock, whose times are used\n",
            sum.untrusted_count, count);
}

// Prints a device's share of the rows and of the time if several devices render.
static void share_print(const WorkerShare *share, const RenderSettings *settings)
{
    fprintf(stderr, "  %.1f%% of the rows in %u band%s; busy %.3f ms, idle %.3f ms\n",
            100.0 * share->rows / settings->region_height, share->bands, text_plural(share->bands),
            1e3 * share->busy_seconds, 1e3 * share->idle_seconds);
}

static void device_print(const RenderReport *report)
{
    line_print("flatten", report->flatten_seconds, "");
    if (report->features & FEATURE_BVH) line_print("bvh", report->bvh_seconds, "");
    line_print("build", report->build_seconds, report->build_from_cache ? "from the cache" : "compiled");
    if (report->is_out_of_line) fputs("    functions out of line\n", stderr);
    line_print("upload", report->upload_seconds, "");
    launches_print("launches", report->launches.items, report->launches.count);
    launches_print("read-back", report->reads.items, report->reads.count);
    if (report->reference_device) fprintf(stderr, "  in double by %s\n", report->reference_device->name);
}

static void pilot_print(const Pilot *pilot)
{
    OwnedText line = {0};
    pilot_describe(&line, pilot);
    line_print("pilot", pilot->seconds, text_c(&line));
    line_print("  builds", pilot->build_seconds, "");
    for (unsigned i = 0; i < ARITHMETIC_COUNT; i++) {
        const PilotCandidate *candidate = &pilot->candidates[i];
        if (candidate->status != PILOT_MEASURED) continue;
        fprintf(stderr, "    %-9s %9.3g ns per pixel", precision_names[i], 1e9 * candidate->pixel_seconds);
        if (i != PRECISION_DOUBLE)
            fprintf(stderr, ", %s %.2g in the sample; bound %.2g: %s",
                    error_metric_names[pilot->budget.metric], candidate->verdict.error,
                    candidate->verdict.bound, candidate->verdict.keeps ? "kept" : "not guaranteed");
        fputc('\n', stderr);
    }
}

// Prints how much of the image `certified` re-rendered in double, and how much remained uncertified.
static void rerenders_print(RerenderCounts counts, const RenderSettings *settings)
{
    if (settings->precision != PRECISION_CERTIFIED) return;
    OWNED char *text = counts_describe(&counts);
    fprintf(stderr, "certified: %s\n", text);
}

static void text_print(const ImageOrigin *origin, const HostTimes *host)
{
    const RenderSettings *settings = origin->settings;
    const Ranks *ranks = origin->ranks;
    fprintf(stderr, "%ux%u, %u sample%s per pixel, precision %s\n", settings->region_width,
            settings->region_height, settings->sample_count, text_plural(settings->sample_count),
            precision_names[settings->precision]);
    rerenders_print(host->rerenders, settings);
    line_print("parse", host->parse_seconds, "");
    if (host->pilot) pilot_print(host->pilot);
    for (size_t i = 0; i < origin->renderer_count; i++) {
        const RenderReport *report = renderer_report(origin->renderers[i]);
        fprintf(stderr, "%s, %u lane%s (kernel %016" PRIx64 ")\n", report->device->name, report->lanes,
                text_plural(report->lanes), report->kernel_hash);
        passports_remark(report->device, stderr);
        if (origin->renderer_count > 1 || ranks) share_print(&report->share, settings);
        device_print(report);
    }
    for (size_t i = 0; ranks && i < ranks->remote.count; i++) {
        const Rank *rank = &ranks->items[i];
        fprintf(stderr, "rank %zu on %s: %s, %u lane%s\n", i + 1, rank->host, rank->device,
                rank->lanes[PASS_ALL], text_plural(rank->lanes[PASS_ALL]));
        share_print(&ranks->remote.shares[i], settings);
    }
    line_print("rendering", host->render_seconds, "in all, from flatten to read-back");
    line_print("encode", host->encode_seconds, "");
}

static void launches_json(Json *json, const char *key, const RenderReport *report,
                          const NamedLaunch *launches, size_t count)
{
    json_begin_array(json, key);
    for (size_t i = 0; i < count; i++) {
        const LaunchTime *time = &launches[i].time;
        json_begin_object(json, NULL);
        json_addf(json, "name %s clock %s event_ms %g host_ms %g", launches[i].name,
                  time->fault ? "host" : "event", time->fault ? NAN : 1e3 * time->event_seconds,
                  1e3 * time->host_seconds);
        command_json(json, report, time);
        if (time->fault) json_text(json, "fault", time->fault);
        json_end(json);
    }
    json_end(json);
}

static void share_json(Json *json, const WorkerShare *share, const RenderSettings *settings)
{
    json_addf(json, "share %g bands %u busy_ms %g idle_ms %g", (double)share->rows / settings->region_height,
              share->bands, 1e3 * share->busy_seconds, 1e3 * share->idle_seconds);
}

static void ranks_json(Json *json, const Ranks *ranks, const RenderSettings *settings)
{
    json_begin_array(json, "by_rank");
    for (size_t i = 0; i < ranks->remote.count; i++) {
        const Rank *rank = &ranks->items[i];
        json_begin_object(json, NULL);
        json_addf(json, "host %s name %s driver %s lanes %u", rank->host, rank->device, rank->driver,
                  rank->lanes[PASS_ALL]);
        share_json(json, &ranks->remote.shares[i], settings);
        json_end(json);
    }
    json_end(json);
}

static void render_device_json(Json *json, const RenderReport *report, const RenderSettings *settings)
{
    json_begin_object(json, NULL);
    json_text(json, "name", report->device->name);
    device_identity_json(json, report->device);
    json_addf(json, "platform %s driver %s", report->device->platform_name, report->device->driver);
    passports_json(json, report->device);
    json_text(json, "double_by", report->reference_device ? report->reference_device->name : NULL);
    json_addf(json, "lanes %u kernel_hash %016" PRIx64, report->lanes, report->kernel_hash);
    build_options_json(json, report);
    json_addf(json,
              "flatten_ms %g bvh_ms %g build_ms %g build_from_cache %d build_out_of_line %d upload_ms %g",
              1e3 * report->flatten_seconds, report->features & FEATURE_BVH ? 1e3 * report->bvh_seconds : NAN,
              1e3 * report->build_seconds, report->build_from_cache, report->is_out_of_line,
              1e3 * report->upload_seconds);
    share_json(json, &report->share, settings);
    launches_json(json, "launches", report, report->launches.items, report->launches.count);
    launches_json(json, "read_backs", report, report->reads.items, report->reads.count);
    json_end(json);
}

static void candidate_json(Json *json, const Pilot *pilot, Precision precision)
{
    static const char *const statuses[] = {"untried", "measured", "unavailable"};
    const PilotCandidate *candidate = &pilot->candidates[precision];
    json_begin_object(json, NULL);
    json_addf(json, "precision %s status %s", precision_names[precision], statuses[candidate->status]);
    if (candidate->status == PILOT_MEASURED)
        json_addf(json, "error %g bound %g keeps %d pixel_ns %g", candidate->verdict.error,
                  candidate->verdict.bound, candidate->verdict.keeps, 1e9 * candidate->pixel_seconds);
    json_end(json);
}

static void pilot_json(Json *json, const Pilot *pilot)
{
    json_begin_object(json, "pilot");
    json_addf(json, "limit %g metric %s confidence %g pixels %zu color_max %g total_ms %g build_ms %g",
              pilot->budget.limit, error_metric_names[pilot->budget.metric], pilot->confidence, pilot->pixels,
              pilot->color_max, 1e3 * pilot->seconds, 1e3 * pilot->build_seconds);
    json_begin_array(json, "candidates");
    for (unsigned i = 0; i < ARITHMETIC_COUNT; i++)
        candidate_json(json, pilot, (Precision)i);
    json_end(json);
    json_end(json);
}

static void json_report(const ImageOrigin *origin, const HostTimes *host)
{
    const RenderSettings *settings = origin->settings;
    Json *json = report_json_open(4, NULL);
    json_text(json, "scene", origin->scene_path);
    if (!isnan(host->frame)) json_number(json, "frame", host->frame);
    json_addf(json, "size [%u %u] samples %u precision %s", settings->region_width, settings->region_height,
              settings->sample_count, precision_names[settings->precision]);
    if (settings->precision == PRECISION_CERTIFIED)
        json_addf(json, "rerendered_samples %" PRIu64 " uncertified_samples %" PRIu64,
                  host->rerenders.rerendered, host->rerenders.uncertified);
    json_number(json, "parse_ms", 1e3 * host->parse_seconds);
    if (host->pilot) pilot_json(json, host->pilot);
    json_begin_array(json, "by_device");
    for (size_t i = 0; i < origin->renderer_count; i++)
        render_device_json(json, renderer_report(origin->renderers[i]), settings);
    json_end(json);
    if (origin->ranks) ranks_json(json, origin->ranks, settings);
    json_addf(json, "render_ms %g encode_ms %g", 1e3 * host->render_seconds, 1e3 * host->encode_seconds);
    if (host->is_several)
        json_print_line(json, stdout);
    else
        json_print(json, stdout);
}

void timing_print(TimingStyle style, const ImageOrigin *origin, const HostTimes *host)
{
    if (style == TIMING_JSON)
        json_report(origin, host);
    else if (style == TIMING_TRACE)
        timing_trace_print(origin->renderers, origin->renderer_count, host->stage);
    else
        text_print(origin, host);
}
