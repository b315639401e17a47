/* A library for LD_PRELOAD that simulates faults of the system. POLYDEM_HOSTILE selects the fault:
 *
 *   date    the date starts a day ago and goes back by a second at every call; the monotonic clock is unchanged
 *   locks   no file can be locked, as on some network file systems
 *   kill    the process is killed at call number POLYDEM_HOSTILE_AT. Calls that count create, open, rename, remove or
 *           sync a path that contains POLYDEM_HOSTILE_PLACE, or write to manifest.txt there; such a write first writes
 *           half of its data. The library creates the file POLYDEM_HOSTILE_MARK to show that this call occurred.
 *   fail    that call fails instead
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

static int does(const char *what)
{
   const char *all = getenv("POLYDEM_HOSTILE");

   return all != NULL && strstr(all, what) != NULL;
}

/* Error of the date [s], which grows with every call */
static long lag(void)
{
   static long seconds = 86400;

   return __atomic_add_fetch(&seconds, 1, __ATOMIC_RELAXED);
}

int clock_gettime(clockid_t clock, struct timespec *now)
{
   int (*real)(clockid_t, struct timespec *) = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
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
   int (*real)(int, int) = (int (*)(int, int))dlsym(RTLD_NEXT, "flock");

   if (!does("locks")) return real(file, operation);
   errno = ENOLCK;
   return -1;
}

static void *next(const char *name)
{
   return dlsym(RTLD_NEXT, name);
}

/* Whether this is the call to disturb */
static int strikes(const char *path)
{
   static long count = 0;
   const char *place = getenv("POLYDEM_HOSTILE_PLACE"), *at = getenv("POLYDEM_HOSTILE_AT");
   const char *mark = getenv("POLYDEM_HOSTILE_MARK");
   int (*real)(const char *, mode_t) = (int (*)(const char *, mode_t))next("creat");

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

static void path_of(int file, char *path, size_t size)
{
   char link[64];
   ssize_t length;

   snprintf(link, sizeof link, "/proc/self/fd/%d", file);
   length = readlink(link, path, size - 1);
   path[length < 0 ? 0 : length] = '\0';
}

#define OPEN(name)                                                                                                     \
   int name(const char *path, int flags, ...)                                                                          \
   {                                                                                                                   \
      int (*real)(const char *, int, mode_t) = (int (*)(const char *, int, mode_t))next(#name);                        \
      mode_t mode = 0;                                                                                                 \
      va_list rest;                                                                                                    \
                                                                                                                       \
      va_start(rest, flags);                                                                                           \
      if (flags & O_CREAT) mode = va_arg(rest, mode_t);                                                                \
      va_end(rest);                                                                                                    \
      return strikes(path) ? fail() : real(path, flags, mode);                                                         \
   }
OPEN(open)
OPEN(open64)

int creat(const char *path, mode_t mode)
{
   int (*real)(const char *, mode_t) = (int (*)(const char *, mode_t))next("creat");

   return strikes(path) ? fail() : real(path, mode);
}

int rename(const char *from, const char *to)
{
   int (*real)(const char *, const char *) = (int (*)(const char *, const char *))next("rename");

   return strikes(from) ? fail() : real(from, to);
}

int unlink(const char *path)
{
   int (*real)(const char *) = (int (*)(const char *))next("unlink");

   return strikes(path) ? fail() : real(path);
}

int rmdir(const char *path)
{
   int (*real)(const char *) = (int (*)(const char *))next("rmdir");

   return strikes(path) ? fail() : real(path);
}

int mkdir(const char *path, mode_t mode)
{
   int (*real)(const char *, mode_t) = (int (*)(const char *, mode_t))next("mkdir");

   return strikes(path) ? fail() : real(path, mode);
}

int fsync(int file)
{
   int (*real)(int) = (int (*)(int))next("fsync");
   char path[4096];

   path_of(file, path, sizeof path);
   return strikes(path) ? fail() : real(file);
}

ssize_t write(int file, const void *bytes, size_t length)
{
   ssize_t (*real)(int, const void *, size_t) = (ssize_t (*)(int, const void *, size_t))next("write");
   char path[4096];

   if (getenv("POLYDEM_HOSTILE_PLACE") == NULL) return real(file, bytes, length);
   path_of(file, path, sizeof path);
   if (strstr(path, "manifest.txt") == NULL || !strikes(path)) return real(file, bytes, length);
   if (real(file, bytes, length / 2) < 0) return -1;
   return fail();
}
