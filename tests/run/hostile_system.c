/* A library for LD_PRELOAD that simulates faults of the system. POLYDEM_HOSTILE selects the fault:
 *
 *   date    the date starts a day ago and goes back by a second at every call; the monotonic clock is unchanged
 *   locks   no file can be locked, as on some network file systems
 *   kill    the process is killed at call number POLYDEM_HOSTILE_AT. Calls that count create, open, rename, remove or
 *           sync a path that contains POLYDEM_HOSTILE_PLACE, or write to manifest.txt there; such a write first writes
 *           half of its data. The library creates the file POLYDEM_HOSTILE_MARK to show that this call occurred.
 *   fail    that call fails instead
 */
#include "system_calls.h"

/* Error of the date [s], which grows with every call */
static long lag(void)
{
   static long seconds = 86400;

   return __atomic_add_fetch(&seconds, 1, __ATOMIC_RELAXED);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
   SYSTEM(int, real, clockid_t, struct timespec *);
   int status = real(clock, now);

   if (status == 0 && clock == CLOCK_REALTIME && does("date")) now->tv_sec -= lag();
   return status;
}

int gettimeofday(struct timeval *restrict now, void *restrict zone)
{
   struct timespec precise;
   int status = clock_gettime(CLOCK_REALTIME, &precise);

   (void)zone;
   now->tv_sec = precise.tv_sec;
   now->tv_usec = precise.tv_nsec / 1000;
   return status;
}

time_t time(time_t *copy)
{
   struct timespec now;

   clock_gettime(CLOCK_REALTIME, &now);
   if (copy != NULL) *copy = now.tv_sec;
   return now.tv_sec;
}

int flock(int file, int operation)
{
   SYSTEM(int, real, int, int);

   if (!does("locks")) return real(file, operation);
   errno = ENOLCK;
   return -1;
}

/* Whether this is the call to disturb */
static int strikes(const char *path)
{
   static long count = 0;
   const char *place = getenv("POLYDEM_HOSTILE_PLACE"), *at = getenv("POLYDEM_HOSTILE_AT");
   const char *mark = getenv("POLYDEM_HOSTILE_MARK");
   int (*real)(const char *, mode_t) = REAL(int, "creat", const char *, mode_t);

   if (place == NULL || at == NULL || mark == NULL || path == NULL || strstr(path, place) == NULL) return 0;
   if (!does("kill") && !does("fail")) return 0;
   if (__atomic_add_fetch(&count, 1, __ATOMIC_RELAXED) != atol(at)) return 0;
   close(real(mark, 0666));
   return 1;
}

static int fail(void)
{
   if (does("kill")) kill(getpid(), SIGKILL);
   errno = EIO;
   return -1;
}

#define OPEN(name)                                             \
   int name(const char *path, int flags, ...)                  \
   {                                                           \
      SYSTEM(int, real, const char *, int, ...);               \
      mode_t mode;                                             \
                                                               \
      TAKE_MODE(mode, flags);                                  \
      return strikes(path) ? fail() : real(path, flags, mode); \
   }
OPEN(open)
OPEN(open64)

int creat(const char *path, mode_t mode)
{
   SYSTEM(int, real, const char *, mode_t);

   return strikes(path) ? fail() : real(path, mode);
}

int rename(const char *from, const char *to)
{
   SYSTEM(int, real, const char *, const char *);

   return strikes(from) ? fail() : real(from, to);
}

int unlink(const char *path)
{
   SYSTEM(int, real, const char *);

   return strikes(path) ? fail() : real(path);
}

int rmdir(const char *path)
{
   SYSTEM(int, real, const char *);

   return strikes(path) ? fail() : real(path);
}

int mkdir(const char *path, mode_t mode)
{
   SYSTEM(int, real, const char *, mode_t);

   return strikes(path) ? fail() : real(path, mode);
}

int fsync(int file)
{
   SYSTEM(int, real, int);
   char path[PATH_MAX];

   path_of(file, path);
   return strikes(path) ? fail() : real(file);
}

ssize_t write(int file, const void *bytes, size_t length)
{
   SYSTEM(ssize_t, real, int, const void *, size_t);
   char path[PATH_MAX];

   if (getenv("POLYDEM_HOSTILE_PLACE") == NULL) return real(file, bytes, length);
   path_of(file, path);
   if (strstr(path, "manifest.txt") == NULL || !strikes(path)) return real(file, bytes, length);
   if (real(file, bytes, length / 2) < 0) return -1;
   return fail();
}
