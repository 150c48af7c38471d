/* Lets this process and those that it starts write so many bytes, and make so many names, below a folder.

   Loaded before the C library (LD_PRELOAD); the limits are in a file that they share, whose name is in the
   environment: see write_limits.py. Nothing is refused in other folders, nor where programs have a C library
   of their own. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <stdarg.h>
#include <stdatomic.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/uio.h>
#include <unistd.h>

struct limits {
    atomic_long bytes;   /* that may still be written */
    atomic_long names;   /* that may still be made */
    atomic_long refused; /* calls */
    long error;          /* what is said then */
    long late;           /* 1: bytes are missed when a file is closed, whose second half is gone then */
    char root[PATH_MAX];
};

static struct limits *limits;

#define REAL(name) static __typeof__(name) *real; if (!real) real = (__typeof__(name) *)dlsym(RTLD_NEXT, #name)

__attribute__((constructor)) static void begin(void)
{
    const char *name = getenv("CAGEFIELD_WRITE_LIMITS");
    int file = name ? open(name, O_RDWR | O_CLOEXEC) : -1;
    void *found;
    if (file < 0)
        return;
    found = mmap(NULL, sizeof *limits, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (found != MAP_FAILED)
        limits = found;
}

static int is_below(const char *path)
{
    size_t size = strlen(limits->root);
    return size > 0 && strncmp(path, limits->root, size) == 0;
}

static int path_of(int file, char *path)
{
    char name[64];
    ssize_t size;
    snprintf(name, sizeof name, "/proc/self/fd/%d", file);
    size = readlink(name, path, PATH_MAX - 1);
    if (size < 0)
        return 0;
    path[size] = 0;
    return 1;
}

static int refuse(void)
{
    atomic_fetch_add(&limits->refused, 1);
    errno = (int)limits->error;
    return -1;
}

/* How many of so many bytes may be written to a file. */
static size_t granted(int file, size_t size)
{
    char path[PATH_MAX];
    long before, taken;
    int saved = errno;
    if (!limits || !path_of(file, path) || !is_below(path)) {
        errno = saved;
        return size;
    }
    errno = saved;
    if (limits->late) {
        atomic_fetch_sub(&limits->bytes, (long)size);
        return size;
    }
    before = atomic_load(&limits->bytes);
    do
        taken = before < (long)size ? before : (long)size;
    while (!atomic_compare_exchange_weak(&limits->bytes, &before, before - taken));
    return (size_t)taken;
}

/* Whether a file, about to be closed, is told only now that it has no room; its second half goes. */
static int is_missed(int file)
{
    char path[PATH_MAX];
    struct stat found;
    int flags, saved = errno, missed = 0;
    if (limits && limits->late && atomic_load(&limits->bytes) < 0) {
        flags = fcntl(file, F_GETFL);
        missed = flags >= 0 && (flags & O_ACCMODE) != O_RDONLY && path_of(file, path) && is_below(path);
    }
    if (missed && fstat(file, &found) == 0 && S_ISREG(found.st_mode))
        (void)!ftruncate(file, found.st_size / 2);
    errno = saved;
    return missed;
}

/* Whether a name may be made, if that is what a call does. */
static int may_make(int folder, const char *name)
{
    char path[2 * PATH_MAX], place[PATH_MAX];
    struct stat found;
    int saved = errno, there;
    if (!limits || !name)
        return 1;
    there = fstatat(folder, name, &found, AT_SYMLINK_NOFOLLOW) == 0;
    errno = saved;
    if (there)
        return 1;
    if (name[0] == '/')
        snprintf(path, sizeof path, "%s", name);
    else {
        if (folder == AT_FDCWD ? !getcwd(place, sizeof place) : !path_of(folder, place))
            return 1;
        snprintf(path, sizeof path, "%s/%s", place, name);
    }
    errno = saved;
    if (!is_below(path))
        return 1;
    return atomic_fetch_sub(&limits->names, 1) > 0;
}

/* ---- bytes ---- */

ssize_t write(int file, const void *data, size_t size)
{
    REAL(write);
    size_t may = granted(file, size);
    return may == 0 && size > 0 ? refuse() : real(file, data, may);
}

ssize_t pwrite(int file, const void *data, size_t size, off_t at)
{
    REAL(pwrite);
    size_t may = granted(file, size);
    return may == 0 && size > 0 ? refuse() : real(file, data, may, at);
}

ssize_t pwrite64(int file, const void *data, size_t size, off64_t at)
{
    REAL(pwrite64);
    size_t may = granted(file, size);
    return may == 0 && size > 0 ? refuse() : real(file, data, may, at);
}

ssize_t writev(int file, const struct iovec *parts, int count)
{
    REAL(writev);
    size_t size = 0, may;
    int i;
    for (i = 0; i < count; i++)
        size += parts[i].iov_len;
    may = granted(file, size);
    if (may == size)
        return real(file, parts, count);
    for (i = 0; i < count && may > 0; i++)
        if (parts[i].iov_len > 0) {
            struct iovec part = {parts[i].iov_base, parts[i].iov_len < may ? parts[i].iov_len : may};
            return real(file, &part, 1);
        }
    return refuse();
}

/* What a copy would take of a file: what is asked for is often more than there is. */
static size_t left_of(int file, size_t size)
{
    struct stat found;
    off_t at = lseek(file, 0, SEEK_CUR);
    if (at >= 0 && fstat(file, &found) == 0 && found.st_size - at < (off_t)size)
        size = found.st_size > at ? (size_t)(found.st_size - at) : 0;
    return size;
}

ssize_t sendfile(int out, int in, off_t *at, size_t size)
{
    REAL(sendfile);
    size_t asked = at ? size : left_of(in, size), may = granted(out, asked);
    return may == 0 && asked > 0 ? refuse() : real(out, in, at, may);
}

ssize_t sendfile64(int out, int in, off64_t *at, size_t size)
{
    REAL(sendfile64);
    size_t asked = at ? size : left_of(in, size), may = granted(out, asked);
    return may == 0 && asked > 0 ? refuse() : real(out, in, at, may);
}

ssize_t copy_file_range(int in, off64_t *from, int out, off64_t *to, size_t size, unsigned int flags)
{
    REAL(copy_file_range);
    size_t asked = from ? size : left_of(in, size), may = granted(out, asked);
    return may == 0 && asked > 0 ? refuse() : real(in, from, out, to, may, flags);
}

size_t fwrite(const void *data, size_t size, size_t count, FILE *file)
{
    REAL(fwrite);
    size_t may = granted(fileno(file), size * count);
    if (may == size * count || size == 0)
        return real(data, size, count, file);
    count = real(data, size, may / size, file);
    refuse();
    return count;
}

int fallocate(int file, int mode, off_t at, off_t size)
{
    REAL(fallocate);
    return granted(file, (size_t)size) < (size_t)size ? refuse() : real(file, mode, at, size);
}

int posix_fallocate(int file, off_t at, off_t size)
{
    REAL(posix_fallocate);
    if (granted(file, (size_t)size) < (size_t)size) { refuse(); return (int)limits->error; }
    return real(file, at, size);
}

/* ---- what is missed late ---- */

int close(int file)
{
    REAL(close);
    int missed = is_missed(file), result = real(file);
    return missed ? refuse() : result;
}

int fclose(FILE *file)
{
    REAL(fclose);
    int missed = fflush(file) == 0 && is_missed(fileno(file)), result = real(file);
    return missed ? refuse() : result;
}

int fsync(int file)
{
    REAL(fsync);
    return is_missed(file) ? refuse() : real(file);
}

int fdatasync(int file)
{
    REAL(fdatasync);
    return is_missed(file) ? refuse() : real(file);
}

/* ---- names ---- */

#define MODE_OF(flags) \
    mode_t mode = 0; \
    if ((flags) & (O_CREAT | O_TMPFILE)) { va_list more; va_start(more, flags); mode = va_arg(more, mode_t); va_end(more); }

int open(const char *name, int flags, ...)
{
    REAL(open);
    MODE_OF(flags)
    return (flags & O_CREAT) && !may_make(AT_FDCWD, name) ? refuse() : real(name, flags, mode);
}

int open64(const char *name, int flags, ...)
{
    REAL(open64);
    MODE_OF(flags)
    return (flags & O_CREAT) && !may_make(AT_FDCWD, name) ? refuse() : real(name, flags, mode);
}

int openat(int folder, const char *name, int flags, ...)
{
    REAL(openat);
    MODE_OF(flags)
    return (flags & O_CREAT) && !may_make(folder, name) ? refuse() : real(folder, name, flags, mode);
}

int openat64(int folder, const char *name, int flags, ...)
{
    REAL(openat64);
    MODE_OF(flags)
    return (flags & O_CREAT) && !may_make(folder, name) ? refuse() : real(folder, name, flags, mode);
}

FILE *fopen(const char *name, const char *how)
{
    REAL(fopen);
    if (how[0] != 'r' && !may_make(AT_FDCWD, name)) { refuse(); return NULL; }
    return real(name, how);
}

FILE *fopen64(const char *name, const char *how)
{
    REAL(fopen64);
    if (how[0] != 'r' && !may_make(AT_FDCWD, name)) { refuse(); return NULL; }
    return real(name, how);
}

int mkdir(const char *name, mode_t mode)
{
    REAL(mkdir);
    return may_make(AT_FDCWD, name) ? real(name, mode) : refuse();
}

int mkdirat(int folder, const char *name, mode_t mode)
{
    REAL(mkdirat);
    return may_make(folder, name) ? real(folder, name, mode) : refuse();
}

int link(const char *from, const char *to)
{
    REAL(link);
    return may_make(AT_FDCWD, to) ? real(from, to) : refuse();
}

int linkat(int from_folder, const char *from, int to_folder, const char *to, int flags)
{
    REAL(linkat);
    return may_make(to_folder, to) ? real(from_folder, from, to_folder, to, flags) : refuse();
}

int symlink(const char *target, const char *name)
{
    REAL(symlink);
    return may_make(AT_FDCWD, name) ? real(target, name) : refuse();
}
