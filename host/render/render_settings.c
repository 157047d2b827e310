#include "host/render/render_settings.h"

bool settings_fit(const RenderSettings *settings, const Compute *compute, MessageList *messages)
{
    const Device *device = compute->device;
    uint32_t lanes = settings->lanes;
    if (lanes != 0 && lanes != 1 && lanes != 4 && lanes != 8 && lanes != 16)
        return message_error(messages, "lanes must be 1, 4, 8 or 16, not %u", lanes);
    if (settings->bounce_count > BOUNCES_MAX)
        return message_error(messages, "bounces must be at most %d, not %u", BOUNCES_MAX,
                             settings->bounce_count);
    if (settings->perturb_scale > PERTURB_SCALE_MAX)
        return message_error(messages, "the perturbation's scale must be at most %d, not %u",
                             PERTURB_SCALE_MAX, settings->perturb_scale);
    if (device->embedded_profile &&
        (settings->precision == PRECISION_STRICT || settings->precision == PRECISION_CERTIFIED))
        return message_error(messages,
                             "precision %s: the device \"%s\" has the embedded profile, whose divisions and "
                             "square roots may be less exact than the precision assumes",
                             precision_names[settings->precision], device->name);
    if (settings->precision == PRECISION_DOUBLE && !device->fp64)
        return message_error(messages, "precision double: the device \"%s\" has no 64-bit floating point%s",
                             device->name, device_fp64_hint(device));
    if (settings->precision == PRECISION_CERTIFIED && settings->perturb_scale > 1)
        return message_error(
            messages,
            "precision certified: its bounds cover errors of the size that devices have, not %u times that",
            settings->perturb_scale);
    if (settings->precision == PRECISION_CERTIFIED && !device->fp64 && !compute->reference)
        return message_error(
            messages,
            "precision certified needs 64-bit floating point, which the device \"%s\" lacks, and "
            "no other device works in double for it%s",
            device->name, device_fp64_hint(device));
    return true;
}

RenderSettings settings_of_pass(const RenderSettings *settings, PixelPass pass)
{
    RenderSettings of_pass = *settings;
    if (pass == PASS_ALL) return of_pass;
    of_pass.precision = PRECISION_DOUBLE;
    of_pass.counting = false;
    return of_pass;
}

CompileSettings settings_of_variant(const RenderSettings *settings, SceneVariant variant)
{
    const Precision precision = settings_of_pass(settings, variant.pass).precision;
    return (CompileSettings){
        .width = settings->width,
        .height = settings->height,
        .sample_count = settings->sample_count,
        .bounce_count = settings->bounce_count,
        .min_contribution = settings->min_contribution,
        .precision = precision,
        .certifies = precision == PRECISION_CERTIFIED || variant.pass == PASS_FLAGGED,
        .lanes = variant.lanes,
        .bvh = settings->bvh,
        .instances = settings->instances,
        .extra_features = settings->extra_features,
        .shift_to_eye = settings->shift_to_eye,
        .hashes_primitives = settings->hashes_scene,
        .is_preview = settings->is_preview,
        .stage = settings->stage,
    };
}
