/* A library for LD_PRELOAD that disturbs processes competing for locks. POLYDEM_HOSTILE selects its behaviour:
 *
 *   locks   no file can be locked, as on some network file systems
 *   slow    each call to a file first waits a short time, sometimes 30 ms, so that processes interleave
 */
#include "system_calls.h"

/* Before a call to a file: wait, if that is selected. */
static void ask(void)
{
   struct timespec now;

   if (!does("slow")) return;
   clock_gettime(CLOCK_MONOTONIC, &now);
   usleep(now.tv_nsec / 64 % 10 == 0 ? 30000 : now.tv_nsec / 64 % 500);
}

int flock(int file, int operation)
{
   ask();
   if (!does("locks")) return REAL(int, "flock", int, int)(file, operation);
   errno = ENOLCK;
   return -1;
}

#define OPEN(name)                                             \
   int name(const char *path, int flags, ...)                  \
   {                                                           \
      SYSTEM(int, real, const char *, int, ...);               \
      mode_t mode;                                             \
                                                               \
      TAKE_MODE(mode, flags);                                  \
      ask();                                                   \
      return real(path, flags, mode);                          \
   }
OPEN(open)
OPEN(open64)

int creat(const char *path, mode_t mode)
{
   ask();
   return REAL(int, "creat", const char *, mode_t)(path, mode);
}

int mkdir(const char *path, mode_t mode)
{
   ask();
   return REAL(int, "mkdir", const char *, mode_t)(path, mode);
}

int unlink(const char *path)
{
   ask();
   return REAL(int, "unlink", const char *)(path);
}

int rename(const char *from, const char *to)
{
   ask();
   return REAL(int, "rename", const char *, const char *)(from, to);
}

int close(int file)
{
   ask();
   return REAL(int, "close", int)(file);
}

int fsync(int file)
{
   ask();
   return REAL(int, "fsync", int)(file);
}

int ftruncate64(int file, off64_t length)
{
   ask();
   return REAL(int, "ftruncate64", int, off64_t)(file, length);
}

int ftruncate(int file, off_t length)
{
   ask();
   return REAL(int, "ftruncate", int, off_t)(file, length);
}

int fallocate64(int file, int mode, off64_t from, off64_t length)
{
   ask();
   return REAL(int, "fallocate64", int, int, off64_t, off64_t)(file, mode, from, length);
}

ssize_t write(int file, const void *bytes, size_t length)
{
   ask();
   return REAL(ssize_t, "write", int, const void *, size_t)(file, bytes, length);
}

ssize_t pwrite64(int file, const void *bytes, size_t length, off64_t from)
{
   ask();
   return REAL(ssize_t, "pwrite64", int, const void *, size_t, off64_t)(file, bytes, length, from);
}

ssize_t pwrite(int file, const void *bytes, size_t length, off_t from)
{
   ask();
   return REAL(ssize_t, "pwrite", int, const void *, size_t, off_t)(file, bytes, length, from);
}
