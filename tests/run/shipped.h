#pragma once
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "scene/ensemble/ensemble.h"
#include "tests/places.h"
#include "tests/run/scenes.h"

/// Shipped examples, changed, and what their reports say.
namespace porthos::test {

/// A text of an example, in its scene or in its URDF file, and what stands there instead.
struct Change {
  std::string from, to;
};

/// An example with its URDF file in a folder; `more` is added at the end of the scene.
inline scene::Scene shipped(const TemporaryFolder& folder, const std::string& name,
                            const std::vector<Change>& changes = {}, const std::string& more = "") {
  const fs::path example = fs::path(PORTHOS_SOURCE_DIR) / "examples" / name;
  std::string text = read_bytes(example / "scene.toml");
  const std::string key = "urdf = \"";
  const size_t path_at = text.find(key) + key.size();
  const std::string path = text.substr(path_at, text.find('"', path_at) - path_at);
  const std::string beside = fs::path(path).filename().string();
  std::string urdf = read_bytes(example / path);
  for (size_t at; path != beside && (at = text.find(key + path + '"')) != text.npos;)
    text.replace(at + key.size(), path.size(), beside);
  for (const auto& [from, to] : changes) {
    std::string& in = text.find(from) == text.npos ? urdf : text;
    const size_t at = in.find(from);
    if (at == in.npos) throw std::runtime_error("no '" + from + "' in " + name);
    in.replace(at, from.size(), to);
  }
  for (const auto& other : fs::directory_iterator(example))  // of its robots, and laws
    if (other.path().extension() == ".urdf" || other.path().extension() == ".py")
      write_bytes(folder / other.path().filename().string(), read_bytes(other.path()));
  write_bytes(folder / beside, urdf);
  write_bytes(folder / "scene.toml", text + more);
  return scene::read_scene((folder / "scene.toml").string());
}
/// The same for a shorter time [s].
inline scene::Scene shipped(const TemporaryFolder& folder, const std::string& name, double duration,
                            const std::vector<Change>& changes = {}, const std::string& more = "") {
  auto s = shipped(folder, name, changes, more);
  scene::apply(s, {.duration = duration});
  return s;
}

inline double value_of(const scene::RunReport& r, const std::string& check) {
  for (const auto& c : r.checks)
    if (c.name == check) return c.value;
  return NAN;
}
/// An entry of a ledger by its name, as of RunReport::ports.
inline double entry_of(const scene::RunReport::Named& list, const std::string& name) {
  for (const auto& [known, value] : list)
    if (known == name) return value;
  return NAN;
}

/// A run that is interrupted at these steps, and continued, has the bits of the whole one.
/// @return the reports of the whole run, and of the last part
inline std::pair<scene::RunReport, scene::RunReport> expect_same_bits_when_resumed(
    const TemporaryFolder& folder, const scene::Scene& s,
    std::initializer_list<std::int64_t> steps) {
  const auto a = scene::assemble(s);
  auto whole = scene::run(s, a, into(folder / "whole"));
  auto o = into(folder / "parts");
  for (const std::int64_t at : steps) {
    o.stop_at = at;
    EXPECT_TRUE(scene::run(s, a, o).interrupted);
    o.resume = true;
  }
  auto rest = scene::run(s, a, into(folder / "parts", true));
  EXPECT_EQ(whole.final_state, rest.final_state);
  EXPECT_EQ(read_bytes(folder / "whole" / "run.h5"), read_bytes(folder / "parts" / "run.h5"));
  return {std::move(whole), std::move(rest)};
}

/// The ensemble of a scene has the same bits by one thread and by two.
inline void expect_same_bits_with_threads(const TemporaryFolder& folder, const scene::Scene& s) {
  std::vector<std::string> cases;
  for (const int threads : {1, 2}) {
    const fs::path out = folder / ("by" + std::to_string(threads));
    scene::EnsembleOptions o;
    o.out = out.string();
    o.threads = threads;
    (void)scene::run_ensemble(scene::Ensemble(s), o);
    cases.push_back(read_bytes(out / "ensemble.h5"));
  }
  EXPECT_EQ(cases[0], cases[1]);
}

/// What reading and assembling a scene that is made in a folder is refused with, from the scene's
/// name on; empty if it is not.
template <class Make>
std::string refusal_of_scene(const Make& make) {
  TemporaryFolder folder;
  try {
    const scene::Scene s = make(folder);
    scene::assemble(s);
  } catch (const InvalidArgument& e) {
    const std::string text = e.what();
    return text.substr(text.find("scene.toml"));
  }
  return "";
}

/// The rate that the refusal of a sampled law names [Hz]; NaN: none.
inline double named_rate(const std::string& told) {
  double rate = NAN;
  if (const auto at = told.find("a rate of "); at != told.npos)
    std::sscanf(told.c_str() + at, "a rate of %lf Hz would do", &rate);
  return rate;
}
/// Refused at a rate far too low, at the named one it holds, at nine tenths of it not.
/// @param refusal_at  of a scene with this rate [Hz]; empty: it is accepted
inline void expect_named_rate_holds(const std::function<std::string(double)>& refusal_at,
                                    double low) {
  const std::string told = refusal_at(low);
  EXPECT_NE(told.find("sampled fails: "), told.npos) << told;
  const double rate = named_rate(told);
  std::printf("  refused at %g Hz, named %g Hz\n", low, rate);
  ASSERT_GT(rate, low) << told;
  EXPECT_EQ(refusal_at(rate), "");
  EXPECT_NE(refusal_at(0.9 * rate), "");
}

}  // namespace porthos::test
