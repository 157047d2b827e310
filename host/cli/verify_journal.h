// Records what glint verify knows about each case, in memory that its processes share. A driver that crashes
// ends only the process of the case.
#pragma once

#include "host/base/fault.h"
#include "host/verify/verify.h"
#include <sys/types.h>

typedef enum { CASE_PENDING, CASE_RUNNING, CASE_DONE, CASE_CRASHED } CaseState;

typedef struct {
    CaseState state;
    bool is_printed;
    VerifyResult result; // only the name and the title if the case crashed
    double start_seconds, seconds;
    char crash[CRASH_TEXT_SIZE]; // what happened
} CaseRecord;

typedef struct {
    bool is_started, is_ended; // whether the first and the last line are printed
    bool is_unsuitable;        // the device does not suit it; the reason is printed
    VerifyKernels kernels;
    double start_seconds, seconds;
    CaseRecord cases[VERIFY_CASES_MAX]; // in the order of verify_case_name
} PrecisionRecord;

typedef struct {
    bool is_headed; // the device's name is printed
    bool is_ended;  // ended by the current process, whose status then counts
    char crash[CRASH_TEXT_SIZE];
    PrecisionRecord precisions[ARITHMETIC_COUNT];
} VerifyJournal;

// Makes this process, a child of `parent`, end when that does.
void child_end_with(pid_t parent);

// Returns a zeroed journal, which lives until the process ends.
VerifyJournal *verify_journal_open(void);
// Calls `work` in a child process. If the child ends while a case is running, records the case as crashed and
// calls `work` in another child, which continues with the pending cases. Returns the exit status of `work` in
// the last child, and that child's exit status in the parent, or EXIT_MACHINE with a message if the child
// ended before `work` returned. No OpenCL call may have been made before.
int verify_journal_work(VerifyJournal *journal, int (*work)(void *context), void *context);
