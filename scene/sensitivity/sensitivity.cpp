#include "scene/sensitivity/sensitivity.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "integrators/derivatives/run_gradient.h"
#include "integrators/derivatives/run_instants.h"
#include "phs/system/linearised.h"
#include "scene/sensitivity/differentiable.h"
#include "scene/sensitivity/end_differences.h"
#include "scene/sensitivity/end_quantities.h"
#include "scene/sensitivity/event_run.h"

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
  /// The slopes of one by parameters of the last phase of a run with events, and by the places that
  /// events made constants of it.
  std::map<std::string, double> by_parameters(size_t i, const EventRun& run, double t,
                                              std::span<const double> x) {
    std::map<std::string, double> slopes;
    for (size_t k = 0; k < parameters_.size(); ++k)
      slopes[parameters_[k]] = found_[i].by_parameters[k];
    for (const auto& [place, phases] : run.beside()) {
      auto& all = by_places_[place];
      for (size_t k = 0; k < phases.size() && all.size() < phases.size(); ++k)
        all.push_back(
            EndQuantities(phases[k].first, phases[k].second).at(t, state_of(x), names_, {}));
      for (size_t k = 0; k < all.size(); ++k)
        slopes[place] +=
            phs::difference_points[k].weight / phs::difference_distance * all[k][i].value;
    }
    return slopes;
  }

 private:
  phs::State state_of(std::span<const double> x) const {
    phs::State s(d_, {x.begin(), x.end()});
    phs::wrap_angles(d_, s);
    return s;
  }
  void find(double t, std::span<const double> x) {
    found_ = quantities_.at(t, state_of(x), names_, parameters_);
  }
  const EndQuantities& quantities_;
  const phs::Description& d_;
  const std::vector<std::string>&names_, &parameters_;
  std::vector<EndQuantity> found_;
  std::map<std::string, std::vector<std::vector<EndQuantity>>> by_places_;
};

/// The slopes of one quantity.
struct Slopes {
  std::vector<double> start, parameters;  ///< parameters: of the first phase, then of the events
  double growth;
};

/// What gradients are taken of.
struct Asked {
  const Scene& scene;
  const Assembly& assembly;
  const std::vector<std::string>& parameters;
  const SensitivityRequest& request;
  size_t count;  ///< of quantities
};

std::vector<Slopes> slopes_of_run(const Asked& ask, const RunSteps& run, Ends& ends,
                                  EndSensitivity& r) {
  std::vector<Objective> objectives;
  for (size_t i = 0; i < ask.count; ++i) objectives.push_back(ends.of(i));
  const auto gradients =
      integrators::gradients_of_run(ask.scene.method, *ask.assembly.model, ask.assembly.initial,
                                    run.steps.size, run.count(), objectives,
                                    {.memory = ask.request.memory,
                                     .last = run.last(),
                                     .taken = run.taken.steps,
                                     .stop = ask.request.stop,
                                     .progress = ask.request.progress});
  r.failure = gradients.front().remark;
  std::vector<Slopes> all;
  for (const auto& g : gradients) {
    all.push_back({g.start, g.parameters, g.growth});
    all.back().parameters.resize(ask.parameters.size());
  }
  for (auto& note :
       notes_on_control(ask.scene, run, ask.assembly.model->description(), gradients.front().end))
    r.notes.push_back(std::move(note));
  return all;
}

double length_of(std::span<const double> v) {
  double sum = 0;
  for (const double a : v) sum = std::hypot(sum, a);
  return sum;
}

