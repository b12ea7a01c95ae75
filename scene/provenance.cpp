#include "scene/provenance.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <fstream>

#include "phs/error.h"
#include "phs/pack.h"
#include "scene/build_info.h"

namespace porthos::scene {
namespace {

/// Model name of the processor.
std::string cpu_model() {
  std::ifstream in("/proc/cpuinfo");
  for (std::string line; std::getline(in, line);)
    if (line.rfind("model name", 0) == 0) {
      const auto at = line.find(": ");
      if (at != std::string::npos) return line.substr(at + 2);
    }
  return "unknown";
}

/// Digests say too little to be shown to people.
bool is_digest(const std::string& name) { return name == "scene file" || name == "model"; }

}  // namespace

std::string sha256(std::string_view bytes) {
  unsigned char digest[EVP_MAX_MD_SIZE];
  unsigned int size = 0;
  if (EVP_Digest(bytes.data(), bytes.size(), digest, &size, EVP_sha256(), nullptr) != 1)
    throw InvalidArgument("OpenSSL offers no SHA-256 on this machine");
  std::string text;
  for (unsigned int i = 0; i < size; ++i) text += fmt::format("{:02x}", digest[i]);
  return text;
}

NamedTexts provenance(const Scene& scene) {
  return {{"porthos_version", build::version},
          {"git_hash", build::git_hash},
          {"compiler", build::compiler},
          {"flags", build::flags},
          {"build_type", build::build_type},
          {"simd", phs::simd_name},
          {"cpu", cpu_model()},
          {"scene_sha256", sha256(scene.text)},
          {"model_sha256", sha256(scene.urdf_text)}};
}

NamedTexts fingerprint(const Scene& scene) {
  return {{"scene file", sha256(scene.text)},
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
          {"program", fmt::format("{}, {}", build::compiler, phs::simd_name)}};
}

std::string difference(const NamedTexts& before, const NamedTexts& now) {
  if (before.size() != now.size()) return "it was written by another version of the program";
  std::string text;
  for (size_t i = 0; i < now.size(); ++i) {
    const auto& [name, value] = now[i];
    if (before[i] == now[i]) continue;
    if (!text.empty()) text += "; ";
    text += is_digest(name)
                ? fmt::format("the {} has changed", name)
                : fmt::format("the {} was {} and is {} now", name, before[i].second, value);
  }
  return text;
}

}  // namespace porthos::scene
