#pragma once
#include <deque>
#include <string>

#include "integrators/core/entry.h"

namespace porthos::integrators {

/// Every method, family by family. A family is a file pair with one function `Entries
/// <family>_entries()`, named once in catalogue.cpp. References to entries stay valid.
const std::deque<Entry>& entries();
/// Adds the methods of an adapter or of a program, while no other thread uses the catalogue. A
/// method that was added under the same name before is replaced.
/// @throws InvalidArgument for the name of a method of Porthos itself, for "auto", and for a name
///   with other signs than letters, digits, _ - .
void add_entries(Entries (*family)());
/// version: a text that changes with its code, by which a checkpoint is known; empty: not checked.
void add_entry(Entry entry, std::string version = {});
/// Of a method that was added; empty for those of Porthos, whose version is the program's.
std::string version_of(const std::string& method);
/// @throws InvalidArgument for an unknown name, which lists the known ones
const Entry& entry_of(const std::string& method);
bool knows_method(const std::string& name);
/// Whether Options::rtol sets its error: the order is 0, or it is another library's.
bool works_to_tolerance(const Declaration& method);

}  // namespace porthos::integrators
