#include "scene/session/detail/info_facts.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <set>

#include "phs/scalars/pack.h"
#include "scene/assemble/steps.h"
#include "scene/run/from_records.h"
#include "scene/run/phase_sequence.h"
#include "scene/run/watched_run.h"

namespace porthos::scene {
namespace {

using mechanics::Mechanism;
using phs::BlockKind;

const char* name_of(BlockKind k) {
  return k == BlockKind::linear ? "linear" : k == BlockKind::angle ? "angle" : "rotation";
}

struct Merging {
  int links = 0, to_world = 0, to_parent = 0;
};

Merging count_merged(const Mechanism& m) {
  Merging n;
  std::set<int> carried;
  for (const auto& b : m.bodies()) {
    ++n.links;
    if (b.node < 0)
      ++n.to_world;
    else if (!carried.insert(b.node).second)
      ++n.to_parent;
  }
  return n;
}

std::string merged_text(const Mechanism& m) {
  const Merging n = count_merged(m);
  if (n.to_parent + n.to_world == 0) return "none";
  return fmt::format("{} merged into the body that carries them, {} fixed to the world",
                     n.to_parent, n.to_world);
}

template <class Has>
std::string joints_with(const Mechanism& m, Has has) {
  const auto& all = m.joint_properties();
  const auto n = std::count_if(all.begin(), all.end(), has);
  return n ? fmt::format("active in {} joint{}", n, n > 1 ? "s" : "") : "absent";
}

std::string gravity_text(const Scene& s, const Assembly& a) {
  if (s.orbit) return "active, of a planet, with its gradient on every link";
  const auto& g = s.urdf.gravity;
  if (mechanics::norm(g) == 0) return "absent";
  return fmt::format("{}uniform ({}, {}, {}) m/s^2",
                     a.centre ? "on the centre of mass alone, " : "active, ", g.x, g.y, g.z);
}

std::string translation_text(const Scene& s, const Assembly& a) {
  if (a.centre)
    return "none to integrate: the centre of mass moves in closed form, the motion about it is run";
  const std::string why = why_centre_stays(s);
  if (s.urdf.base != mechanics::UrdfOptions::Base::free) return "absent";
  if (s.orbit) return "none to integrate: the orbit of the centre of mass is split off";
  return "integrated with everything else: " + why;
}

std::string coordinates_text(const Assembly& a) {
  const std::string why = a.why_coordinates.empty() ? "" : "; chosen: " + a.why_coordinates;
  return (a.reduced ? "maximal: every body is free, every joint is a loop"
                    : "reduced: those of the joints") +
         why;
}

std::string when_text(const Event& e) {
  if (e.carried) return "from the start";
  if (!e.waits()) return fmt::format("at {:g} s", e.at);
  const std::string after = e.after > 0 ? fmt::format(", not before {:g} s", e.after) : "";
  if (e.within_reach) return "once within its limits" + after;
  return fmt::format("once {} {:g}{}", e.above ? "above" : "below", e.above ? *e.above : *e.below,
                     after);
}

/// Median over batches of the time of one field evaluation [ns].
template <class T>
double nanoseconds_per_evaluation(const Assembly& a) {
  using Clock = std::chrono::steady_clock;
  const phs::Model& model = a.internal();
  const auto system = model.instantiate<T>();
  const auto end = a.initial.x.begin() + model.description().nx;
  std::vector<T> x(a.initial.x.begin(), end), dx(x.size());
  const auto batch = [&](int n) {
    const auto start = Clock::now();
    for (int i = 0; i < n; ++i) system->field(T(0.0), x, {}, dx);
    return std::chrono::duration<double, std::nano>(Clock::now() - start).count();
  };
  int n = 1;
  while (batch(n) < 1e6 && n < (1 << 24)) n *= 2;  // a batch takes a millisecond or more
  std::vector<double> times(31);
  for (double& t : times) t = batch(n) / n;
  std::nth_element(times.begin(), times.begin() + 15, times.end());
  return times[15];
}

}  // namespace

std::string simd_text() {
  return fmt::format("{}, {} numbers at once, multiply-adds {}", phs::simd_name, phs::native_lanes,
                     phs::fuses ? "fused" : "rounded twice");
}

void refuse_as_run(const Scene& scene, const Assembly& assembly) {
  const auto begin = [](const Scene& s, const Assembly& a,
                        const std::vector<integrators::Event>& until) {
    const WatchedRun run(s, a, until, {});
    (void)FromRecords(s, a, run.layout());
  };
  if (scene.events.empty()) return begin(scene, assembly, {});
  (void)rehearse(scene, assembly);
  PhaseSequence phases(scene, assembly);
  if (const Phase* first = phases.next()) begin(first->scene, first->assembly, first->until);
}

std::vector<EventFacts> event_facts(const Scene& s, const Assembly& a) {
  std::vector<EventFacts> list;
  if (s.events.empty()) return list;
  const PhaseSequence start(s, a);
  for (const Event& e : s.events) {
    EventFacts& f = list.emplace_back(EventFacts{text(e), when_text(e)});
    if (e.type != Event::Type::capture || e.carried) continue;
    const auto& l = e.latch;
    const auto there = mechanics::relative_pose(start.moving(), l.link, l.body);
    f.apart = mechanics::norm(there.R * l.on_body + there.r - l.on_link);
    if (std::isfinite(l.reach)) f.reach = l.reach;
  }
  return list;
}

std::vector<StateFacts> state_facts(const Assembly& a) {
  std::vector<StateFacts> list;
  WorldView view(a);
  const phs::State& s = view(0, a.initial);
  const auto part = [&](int at, int size) {
    std::vector<double> numbers(&s.x[size_t(at)], &s.x[size_t(at)] + size);
    for (double& number : numbers) number += 0.0;  // no -0
    return numbers;
  };
  auto turns = s.turns.begin();
  for (const auto& b : a.model->description().blocks) {
    StateFacts one{&b, name_of(b.kind), part(b.at, b.size), {}};
    if (b.kind == BlockKind::angle) one.start[0] += phs::two_pi_hi * double(*turns++);
    if (b.momentum >= 0) one.momentum = part(b.momentum, b.size);
    list.push_back(std::move(one));
  }
  return list;
}

std::optional<ConstraintFacts> constraint_facts(const Assembly& a) {
  const auto system = a.model->instantiate<double>();
  const auto rows = system->constraints();
  if (!rows) return {};
  std::vector<double> g(size_t(rows->count()));
  rows->place(a.initial.x, g);
  ConstraintFacts facts{rows->count(), rows->factor(a.initial.x), 0, {}};
  facts.pivot = rows->smallest_pivot();
  for (const auto& block : a.model->description().constraints) {
    ConstraintFacts::Block one{block.name, block.kind, block.size, 0, true};
    for (int r = block.at; r < block.at + block.size; ++r) {
      one.independent += rows->uses(r);
      one.unique = one.unique && (rows->unique(r) || !rows->uses(r));
    }
    facts.blocks.push_back(one);
  }
  return facts;
}

TextRows plan_rows(const Scene& s, const Assembly& a) {
  const Mechanism& m = *a.mechanism;
  const Steps steps = steps_of(s);
  const std::string last =
      steps.last > 0 ? fmt::format(", the last of {:g} s", steps.last) : std::string();
  return {{"gravity", gravity_text(s, a)},
          {"damping", joints_with(m, [](const auto& j) { return j.damping > 0; })},
          {"springs", joints_with(m, [](const auto& j) { return j.stiffness > 0; })},
          {"translation of the base", translation_text(s, a)},
          {"coordinates", coordinates_text(a)},
          {"links on fixed joints", merged_text(m)},
          {"SIMD", simd_text()},
          {"method", fmt::format("{}, {} steps of {} s{} = {} s", s.method, steps.total, s.step,
                                 last, steps.time(steps.total))},
          {"chosen by", s.choice.empty() ? "the scene" : s.choice},
          {"records", fmt::format("every {} s", double(steps.every) * s.step)}};
}

std::vector<LeftOut> left_out_facts(const Mechanism& m, bool friction) {
  std::vector<LeftOut> list;
  for (const auto& j : m.joint_properties()) {
    const bool turns = j.turn >= 0;
    LeftOut one{j.joint,
                j.lower,
                j.upper,
                friction ? 0 : j.friction,
                turns ? "rad" : "m",
                turns ? "N m" : "N"};
    if (one.lower || one.upper || one.friction > 0) list.push_back(one);
  }
  return list;
}

EvaluationCost evaluation_cost(const Assembly& a) {
  return {nanoseconds_per_evaluation<double>(a), nanoseconds_per_evaluation<phs::Pack8>(a) / 8};
}

}  // namespace porthos::scene
