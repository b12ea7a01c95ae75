#pragma once
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "energy_shaping/porthos_law.h"
#include "phs/error.h"
#include "phs/functions/law.h"

/// Control laws of the user's own, behind the C functions of porthos_law.h.
namespace porthos::energy_shaping {

/// Opens a shared object and keeps it open until the program ends. It is trusted code.
/// @param with_its_symbols  later libraries may use its symbols, and those of its libraries
/// @throws InvalidArgument if it cannot be loaded, has no porthos_law_functions, or is of another
///   version
const porthos_law& open_law_library(const std::string& path, bool with_its_symbols = false);

using phs::LawFailure;

/// A joint of one degree of freedom under a foreign law.
struct LawJoint {
  std::string name;
  size_t q;  ///< place of its coordinate in the state of the controlled system
};

/// What a foreign law sees besides its joints.
struct LawInputs {
  size_t size = 0;
  /// Computes them from the state; for any thread.
  std::function<void(double t, std::span<const double> x, std::span<double> values)> at = {};
};

/// A foreign law over joints, whose ports have its rates as outputs, in the same order. What the
/// law remembers is in the memory of the run, as bytes. Objects of the law are made on demand, one
/// for each thread that evaluates it at a time. Thread-safe if the functions are for different
/// objects.
/// @param name      for messages
/// @param settings  JSON, for porthos_law::create
/// @param room      bytes that the memory has for what the law remembers; 0: 4096 more than twice
///   what it remembers at the start
/// @throws LawFailure "<name>: <message>" if the law cannot be made or saved. The law throws it at
///   an instant where it fails, gives a number that is not finite, or remembers more than there is
///   room for.
phs::SampledLawPtr foreign_law(const porthos_law& functions, const std::string& name,
                               std::vector<LawJoint> joints, const std::string& settings,
                               LawInputs inputs = {}, size_t room = 0);

}  // namespace porthos::energy_shaping
