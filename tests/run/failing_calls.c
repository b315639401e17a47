/* A library for LD_PRELOAD that simulates a failing file system: the n-th call that writes to files of a folder fails, or
 * the n-th that reads. Each process counts the calls of all its threads, from 1.
 *
 *   POLYDEM_FAIL_FOLDER   the folder, as an absolute path without links
 *   POLYDEM_FAIL_KIND     reads: calls that read, list or look for something; otherwise calls that write
 *   POLYDEM_FAIL_RANK     the rank of Open MPI that fails; all processes if it is not set
 *   POLYDEM_FAIL_CALL     number of the call that fails; none if it is not set
 *   POLYDEM_FAIL_HOW      once; on: all later calls fail, too; short: half of the data are written or read, which succeeds;
 *                         cut: likewise, and the next call fails;
 *                         kill: the process is killed before the call, or after it wrote half of the data
 *   POLYDEM_FAIL_ERROR    number of the error; EIO if it is not set
 *   POLYDEM_FAIL_LOG      a file to which each call adds a line: number, name, path
 *
 * A failing call does nothing, except close, which still closes the file.
 */
#include "system_calls.h"
#include <dirent.h>

static const char *setting(const char *name, const char *otherwise)
{
   const char *text = getenv(name);

   return text != NULL ? text : otherwise;
}

static int is_inside(const char *path)
{
   const char *folder = setting("POLYDEM_FAIL_FOLDER", "");
   size_t n = strlen(folder);

   return n > 0 && strncmp(path, folder, n) == 0 && (path[n] == '/' || path[n] == '\0');
}

static int kills(void)
{
   return strcmp(setting("POLYDEM_FAIL_HOW", "once"), "kill") == 0;
}

/* What a call that wrote half of its data returns */
static ssize_t after_half(ssize_t written)
{
   if (kills()) kill(getpid(), SIGKILL);
   return written;
}

/* Count a call to the folder: 0 to pass it on, 1 to fail, -1 for half of the data */
static int count(const char *call, const char *path)
{
   static int calls = 0;
   const char *own = setting("OMPI_COMM_WORLD_RANK", "0");
   const char *rank = setting("POLYDEM_FAIL_RANK", own), *how = setting("POLYDEM_FAIL_HOW", "once");
   const char *log = setting("POLYDEM_FAIL_LOG", "");
   int number, chosen = atoi(setting("POLYDEM_FAIL_CALL", "0")), before = errno;
   int halves = strcmp(how, "short") == 0 || strcmp(how, "cut") == 0 || (kills() && strstr(call, "write") != NULL);

   if (!is_inside(path) || strcmp(rank, own) != 0) return 0;
   number = __atomic_add_fetch(&calls, 1, __ATOMIC_RELAXED);
   if (*log != '\0') {
      char line[PATH_MAX + 64];
      int length = snprintf(line, sizeof line, "%d %s %s\n", number, call, path);
      int (*open_log)(const char *, int, ...) = REAL(int, "open", const char *, int, ...);
      ssize_t (*put)(int, const void *, size_t) = REAL(ssize_t, "write", int, const void *, size_t);
      int (*close_log)(int) = REAL(int, "close", int);
      int file = open_log(log, O_WRONLY | O_CREAT | O_APPEND, 0666);

      if (file < 0 || put(file, line, (size_t)length) != length || close_log(file) != 0) abort();
   }
   errno = before;
   if (chosen == 0 || number < chosen) return 0;
   if (halves && number == chosen) return strstr(call, "write") != NULL || strstr(call, "read") != NULL ? -1 : 0;
   if (number == chosen && kills()) kill(getpid(), SIGKILL);
   if (number > chosen && strcmp(how, "on") != 0 && !(strcmp(how, "cut") == 0 && number == chosen + 1)) return 0;
   errno = atoi(setting("POLYDEM_FAIL_ERROR", "5"));
   return 1;
}

static int reads_fail(void)
{
   return strcmp(setting("POLYDEM_FAIL_KIND", "writes"), "reads") == 0;
}

