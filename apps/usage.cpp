#include "apps/usage.h"

#include <fmt/format.h>

#include "phs/error.h"
#include "phs/nearest.h"

namespace porthos::apps {
namespace {

std::string unknown_option(const CLI::App& command, const std::string& option) {
  std::vector<std::string> names;
  for (const CLI::Option* o : command.get_options())
    for (const std::string& name : o->get_lnames()) names.push_back("--" + name);
  return fmt::format("{} has no option {}, the nearest is {}", command.get_name(), option,
                     nearest(option, {names.begin(), names.end()}));
}

}  // namespace

std::string unknown_command(const CLI::App& app, const char* first) {
  const auto named = [&](const CLI::App* c) { return c->get_name() == first; };
  if (*first == '-' || !app.get_subcommands(named).empty()) return "";
  std::string known;
  for (const CLI::App* c : app.get_subcommands([](const CLI::App*) { return true; }))
    add_to_list(known, c->get_name());
  return fmt::format("there is no command '{}', expected one of {}", first, known);
}

std::string usage_error(const CLI::App& app, const CLI::ParseError& e) {
  if (dynamic_cast<const CLI::ExtrasError*>(&e))
    for (const CLI::App* c : app.get_subcommands())
      for (const std::string& word : c->remaining())
        if (word.starts_with("--")) return unknown_option(*c, word);
  return e.what();
}

}  // namespace porthos::apps
