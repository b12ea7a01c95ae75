#include "scene/session/phase_events.h"

#include <cmath>

#include "scene/read/event.h"
#include "scene/run/checkpoint.h"

namespace porthos::scene {
namespace {

bool took_place(const Event& e, double at, const std::optional<EventTimes>& happened) {
  const auto near = [&](double t) { return std::fabs(t - at) <= 1e-9 * at; };
  if (!happened) return near(e.at);
  for (const auto& [event, t] : *happened)
    if (event == text(e) && near(t)) return true;
  return false;
}

}  // namespace

void pass_events(mechanics::MovingMechanism& moving, const Scene& scene,
                 const std::filesystem::path& phase, double end,
                 const std::optional<EventTimes>& happened) {
  pass_events(moving, scene, read_checkpoint(phase / "end").state, end, happened);
}

void pass_events(mechanics::MovingMechanism& moving, const Scene& scene, const phs::State& last,
                 double end, const std::optional<EventTimes>& happened) {
  moving.state = last;
  const auto own = size_t(moving.model->description().nx);  // in orbit the orbit follows
  moving.state.x.resize(own);
  moving.state.lo.resize(own);
  for (Event e : scene.events) {
    if (e.on_latch() || e.on_loop() || !took_place(e, end, happened)) continue;  // no body moves
    e.latch.reach = e.latch.speed = e.latch.rate = HUGE_VAL;
    apply(moving, e);
  }
}

}  // namespace porthos::scene