/* Count a call that writes */
static int judge(const char *call, const char *path)
{
   return reads_fail() ? 0 : count(call, path);
}

static int judge_file(const char *call, int file)
{
   char path[PATH_MAX];

   path_of(file, path);
   return *path == '\0' ? 0 : judge(call, path);
}

static const char *absolute(const char *path, char *place)
{
   if (path[0] == '/' || getcwd(place, PATH_MAX) == NULL) return path;
   strcat(place, "/");
   return strncat(place, path, PATH_MAX - 1);
}

static int judge_path(const char *call, const char *path)
{
   char place[2 * PATH_MAX];

   return judge(call, absolute(path, place));
}

/* Count a call that reads, lists or looks for something */
static int judge_reading(const char *call, const char *path)
{
   char place[2 * PATH_MAX];

   return path != NULL && reads_fail() ? count(call, absolute(path, place)) : 0;
}

static int judge_reading_file(const char *call, int file)
{
   char path[PATH_MAX];

   if (!reads_fail()) return 0;
   path_of(file, path);
   return *path == '\0' ? 0 : judge_reading(call, path);
}

static int may_write(int flags)
{
   return (flags & O_ACCMODE) != O_RDONLY || (flags & (O_CREAT | O_TRUNC)) != 0;
}

#define OPEN(name)                                                            \
   int name(const char *path, int flags, ...)                                 \
   {                                                                          \
      SYSTEM(int, real, const char *, int, ...);                              \
      mode_t mode;                                                            \
      TAKE_MODE(mode, flags);                                                 \
      if (may_write(flags) && judge_path("open", path) > 0) return -1;        \
      if (!may_write(flags) && judge_reading("open", path) > 0) return -1;    \
      return real(path, flags, mode);                                         \
   }
OPEN(open)
OPEN(open64)

#define OPENAT(name)                                                          \
   int name(int folder, const char *path, int flags, ...)                     \
   {                                                                          \
      SYSTEM(int, real, int, const char *, int, ...);                         \
      mode_t mode;                                                            \
      TAKE_MODE(mode, flags);                                                 \
      if (may_write(flags) && judge_path("open", path) > 0) return -1;        \
      if (!may_write(flags) && judge_reading("open", path) > 0) return -1;    \
      return real(folder, path, flags, mode);                                 \
   }
OPENAT(openat)
OPENAT(openat64)

#define CREAT(name)                                                           \
   int name(const char *path, mode_t mode)                                    \
   {                                                                          \
      SYSTEM(int, real, const char *, mode_t);                                \
      return judge_path("creat", path) > 0 ? -1 : real(path, mode);           \
   }
CREAT(creat)
CREAT(creat64)

ssize_t write(int file, const void *bytes, size_t length)
{
   SYSTEM(ssize_t, real, int, const void *, size_t);
   int verdict = judge_file("write", file);

   if (verdict < 0) return after_half(real(file, bytes, length > 1 ? length / 2 : length));
   return verdict > 0 ? -1 : real(file, bytes, length);
}

#define PWRITE(name)                                                                                          \
   ssize_t name(int file, const void *bytes, size_t length, off64_t place)                                    \
   {                                                                                                          \
      SYSTEM(ssize_t, real, int, const void *, size_t, off64_t);                                              \
      int verdict = judge_file("pwrite", file);                                                               \
      if (verdict < 0) return after_half(real(file, bytes, length > 1 ? length / 2 : length, place));         \
      return verdict > 0 ? -1 : real(file, bytes, length, place);                                             \
   }
PWRITE(pwrite)
PWRITE(pwrite64)

/* A short write writes only the first of its pieces, or half of a single piece. */
static struct iovec half(const struct iovec *pieces, int n)
{
   struct iovec first = pieces[0];

   if (n == 1 && first.iov_len > 1) first.iov_len /= 2;
   return first;
}

ssize_t writev(int file, const struct iovec *pieces, int n)
{
   SYSTEM(ssize_t, real, int, const struct iovec *, int);
   int verdict = judge_file("writev", file);
   struct iovec first = half(pieces, n);

   if (verdict > 0) return -1;
   return verdict < 0 ? after_half(real(file, &first, 1)) : real(file, pieces, n);
}

