// Makes allocations and system calls of a process fail by the rules of tests/failing/faults.h. tools/chaos
// preloads this library into glint, with tests/failing/calls.c for OpenCL's calls.
//
//   allocation   an allocation by glint's own code
//   file         a system call on a file below the folder GLINT_CHAOS_FOLDER, or on stdin and stdout. It
//   fails
//                with EIO, at `full` with ENOSPC if it writes or creates, at `interrupt` with EINTR; `short`
//                is for reads and writes
//
// GLINT_DENIED is the number of a system call that always fails with EPERM.
//
// seccomp traps the system calls, including those within libc. Works only on x86-64 Linux with glibc.
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "tests/failing/faults.h"
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <link.h>
#include <linux/audit.h>
#include <linux/filter.h>
#include <linux/seccomp.h>
#include <signal.h>
#include <stdarg.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/prctl.h>
#include <sys/syscall.h>
#include <ucontext.h>
#include <unistd.h>

// glibc's parameters have reserved names
// NOLINTBEGIN(readability-inconsistent-declaration-parameter-name)

static char folder[PATH_MAX];
static uintptr_t text_start, text_end; // the bounds of the main program's code

// Makes a system call that the filter lets pass.
__attribute__((naked, noinline)) static long pass_through(long number, long a, long b, long c, long d, long e,
                                                          long f)
{
    __asm__("mov %rdi, %rax\n mov %rsi, %rdi\n mov %rdx, %rsi\n mov %rcx, %rdx\n mov %r8, %r10\n"
            "mov %r9, %r8\n mov 8(%rsp), %r9\n syscall\n ret\n");
}
enum { PASS_THROUGH_BYTES = 64 };

static void *real(const char *name)
{
    void *function = dlsym(RTLD_NEXT, name);
    if (!function) abort();
    return function;
}

// One type serves for all functions whose arguments are integers or pointers.
typedef long (*Function)(long, long, long, long, long, long, long, long, long, long, long);
#define PARAMETERS long a, long b, long c, long d, long e, long f, long g, long h, long i, long j, long k
#define ARGUMENTS  a, b, c, d, e, f, g, h, i, j, k

// ---- allocations by the main program

void *__libc_malloc(size_t size);
void *__libc_calloc(size_t count, size_t size);
void *__libc_realloc(void *old, size_t size);
void *__libc_memalign(size_t alignment, size_t size);

#define IS_GLINT                                                                                             \
    ((uintptr_t)__builtin_return_address(0) >= text_start &&                                                 \
     (uintptr_t)__builtin_return_address(0) < text_end)
#define ALLOCATION_FAILS(name)                                                                               \
    (IS_GLINT && fault_at(name, CALL_ALLOCATION, NULL) ? (errno = ENOMEM, true) : false)

void *malloc(size_t size)
{
    return ALLOCATION_FAILS("malloc") ? NULL : __libc_malloc(size);
}

void *calloc(size_t count, size_t size)
{
    return ALLOCATION_FAILS("calloc") ? NULL : __libc_calloc(count, size);
}

void *realloc(void *old, size_t size)
{
    return ALLOCATION_FAILS("realloc") ? NULL : __libc_realloc(old, size);
}

void *aligned_alloc(size_t alignment, size_t size)
{
    return ALLOCATION_FAILS("aligned_alloc") ? NULL : __libc_memalign(alignment, size);
}

int posix_memalign(void **result, size_t alignment, size_t size)
{
    if (ALLOCATION_FAILS("posix_memalign")) return ENOMEM;
    *result = __libc_memalign(alignment, size);
    return *result ? 0 : ENOMEM;
}

