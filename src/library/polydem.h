/* The C interface of polydem: a simulation that is advanced step by step.
 *
 * Each call takes an error handle first. A call that fails leaves a code and a message there, and changes nothing else
 * unless it says so; the next call clears them. No error of polydem ends the program (memory that runs out does). No
 * call writes on the screen, catches signals or changes the number of OpenMP threads of its caller.
 *
 * Several simulations live in one process. Each may be used by one thread at a time.
 */
#ifndef POLYDEM_H
#define POLYDEM_H

#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct polydem_error_s *polydem_error;
typedef struct polydem_simulation_s *polydem_simulation;
typedef struct polydem_snapshot_s *polydem_snapshot;

/* Codes of errors, the exit codes of the program */
enum { POLYDEM_OK = 0, POLYDEM_RUN_ERROR = 1, POLYDEM_INPUT_ERROR = 2, POLYDEM_IO_ERROR = 3 };

/* What becomes of a result that is in the folder already; with POLYDEM_EXCHANGE added, actions may let bodies enter and
 * leave */
enum { POLYDEM_NEW = 0, POLYDEM_FORCE = 1, POLYDEM_CONTINUE = 2, POLYDEM_EXCHANGE = 4 };

/* Kinds of arrays */
enum { POLYDEM_ABSENT = 0, POLYDEM_INTEGERS = 1, POLYDEM_REALS = 2 };

/* A text is copied to a buffer and cut to `size` characters, its end included; its whole length is returned. */

/* Version of polydem, as "0.1.0" */
long polydem_version(char *buffer, long size);

/* Make an error handle, ask for its code, copy its message, delete it. */
polydem_error polydem_new_error(void);
void polydem_delete_error(polydem_error *error);
int polydem_error_code(polydem_error error);
long polydem_error_message(polydem_error error, char *buffer, long size);

/* Make a simulation; null after an error.
 *   file       path of a namelist, or its name in messages if there is a text
 *   text       the namelist; null: it is read from the file
 *   overrides  n_overrides texts "group.key=value" or "group.name.key=value"
 *   folder     folder of the result, which is that of `polydem run`; null: nothing is written
 *   mode       POLYDEM_NEW, POLYDEM_FORCE or POLYDEM_CONTINUE, or one of them + POLYDEM_EXCHANGE; to continue a
 *              finished run is an error, unless it shall be longer
 *   threads    number of OpenMP threads; 0: one */
polydem_simulation polydem_new_simulation(polydem_error error, const char *file, const char *text, long n_overrides,
                                          const char *const *overrides, const char *folder, int mode, int threads);

/* Make a simulation of the processes of a communicator of MPI, with the library libpolydem_mpi. The program starts MPI
 * before, gives the Fortran handle of the communicator (MPI_Comm_c2f), and ends MPI after it has deleted the simulation.
 * With a folder it has all processes. All calls but those for errors, copies of arrays, snapshots that are deleted, real
 * values, and whole numbers other than "contacts" are collective: all processes make them alike and in the same order.
 * All get the same values and errors. `seconds` of polydem_advance has no effect. */
polydem_simulation polydem_new_simulation_on_ranks(polydem_error error, int communicator, const char *file,
                                                   const char *text, long n_overrides, const char *const *overrides,
                                                   const char *folder, int mode, int threads);

/* End the run and free its memory. A run with a folder that is not over is interrupted: `polydem run --continue`, or
 * POLYDEM_CONTINUE, goes on with it. */
void polydem_delete_simulation(polydem_error error, polydem_simulation *simulation);

/* Advance by a number of steps through all stages, at most to the end of the run and for about so many seconds of
 * elapsed time (0: no limit). Returns the number of steps done. After an error of the run the simulation can be looked
 * at, but not advanced. The files of a run that is over are complete. */
long polydem_advance(polydem_error error, polydem_simulation simulation, long steps, double seconds);

/* Record an action, which takes effect at the begin of the next step: a line of a file of actions in parts.
 *   kind    wall_velocity, load, gravity, drag, friction, force, add, remove, end_stage, end_run
 *   name    of the wall, load or material ("-": none); null for other kinds
 *   bodies  identifiers of n_bodies bodies
 *   values  n_values values in SI units
 * `polydem run --actions FILE` repeats a run with its actions to the same bits; the text "actions" has their lines, and
 * so has actions.txt in a folder. What is not possible is an error, and no action. */
void polydem_act(polydem_error error, polydem_simulation simulation, const char *kind, const char *name, long n_bodies,
                 const int64_t *bodies, long n_values, const double *values);

/* Values by their names: see the manual. Unknown names are errors. */
double polydem_real(polydem_error error, polydem_simulation simulation, const char *name);
long polydem_integer(polydem_error error, polydem_simulation simulation, const char *name);
long polydem_text(polydem_error error, polydem_simulation simulation, const char *name, char *buffer, long size);

/* Find an array by its name: its kind, and its numbers of rows and of values per row. It is kept until the next call
 * for this simulation and can be copied until then. */
int polydem_find_array(polydem_error error, polydem_simulation simulation, const char *name, long shape[2]);
void polydem_copy_integers(polydem_error error, polydem_simulation simulation, int64_t *values, long size);
void polydem_copy_reals(polydem_error error, polydem_simulation simulation, double *values, long size);

/* Take the state of a simulation, return to it as often as wanted, delete it. A simulation with a folder cannot return,
 * since its files go on. */
polydem_snapshot polydem_new_snapshot(polydem_error error, polydem_simulation simulation);
void polydem_restore(polydem_error error, polydem_simulation simulation, polydem_snapshot snapshot);
void polydem_delete_snapshot(polydem_snapshot *snapshot);

/* Make another simulation, without a folder, that goes on from the state of this one; null after an error. */
polydem_simulation polydem_copy_simulation(polydem_error error, polydem_simulation simulation);

#ifdef __cplusplus
}
#endif
#endif
