/* A hostile system, for LD_PRELOAD in front of the program: what it does, POLYDEM_HOSTILE says.
 *
 *   date    the date began a day ago and goes back by a second whenever anybody asks; the monotonic clock is left alone
 *   locks   no file can be locked, as on some network file systems
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <errno.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/time.h>
#include <time.h>

static int does(const char *what)
{
   const char *all = getenv("POLYDEM_HOSTILE");

   return all != NULL && strstr(all, what) != NULL;
}

/* By how much the date is wrong [s], more with every call */
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
