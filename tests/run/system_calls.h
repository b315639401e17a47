/* What the libraries for LD_PRELOAD of this folder share: the hidden system functions, and paths of descriptors. */
#ifndef SYSTEM_CALLS_H
#define SYSTEM_CALLS_H
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <limits.h>
#include <signal.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/time.h>
#include <sys/types.h>
#include <sys/uio.h>
#include <time.h>
#include <unistd.h>

/* The system function of this name, which a function of the library hides */
#define REAL(type, name, ...) ((type (*)(__VA_ARGS__))dlsym(RTLD_NEXT, name))

/* The system function that the present function hides, as a variable */
#define SYSTEM(type, name, ...) type (*name)(__VA_ARGS__) = REAL(type, __func__, __VA_ARGS__)

/* Permissions in the arguments of open(2) after `flags` */
#define TAKE_MODE(mode, flags)                                                                \
   do {                                                                                       \
      va_list rest;                                                                           \
      va_start(rest, flags);                                                                  \
      mode = ((flags) & O_CREAT) || ((flags) & O_TMPFILE) == O_TMPFILE ? va_arg(rest, mode_t) : 0; \
      va_end(rest);                                                                           \
   } while (0)

/* Whether POLYDEM_HOSTILE selects a fault */
__attribute__((unused)) static int does(const char *what)
{
   const char *all = getenv("POLYDEM_HOSTILE");

   return all != NULL && strstr(all, what) != NULL;
}

/* Path of a descriptor in a buffer of PATH_MAX bytes; empty if it has none. errno is kept. */
__attribute__((unused)) static void path_of(int file, char *path)
{
   char link[64];
   int before = errno;
   ssize_t length;

   snprintf(link, sizeof link, "/proc/self/fd/%d", file);
   length = readlink(link, path, PATH_MAX - 1);
   path[length < 0 ? 0 : length] = '\0';
   errno = before;
}

#endif