// Wraps a function whose arguments are integers or pointers. Its symbol is named explicitly, because libc
// declares it with other types. `failure` is what it returns when it fails.
#define FAILING(name, failure)                                                                               \
    long failing_##name(PARAMETERS) __asm__(#name);                                                          \
    long failing_##name(PARAMETERS)                                                                          \
    {                                                                                                        \
        return ALLOCATION_FAILS(#name) ? (failure) : ((Function)real(#name))(ARGUMENTS);                     \
    }

FAILING(strdup, 0)
FAILING(strndup, 0)
FAILING(realpath, 0)
FAILING(fopen, 0)
FAILING(fdopen, 0)
FAILING(tmpfile, 0)
FAILING(open_memstream, 0)
FAILING(fdopendir, 0)
FAILING(pthread_create, EAGAIN)
FAILING(inotify_init1, -1)
FAILING(eventfd, -1)
FAILING(pipe2, -1)
FAILING(posix_spawn, ENOMEM)
FAILING(waitpid, -1)
FAILING(vasprintf, -1)

int asprintf(char **result, const char *format, ...)
{
    if (ALLOCATION_FAILS("asprintf")) return -1;
    va_list arguments;
    va_start(arguments, format);
    int length = ((int (*)(char **, const char *, va_list))real("vasprintf"))(result, format, arguments);
    va_end(arguments);
    return length;
}

// ---- system calls

// FOLDER_PATH calls have a folder and a path, PATH_ALONE calls a path, TO_FOLDER calls a folder as third
// argument, and the others begin with a descriptor. STORES calls may find the disk full, as WRITES calls do.
enum { READS = 1, WRITES = 2, CREATES = 4, FOLDER_PATH = 8, STORES = 16, PATH_ALONE = 32, TO_FOLDER = 64 };

static const struct {
    int number, what;
    const char *name;
} trapped[] = {
    {SYS_read, READS, "read"},
    {SYS_pread64, READS, "pread"},
    {SYS_readv, 0, "readv"},
    {SYS_write, WRITES, "write"},
    {SYS_pwrite64, WRITES, "pwrite"},
    {SYS_writev, STORES, "writev"},
    {SYS_fsync, STORES, "fsync"},
    {SYS_flock, 0, "flock"},
    {SYS_fchmod, 0, "fchmod"},
    {SYS_openat, CREATES | FOLDER_PATH, "open"},
    {SYS_linkat, STORES | TO_FOLDER, "link"},
    {SYS_renameat, STORES, "rename"},
    {SYS_renameat2, STORES, "rename"},
    {SYS_newfstatat, FOLDER_PATH, "stat"},
    {SYS_readlink, PATH_ALONE, "readlink"},
    {SYS_getdents64, 0, "readdir"},
    {SYS_mkdir, STORES | PATH_ALONE, "mkdir"},
};
enum { TRAPPED_COUNT = sizeof trapped / sizeof *trapped };

// Returns whether a descriptor is stdin or stdout, or its file is below the folder.
static bool descriptor_is_ours(long descriptor)
{
    char link[40], path[PATH_MAX];
    if (descriptor == 0 || descriptor == 1) return true;
    snprintf(link, sizeof link, "/proc/self/fd/%d", (int)descriptor);
    long length = pass_through(SYS_readlink, (long)link, (long)path, sizeof path - 1, 0, 0, 0);
    if (length <= 0) return false;
    path[length] = '\0';
    return strncmp(path, folder, strlen(folder)) == 0;
}

static bool path_is_ours(long descriptor, const char *path)
{
    if (path[0] == '/') return strncmp(path, folder, strlen(folder)) == 0;
    return (int)descriptor == AT_FDCWD || descriptor_is_ours(descriptor);
}

static long call_make(size_t n, const long *a)
{
    const int what = trapped[n].what, number = trapped[n].number;
    const char *path = (const char *)(what & PATH_ALONE ? a[0] : what & FOLDER_PATH ? a[1] : 0);
    bool ours = path && path[0] != '\0' ? path_is_ours(what & PATH_ALONE ? AT_FDCWD : a[0], path)
                                        : descriptor_is_ours(a[what & TO_FOLDER ? 2 : 0]);
    if (!ours) return pass_through(number, a[0], a[1], a[2], a[3], a[4], a[5]);
    long size = a[2];
    const FaultAct act = fault_at(trapped[n].name, CALL_FILE, NULL);
    if (act == FAULT_SHORT && (what & (READS | WRITES)) && size > 1) size = (size + 1) / 2;
    bool grows =
        (what & (WRITES | STORES)) || ((what & CREATES) && (a[2] & (O_CREAT | (O_TMPFILE & ~O_DIRECTORY))));
    int error = act == FAULT_FAIL            ? EIO
                : act == FAULT_INTERRUPT     ? EINTR
                : act == FAULT_FULL && grows ? ENOSPC
                                             : 0;
    if (!error) return pass_through(number, a[0], a[1], size, a[3], a[4], a[5]);
    if (act == FAULT_FULL) faults_log_failed(trapped[n].name);
    return -error;
}

static void on_trap(int signal, siginfo_t *info, void *context)
{
    (void)signal;
    greg_t *registers = ((ucontext_t *)context)->uc_mcontext.gregs;
    const long arguments[] = {registers[REG_RDI], registers[REG_RSI], registers[REG_RDX],
                              registers[REG_R10], registers[REG_R8],  registers[REG_R9]};
    int error = errno;
    for (size_t n = 0; n < TRAPPED_COUNT; n++)
        if (trapped[n].number == info->si_syscall) {
            registers[REG_RAX] = call_make(n, arguments);
            break;
        }
    errno = error;
}

// Keeps this library's handler of SIGSYS, since LLVM installs one.
int sigaction(int signal, const struct sigaction *action, struct sigaction *old)
{
    static int (*function)(int, const struct sigaction *, struct sigaction *);
    if (!function) function = (int (*)(int, const struct sigaction *, struct sigaction *))real("sigaction");
    if (signal == SIGSYS && (!action || action->sa_sigaction != on_trap)) {
        if (old) *old = (struct sigaction){0};
        return 0;
    }
    return function(signal, action, old);
}

static void filter_install(struct sock_filter *filter, unsigned short count)
{
    const struct sock_fprog program = {.len = count, .filter = filter};
    if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0 ||
        prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program) != 0)
        faults_log_failed("seccomp");
}

