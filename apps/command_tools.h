#pragma once
#include <atomic>
#include <optional>
#include <string>

#include "apps/commands.h"
#include "scene/read/scene.h"
#include "scene/run/run_report.h"

/// What commands share.
namespace porthos::apps {

/// From now on SIGINT, SIGTERM and, unless nohup had it ignored, SIGHUP raise this flag, at which
/// runs save and stop. A second signal has no effect: wrappers such as timeout send two at once.
const std::atomic<bool>& stop_on_signals();

/// The number of an option. @throws InvalidArgument for a text that is no number, saying what was
/// expected: "a number of seconds"
std::optional<double> number_of(const char* option, const std::optional<std::string>& text,
                                const char* expected);
/// The same in seconds.
std::optional<double> seconds(const char* option, const std::optional<std::string>& text);

/// A word as a shell reads it back.
std::string quoted(const std::string& word);

/// @throws InvalidArgument as scene::read_scene(), and for a model in place of a scene, which a
///   TOML reader would only call broken
scene::Scene scene_of(const std::string& path);
/// The scene of the arguments, or its --case, with --method, --step and --duration.
/// @throws InvalidArgument as scene_of(); for a bad option
scene::Scene read(const Arguments& arguments);

/// examples/ets_vii/scene.toml -> "ets_vii", arm.toml -> "arm", results/arm/ -> "arm"
std::string name_of(const std::string& scene);
/// The folder of a run's results unless --out names one.
std::string default_out(const Arguments& arguments);

ExitCode exit_code(scene::Verdict verdict);

/// A line on stderr.
void log(const std::string& line);

}  // namespace porthos::apps
