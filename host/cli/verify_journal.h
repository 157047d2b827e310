// What glint verify knows of each case, in memory that its processes share: a driver that crashes ends the
// process of the case alone.
#pragma once

#include "host/base/fault.h"
#include "host/verify/verify.h"

typedef enum { CASE_PENDING, CASE_RUNNING, CASE_DONE, CASE_CRASHED } CaseState;

typedef struct {
    CaseState state;
    bool is_printed;
    VerifyResult result; // of a crashed case the name and the title
    double start_seconds, seconds;
    char crash[CRASH_TEXT_SIZE]; // what happened
} CaseRecord;

typedef struct {
    bool is_started, is_ended; // its lines are printed
    bool is_unsuitable;        // for the device's arithmetic; the reason is printed
    VerifyKernels kernels;
    double start_seconds, seconds;
    CaseRecord cases[VERIFY_CASES_MAX]; // in the order of verify_case_name
} PrecisionRecord;

typedef struct {
    bool is_headed; // the device's name is printed
    bool is_ended;  // by the process at work, whose status then counts
    char crash[CRASH_TEXT_SIZE];
    PrecisionRecord precisions[ARITHMETIC_COUNT];
} VerifyJournal;

// Returns a zeroed journal, which lives until the process ends.
VerifyJournal *verify_journal_open(void);
// Calls `work` in a child process; where that ends while a case is running, records the case as crashed and
// calls it in another one, which continues with the cases that are pending. Returns the exit status: in the
// last child that of `work`, in the parent the child's. No OpenCL call may have been made before.
int verify_journal_work(VerifyJournal *journal, int (*work)(void *context), void *context);
