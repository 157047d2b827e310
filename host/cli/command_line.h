// Reads the options of a command from tables, and prints its help from them.
#pragma once

#include "host/base/array.h"
#include <getopt.h> // optind
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Option Option;

// Reads an option's value into the command's options. On a mistake prints what the option expects and returns
// false.
typedef bool OptionReader(const Option *option, const char *value, void *options);

struct Option {
    const char *name;
    const char *argument; // as the help names it, [=STYLE] if it is optional; NULL for a flag
    const char *help;     // wrapped where it is printed; a line break starts an item of a list
    OptionReader *read;
    size_t offset; // of the field, within the struct that the reader gets
    // What the reader accepts, if it has a range or names. NUMBERS_ABOVE excludes `low`.
    double low, high;
    bool is_above;
    const char *const *names;
    size_t name_count;
    char letter; // of the short form, or '\0'
};

#define NUMBERS(least, most)       .low = (least), .high = (most)
#define NUMBERS_ABOVE(bound, most) NUMBERS(bound, most), .is_above = true
#define NAMES(array)               .names = (array), .name_count = COUNT_OF(array)

// A table of options and the place, in the command's struct, of the struct with their fields.
typedef struct {
    const Option *items;
    size_t count, offset;
    const char *heading; // printed above them, or NULL
} OptionGroup;

#define OPTIONS(array)                                                                                       \
    {                                                                                                        \
        (array), COUNT_OF(array), 0, NULL                                                                    \
    }
#define OPTIONS_WITHIN(array, Type, member)                                                                  \
    {                                                                                                        \
        (array), COUNT_OF(array), offsetof(Type, member), NULL                                               \
    }

enum { OPTION_GROUPS_MAX = 16 };

typedef struct {
    const char *usage;                         // what the help prints before the options; NULL for no help
    void (*usage_print)(void);                 // prints more between the usage and the options; may be NULL
    OptionGroup groups[OPTION_GROUPS_MAX + 1]; // up to the first without items
} CommandLine;

// The result of reading a command line if the command must run. Any other result is the exit status.
enum { OPTIONS_READ = -1 };

// Reads the options into the struct. Other arguments start at getopt's `optind`. Returns OPTIONS_READ, or
// the exit status after printing the help or a message.
int command_line_read(const CommandLine *line, void *options, int argument_count, char **arguments);

// Readers. The types are those of their fields.
OptionReader option_flag;       // bool: set
OptionReader option_text;       // const char *
OptionReader option_count;      // uint32_t: an integer from `low` to `high`
OptionReader option_number;     // double, from `low` to `high`
OptionReader option_size;       // uint32_t[2], of WxH
OptionReader option_choice;     // an enum: the index of the name
OptionReader option_set;        // unsigned: one bit for each name of a comma-separated list
OptionReader option_folder;     // const char *: creates the folder, which must be writable
OptionReader option_new_folder; // const char *: creates the folder, which must be writable and empty

// What option_count and option_choice read, for readers that store it elsewhere.
bool count_read(const Option *option, const char *value, uint32_t *count);
bool choice_read(const Option *option, const char *value, unsigned *index);
// Returns the field of the option.
void *option_field(const Option *option, void *options);
// Reads at most `most` values, separated by commas, each into the next `item_size` bytes of `items`.
bool option_list(const Option *option, const char *value, OptionReader *read, void *items, size_t item_size,
                 size_t most, size_t *count);
// Reads decimal digits only, until their number exceeds 2^31. *end receives the position after them. Returns
// false if there are none.
bool digits_read(const char *value, const char **end, uint64_t *result);
// Prints what the option expects, as a format, and the value. Returns false.
bool option_fault(const Option *option, const char *value, const char *expected, ...)
    __attribute__((format(printf, 3, 4)));

// Prints a usage error that points to --help and returns EXIT_USER.
int option_usage_fault(const char *command, const char *what);
// Returns whether exactly one argument is left. Otherwise prints what is missing or superfluous.
bool option_only_scene(const char *command, int argument_count, char **arguments);
