/* Removes the variables GFORTRAN_* from the environment of this process.
 *
 * They change how the runtime library of gfortran reads and writes numbers: the byte order in files, the sign of
 * positive numbers, the numbers of units. The library reads them before the main program starts, and with two equal
 * units it ends the process. Functions in .preinit_array run before those of any library, so this one is in C, and it
 * calls nothing.
 */
static int has_prefix(const char *text, const char *prefix)
{
   while (*prefix != '\0' && *text == *prefix) ++text, ++prefix;
   return *prefix == '\0';
}

static void remove_variables(int count, char **arguments, char **environment)
{
   char **kept = environment;

   (void)count;
   (void)arguments;
   for (; *environment != 0; ++environment) {
      if (!has_prefix(*environment, "GFORTRAN_")) *kept++ = *environment;
   }
   *kept = 0;
}

__attribute__((section(".preinit_array"), used)) static void (*const first)(int, char **, char **) = remove_variables;
