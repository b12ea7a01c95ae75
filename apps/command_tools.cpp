#include "apps/command_tools.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "scene/ensemble/case_scene.h"

namespace porthos::apps {
namespace {

namespace fs = std::filesystem;

std::atomic<bool> stop{false};
static_assert(std::atomic<bool>::is_always_lock_free);

/// Case --case of the scene's [ensemble], or of the results of one.
scene::Scene case_of(const Arguments& a) {
  const auto number = as_number(*a.of_case);
  if (!number || !(*number >= 0 && *number < 1e15) || *number != std::floor(*number))
    throw InvalidArgument(
        fmt::format("--case: case is '{}', expected the number of one, from 0", *a.of_case));
  const auto index = std::int64_t(*number);
  if (fs::is_directory(a.scene)) return scene::scene_of_case(fs::path(a.scene), index);
  return scene::scene_of_case(scene_of(a.scene), index);
}

}  // namespace

const std::atomic<bool>& stop_on_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop = true; };
  action.sa_flags = SA_RESTART;
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    struct sigaction before {};
    sigaction(signal, nullptr, &before);
    const bool nohup = signal == SIGHUP && before.sa_handler == SIG_IGN;
    if (!nohup) sigaction(signal, &action, nullptr);
  }
  return stop;
}

std::optional<double> number_of(const char* option, const std::optional<std::string>& text,
                                const char* expected) {
  if (!text) return {};
  const auto x = as_number(*text);
  if (!x)
    throw InvalidArgument(
        fmt::format("--{0}: {0} is '{1}', expected {2}", option, *text, expected));
  return x;
}

std::optional<double> seconds(const char* option, const std::optional<std::string>& text) {
  return number_of(option, text, "a number of seconds");
}

std::string quoted(const std::string& word) {
  const bool plain = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) || std::string_view("/._-+=:").find(char(c)) != std::string_view::npos;
  });
  if (plain) return word;
  std::string q = "'";
  for (const char c : word) q += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return q + "'";
}

scene::Scene scene_of(const std::string& path) {
  std::ifstream file;
  if (fs::is_regular_file(path)) file.open(path);  // a pipe can be read only once
  if (char first = 0; file >> first && first == '<')
    throw InvalidArgument(fmt::format("{} is a model, expected a scene: porthos new {} writes one",
                                      path, quoted(path)));
  return scene::read_scene(path);
}

scene::Scene read(const Arguments& a) {
  scene::Scene s = a.of_case ? case_of(a) : scene_of(a.scene);
  scene::apply(s, {a.method, seconds("step", a.step), seconds("duration", a.duration)});
  return s;
}

std::string name_of(const std::string& scene) {
  fs::path path = fs::absolute(scene).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  const std::string folder = path.parent_path().filename().string();
  return path.filename() == "scene.toml" && !folder.empty() ? folder : path.stem().string();
}

std::string default_out(const Arguments& a) {
  const std::string out = "results/" + name_of(a.scene);
  return a.of_case ? fmt::format("{}_case_{}", out, *a.of_case) : out;
}

ExitCode exit_code(scene::Verdict v) {
  return v == scene::Verdict::pass   ? exit_ok
         : v == scene::Verdict::fail ? exit_verdict_failed
                                     : exit_not_judged;
}

void log(const std::string& line) { fmt::print(stderr, "porthos: {}\n", line); }

}  // namespace porthos::apps
