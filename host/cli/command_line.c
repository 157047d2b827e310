#include "host/cli/command_line.h"

#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include "host/base/memory.h"
#include "host/base/text.h"
#include "host/cli/interrupts.h"
#include "host/image/image.h"
#include "host/scene/scene.h"
#include <assert.h>
#include <ctype.h>
#include <dirent.h>
#include <errno.h>
#include <getopt.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { HELP_COLUMN = 24, HELP_WIDTH = 110, LIST_INDENT = 2, FIRST_CODE = 256, OPTIONS_MAX = 64 };

static const Option help_option[] = {{"help", NULL, "print this help", NULL, .letter = 'h'}};

void *option_field(const Option *option, void *options)
{
    return (char *)options + option->offset;
}

int command_finish(int status)
{
    if (status == EXIT_INTERRUPTED) interrupt_report("");
    // a truncated report must not exit with success
    errno = EIO; // the error of an earlier write is lost
    if (fflush(stdout) != 0 || ferror(stdout)) {
        stderr_print("cannot write to standard output: %s", strerror(errno));
        clearerr(stdout); // reported once
        return EXIT_MACHINE;
    }
    fault_output_is_complete(status);
    return status;
}

bool stderr_print(const char *format, ...)
{
    OWNED char *text = NULL;
    ARGUMENTS_FORMAT(text, format);
    fprintf(stderr, "glint: %s\n", text);
    return false;
}

bool option_fault(const Option *option, const char *value, const char *expected, ...)
{
    va_list arguments;
    va_start(arguments, expected);
    fprintf(stderr, "glint: --%s: expected ", option->name);
    vfprintf(stderr, expected, arguments);
    va_end(arguments);
    fprintf(stderr, ", not \"%s\"\n", value);
    return false;
}

bool option_flag(const Option *option, const char *value, void *options)
{
    (void)value;
    *(bool *)option_field(option, options) = true;
    return true;
}

bool option_text(const Option *option, const char *value, void *options)
{
    *(const char **)option_field(option, options) = value;
    return true;
}

bool option_named_file(const Option *option, const char *value, void *options)
{
    if (strcmp(value, "-") == 0) return option_fault(option, value, "the name of a file");
    return option_text(option, value, options);
}

bool option_texts(const Option *option, const char *value, void *options)
{
    OptionTexts *texts = option_field(option, options);
    if (texts->count == OPTION_TEXTS_MAX)
        return stderr_print("--%s: may be given at most %d times", option->name, OPTION_TEXTS_MAX);
    texts->items[texts->count++] = value;
    return true;
}

bool digits_read(const char *value, const char **end, uint64_t *result)
{
    *result = 0;
    const char *at = value;
    for (; *at >= '0' && *at <= '9' && *result < 1u << 31; at++)
        *result = *result * 10 + (uint64_t)(*at - '0');
    *end = at;
    return at > value;
}

bool option_count(const Option *option, const char *value, void *options)
{
    const char *end;
    uint64_t number;
    if (!digits_read(value, &end, &number) || *end != '\0' || (double)number < option->low ||
        (double)number > option->high)
        return option_fault(option, value, "an integer from %.0f to %.0f", option->low, option->high);
    *(uint32_t *)option_field(option, options) = (uint32_t)number;
    return true;
}

bool option_number(const Option *option, const char *value, void *options)
{
    char *end;
    const double number = strtod(value, &end);
    const bool has_low = option->is_above ? number > option->low : number >= option->low;
    if (end != value && *end == '\0' && has_low && number <= option->high && isfinite(number)) {
        *(double *)option_field(option, options) = number;
        return true;
    }
    if (option->is_above && option->high < INFINITY)
        return option_fault(option, value, "a number above %g, at most %g", option->low, option->high);
    if (option->is_above) return option_fault(option, value, "a number above %g", option->low);
    if (option->high == INFINITY) return option_fault(option, value, "a number of at least %g", option->low);
    return option_fault(option, value, "a number from %g to %g", option->low, option->high);
}

static bool sides_read(const Option *option, const char *value, void *options, const char *example)
{
    const uint64_t largest = IMAGE_SIDE_MAX;
    const char *at;
    uint64_t width, height;
    if (!digits_read(value, &at, &width) || (*at != 'x' && *at != 'X') ||
        !digits_read(at + 1, &at, &height) || *at != '\0' || width < 1 || height < 1 || width > largest ||
        height > largest)
        return option_fault(option, value, "WIDTHxHEIGHT, such as %s, each from 1 to %u", example,
                            (unsigned)largest);
    uint32_t *size = option_field(option, options);
    size[0] = (uint32_t)width;
    size[1] = (uint32_t)height;
    return true;
}

bool option_size(const Option *option, const char *value, void *options)
{
    return sides_read(option, value, options, "1280x720");
}

bool option_work_group(const Option *option, const char *value, void *options)
{
    return sides_read(option, value, options, "16x4");
}