#define PWRITEV(name)                                                               \
   ssize_t name(int file, const struct iovec *pieces, int n, off64_t place)         \
   {                                                                                \
      SYSTEM(ssize_t, real, int, const struct iovec *, int, off64_t);               \
      int verdict = judge_file("pwritev", file);                                    \
      struct iovec first = half(pieces, n);                                         \
      if (verdict > 0) return -1;                                                   \
      return verdict < 0 ? after_half(real(file, &first, 1, place)) : real(file, pieces, n, place); \
   }
PWRITEV(pwritev)
PWRITEV(pwritev64)

#define OF_A_FILE(name, label)                                                \
   int name(int file)                                                         \
   {                                                                          \
      SYSTEM(int, real, int);                                                 \
      return judge_file(label, file) > 0 ? -1 : real(file);                   \
   }
OF_A_FILE(fsync, "fsync")
OF_A_FILE(fdatasync, "fdatasync")

int close(int file)
{
   SYSTEM(int, real, int);
   int before = errno, flags = fcntl(file, F_GETFL), verdict, error, status;

   errno = before;
   verdict = flags >= 0 && may_write(flags) ? judge_file("close", file) : 0;
   error = errno;
   status = real(file);
   if (verdict <= 0) return status;
   errno = error;
   return -1;
}

#define FTRUNCATE(name)                                                       \
   int name(int file, off64_t length)                                         \
   {                                                                          \
      SYSTEM(int, real, int, off64_t);                                        \
      return judge_file("ftruncate", file) > 0 ? -1 : real(file, length);     \
   }
FTRUNCATE(ftruncate)
FTRUNCATE(ftruncate64)

#define TRUNCATE(name)                                                        \
   int name(const char *path, off64_t length)                                 \
   {                                                                          \
      SYSTEM(int, real, const char *, off64_t);                               \
      return judge_path("truncate", path) > 0 ? -1 : real(path, length);      \
   }
TRUNCATE(truncate)
TRUNCATE(truncate64)

#define FALLOCATE(name)                                                       \
   int name(int file, int mode, off64_t offset, off64_t length)               \
   {                                                                          \
      SYSTEM(int, real, int, int, off64_t, off64_t);                          \
      return judge_file("fallocate", file) > 0 ? -1 : real(file, mode, offset, length); \
   }
FALLOCATE(fallocate)
FALLOCATE(fallocate64)

#define POSIX_FALLOCATE(name)                                                 \
   int name(int file, off64_t offset, off64_t length)                         \
   {                                                                          \
      SYSTEM(int, real, int, off64_t, off64_t);                               \
      return judge_file("fallocate", file) > 0 ? errno : real(file, offset, length); \
   }
POSIX_FALLOCATE(posix_fallocate)
POSIX_FALLOCATE(posix_fallocate64)