std::vector<Slopes> slopes_across(const Asked& ask, const EventRun& run, Ends& ends,
                                  EndSensitivity& r) {
  std::vector<integrators::EventObjective> objectives;
  for (size_t i = 0; i < ask.count; ++i)
    objectives.push_back({.end = ends.of(i).end,
                          .sampled = {},
                          .end_by_time = {},
                          .end_by_parameters = [&, i](double t, std::span<const double> x) {
                            return ends.by_parameters(i, run, t, x);
                          }});
  const auto gradients = integrators::gradients_across_events(
      ask.scene.method, run.phases(), ask.assembly.initial, ask.scene.step, ask.scene.duration,
      objectives, {.memory = ask.request.memory, .stop = ask.request.stop});
  r.failure = gradients.front().remark;
  std::vector<Slopes> all;
  for (size_t i = 0; i < gradients.size() && r.failure.empty(); ++i) {
    const auto& g = gradients[i];
    const double from = length_of(g.start), to = length_of(ends.found(i).by_state);
    Slopes& own = all.emplace_back(Slopes{g.start, {}, from > 0 ? std::log10(from / to) : 0});
    const auto add = [&](const std::string& name) {
      const auto at = std::ranges::find(g.names, name);
      own.parameters.push_back(at == g.names.end() ? 0
                                                   : g.parameters[size_t(at - g.names.begin())]);
    };
    for (const auto& name : ask.parameters) add(name);
    for (const auto& input : run.inputs()) add(input.name);
  }
  return all;
}

}  // namespace

EndSensitivity end_sensitivity(const Scene& given, const SensitivityRequest& request) {
  check_request(request);
  if (!request.by.empty()) return end_differences(given, request);
  const Scene scene = scene_with_slopes(given, "sensitivity", by_differences);
  const Assembly a = assemble(scene);
  std::optional<Steps> steps;
  std::optional<EventRun> events;
  if (scene.events.empty())
    steps = differentiable_steps(scene, a, by_differences);
  else
    events.emplace(scene, a, by_differences, request.stop);

  EndSensitivity r;
  r.title = scene.title;
  r.method = scene.method;
  r.uncertainty = request.uncertainty;
  if (events) r.failure = events->failure();
  if (!r.failure.empty()) return r;
  const Assembly& last = events ? events->last() : a;
  const EndQuantities quantities(events ? events->last_scene() : scene, last);
  for (const auto& name : request.of) quantities.require(name);
  const auto& names = request.of.empty() ? quantities.usual() : request.of;
  const auto parameters = parameters_of(scene, *a.model),
             at_end = parameters_of(scene, *last.model);
  const Inputs inputs(a, parameters);
  r.inputs = inputs.list();
  RunSteps run{steps.value_or(steps_of(scene))};
  if (!events) run = run_steps(scene, a, *steps, request.stop);
  r.step = run.steps.size;
  r.last = run.last();
  r.chosen = run.controlled ? run.count() : 0;
  r.duration = run.steps.duration;
  r.failure = run.taken.remark;
  if (!r.failure.empty()) return r;

  if (parameters.empty()) r.notes.push_back(no_parameters_note(scene, *a.model));
  if (request.of.empty())
    for (const auto& note : quantities.left_out()) r.notes.push_back(note);
  Ends ends(quantities, last.model->description(), names, at_end);
  const Asked ask{scene, a, parameters, request, names.size()};
  const auto slopes =
      events ? slopes_across(ask, *events, ends, r) : slopes_of_run(ask, run, ends, r);
  if (!r.failure.empty()) return r;
  if (events) {
    r.notes.insert(r.notes.end(), events->notes().begin(), events->notes().end());
    r.inputs.insert(r.inputs.end(), events->inputs().begin(), events->inputs().end());
  }
  for (size_t i = 0; i < names.size(); ++i) {
    const EndQuantity& found = ends.found(i);
    const auto own = std::span(slopes[i].parameters).first(parameters.size()),
               of_events = std::span(slopes[i].parameters).subspan(parameters.size());
    std::vector<double> theta(own.begin(), own.end());
    for (size_t k = 0; k < theta.size() && !events; ++k) theta[k] += found.by_parameters[k];
    auto all = inputs.slopes(slopes[i].start, theta);
    all.insert(all.end(), of_events.begin(), of_events.end());
    r.of.push_back(
        {found.name, found.unit, found.value, std::move(all), slopes[i].growth, found.error});
  }
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