// Prints the choices and suggests the nearest one. Returns false.
static bool names_fault(const Option *option, const char *value, const char *expected)
{
    fprintf(stderr, "glint: --%s: expected %s", option->name, expected);
    for (size_t i = 0; i < option->name_count; i++)
        fprintf(stderr, "%s%s", i == 0 ? "" : i + 1 == option->name_count ? " or " : ", ", option->names[i]);
    const char *near =
        isdigit((unsigned char)*value) ? NULL : text_nearest(value, option->names, option->name_count);
    fprintf(stderr, ", not \"%s\"", value);
    if (near) fprintf(stderr, "; did you mean %s?", near);
    fputc('\n', stderr);
    return false;
}

// Returns the index of the name, or name_count.
static size_t name_find(const Option *option, const char *name)
{
    size_t i = 0;
    while (i < option->name_count && strcmp(option->names[i], name) != 0)
        i++;
    return i;
}

bool option_choice(const Option *option, const char *value, void *options)
{
    const size_t index = value ? name_find(option, value) : 0;
    if (value && index == option->name_count) return names_fault(option, value, "");
    *(unsigned *)option_field(option, options) = option->values ? option->values[index] : (unsigned)index;
    return true;
}

bool option_list(const Option *option, const char *value, OptionReader *read, OptionItems list)
{
    Option item = *option;
    item.offset = 0;
    *list.count = 0;
    for (const char *at = value;; at++) {
        const size_t length = strcspn(at, ",");
        OWNED char *word = memory_copy_part(at, length);
        if (*list.count == list.most)
            return stderr_print("--%s: expected at most %zu values", option->name, list.most);
        if (!read(&item, word, (char *)list.items + *list.count * list.item_size)) return false;
        (*list.count)++;
        at += length;
        if (*at == '\0') return true;
    }
}

static bool name_read(const Option *option, const char *value, void *index)
{
    *(size_t *)index = name_find(option, value);
    return *(size_t *)index < option->name_count || names_fault(option, value, "a comma-separated list of ");
}

bool option_set(const Option *option, const char *value, void *options)
{
    enum { VALUES_MAX = 64, NAMES_MAX = 32 };
    if (option->name_count > NAMES_MAX) fault("--%s with more than %d names", option->name, NAMES_MAX);
    size_t indices[VALUES_MAX], count;
    const OptionItems list = {indices, sizeof *indices, VALUES_MAX, &count};
    if (!option_list(option, value, name_read, list)) return false;
    unsigned set = 0;
    for (size_t i = 0; i < count; i++)
        set |= 1u << indices[i];
    *(unsigned *)option_field(option, options) = set;
    return true;
}

bool effect_folder(const Option *option, void *options)
{
    const char *path = *(const char **)option_field(option, options);
    if (mkdir(path, 0777) != 0 && errno != EEXIST)
        return stderr_print("--%s: cannot create the folder '%s': %s", option->name, path, strerror(errno));
    if (access(path, W_OK | X_OK) == 0) return true;
    return stderr_print("--%s: cannot write to '%s': %s", option->name, path, strerror(errno));
}

bool effect_empty_folder(const Option *option, void *options)
{
    const char *path = *(const char **)option_field(option, options);
    if (!effect_folder(option, options)) return false;
    DIR *folder = opendir(path);
    if (!folder)
        return stderr_print("--%s: cannot read the folder '%s': %s", option->name, path, strerror(errno));
    bool is_empty = true;
    for (const struct dirent *item; (item = readdir(folder));)
        is_empty &= strcmp(item->d_name, ".") == 0 || strcmp(item->d_name, "..") == 0;
    closedir(folder);
    if (!is_empty) stderr_print("--%s: the folder '%s' is not empty", option->name, path);
    return is_empty;
}

// Prints the text from HELP_COLUMN on, wrapped; the items of a list are indented.
static void help_wrap(const char *text)
{
    size_t column = HELP_COLUMN;
    for (const char *at = text; *at != '\0';) {
        if (*at == '\n') {
            column = HELP_COLUMN + LIST_INDENT;
            printf("\n%*s", (int)column, "");
            at++;
        }
        const size_t length = strcspn(at, " \n");
        if (column + 1 + length > HELP_WIDTH) {
            printf("\n%*s", HELP_COLUMN, "");
            column = HELP_COLUMN;
        } else if (at > text && at[-1] == ' ') {
            putchar(' ');
            column++;
        }
        printf("%.*s", (int)length, at);
        column += length;
        at += length;
        if (*at == ' ') at++;
    }
    putchar('\n');
}

static void options_print(const Option *options, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        const Option *option = &options[i];
        const char letter[] = {'-', option->letter, ',', '\0'};
        const char *argument = option->argument ? option->argument : "";
        const int length = printf("  %3s --%s%s%s", option->letter ? letter : "", option->name,
                                  *argument && *argument != '[' ? " " : "", argument);
        if (length + 2 > HELP_COLUMN)
            printf("\n%*s", HELP_COLUMN, "");
        else
            printf("%*s", HELP_COLUMN - length, "");
        help_wrap(option->help);
    }
}

