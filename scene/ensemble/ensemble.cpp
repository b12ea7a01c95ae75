#include "scene/ensemble/ensemble.h"

#include <algorithm>
#include <mutex>

#include "scene/assemble/contacts.h"
#include "scene/assemble/steps.h"
#include "scene/ensemble/case_run.h"
#include "scene/files/digest.h"
#include "scene/run/phase_sequence.h"
#include "scene/run/watched_run.h"

namespace porthos::scene {
namespace {

integrators::Options method_options(const Scene& s, const phs::Description& d) {
  return {
      .rtol = s.rtol, .port_work = !d.powers.empty(), .iteration_tolerance = s.iteration_tolerance};
}

/// Whether the cases of a scene consist only of steps of one size by one method, so that lanes can
/// take them.
bool is_plain(const Scene& s) {
  return s.events.empty() && s.outputs.empty() && !s.monitor && !s.orbit &&
         s.step_control == integrators::StepControl::fixed && steps_of(s).last == 0 &&
         !switches(s) && std::none_of(s.elements.begin(), s.elements.end(), [](const Element& e) {
           return e.pushes();
         });
}

/// The systems in which a case may end.
std::vector<std::shared_ptr<const phs::Model>> systems_of(const Scene& s, const Assembly& a) {
  if (s.events.empty()) return {a.model};
  return rehearse(s, a);
}

}  // namespace

Ensemble::Ensemble(Scene scene)
    : scene_(std::move(scene)),
      assembly_(assemble(scene_)),
      cases_(read_ensemble(scene_, assembly_)),
      sampler_(cases_),
      state_columns_(systems_of(scene_, assembly_)),
      layout_(size_t(cases_.columns()), state_columns_, scene_.events.size(),
              number_names(scene_.outputs).size(), scene_.stops.size()),
      checks_(scene_),
      // A controller is designed from the start: its motion begins there.
      one_model_(scene_.controllers.empty() &&
                 std::all_of(cases_.quantities.begin(), cases_.quantities.end(),
                             [](const Quantity& q) { return is_of_start(q.key); })),
      in_lanes_(one_model_ && assembly_.model->holds().empty() && is_plain(scene_)) {
  (void)WatchedRun(scene_, assembly_, {}, {});  // refuses a method or a monitor that does not fit
}

NamedTexts Ensemble::identity() const {
  auto texts = fingerprint(scene_);
  if (!cases_.table_text.empty()) texts.emplace_back("table of cases", sha256(cases_.table_text));
  return texts;
}

void Ensemble::work(const std::function<std::int64_t()>& next,
                    const std::function<void(std::span<const double>)>& done,
                    const WorkOptions& o) const {
  std::mutex one_at_a_time;
  const CaseDone put = [&](std::span<const double> row) {
    const std::lock_guard lock(one_at_a_time);
    done(row);
  };
  const auto next_case = [&] {
    const std::lock_guard lock(one_at_a_time);
    return next();
  };
  if (!in_lanes_) return work_alone(next_case, put, o);
  ensemble::simulate_batch(*assembly_.model, scene_.method, scene_.step,
                           [&]() -> std::unique_ptr<ensemble::BatchRun> {
                             const std::int64_t index = next_case();
                             return index < 0 ? nullptr : make_lane_case(*this, index, put);
                           },
                           {.threads = o.threads,
                            .lanes = o.lanes,
                            .method = method_options(scene_, assembly_.model->description()),
                            .stop = o.stop});
}

void Ensemble::work_alone(const std::function<std::int64_t()>& next,
                          const std::function<void(std::span<const double>)>& done,
                          const WorkOptions& o) const {
  ensemble::in_team(o.threads, o.stop, [&](const std::function<bool()>& stopped) {
    while (!stopped()) {
      const std::int64_t index = next();
      if (index < 0) return;
      run_case(*this, index, o.stop, done);
    }
  });
}

}  // namespace porthos::scene
