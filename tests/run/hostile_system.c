/* A library for LD_PRELOAD that simulates faults of the system. POLYDEM_HOSTILE selects the fault:
 *
 *   date    the date starts a day ago and goes back by a second at every call; the monotonic clock is unchanged
 *   locks   no file can be locked, as on some network file systems
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
