/* A library for LD_PRELOAD that lets ranks sleep while they wait for each other.
 *
 * Open MPI asks again and again whether a message has come, and gives the processor away in between (sched_yield, with
 * mpi_yield_when_idle). Where there are more ranks than processors, or other work, each turn of the waiting ones then costs
 * as much as one of the rank for which they wait. Here they sleep for a moment instead: as long as a timer needs, some 60 us.
 */
#include <time.h>

int sched_yield(void)
{
   const struct timespec moment = {0, 1};

   nanosleep(&moment, 0);
   return 0;
}
