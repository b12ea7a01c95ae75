#include "tests/combinations/runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>

#include "phs/error.h"
#include "report/report.h"
#include "scene/compare/auto_method.h"
#include "scene/compare/compare.h"
#include "scene/ensemble/ensemble.h"
#include "scene/files/files.h"
#include "tests/run/scenes.h"

namespace porthos::test::combinations {
namespace {

using scene::Verdict;

std::string failing(const scene::RunReport& r) {
  std::string text = to_string(r.verdict());
  for (const auto& c : r.checks)
    if (!c.pass) text += fmt::format("; {} {:.3g}, limit {:g}", c.name, c.value, c.limit);
  for (const auto& n : r.notes) text += "; " + n;
  return text;
}
Seen judged(const scene::RunReport& r) {
  if (r.verdict() != Verdict::pass) return {"", failing(r)};
  return {"", r.steps < 20 ? fmt::format("{} steps, expected 20 or more", r.steps) : ""};
}

scene::RunReport run(const fs::path& path, const fs::path& out, bool verify, bool resume = false,
                     std::int64_t stop_at = -1) {
  const auto s = scene::read_scene(path.string());
  scene::RunOptions o = into(out, resume);
  o.check_symmetry = verify;
  o.stop_at = stop_at;
  return scene::run(s, scene::assemble(s), o);
}

/// Stopped on the way and continued: the same bits as the run that was not.
Seen run_in_parts(const fs::path& path) {
  const fs::path folder = path.parent_path(), parts = folder / "out", whole = folder / "whole";
  // What auto chooses is a matter of times: two choices may differ, and are made again then.
  for (int attempt = 0; attempt < 8; ++attempt) {
    fs::remove_all(whole);
    fs::remove_all(parts);
    const auto expected = run(path, whole, false);
    const auto stopped = run(path, parts, false, false, expected.steps / 2);
    if (!stopped.interrupted) return {"", "it was not stopped"};
    const auto r = run(path, parts, false, true);
    if (r.method != expected.method || r.step_s != expected.step_s) continue;
    if (!(r.final_state == expected.final_state)) return {"", "the final state differs"};
    for (const auto& file : fs::recursive_directory_iterator(whole))
      if (const auto name = fs::relative(file.path(), whole);
          name.filename() == "run.h5" && read_bytes(file.path()) != read_bytes(parts / name))
        return {"", name.string() + " differs"};
    return judged(r);
  }
  return {"", "auto chose differently eight times"};
}

Seen run_ensemble(const fs::path& path) {
  write_bytes(path, read_bytes(path) +
                        "\n[ensemble]\ncases = 3\n[ensemble.vary]\n"
                        "'initial.joints.joint1.position' = { uniform = [0.28, 0.32] }\n");
  scene::EnsembleOptions o;
  o.out = (path.parent_path() / "out").string();
  o.threads = 1;
  const scene::Ensemble e(scene::with_method_kept(scene::read_scene(path.string()), o.out));
  const auto r = scene::run_ensemble(e, o);
  if (r.complete && r.verdict() == Verdict::pass) return {};
  std::string why = fmt::format("{} of {} cases passed", r.passed, r.cases);
  for (const auto& kind : r.failures) why += fmt::format("; {} of them: {}", kind.count, kind.name);
  return {"", why};
}

Seen compare(const fs::path& path) {
  const auto s = scene::read_scene(path.string());
  scene::CompareOptions o;
  o.methods = {"gauss8", "gauss12"};
  if (s.is_constrained()) o.methods = {"spark8", "spark12"};
  if (s.rolls()) o.methods = {"pgauss8", "pgauss12"};
  o.budget_s = 0.2;
  const auto c = scene::compare(s, scene::assemble(s), o);
  scene::make_folder(path.parent_path() / "out");
  write_comparison((path.parent_path() / "out").string(), s, c);
  if (c.methods.size() < 2) return {"", "methods are left out"};
  for (const auto& m : c.methods) {
    double best = HUGE_VAL;
    for (const auto& t : m.trials)
      if (t.complete()) best = std::fmin(best, c.error_of(t));
    if (!m.short_sweeps && !(best < 1e-7))
      return {"",
              fmt::format("{}: best error {:.2g} of {} trials", m.label(), best, m.trials.size())};
  }
  return {};
}

/// The page of the results in a folder has the verdict and the figures of a feature.
Seen write_report(const fs::path& folder, const std::string& shown) {
  const fs::path page = folder / "page.html", made = folder / "report.html";
  const std::string head = "<script>", tail = "</script>";
  write_bytes(page, head + "@PORTHOS_DATA@" + tail);
  report::write_report(folder / "out", made, page);
  const std::string text = read_bytes(made);
  const auto data =
      nlohmann::json::parse(text.substr(head.size(), text.size() - head.size() - tail.size()));
  const char* of = data["kind"] == "ensemble"  ? "ensemble"
                   : data["summary"].is_null() ? "comparison"
                                               : "summary";
  const std::string summary = data[of].dump();
  if (summary.find(shown) == summary.npos) return {"", "the report does not show " + shown};
  return {};
}

Seen run_and_report(const fs::path& path, const std::string& shown) {
  const Seen seen = judged(run(path, path.parent_path() / "out", false));
  return seen.runs() ? write_report(path.parent_path(), shown) : seen;
}

/// Files that only a run under way leaves behind.
bool has_begun(const fs::path& folder) {
  for (const char* sign : {"checkpoint", "phase_1", "run.h5"})
    if (fs::exists(folder / "out" / sign)) return true;
  return false;
}

/// The sentence without the place in the file.
std::string sentence_of(const std::string& why, const std::string& file) {
  std::string text = why;
  const std::string folder = fs::path(file).parent_path().string();
  for (size_t at; (at = text.find(file)) != text.npos;) text.replace(at, file.size(), "scene.toml");
  for (size_t at; (at = text.find(folder)) != text.npos;)
    text.replace(at, folder.size(), "results");
  return std::regex_replace(text, std::regex("scene.toml(:[0-9]+)*: "), "");
}

Seen run_mode(const fs::path& path, Mode mode, const std::string& shown) {
  switch (mode) {
    case Mode::resume:
      return run_in_parts(path);
    case Mode::ensemble:
      return run_ensemble(path);
    case Mode::compare:
      return compare(path);
    case Mode::report:
      return run_and_report(path, shown);
    default:
      return judged(run(path, path.parent_path() / "out", true));
  }
}

bool says_one_of(const std::string& sentence, const std::vector<std::string>& words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const std::string& w) { return sentence.find(w) != sentence.npos; });
}

}  // namespace

