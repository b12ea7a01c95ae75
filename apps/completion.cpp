#include <fmt/format.h>

#include <CLI/CLI.hpp>

#include "apps/commands.h"
#include "apps/output.h"
#include "integrators/core/integrator.h"
#include "phs/error.h"

namespace porthos::apps {
namespace {

/// An option for completion by a shell: --step, and whether a value follows.
struct Option {
  std::string name, what;
  bool value, method;  ///< method: its values are names of methods
};

struct Command {
  std::string name, what;
  std::vector<Option> options;
};

std::vector<Command> commands_of(const CLI::App& app) {
  std::vector<Command> list;
  for (const CLI::App* c : app.get_subcommands([](const CLI::App*) { return true; })) {
    Command command{c->get_name(), c->get_description(), {}};
    for (const CLI::Option* o : c->get_options())
      for (const auto& name : o->get_lnames())
        command.options.push_back({"--" + name, o->get_description(),
                                   o->get_items_expected_max() > 0,
                                   name == "method" || name == "methods"});
    list.push_back(std::move(command));
  }
  return list;
}

std::string methods() {
  std::string names = "auto";
  for (const auto& d : integrators::catalogue()) names += " " + d.name;
  return names;
}

std::string names_of(const Command& c) {
  std::string names;
  for (const auto& o : c.options) names += (names.empty() ? "" : " ") + o.name;
  return names;
}

std::string bash(const std::vector<Command>& commands) {
  std::string all, cases;
  for (const auto& c : commands) {
    all += (all.empty() ? "" : " ") + c.name;
    cases += fmt::format("    {}) options=\"{}\" ;;\n", c.name, names_of(c));
  }
  return fmt::format(
      R"(# porthos completion bash > ~/.local/share/bash-completion/completions/porthos
_porthos() {{
  local word=${{COMP_WORDS[COMP_CWORD]}} before=${{COMP_WORDS[COMP_CWORD-1]}} options=
  COMPREPLY=()
  if ((COMP_CWORD == 1)); then
    COMPREPLY=($(compgen -W "{0} --help --version" -- "$word"))
    return
  fi
  case $before in
    --method|--methods) COMPREPLY=($(compgen -W "{2}" -- "$word")); return ;;
  esac
  case ${{COMP_WORDS[1]}} in
{1}  esac
  if [[ ${{COMP_WORDS[1]}} == completion ]]; then
    COMPREPLY=($(compgen -W "bash zsh fish" -- "$word"))
  elif [[ $word == -* ]]; then
    COMPREPLY=($(compgen -W "$options" -- "$word"))
  else
    COMPREPLY=($(compgen -f -- "$word"))
  fi
}}
complete -o filenames -F _porthos porthos
)",
      all, cases, methods());
}

/// Text for single quotes of a shell, without characters that are special for zsh.
std::string plain(std::string text) {
  std::string out;
  for (const char c : text)
    if (c == '\'')
      out += "'\\''";
    else if (c == '[' || c == ']' || c == ':')
      out += std::string("\\") + c;
    else
      out += c;
  return out;
}

std::string zsh(const std::vector<Command>& commands) {
  std::string all, cases;
  for (const auto& c : commands) {
    all += fmt::format("    '{}:{}'\n", c.name, plain(c.what));
    cases += fmt::format("    {})\n      _arguments", c.name);
    for (const auto& o : c.options)
      cases += fmt::format(" \\\n        '{}[{}]{}'", o.name, plain(o.what),
                           !o.value   ? ""
                           : o.method ? ":method:(" + methods() + ")"
                                      : ":value:_files");
    cases += c.name == "completion" ? " \\\n        '1:shell:(bash zsh fish)' ;;\n"
                                    : " \\\n        '*:file:_files' ;;\n";
  }
  return fmt::format(R"(#compdef porthos
# porthos completion zsh > a folder of $fpath/_porthos
_porthos() {{
  local -a commands=(
{0}  )
  if ((CURRENT == 2)); then
    _describe command commands
    return
  fi
  local command=$words[2]
  shift words
  ((CURRENT--))
  case $command in
{1}  esac
}}
_porthos "$@"
)",
                     all, cases);
}

std::string fish(const std::vector<Command>& commands) {
  const auto quoted = [](const std::string& text) {
    std::string out = "'";
    for (const char c : text)
      out += c == '\'' || c == '\\' ? std::string("\\") + c : std::string(1, c);
    return out + "'";
  };
  std::string text = "# porthos completion fish > ~/.config/fish/completions/porthos.fish\n";
  for (const auto& c : commands) {
    text += fmt::format("complete -c porthos -n __fish_use_subcommand -f -a {} -d {}\n", c.name,
                        quoted(c.what));
    for (const auto& o : c.options)
      text += fmt::format("complete -c porthos -n '__fish_seen_subcommand_from {}' -l {}{} -d {}\n",
                          c.name, o.name.substr(2),
                          o.method  ? " -x -a '" + methods() + "'"
                          : o.value ? " -r"
                                    : "",
                          quoted(o.what));
  }
  return text +
         "complete -c porthos -n '__fish_seen_subcommand_from completion' -f -a 'bash zsh fish'\n";
}

}  // namespace

int completion_command(const CLI::App& app, const Arguments& a) {
  const auto commands = commands_of(app);
  if (a.scene == "bash")
    print(bash(commands));
  else if (a.scene == "zsh")
    print(zsh(commands));
  else if (a.scene == "fish")
    print(fish(commands));
  else
    throw InvalidArgument(
        fmt::format("there is no completion for '{}', expected bash, zsh or fish", a.scene));
  return exit_ok;
}

}  // namespace porthos::apps
