#include "host/cli/verify_journal.h"

#include "host/base/clock.h"
#include "host/base/exit_status.h"
#include "host/cli/command_line.h"
#include "host/cli/interrupts.h"
#include <errno.h>
#include <signal.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

VerifyJournal *verify_journal_open(void)
{
    VerifyJournal *journal =
        mmap(NULL, sizeof *journal, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (journal == MAP_FAILED) fault("out of memory: the journal of verify");
    return journal;
}

static CaseRecord *running_case(VerifyJournal *journal)
{
    for (size_t i = 0; i < ARITHMETIC_COUNT; i++)
        for (size_t k = 0; k < VERIFY_CASES_MAX; k++)
            if (journal->precisions[i].cases[k].state == CASE_RUNNING)
                return &journal->precisions[i].cases[k];
    return NULL;
}

// Completes journal->crash, which a crash in an OpenCL call has set.
static void crash_describe(VerifyJournal *journal, int status)
{
    if (journal->crash[0] != '\0') return;
    if (WIFSIGNALED(status))
        snprintf(journal->crash, sizeof journal->crash, "the process was ended by a signal: %s",
                 strsignal(WTERMSIG(status)));
    else
        snprintf(journal->crash, sizeof journal->crash, "the process ended with status %d",
                 WEXITSTATUS(status));
}

static void crash_record(VerifyJournal *journal, CaseRecord *record)
{
    record->state = CASE_CRASHED;
    record->seconds = clock_seconds() - record->start_seconds;
    memcpy(record->crash, journal->crash, sizeof record->crash);
    journal->crash[0] = '\0';
}

void child_end_with(pid_t parent)
{
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    if (getppid() != parent) _exit(EXIT_INTERRUPTED);
}

// Ignores the signals that end a group of processes. The parent receives them and ends this process.
static void child_begin(VerifyJournal *journal, pid_t parent)
{
    child_end_with(parent);
    interrupts_ignore();
    fault_record_crashes(journal->crash);
}

int verify_journal_work(VerifyJournal *journal, int (*work)(void *context), void *context)
{
    const pid_t parent = getpid();
    for (;;) {
        fflush(stdout); // otherwise each process would print the contents of the buffer
        const pid_t child = fork();
        if (child < 0) {
            stderr_print("cannot start a process: %s", strerror(errno));
            return EXIT_MACHINE;
        }
        if (child == 0) {
            child_begin(journal, parent);
            const int status = work(context);
            journal->is_ended = true;
            return status;
        }
        int status = 0;
        while (waitpid(child, &status, 0) < 0 && errno == EINTR)
            ;
        CaseRecord *running = running_case(journal);
        // a fault ends the process with EXIT_MACHINE after its message
        const bool has_status =
            WIFEXITED(status) && (journal->is_ended || (!running && WEXITSTATUS(status) == EXIT_MACHINE));
        if (!has_status) crash_describe(journal, status);
        if (journal->is_ended || !running) {
            if (journal->crash[0] != '\0') stderr_print("%s", journal->crash);
            return has_status ? WEXITSTATUS(status) : EXIT_MACHINE;
        }
        crash_record(journal, running);
    }
}
