/* Advance a simulation from C, and print what a program may want of it: example FILE.nml STEPS */
#include <inttypes.h>
#include <polydem.h>
#include <stdio.h>
#include <stdlib.h>

/* End with the message of an error, if there is one. */
static void check(polydem_error error)
{
    if (polydem_error_code(error) == POLYDEM_OK) return;
    char message[2000];
    polydem_error_message(error, message, sizeof message);
    fprintf(stderr, "%s\n", message);
    exit(polydem_error_code(error));
}

int main(int argc, char **argv)
{
    if (argc != 3) return 2;
    polydem_error error = polydem_new_error();
    const char *overrides[] = {"output.energy_balance=.true."};
    polydem_simulation simulation = polydem_new_simulation(error, argv[1], NULL, 1, overrides, NULL, POLYDEM_NEW, 1);
    check(error);

    long left = atol(argv[2]);
    while (left > 0 && polydem_integer(error, simulation, "is_over") == 0) {
        left -= polydem_advance(error, simulation, left < 100 ? left : 100, 0.0);
        check(error);
    }

    long shape[2];
    polydem_find_array(error, simulation, "bodies/position", shape);
    double *position = malloc((size_t)(shape[0] * shape[1]) * sizeof *position);
    polydem_copy_reals(error, simulation, position, shape[0] * shape[1]);
    check(error);
    double highest = position[1];
    for (long k = 1; k < shape[0]; k++)
        if (position[2 * k + 1] > highest) highest = position[2 * k + 1];
    free(position);

    char hash[17], version[20];
    polydem_version(version, sizeof version);
    polydem_text(error, simulation, "state_hash", hash, sizeof hash);
    check(error);
    printf("%s %ld %.17g %s\n", version, polydem_integer(error, simulation, "step"), highest, hash);

    polydem_delete_simulation(error, &simulation);
    check(error);
    polydem_delete_error(&error);
    return 0;
}
