#pragma once
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "phs/error.h"

// toml++ 3.3 asserts conditions that some damaged texts violate: it would abort, and with NDEBUG
// continue with undefined behaviour. Here it throws in every build, and parse_toml() reports it.
namespace porthos::scene {
struct TomlAssertion : std::logic_error {
  using std::logic_error::logic_error;
};
[[noreturn]] void toml_gave_up(const char* asserted);
}  // namespace porthos::scene
#pragma push_macro("NDEBUG")
#undef NDEBUG
#define TOML_ASSERT(expr) ((expr) ? static_cast<void>(0) : ::porthos::scene::toml_gave_up(#expr))
#include <toml++/toml.h>
#pragma pop_macro("NDEBUG")

/// Places in a TOML file, and the messages for refused input. Private to the readers of a scene.
namespace porthos::scene {

using Names = std::vector<std::string_view>;

std::string joined(const Names& names);
/// The types for which the schema has tables `id`.<type>: "\"spring\", \"damper\" or \"friction\"".
std::string types_of(const std::string& id);
/// The known name that takes the fewest edits from `name`.
std::string_view nearest(std::string_view name, const Names& known);
/// Description of the value in the file, for "expected ..." messages.
std::string found(const toml::node& n);

/// where: "file:line:column", or "--step" of a command line
[[noreturn]] void refuse(const std::string& where, const std::string& sentence);
void check_seconds(const char* name, double seconds, const std::string& where);

/// Calls f(). An error message without a place gets the place in the file in front.
template <class F>
auto at_line(const std::string& where, F f) {
  try {
    return f();
  } catch (const InvalidArgument& why) {
    const std::string text = why.what();
    const std::string file = where.substr(0, where.find(':'));
    throw InvalidArgument(text.rfind(file, 0) == 0 ? text : where + ": " + text);
  }
}

struct File {
  std::string path;
  std::string at(const toml::source_region& r) const {
    return fmt::format("{}:{}:{}", path, std::max(r.begin.line, 1u), std::max(r.begin.column, 1u));
  }
};

/// @throws InvalidArgument with the place, if the text is not TOML
toml::table parse_toml(std::string_view text, const File& file);

/// Replaces the numbers of a key, see variation.h. @throws InvalidArgument if it has no place
void replace(toml::table& root, const std::string& key, const std::vector<double>& values);

}  // namespace porthos::scene
