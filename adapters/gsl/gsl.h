#pragma once

/// GNU Scientific Library's integrators in the catalogue. GSL is GPL-3: a program that links this adapter is, as a whole,
/// under GPL-3. The libraries of Porthos never link it.
namespace porthos::adapters {

/// Adds gsl_rk8pd, gsl_msadams and gsl_bsimp to the catalogue. Call once, before its first use.
void add_gsl_methods();

}  // namespace porthos::adapters