#define OF_TWO_PATHS(name)                                                    \
   int name(const char *from, const char *to)                                 \
   {                                                                          \
      SYSTEM(int, real, const char *, const char *);                          \
      return judge_path(#name, to) > 0 ? -1 : real(from, to);                 \
   }
OF_TWO_PATHS(rename)
OF_TWO_PATHS(link)
OF_TWO_PATHS(symlink)

int unlink(const char *path)
{
   SYSTEM(int, real, const char *);
   return judge_path("unlink", path) > 0 ? -1 : real(path);
}

int mkdir(const char *path, mode_t mode)
{
   SYSTEM(int, real, const char *, mode_t);
   return judge_path("mkdir", path) > 0 ? -1 : real(path, mode);
}

/* --- reading ----------------------------------------------------------------------------------------------------- */

ssize_t read(int file, void *bytes, size_t length)
{
   SYSTEM(ssize_t, real, int, void *, size_t);
   int verdict = judge_reading_file("read", file);

   return verdict > 0 ? -1 : real(file, bytes, verdict < 0 && length > 1 ? length / 2 : length);
}

#define PREAD(name)                                                                                           \
   ssize_t name(int file, void *bytes, size_t length, off64_t place)                                          \
   {                                                                                                          \
      SYSTEM(ssize_t, real, int, void *, size_t, off64_t);                                                    \
      int verdict = judge_reading_file("pread", file);                                                        \
      return verdict > 0 ? -1 : real(file, bytes, verdict < 0 && length > 1 ? length / 2 : length, place);    \
   }
PREAD(pread)
PREAD(pread64)

ssize_t readv(int file, const struct iovec *pieces, int n)
{
   SYSTEM(ssize_t, real, int, const struct iovec *, int);
   int verdict = judge_reading_file("readv", file);
   struct iovec first = half(pieces, n);

   if (verdict > 0) return -1;
   return verdict < 0 ? real(file, &first, 1) : real(file, pieces, n);
}

#define PREADV(name)                                                                \
   ssize_t name(int file, const struct iovec *pieces, int n, off64_t place)         \
   {                                                                                \
      SYSTEM(ssize_t, real, int, const struct iovec *, int, off64_t);               \
      int verdict = judge_reading_file("preadv", file);                             \
      struct iovec first = half(pieces, n);                                         \
      if (verdict > 0) return -1;                                                   \
      return verdict < 0 ? real(file, &first, 1, place) : real(file, pieces, n, place); \
   }
PREADV(preadv)
PREADV(preadv64)

#define FSTAT(name, type)                                                     \
   int name(int file, struct type *state)                                     \
   {                                                                          \
      SYSTEM(int, real, int, struct type *);                                  \
      return judge_reading_file("fstat", file) > 0 ? -1 : real(file, state);  \
   }
FSTAT(fstat, stat)
FSTAT(fstat64, stat64)

#define STAT(name, type)                                                      \
   int name(const char *path, struct type *state)                             \
   {                                                                          \
      SYSTEM(int, real, const char *, struct type *);                         \
      return judge_reading("stat", path) > 0 ? -1 : real(path, state);        \
   }
STAT(stat, stat)
STAT(stat64, stat64)
STAT(lstat, stat)
STAT(lstat64, stat64)

/* Of programs that were made for C libraries before 2.33 */
#define OLD_FSTAT(name, type)                                                 \
   int name(int version, int file, struct type *state)                        \
   {                                                                          \
      SYSTEM(int, real, int, int, struct type *);                             \
      return judge_reading_file("fstat", file) > 0 ? -1 : real(version, file, state);\
   }
OLD_FSTAT(__fxstat, stat)
OLD_FSTAT(__fxstat64, stat64)

#define OLD_STAT(name, type)                                                  \
   int name(int version, const char *path, struct type *state)                \
   {                                                                          \
      SYSTEM(int, real, int, const char *, struct type *);                    \
      return judge_reading("stat", path) > 0 ? -1 : real(version, path, state);\
   }
OLD_STAT(__xstat, stat)
OLD_STAT(__xstat64, stat64)
OLD_STAT(__lxstat, stat)
OLD_STAT(__lxstat64, stat64)

int access(const char *path, int mode)
{
   SYSTEM(int, real, const char *, int);
   return judge_reading("access", path) > 0 ? -1 : real(path, mode);
}

int faccessat(int folder, const char *path, int mode, int flags)
{
   SYSTEM(int, real, int, const char *, int, int);
   return judge_reading("access", path) > 0 ? -1 : real(folder, path, mode, flags);
}

char *realpath(const char *path, char *resolved)
{
   SYSTEM(char *, real, const char *, char *);
   return judge_reading("realpath", path) > 0 ? NULL : real(path, resolved);
}

DIR *opendir(const char *path)
{
   SYSTEM(DIR *, real, const char *);
   return judge_reading("opendir", path) > 0 ? NULL : real(path);
}

#define READDIR(name, type)                                                   \
   struct type *name(DIR *folder)                                             \
   {                                                                          \
      SYSTEM(struct type *, real, DIR *);                                     \
      return judge_reading_file("list", dirfd(folder)) > 0 ? NULL : real(folder); \
   }
READDIR(readdir, dirent)
READDIR(readdir64, dirent64)
