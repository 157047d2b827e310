// The subcommands. Each receives its name as the first argument and returns the exit status.
#pragma once

int command_render(int argument_count, char **arguments);
int command_view(int argument_count, char **arguments);
int command_trace(int argument_count, char **arguments);
int command_check(int argument_count, char **arguments);
int command_devices(int argument_count, char **arguments);
int command_diff(int argument_count, char **arguments);
int command_bench(int argument_count, char **arguments);
int command_accuracy(int argument_count, char **arguments);
int command_certify(int argument_count, char **arguments);
int command_verify(int argument_count, char **arguments);
int command_golden(int argument_count, char **arguments);
int command_report(int argument_count, char **arguments);
int command_cache(int argument_count, char **arguments);
