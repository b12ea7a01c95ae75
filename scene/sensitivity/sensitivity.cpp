#include "scene/sensitivity/sensitivity.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "integrators/derivatives/run_gradient.h"
#include "integrators/derivatives/run_instants.h"
#include "phs/system/linearised.h"
#include "scene/sensitivity/differentiable.h"
#include "scene/sensitivity/end_differences.h"
#include "scene/sensitivity/end_quantities.h"

namespace porthos::scene {
namespace {

using integrators::Objective;

constexpr const char* by_differences =
    "; --by base.mass (by= in Python) takes differences of whole runs";

void check_request(const SensitivityRequest& request) {
  if (request.uncertainty && !(*request.uncertainty > 0 && std::isfinite(*request.uncertainty)))
    throw InvalidArgument(fmt::format(
        "uncertainty is {}, expected a positive number, relative to each parameter: 0.01 for 1 %",
        *request.uncertainty));
}

/// None where there are gains of sampled laws alone.
std::vector<std::string> parameters_of(const Scene& scene, const phs::Model& model) {
  auto names = integrators::parameters_of_run(scene.method, model, scene.step);
  if (names.size() == integrators::gains_of_run(model).size()) names.clear();
  return names;
}
bool has_parameters(const Scene& scene) {
  return !parameters_of(scene, *assemble(scene).model).empty();
}

/// The elements, contacts and controllers of a scene each of which alone leaves a model without
/// slopes by its parameters; one that needs another is not told.
std::vector<std::string> parameters_end_with(const Scene& scene) {
  Scene bare = scene;
  bare.elements.clear();
  bare.contacts.clear();
  bare.controllers.clear();
  bare.outputs.clear();
  std::vector<std::string> names;
  const auto add = [&](auto Scene::*list) {
    for (const auto& item : scene.*list) {
      (bare.*list).assign(1, item);
      try {
        if (!has_parameters(bare)) names.push_back("'" + item.name + "'");
      } catch (const InvalidArgument&) {
      }
    }
    (bare.*list).clear();
  };
  add(&Scene::elements);
  add(&Scene::contacts);
  add(&Scene::controllers);
  return names;
}

std::string no_parameters_note(const Scene& scene, const phs::Model& model) {
  if (model.holds().empty() && !phs::linearise<double>(model)->parameters().empty())
    return fmt::format(
        "no slopes by parameters of runs of {}, only by start values: gauss16 has both, and --by "
        "takes differences of whole runs",
        scene.method);
  constexpr size_t most = 3;
  auto with = parameters_end_with(scene);
  if (with.size() > most) {
    const size_t more = with.size() - most;
    with.resize(most);
    with.push_back(fmt::format("{} more", more));
  }
  return fmt::format(
      "no slopes by parameters{}, only by start values: an [ensemble] over a parameter gives "
      "differences instead",
      with.empty() ? "" : fmt::format(" with {}", fmt::join(with, ", ")));
}

/// The ends of all quantities, evaluated once.
class Ends {
 public:
  Ends(const EndQuantities& quantities, const phs::Description& d,
       const std::vector<std::string>& names, const std::vector<std::string>& parameters)
      : quantities_(quantities), d_(d), names_(names), parameters_(parameters) {}

  Objective of(size_t i) {
    return {.end =
                [this, i](double t, std::span<const double> x, std::span<double> gradient) {
                  if (found_.empty()) find(t, x);
                  std::ranges::copy(found_[i].by_state, gradient.begin());
                  return found_[i].value;
                },
            .sampled = {},
            .running = {}};
  }
  const EndQuantity& found(size_t i) const { return found_[i]; }

 private:
  void find(double t, std::span<const double> x) {
    phs::State s(d_, {x.begin(), x.end()});
    phs::wrap_angles(d_, s);
    found_ = quantities_.at(t, s, names_, parameters_);
  }
  const EndQuantities& quantities_;
  const phs::Description& d_;
  const std::vector<std::string>&names_, &parameters_;
  std::vector<EndQuantity> found_;
};

}  // namespace

EndSensitivity end_sensitivity(const Scene& given, const SensitivityRequest& request) {
  check_request(request);
  if (!request.by.empty()) return end_differences(given, request);
  const Scene scene = scene_with_slopes(given, "sensitivity", by_differences);
  const Assembly a = assemble(scene);
  const Steps steps = differentiable_steps(scene, a, by_differences);
  const EndQuantities quantities(scene, a);
  for (const auto& name : request.of) quantities.require(name);
  const auto& names = request.of.empty() ? quantities.usual() : request.of;
  const auto parameters = parameters_of(scene, *a.model);
  const Inputs inputs(a, parameters);

  EndSensitivity r;
  r.title = scene.title;
  r.method = scene.method;
  r.inputs = inputs.list();
  r.uncertainty = request.uncertainty;
  const RunSteps run = run_steps(scene, a, steps, request.stop);
  r.step = steps.size;
  r.last = run.last();
  r.chosen = run.controlled ? run.count() : 0;
  r.duration = steps.duration;
  r.failure = run.taken.remark;
  if (!r.failure.empty()) return r;

  Ends ends(quantities, a.model->description(), names, parameters);
  std::vector<Objective> objectives;
  for (size_t i = 0; i < names.size(); ++i) objectives.push_back(ends.of(i));
  const auto gradients = integrators::gradients_of_run(scene.method, *a.model, a.initial,
                                                       run.steps.size, run.count(), objectives,
                                                       {.memory = request.memory,
                                                        .last = run.last(),
                                                        .taken = run.taken.steps,
                                                        .stop = request.stop,
                                                        .progress = request.progress});

  if (parameters.empty()) r.notes.push_back(no_parameters_note(scene, *a.model));
  if (request.of.empty())
    for (const auto& note : quantities.left_out()) r.notes.push_back(note);
  for (size_t i = 0; i < names.size(); ++i) {
    const auto& g = gradients[i];
    r.failure = g.remark;
    if (g.outcome != integrators::Outcome::ok) return r;
    const EndQuantity& at_end = ends.found(i);
    auto theta = g.parameters;
    theta.resize(parameters.size());
    for (size_t k = 0; k < theta.size(); ++k) theta[k] += at_end.by_parameters[k];
    r.of.push_back({at_end.name, at_end.unit, at_end.value, inputs.slopes(g.start, theta), g.growth,
                    at_end.error});
  }
  for (auto& note : notes_on_control(scene, run, a.model->description(), gradients.front().end))
    r.notes.push_back(std::move(note));
  return r;
}

double EndSensitivity::deviation(const EndSlopes& q) const {
  double sum = 0;
  for (size_t i = 0; i < inputs.size(); ++i)
    if (!inputs[i].start) sum += by_whole(q, i) * by_whole(q, i);
  return uncertainty.value_or(NAN) * std::sqrt(sum);
}

std::vector<size_t> EndSensitivity::sorted(const EndSlopes& q, bool start) const {
  std::vector<size_t> order;
  for (size_t i = 0; i < inputs.size(); ++i)
    if (inputs[i].start == start && q.counts(i)) order.push_back(i);
  std::ranges::stable_sort(order, std::greater<>(), [&](size_t i) {
    return std::fabs(start ? q.slopes[i] : by_whole(q, i));
  });
  return order;
}

}  // namespace porthos::scene
