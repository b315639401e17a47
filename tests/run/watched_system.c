/* A library for LD_PRELOAD that logs calls of mkdir and fsync to the file POLYDEM_WATCHED, one line each:
 *
 *   mkdir PATH      the path that the program passes
 *   fsync PATH      the path of the descriptor
 */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <limits.h>
#include <stdio.h>
#include <stdlib.h>
#include <sys/stat.h>
#include <unistd.h>

static void note(const char *what, const char *path)
{
   const char *name = getenv("POLYDEM_WATCHED");
   FILE *file = name == NULL ? NULL : fopen(name, "a");

   if (file == NULL) return;
   fprintf(file, "%s %s\n", what, path);
   fclose(file);
}

int mkdir(const char *path, mode_t mode)
{
   int (*real)(const char *, mode_t) = (int (*)(const char *, mode_t))dlsym(RTLD_NEXT, "mkdir");

   note("mkdir", path);
   return real(path, mode);
}

int fsync(int file)
{
   int (*real)(int) = (int (*)(int))dlsym(RTLD_NEXT, "fsync");
   char link[64], path[PATH_MAX];
   ssize_t length;

   snprintf(link, sizeof link, "/proc/self/fd/%d", file);
   length = readlink(link, path, sizeof path - 1);
   if (length > 0) {
      path[length] = '\0';
      note("fsync", path);
   }
   return real(file);
}