std::string shown_of(const Feature& f) {
  static const std::map<std::string, std::string> others{
      {"orbit", "\"orbital\""},
      {"drag", "drag"},
      {"Sun pressure", "sunlight"},
      {"Moon", "third_bodies"},
      {"soft_latch", "latch1"},
      {"line_spring", "tether1"},
      {"dry friction", "joint1.dry_friction"},
      {"contact", "bumper1"},
      {"rigid contact", "striker1"},
      {"law over joints", "law1"},
      {"law in Python, tank", "own1"},
      {"outputs", "tip1"},
      {"robot", "other1.position"},
      {"joint wrench", "wrench1"},
      {"panel", "panel"},
      {"cmg", "gimbal.cmg"},
      {"wheel", "wheel.wheel"},
      {"sampled controller", "joint1.controller.hold"},
      {"thruster", "thruster1"},
      {"wrench", "wrench1"},
      {"force of a file", "joint1.force"},
      {"force of pieces", "joint1.force"},
      {"torquer", "torquer1"},
      {"ball joint", "ball1"},
      {"capture", "capture of target1"},
      {"capture by a link", "capture of prey1.lower"},
      {"release", "release of tool1"},
      {"lock and unlock", "unlock of joint1"},
      {"lock above", "lock of joint1"},
      {"capture within reach", "capture of target1"},
      {"engage and disengage", "disengagement of latch1"},
      {"monitor project", "energy monitor"},
      {"shorter last step", "last step"},
      {"auto", "auto chose"}};
  if (const auto known = others.find(f.name); known != others.end()) return known->second;
  if (f.tables.starts_with("[[actuator]]")) return "joint1.actuator";
  if (f.tables.starts_with("[[element]]")) return "joint1." + f.name;
  for (const auto& [key, value] : f.sets)
    if (key == "integrator.method" || key == "integrator.step_control")
      return value.substr(1, value.size() - 2);
  return "";
}

std::string write_scene(const fs::path& folder, const SceneTexts& texts) {
  fs::create_directories(folder);
  write_bytes(folder / "model.urdf", texts.urdf);
  write_bytes(folder / "scene.toml", texts.scene);
  write_bytes(folder / "push.csv", "t,force\n0,0.1\n0.3,-0.05\n0.6,0.05\n1,0\n");
  // It remembers its last torque, so that what is continued has its memory.
  write_bytes(folder / "law.py",
              "class Law:\n    def __init__(self, joints):\n        self.last = 0.0\n\n"
              "    def __call__(self, t, q, v):\n"
              "        self.last = 0.5 * self.last + 2 * (0.1 - q[0]) - 0.5 * v[0]\n"
              "        return [self.last]\n");
  return (folder / "scene.toml").string();
}

Seen run_pair(const Feature& a, const Feature& b, const Settings& more) {
  const TemporaryFolder folder;
  const std::string path = write_scene(folder / "", scene_of(a, b, more));
  const Mode mode = b.mode == Mode::verify || a.mode != Mode::verify ? a.mode : b.mode;
  try {
    const Seen seen = run_mode(path, mode, shown_of(a));
    const bool both = a.mode != Mode::verify && b.mode == Mode::report;  // of what the other left
    return both && seen.runs() ? write_report(folder / "", "gauss8") : seen;
  } catch (const InvalidArgument& e) {
    const std::string why = sentence_of(e.what(), path);
    return has_begun(folder / "") && mode != Mode::resume ? Seen{"", "refused under way: " + why}
                                                          : Seen{why, ""};
  }
}

bool names_both(const std::string& sentence, const Feature& a, const Feature& b) {
  const auto stands_on = [&](const Feature& f) {
    std::vector<std::string> words;
    for (const auto& [key, value] : f.needs) {
      words.push_back(key.substr(key.find('.') + 1));
      words.push_back(key.substr(0, key.find('.')));
    }
    return says_one_of(sentence, words);
  };
  const bool first = says_one_of(sentence, a.words), second = says_one_of(sentence, b.words);
  return (first && second) || (first && stands_on(b)) || (second && stands_on(a));
}

}  // namespace porthos::test::combinations
