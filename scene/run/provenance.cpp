#include "scene/run/provenance.h"

#include <fmt/format.h>

#include <fstream>

#include "integrators/catalogue.h"
#include "phs/error.h"
#include "phs/scalars/pack.h"
#include "scene/build_info.h"
#include "scene/files/digest.h"

namespace porthos::scene {
namespace {

/// Model name of the processor.
std::string cpu_model() {
  std::ifstream in("/proc/cpuinfo");
  if (in) in.exceptions(std::ios::badbit);  // memory that is missing is no missing name
  for (std::string line; std::getline(in, line);)
    if (line.rfind("model name", 0) == 0) {
      const auto at = line.find(": ");
      if (at != std::string::npos) return line.substr(at + 2);
    }
  return "unknown";
}

/// Whether a text is a digest, which is not shown to people.
bool is_digest(const std::string& name) {
  return name == "scene file" || name == "model" || name == "table of cases" ||
         name.rfind("file ", 0) == 0 || name.rfind("method '", 0) == 0;
}

/// Digests of the files a scene reads in addition to its own and the model's, by their names in it.
NamedTexts tables_of(const Scene& scene) {
  NamedTexts list;
  for (const auto& [name, content] : scene.files)
    list.emplace_back("file " + name, sha256(content));
  for (const Controller& c : scene.controllers)
    if (!c.file.name.empty()) list.emplace_back("file " + c.file.name, sha256(c.file.text));
  if (scene.start_from)
    list.emplace_back("record of " + scene.start_from->folder, sha256(text(*scene.start_from)));
  return list;
}

const std::string* value_in(const NamedTexts& list, const std::string& name) {
  for (const auto& [known, value] : list)
    if (known == name) return &value;
  return nullptr;
}

}  // namespace

NamedTexts provenance(const Scene& scene) {
  NamedTexts list{{"porthos_version", build::version},
                  {"git_hash", build::git_hash},
                  {"compiler", build::compiler},
                  {"flags", build::flags},
                  {"build_type", build::build_type},
                  {"simd", phs::simd_name},
                  {"cpu", cpu_model()},
                  {"scene_sha256", sha256(scene.text)},
                  {"model_sha256", sha256(scene.urdf_text)}};
  list.insert(list.end(), scene.digests.begin(), scene.digests.end());
  for (const auto& [name, digest] : tables_of(scene)) list.emplace_back(name + " sha256", digest);
  return list;
}

NamedTexts fingerprint(const Scene& scene) {
  NamedTexts list{{"scene file", sha256(scene.text)},
                  {"model", sha256(scene.urdf_text)},
                  {"method", scene.method},
                  {"step", fmt::format("{} s", scene.step)},
                  {"duration", fmt::format("{} s", scene.duration)},
                  {"rtol", fmt::format("{}", scene.rtol)},
                  {"iteration_tolerance", fmt::format("{}", scene.iteration_tolerance)},
                  {"step_control", fmt::format("{} ({} rad/s, {} m)", to_string(scene.step_control),
                                               scene.control_rate, scene.control_length)},
                  {"record_every", fmt::format("{} s", scene.record_every)},
                  {"choice", scene.choice},
                  {"program", fmt::format("porthos {} ({}), {}, {}", build::version,
                                          build::git_hash, build::compiler, phs::simd_name)}};
  if (auto version = integrators::version_of(scene.method); !version.empty())
    list.emplace_back("method '" + scene.method + "'", std::move(version));
  for (auto& each : tables_of(scene)) list.push_back(std::move(each));
  return list;
}

std::string difference(const NamedTexts& before, const NamedTexts& now) {
  std::string text;
  const auto say = [&](const std::string& what) {
    text += (text.empty() ? "the " : "; the ") + what;
  };
  for (const auto& [name, value] : now) {
    const std::string* was = value_in(before, name);
    if (was && *was == value) continue;
    if (!was)
      say(name + " is new");
    else if (is_digest(name))
      say(name + " has changed");
    else
      say(fmt::format("{} was {} and is {} now", name, *was, value));
  }
  for (const auto& [name, value] : before)
    if (!value_in(now, name)) say(name + " is no longer there");
  return text;
}

}  // namespace porthos::scene
