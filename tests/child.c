#include "tests/child.h"
#include "tests/check.h"

#include "host/base/exit_status.h"
#include "host/base/fault.h"
#include <sys/mman.h>
#include <sys/wait.h>

// Exits without a leak check, since a fault leaves its memory to the system and must keep its status.
static void leave(int status, void *unused)
{
    (void)unused;
    fflush(NULL);
    _exit(status);
}

ChildEnd child_run(void (*work)(void *result), void *result, size_t size)
{
    ChildEnd end = {.status = -1};
    void *shared = mmap(NULL, size, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    FILE *errors = tmpfile();
    if (shared == MAP_FAILED || !errors) fault("no memory or file for a child");
    memcpy(shared, result, size);
    fflush(NULL);
    pid_t child = fork();
    if (child < 0) fault("no child");
    if (child == 0) {
        dup2(fileno(errors), STDERR_FILENO);
        on_exit(leave, NULL);
        work(shared);
        exit(0);
    }
    int status;
    if (waitpid(child, &status, 0) != child) fault("no status of a child");
    if (WIFEXITED(status))
        end.status = WEXITSTATUS(status);
    else
        end.signal = WTERMSIG(status);
    fseek(errors, 0, SEEK_SET);
    end.errors[fread(end.errors, 1, sizeof end.errors - 1, errors)] = '\0';
    fclose(errors);
    memcpy(result, shared, size);
    munmap(shared, size);
    return end;
}

ChildEnd child_run_with_device(void (*work)(void *result), void *result, size_t size)
{
    const ChildEnd end = child_run(work, result, size);
    if (end.status == NO_DEVICE) skip();
    return end;
}

unsigned failures_without_memory(void (*work)(void *left))
{
    long left = 0;
    unsigned failed = 0;
    for (ChildEnd end; (end = child_run(work, &left, sizeof left)).status != 0; left = ++failed) {
        assert_int_equal(end.status, EXIT_MACHINE);
        assert_non_null(strstr(end.errors, "out of memory"));
    }
    assert_true(left >= 0); // none failed unseen
    return failed;
}
