// glint render renders scene files, or frames of one, to images.
#include "host/cli/render.h"
#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/commands.h"
#include "host/cli/interrupts.h"
#include "host/cli/render_image.h"
#include "host/import/load.h"
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

// Returns the pattern with its directive, if any, replaced by the frame's number. The caller frees it.
static char *frame_name_make(const char *pattern, uint32_t frame)
{
    const FramePlace place = frame_place_of(pattern);
    if (!place.start) return memory_copy_text(pattern);
    return text_format("%.*s%0*u%s", (int)(place.start - pattern), pattern, place.digits, frame, place.end);
}

// Returns the path of an image. The caller frees it.
static char *image_path_make(const RenderOptions *options, size_t index)
{
    const char *output = options->output.path;
    const bool is_frame = options->frame_count > 0;
    const uint32_t frame = options->first_frame + (uint32_t)index;
    if (options->has_format) return memory_copy_text(output);
    if (output && is_frame && (frame_place_of(output).start || !output_is_folder(output)))
        return frame_name_make(output, frame);
    if (output && !is_frame && options->scenes.count == 1) return memory_copy_text(output);
    OWNED char *name = image_output_default_path(options->scenes.items[is_frame ? 0 : index]);
    if (is_frame) name[strlen(name) - strlen(".png")] = '\0';
    OWNED char *ending = is_frame ? text_format("-%04u.png", frame) : memory_copy_text("");
    return text_format("%s%s%s%s", output ? output : "", output ? "/" : "", name, ending);
}

// Returns whether all images have different paths, and prints an error if not.
static bool paths_differ(char *const *paths, const RenderOptions *options)
{
    if (options->has_format) return true; // all go to standard output
    for (size_t i = 0; i < options->scenes.count; i++)
        for (size_t k = 0; k < i; k++) {
            if (strcmp(paths[i], paths[k]) != 0) continue;
            return stderr_print("the images of '%s' and '%s' would both be '%s'", options->scenes.items[k],
                                options->scenes.items[i], paths[i]);
        }
    return true;
}

RenderCommand *render_command_open(int argument_count, char **arguments, int *status)
{
    RenderOptions options;
    *status = render_options_read(&options, argument_count, arguments);
    if (*status != OPTIONS_READ) return NULL;
    RenderCommand *command = memory_allocate_zeroed(1, sizeof *command);
    command->options = options;
    command->count = options.frame_count > 0 ? options.frame_count : options.scenes.count;
    command->paths = memory_allocate(command->count, sizeof *command->paths);
    for (size_t i = 0; i < command->count; i++)
        command->paths[i] = image_path_make(&options, i);
    if (paths_differ(command->paths, &options)) return command;
    render_command_close(command);
    *status = EXIT_USER;
    return NULL;
}

// Mistakes in a scene are reported when it is rendered.
static bool scene_is_overwritten(RenderOptions options, const char *path, char *const *images)
{
    OwnedScene scene = {0};
    OwnedMessageList ignored = {0};
    const SceneOptions scene_options = scene_options_of(&options.common);
    if (!scene_load(&scene, path, &scene_options, &ignored)) return false;
    for (size_t i = 0; i < options.scenes.count; i++) {
        options.output.path = images[i];
        if (image_output_overwrites_scene(&options.output, &scene, path)) return true;
    }
    return false;
}

bool render_command_check_overwrites(RenderCommand *command)
{
    const RenderOptions *options = &command->options;
    bool image_exists = false;
    for (size_t i = 0; i < options->scenes.count && options->scenes.count > 1 && !options->skips_existing;
         i++)
        image_exists = image_exists || access(command->paths[i], F_OK) == 0;
    for (size_t i = 0; i < options->scenes.count && image_exists; i++) {
        const bool can_read_twice = strcmp(options->scenes.items[i], "-") != 0;
        if (!can_read_twice || !scene_is_overwritten(*options, options->scenes.items[i], command->paths))
            continue;
        render_command_record(command, EXIT_USER);
        return false;
    }
    return true;
}

const char *render_command_scene(const RenderCommand *command, size_t index)
{
    return command->options.scenes.items[command->options.frame_count > 0 ? 0 : index];
}

// Returns whether all files of an image exist, and prints the image's name if so.
static bool image_exists(const RenderOptions *options, const char *path)
{
    ImageOutputOptions output = options->output;
    output.path = path;
    if (!image_output_exists(&output)) return false;
    if (!options->quiet) stderr_print("kept %s", path);
    return true;
}

int render_command_run(RenderCommand *command, size_t index, Ranks *ranks)
{
    RenderDevices *open = &command->open;
    RenderOptions *options = &command->options;
    options->scene = render_command_scene(command, index);
    if (options->frame_count > 0) options->common.scene.frame = options->first_frame + (double)index;
    if (options->skips_existing && image_exists(options, command->paths[index])) return EXIT_DONE;
    render_devices_release(open);
    interrupts_end_at_once(); // nothing checks the flag while a scene is read
    if (is_interrupted()) return EXIT_INTERRUPTED;
    RenderOptions of_image = *options;
    OWNED char *checkpoint =
        options->checkpoint && options->frame_count > 0
            ? frame_name_make(options->checkpoint, options->first_frame + (uint32_t)index)
            : NULL;
    if (checkpoint) of_image.checkpoint = checkpoint;
    const int status = image_file_render(of_image, command->paths[index], open, ranks);
    return render_devices_work(open) ? status : EXIT_MACHINE;
}

void render_command_record(RenderCommand *command, int status)
{
    if (status != EXIT_DONE) command->status = status;
}

// Returns whether another scene can be rendered. A mistake in one scene does not affect others.
static bool continues_after(int status)
{
    return status == EXIT_DONE || status == EXIT_USER;
}

void render_command_run_from(RenderCommand *command, size_t first, Ranks *ranks)
{
    bool continues = continues_after(command->status);
    for (size_t i = first; i < command->count && continues; i++) {
        const int status = render_command_run(command, i, ranks);
        render_command_record(command, status);
        continues = continues_after(status);
    }
    if (command->status == EXIT_DONE) fault_output_is_complete(EXIT_DONE);
}

void render_command_drop_devices(RenderCommand *command)
{
    RenderDevices *open = &command->open;
    for (size_t i = 0; i < open->count; i++)
        if (!compute_ok(open->items[i].compute)) render_devices_drop(open, i);
}

int render_command_close(RenderCommand *command)
{
    const int status = render_devices_close(&command->open, command->status);
    for (size_t i = 0; i < command->count; i++)
        free(command->paths[i]);
    free(command->paths);
    free(command);
    return status;
}

int command_render(int argument_count, char **arguments)
{
    int status;
    RenderCommand *command = render_command_open(argument_count, arguments, &status);
    if (!command) return status;
    if (render_command_check_overwrites(command)) render_command_run_from(command, 0, NULL);
    return render_command_close(command);
}
