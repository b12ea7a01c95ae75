#pragma once
/* A control law of one's own, in C99 or any language that can export C functions: a shared object
   that a [[controller]] of type "shared_library" names (docs/controllers.md). It is trusted code
   and runs in the process of the simulation.

   The shared object exports one symbol, porthos_law_functions. Example, one joint to the angle 1:

     static void* create(int n, const char* const* names, int inputs, const char* settings,
                         char* message) {
       static int nothing;
       return n == 1 ? &nothing : NULL;
     }
     static int torques(void* law, double t, const double* q, const double* v,
                        const double* inputs, double* tau, char* message) {
       tau[0] = 20 * (1 - q[0]) - 5 * v[0];
       return 0;
     }
     static void destroy(void* law) {}
     const porthos_law* porthos_law_functions(void) {
       static const porthos_law all = {PORTHOS_LAW_VERSION, create, torques, NULL, NULL, destroy};
       return &all;
     }                                                                                          */

#define PORTHOS_LAW_VERSION 1
/* Bytes of `message`, where a function that fails writes a sentence that ends with a 0. */
#define PORTHOS_LAW_MESSAGE 4096

#ifdef __cplusplus
extern "C" {
#endif

typedef struct porthos_law {
  int version; /* PORTHOS_LAW_VERSION */
  /* A law over n joints that also sees a number of inputs, or NULL with a message.
     settings: the table `settings` of the controller as JSON; "{}" if the scene has none. */
  void* (*create)(int n, const char* const* names, int inputs, const char* settings, char* message);
  /* The n torques [N m] or forces [N] that are held from time t [s] until the next instant, from
     the measured positions q [rad or m] and rates v [rad/s or m/s], and from the numbers of the
     outputs that the scene names as inputs, one after another.
     Returns 0, or any other number with a message: the run then ends. */
  int (*torques)(void* law, double t, const double* q, const double* v, const double* inputs,
                 double* tau, char* message);
  /* What the law remembers from one instant to the next, as bytes. Both are NULL if it remembers
     nothing. A run may go back to an earlier instant (a step that is repeated, a checkpoint): the
     law then gets the bytes of that instant, and must give the same torques as before.
     save: writes the bytes, at most `size`, and returns how many there are, or -1 with a message.
     restore: returns 0, or any other number with a message. */
  int (*save)(void* law, void* bytes, int size, char* message);
  int (*restore)(void* law, const void* bytes, int size, char* message);
  void (*destroy)(void* law);
} porthos_law;

/// The symbol that a shared object exports.
const porthos_law* porthos_law_functions(void);

#ifdef __cplusplus
}
#endif
