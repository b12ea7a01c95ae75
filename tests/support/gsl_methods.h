#pragma once
#ifdef PORTHOS_HAVE_GSL
#include "adapters/gsl/gsl.h"

/// Include in one file of a test program that wants GSL's methods in the catalogue.
namespace porthos::test {
inline const bool gsl_methods_added = (adapters::add_gsl_methods(), true);
}
#endif
