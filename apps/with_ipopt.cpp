#include "adapters/ipopt/ipopt.h"

namespace {

// Of the command alone and not of porthos_mpi: MUMPS, below IPOPT, has functions named as MPI's.
[[maybe_unused]] const bool added = [] {
  porthos::adapters::add_ipopt();
  return true;
}();

}  // namespace
