/* Kills its process in the middle of the n-th write to a file below a folder: half of the bytes are there.

   Loaded before the C library (LD_PRELOAD); does nothing until a process arms it, and nothing in that
   process's own children. What a library writes by fwrite() goes to its file at once then. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdatomic.h>
#include <stdio.h>
#include <string.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

static char root[PATH_MAX];
static long fatal;
static atomic_long calls;
static pid_t armed;

void write_points_arm(const char *folder, long at)
{
    snprintf(root, sizeof root, "%s/", folder);
    fatal = at;
    atomic_store(&calls, 0);
    armed = getpid();
}

long write_points_count(void) { return atomic_load(&calls); }

/* 1 where this is the write in which the process ends. */
static int is_last(int file)
{
    char name[64], path[PATH_MAX];
    ssize_t size;
    if (armed == 0 || armed != getpid())
        return 0;
    snprintf(name, sizeof name, "/proc/self/fd/%d", file);
    size = readlink(name, path, sizeof path - 1);
    if (size < 0)
        return 0;
    path[size] = 0;
    if (strncmp(path, root, strlen(root)) != 0)
        return 0;
    return atomic_fetch_add(&calls, 1) + 1 == fatal;
}

static void end(void)
{
    kill(getpid(), SIGKILL);
    for (;;)
        pause();
}

/* Half of what a copy would take of a file: what is asked for is often more than there is. */
static size_t half_of(int file, size_t size)
{
    struct stat found;
    if (fstat(file, &found) == 0 && (size_t)found.st_size < size)
        size = (size_t)found.st_size;
    return size / 2;
}

#define REAL(name) static __typeof__(name) *real; if (!real) real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

ssize_t write(int file, const void *data, size_t size)
{
    REAL(write);
    if (is_last(file)) { real(file, data, size / 2); end(); }
    return real(file, data, size);
}

ssize_t pwrite(int file, const void *data, size_t size, off_t at)
{
    REAL(pwrite);
    if (is_last(file)) { real(file, data, size / 2, at); end(); }
    return real(file, data, size, at);
}

ssize_t pwrite64(int file, const void *data, size_t size, off64_t at)
{
    REAL(pwrite64);
    if (is_last(file)) { real(file, data, size / 2, at); end(); }
    return real(file, data, size, at);
}

ssize_t writev(int file, const struct iovec *parts, int count)
{
    REAL(writev);
    if (is_last(file)) { real(file, parts, count / 2); end(); }
    return real(file, parts, count);
}

ssize_t sendfile(int out, int in, off_t *at, size_t size)
{
    REAL(sendfile);
    if (is_last(out)) { real(out, in, at, half_of(in, size)); end(); }
    return real(out, in, at, size);
}

ssize_t sendfile64(int out, int in, off64_t *at, size_t size)
{
    REAL(sendfile64);
    if (is_last(out)) { real(out, in, at, half_of(in, size)); end(); }
    return real(out, in, at, size);
}

ssize_t copy_file_range(int in, off64_t *from, int out, off64_t *to, size_t size, unsigned int flags)
{
    REAL(copy_file_range);
    if (is_last(out)) { real(in, from, out, to, half_of(in, size), flags); end(); }
    return real(in, from, out, to, size, flags);
}

size_t fwrite(const void *data, size_t size, size_t count, FILE *file)
{
    REAL(fwrite);
    if (is_last(fileno(file))) { real(data, 1, size * count / 2, file); fflush(file); end(); }
    return real(data, size, count, file);
}
