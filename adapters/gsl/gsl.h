#pragma once

/// GNU Scientific Library's integrators in the catalogue. GSL is GPL-3: a program that links this
/// adapter is, as a whole, under GPL-3. The libraries of Porthos never link it.
namespace porthos::adapters {

/// Adds gsl_rk8pd, gsl_msadams and gsl_bsimp (which needs the Jacobian: systems that take duals
/// only) to the catalogue, while no other thread uses it.
///
/// Making one of them replaces GSL's default error handler, which aborts the program, by one that
/// does nothing; a handler of the program's own stays. GSL does not tell how often it factorises:
/// Cost::factorisations stays 0.
void add_gsl_methods();

}  // namespace porthos::adapters
