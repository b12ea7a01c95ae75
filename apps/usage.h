#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace porthos::apps {

/// The message for wrong arguments; our own where CLI11's is unclear.
/// @param first  the first argument, which names the command; may be null
std::string usage_error(const CLI::App& app, const CLI::ParseError& error, const char* first);

}  // namespace porthos::apps
