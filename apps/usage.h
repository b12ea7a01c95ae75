#pragma once
#include <CLI/CLI.hpp>
#include <string>

namespace porthos::apps {

/// What is wrong with the first argument, which names the command; empty: nothing.
std::string unknown_command(const CLI::App& app, const char* first);
/// The message for wrong arguments; our own where CLI11's is unclear.
std::string usage_error(const CLI::App& app, const CLI::ParseError& error);

}  // namespace porthos::apps
