#pragma once
#include <string>

#include "integrators/core/entry.h"

namespace porthos::integrators {

/// Every method, family by family. A family is a file pair with one function `Entries
/// <family>_entries()`, named once in catalogue.cpp.
const Entries& entries();
/// Adds the family of an adapter. @throws InvalidArgument after the first use of the catalogue,
/// which is constant from then on
void add_entries(Entries (*family)());
/// @throws InvalidArgument for an unknown name, which lists the known ones
const Entry& entry_of(const std::string& method);

}  // namespace porthos::integrators
