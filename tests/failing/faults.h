// Makes calls fail by rules. C tests set one of them, `injected`. tests/faults.so and tools/chaos.c, which
// are preloaded into glint, read those of GLINT_FAULTS, with '; ' between:
//
//     CALL[@FIRST[-]] [kernel=NAME] [file=PATH:BYTES] ACT[=NUMBER]
//
// CALL is a function or a class of calls. Without FIRST all of these calls fail, else the one with that
// index, from 0, or with '-' also the later ones. `kernel` restricts a rule to the calls for this kernel,
// `file` to those while the file has at least so many bytes. Rules behind "child " are for child processes
// only.
//
// The file GLINT_FAULT_LOG receives "failed CALL" when a call fails, and as the process ends each rule's CALL
// with its count.
#pragma once

#include <pthread.h>
#include <stdatomic.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// Classes of calls. `creating` calls are those OpenCL calls that create an object.
enum { CALL_OPENCL = 1, CALL_CREATING = 2, CALL_ALLOCATION = 4, CALL_FILE = 8 };

typedef enum {
    FAULT_NONE,
    FAULT_COUNT, // the calls are only counted
    FAULT_FAIL,
    FAULT_NULL,      // an object is NULL with CL_SUCCESS
    FAULT_FULL,      // a call that writes finds the disk full
    FAULT_INTERRUPT, // by a signal
    FAULT_SHORT,     // half of the bytes are transferred
    FAULT_CRASH,
    FAULT_ABORT,
    FAULT_ASSERTION, // of the driver
    FAULT_KILL,      // the process is killed
    FAULT_HANG,
    FAULT_EXIT,  // with the status NUMBER
    FAULT_SLEEP, // for NUMBER milliseconds; the call then succeeds
} FaultAct;

#define EVERY_CALL SIZE_MAX

typedef struct {
    const char *call;   // NULL: no rule
    size_t index;       // of the call that fails, from 0 among those that the rule concerns, or EVERY_CALL
    bool is_lasting;    // the later calls fail as well
    bool is_in_threads; // only calls of other threads than the first are counted and fail
    FaultAct act;
    int number;
    unsigned classes;          // of `call`, unless it is a function
    const char *kernel, *file; // those that `kernel` and `file` name, or NULL
    size_t file_bytes;
    atomic_size_t count; // of the calls that the rule concerns
} Fault;

extern Fault injected;
extern pthread_t first_thread;
extern bool faults_are_for_children;

// Counts a call and returns how it fails, which is logged, or FAULT_NONE. `kernel` may be NULL.
FaultAct fault_at(const char *call, unsigned classes, const char *kernel);
// Returns whether a rule of GLINT_FAULTS is about a class.
bool faults_concern(unsigned class);
void faults_log_failed(const char *call); // at FAULT_FULL only the caller knows whether the call fails
// Logs the counts. Is called as the process exits.
void faults_log_counts(void);