static int help_print(const CommandLine *line)
{
    printf("%s\n", line->usage);
    if (line->usage_print) line->usage_print();
    for (const OptionGroup *group = line->groups; group->items; group++) {
        if (group->heading) printf("\n%s\n", group->heading);
        options_print(group->items, group->count);
    }
    options_print(help_option, 1);
    return EXIT_DONE;
}

// Prints one option per line for completions and manual pages. Tabs separate its names, its argument, its
// choices and each line of its help.
static void options_list(const Option *options, size_t count)
{
    for (const Option *option = options; option < options + count; option++) {
        if (option->letter) printf("-%c ", option->letter);
        printf("--%s\t%s\t", option->name, option->argument ? option->argument : "");
        for (size_t i = 0; i < option->name_count; i++)
            printf("%s%s", i > 0 ? " " : "", option->names[i]);
        putchar('\t');
        for (const char *at = option->help; *at != '\0'; at++)
            putchar(*at == '\n' ? '\t' : *at);
        putchar('\n');
    }
}

// Stores the operands. Returns false with a message if one is missing or superfluous.
static bool operands_read(const CommandLine *line, void *options, CommandOperands operands)
{
    void *field = (char *)options + line->operands_offset;
    const size_t count = operands.count;
    const OperandRule rule = line->operands;
    if (rule == OPERANDS_NONE) return count == 0 || option_usage_fault(line->command, "takes no arguments");
    if (rule != OPERANDS_ANY && count == 0) return option_usage_fault(line->command, "no scene given");
    if (rule == OPERANDS_SCENE) {
        *(const char **)field = operands.items[0];
        if (count == 1) return true;
        OWNED char *what = text_format("takes one scene, but '%s' is a second", operands.items[1]);
        return option_usage_fault(line->command, what);
    }
    *(CommandOperands *)field = operands;
    for (size_t i = 0; line->operand_check && i < count; i++)
        if (!line->operand_check(operands.items[i])) return false;
    return true;
}

bool option_usage_fault(const char *command, const char *what)
{
    fprintf(stderr, "glint %s: %s; see glint %s --help\n", command, what, command);
    return false;
}

// Returns whether the checks of the command and of its groups find nothing wrong.
static bool checks_pass(const CommandLine *line, void *options)
{
    const char *what = line->check ? line->check(options) : NULL;
    for (const OptionGroup *group = line->groups; group->items && !what; group++)
        what = group->check ? group->check(options) : NULL;
    return !what || option_usage_fault(line->command, what);
}

int command_line_read(const CommandLine *line, void *options, int argument_count, char **arguments)
{
    const Option *listed[OPTIONS_MAX + 1] = {0}; // cppcheck does not see that fault never returns
    bool are_given[OPTIONS_MAX + 1] = {0};
    struct option long_options[OPTIONS_MAX + 2] = {0};
    char letters[2 * OPTIONS_MAX + 2] = "", *letter = letters;
    size_t count = 0;
    for (const OptionGroup *group = line->groups; group->items; group++)
        for (size_t i = 0; i < group->count; i++, count++) {
            if (count == OPTIONS_MAX) fault("a command with more than %d options", OPTIONS_MAX);
            const Option *option = listed[count] = &group->items[i];
            const int has_argument = !option->argument          ? no_argument
                                     : *option->argument == '[' ? optional_argument
                                                                : required_argument;
            const int code = option->letter ? option->letter : FIRST_CODE + (int)count;
            long_options[count] = (struct option){option->name, has_argument, NULL, code};
            if (option->letter) *letter++ = option->letter;
            if (option->letter && has_argument == required_argument) *letter++ = ':';
        }
    if (line->usage) {
        long_options[count] = (struct option){"help", no_argument, NULL, 'h'};
        *letter = 'h';
    }
    if (line->usage && strcmp(arguments[argument_count - 1], "--list-options") == 0) {
        for (const OptionGroup *group = line->groups; group->items; group++)
            options_list(group->items, group->count);
        options_list(help_option, 1);
        return EXIT_DONE;
    }
    optind = 0; // restarts getopt
    for (int code; (code = getopt_long(argument_count, arguments, letters, long_options, NULL)) != -1;) {
        if (code == 'h') return help_print(line);
        if (code == '?') {
            if (line->usage) stderr_print("see glint %s --help", line->command);
            return EXIT_USER;
        }
        size_t i = 0;
        while (long_options[i].val != code)
            i++;
        assert(i < count); // getopt_long returns the listed codes
        if (!listed[i]->read(listed[i], optarg, options)) return EXIT_USER;
        if (listed[i]->given) *(bool *)((char *)options + listed[i]->given) = true;
        are_given[i] = true;
    }
    const CommandOperands operands = {arguments + optind, (size_t)(argument_count - optind)};
    if (!operands_read(line, options, operands) || !checks_pass(line, options)) return EXIT_USER;
    for (size_t i = 0; i < count; i++)
        if (are_given[i] && listed[i]->effect && !listed[i]->effect(listed[i], options)) return EXIT_USER;
    return OPTIONS_READ;
}