static void trap_calls(void)
{
    struct sigaction action = {.sa_sigaction = on_trap, .sa_flags = SA_SIGINFO | SA_NODEFER};
    sigaction(SIGSYS, &action, NULL);
    const uint64_t start = (uintptr_t)pass_through, end = start + PASS_THROUGH_BYTES;
    if (start >> 32 != end >> 32) abort();
    struct sock_filter filter[TRAPPED_COUNT + 16];
    unsigned short n = 0;
#define LOAD(field) BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, field))
    filter[n++] = (struct sock_filter)LOAD(nr);
    for (size_t i = 0; i < TRAPPED_COUNT; i++) {
        uint8_t to_check = (uint8_t)(TRAPPED_COUNT - i);
        filter[n++] =
            (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (uint32_t)trapped[i].number, to_check, 0);
    }
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_LD | BPF_W | BPF_ABS,
                                               offsetof(struct seccomp_data, instruction_pointer) + 4);
    filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, (uint32_t)(start >> 32), 0, 4);
    filter[n++] = (struct sock_filter)LOAD(instruction_pointer);
    filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, (uint32_t)start, 0, 2);
    filter[n++] = (struct sock_filter)BPF_JUMP(BPF_JMP | BPF_JGE | BPF_K, (uint32_t)end, 1, 0);
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW);
    filter[n++] = (struct sock_filter)BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP);
    filter_install(filter, n);
}

// Denies a system call in this process and its children, as a sandbox does that is unaware of it.
static void deny_call(unsigned number)
{
    struct sock_filter filter[] = {
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(struct seccomp_data, nr)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, number, 0, 1),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ERRNO | EPERM),
        BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
    };
    filter_install(filter, sizeof filter / sizeof *filter);
}

// ---- start and end

static int find_text(struct dl_phdr_info *info, size_t size, void *unused)
{
    (void)size, (void)unused;
    for (int i = 0; i < info->dlpi_phnum; i++) {
        const ElfW(Phdr) *header = &info->dlpi_phdr[i];
        if (header->p_type != PT_LOAD || !(header->p_flags & PF_X)) continue;
        text_start = info->dlpi_addr + header->p_vaddr;
        text_end = text_start + header->p_memsz;
    }
    return 1; // stops after the first object, which is the main program
}

__attribute__((constructor)) static void start(void)
{
    const char *where = getenv("GLINT_CHAOS_FOLDER"), *denied = getenv("GLINT_DENIED");
    if (faults_are_for_children) return;
    if (where) snprintf(folder, sizeof folder, "%s", where);
    dl_iterate_phdr(find_text, NULL);
    // the filter would kill programs that a driver starts before they could handle the signal
    unsetenv("LD_PRELOAD");
    if (faults_concern(CALL_FILE)) trap_calls();
    if (denied) deny_call((unsigned)strtoul(denied, NULL, 10));
}

// Replaces _exit, by which the process that reads a mesh for another one ends.
void _exit(int status)
{
    faults_log_counts();
    for (;;)
        pass_through(SYS_exit_group, status, 0, 0, 0, 0, 0);
}

// NOLINTEND(readability-inconsistent-declaration-parameter-name)
