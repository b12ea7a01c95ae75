#include "scene/plan/replay_scene.h"

#include <sstream>

#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// A basic string of TOML.
std::string quoted_key(const std::string& text) {
  std::ostringstream out;
  out << toml::value<std::string>(text);
  return out.str();
}

/// Numbers that read back as they are, eight in a line.
std::string numbers_text(const std::vector<double>& values) {
  std::string text;
  for (size_t i = 0; i < values.size(); ++i)
    text += fmt::format("{}{}", i % 8 ? " " : "\n    ",
                        fmt::format("{}{}", values[i], i + 1 < values.size() ? "," : ""));
  return text;
}

}  // namespace

std::string replay_scene(const Scene& scene, const PlanProblem& made,
                         const planning::Trajectory& motion) {
  const File file{scene.path};
  toml::table root = parse_toml(scene.text, file);
  root.erase("plan");
  root.erase("ensemble");
  root.insert_or_assign("title", scene.title + ", replayed");
  root["model"].as_table()->insert_or_assign("urdf", "model.urdf");
  toml::table& integrator = *root["integrator"].as_table();
  // of the command line, if they were given there
  integrator.insert_or_assign("method", scene.method);
  integrator.insert_or_assign("step", scene.step);
  toml::table& run = *root["run"].as_table();
  run.insert_or_assign("duration", scene.duration);
  if (!scene.record_every_given) run.erase("record_every");  // it is no multiple of a new step
  std::ostringstream text;
  text << "# A plan as a scene: written by porthos plan from " << scene.path << ".\n"
       << root << "\n";
  const auto& p = made.problem;
  const size_t nu = made.inputs.size();
  const int nodes = p.inputs == planning::Inputs::held ? 1 : p.stages;
  for (size_t k = 0; k < nu; ++k) {
    std::vector<double> values;
    for (size_t i = k; i < motion.u.size(); i += nu) values.push_back(motion.u[i]);
    text << fmt::format(
        "\n[[element]]\ntype = \"force\"\njoint = {0}\nname = {1}\n"
        "[element.pieces]\nperiod = {2}\nnodes = {3}\nvalues = [{4}]\n",
        quoted_key(made.inputs[k]), quoted_key(made.inputs[k] + ".plan"), p.step(), nodes,
        numbers_text(values));
  }
  return text.str();
}

}  // namespace porthos::scene
