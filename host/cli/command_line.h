// Reads the options of a command from tables, and prints its help from them.
#pragma once

#include "host/base/array.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct Option Option;

// Stores an option's value in the command's options, and has no other effect. On a mistake prints what the
// option expects and returns false.
typedef bool OptionReader(const Option *option, const char *value, void *options);
// Carries out what a stored value asks for before the command starts, such as a new folder, or only checks
// the value together with the other options. Returns false with a message if it fails.
typedef bool OptionEffect(const Option *option, void *options);

// Checks options together. Returns the mistake, which the caller prints as a usage error, or NULL if there is
// none.
typedef const char *OptionCheck(void *options);

struct Option {
    const char *name;
    const char *argument; // as the help names it, [=STYLE] if it is optional; NULL for a flag
    const char *help;     // wrapped where it is printed; a line break starts an item of a list
    OptionReader *read;
    size_t offset;        // of the field in the command's struct
    size_t given;         // the offset of a bool that becomes true if the option is given, or 0
    OptionEffect *effect; // of an option that is given, once its command line was accepted; may be NULL
    // What the reader accepts, if it has a range or names. NUMBERS_ABOVE excludes `low`.
    double low, high;
    bool is_above;
    const char *const *names;
    size_t name_count;
    const unsigned *values; // what option_choice stores for each name, or NULL for its index
    char letter;            // of the short form, or '\0'
};

#define NUMBERS(least, most)       .low = (least), .high = (most)
#define NUMBERS_ABOVE(bound, most) NUMBERS(bound, most), .is_above = true
#define NAMES(array)               .names = (array), .name_count = COUNT_OF(array)

typedef struct {
    const Option *items;
    size_t count;
    const char *heading; // printed above them, or NULL
    OptionCheck *check;  // of these options, after the command's check; may be NULL
} OptionGroup;

#define OPTIONS(array)                                                                                       \
    {                                                                                                        \
        .items = (array), .count = COUNT_OF(array)                                                           \
    }
#define OPTION(option)                                                                                       \
    {                                                                                                        \
        .items = &(option), .count = 1                                                                       \
    }

#define OPERANDS(rule, Type, member) .operands = OPERANDS_##rule, .operands_offset = offsetof(Type, member)

enum { OPTION_GROUPS_MAX = 16 };

typedef struct {
    char **items;
    size_t count;
} CommandOperands;

// How many arguments may follow the options, and the type of the field that stores them.
typedef enum {
    OPERANDS_NONE,   // none, the default
    OPERANDS_SCENE,  // one, in a const char *
    OPERANDS_SCENES, // at least one, in CommandOperands
    OPERANDS_ANY     // any number, in CommandOperands
} OperandRule;

typedef struct {
    const char *command;
    const char *usage;                         // what the help prints before the options; NULL for no help
    void (*usage_print)(void);                 // prints more between the usage and the options; may be NULL
    OptionGroup groups[OPTION_GROUPS_MAX + 1]; // up to the first without items
    OperandRule operands;
    size_t operands_offset; // of their field in the command's struct
    // Prints a message and returns false if an operand is wrong; may be NULL.
    bool (*operand_check)(const char *operand);
    OptionCheck *check; // of all options and operands; may be NULL
} CommandLine;

// The result of reading a command line if the command must run. Any other result is the exit status.
enum { OPTIONS_READ = -1 };

// Reads options and operands into the struct, checks the whole command line, and only then carries out the
// effects of options, in the order of the groups. Returns OPTIONS_READ, or the exit status after printing the
// help or a message.
int command_line_read(const CommandLine *line, void *options, int argument_count, char **arguments);

// Readers. The types are those of their fields.
OptionReader option_flag;       // bool: set
OptionReader option_text;       // const char *
OptionReader option_named_file; // const char *: the name of a file, which is not "-"
OptionReader option_texts;      // OptionTexts: each use of the option adds a text
OptionReader option_count;      // uint32_t: an integer from `low` to `high`
OptionReader option_number;     // double, from `low` to `high`
OptionReader option_size;       // uint32_t[2]: WxH pixels
OptionReader option_work_group; // uint32_t[2]: WxH work-items
OptionReader option_choice;     // an enum or uint32_t: the named value, or the first without an argument
OptionReader option_set;        // unsigned: one bit for each name of a comma-separated list

enum { OPTION_TEXTS_MAX = 64 };
typedef struct {
    const char *items[OPTION_TEXTS_MAX];
    size_t count;
} OptionTexts;

// Effects that create the folder that the option's value names, unless it exists. It must be writable.
OptionEffect effect_folder;
OptionEffect effect_empty_folder; // which must also be empty

// Returns the field of the option.
void *option_field(const Option *option, void *options);
// An array that receives the values of an option.
typedef struct {
    void *items;
    size_t item_size, most; // bytes of an item, and the largest number of them
    size_t *count;
} OptionItems;
// Reads at most list.most values, separated by commas, and sets *list.count. Returns false with a message on
// a mistake.
bool option_list(const Option *option, const char *value, OptionReader *read, OptionItems list);
// Reads decimal digits until the value is 2^31 or more. *end receives the position after them. Returns false
// if there are none.
bool digits_read(const char *value, const char **end, uint64_t *result);
// Prints what the option expects, as a format, and the value. Returns false.
bool option_fault(const Option *option, const char *value, const char *expected, ...)
    __attribute__((format(printf, 3, 4)));

// Prints that the command was interrupted, unless it has already done so. Flushes standard output. A later
// fault then causes only a warning. Returns the exit status, which is EXIT_MACHINE with a message if standard
// output failed.
int command_finish(int status);

// Prints a line to standard error, after "glint: ". Returns false, so that a function can return its error.
bool stderr_print(const char *format, ...) __attribute__((format(printf, 1, 2)));
// Prints a usage error that points to --help. Returns false.
bool option_usage_fault(const char *command, const char *what);
