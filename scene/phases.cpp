#include "scene/phases.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "scene/checkpoint.h"
#include "scene/files.h"
#include "scene/latching.h"
#include "scene/part.h"

namespace porthos::scene {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr double momentum_limit = 1e-14;  // across an event: the rounding of the state behind it

fs::path phase_folder(const RunOptions& o, size_t k) {
  return fs::path(o.out) / fmt::format("phase_{}", k + 1);
}
fs::path end_folder(const fs::path& phase) { return phase / "end"; }

void check(const Scene& s) {
  if (s.step_control != integrators::StepControl::fixed)
    throw InvalidArgument(s.events[0].where +
                          ": events need steps of one size, expected step_control = \"fixed\"");
  for (const Event& e : s.events) {
    if (e.waits()) continue;
    const double steps = e.at / s.step;
    if (!(e.at > 0 && e.at < s.duration))
      throw InvalidArgument(
          fmt::format("{}: the event is at {:g} s, expected a time inside the run, "
                      "between 0 and {:g} s",
                      e.where, e.at, s.duration));
    if (std::fabs(steps - std::round(steps)) > 1e-9 * steps)
      throw InvalidArgument(fmt::format(
          "{}: the event is at {:g} s, {:g} steps of {:g} s, expected a whole number of steps",
          e.where, e.at, steps, s.step));
  }
  if (!s.actuators.empty())
    throw InvalidArgument(s.actuators[0].where + ": actuator '" + s.actuators[0].name +
                          "' has a state of its own, which an event would lose: expected none in a "
                          "scene with events");
  for (const Element& e : s.elements)
    if (e.motor)
      throw InvalidArgument(e.where + ": element '" + e.name +
                            "' has a state of its own, which an event would lose: expected none "
                            "with such a state in a scene with events");
}

/// Where a phase that begins at `from` ends at the latest: at the next event that has a time, or with the run.
double end_after(const Scene& s, double from) {
  double end = s.duration;
  for (const Event& e : s.events)
    if (!e.waits() && e.at > from) end = std::min(end, e.at);
  return end;
}

bool on_ground(const mechanics::MechanismBuilder& parts) {
  const auto& all = parts.bodies();
  return std::any_of(all.begin(), all.end(), [](const mechanics::BodySpec& b) {
    return b.parent == "world" && b.joint.type != "free";
  });
}

double size(const mechanics::Vec3d& a) { return std::hypot(a.x, a.y, a.z); }

/// The errors and books of all phases in one report.
class Whole {
 public:
  explicit Whole(const Scene& s) { r_.title = s.title, r_.method = s.method, r_.step_s = s.step; }

  void add(const RunReport& p, double from) {
    const bool first = r_.records == 0;
    r_.records += p.records, r_.looks += p.looks, r_.steps = p.steps,
                                                  r_.simulated_s = p.simulated_s;
    r_.cpu_s += p.cpu_s, r_.wall_s += p.wall_s;
    r_.cost.steps += p.cost.steps, r_.cost.evaluations += p.cost.evaluations;
    r_.cost.sweeps += p.cost.sweeps;
    EnergyReport& e = r_.energy;
    if (first) e = p.energy;
    e.scale_J = std::max(e.scale_J, p.energy.scale_J);
    for (const auto& [name, joule] : p.energy.scale_parts) most(e.scale_parts, name, joule);
    e.max_abs_error_J = std::max(e.max_abs_error_J, p.energy.max_abs_error_J);
    for (const auto at : {&EnergyReport::max_rel_error, &EnergyReport::rms_rel_error,
                          &EnergyReport::growth_exponent})
      e.*at = std::fmax(e.*at, p.energy.*at);  // not a number: too few records to tell
    if (std::fabs(p.energy.drift_per_s) > std::fabs(e.drift_per_s))
      e.drift_per_s = p.energy.drift_per_s;
    e.drift_is_significant |= p.energy.drift_is_significant;
    for (const auto at : {&RunReport::linear_momentum_error, &RunReport::angular_momentum_error,
                          &RunReport::quaternion_norm_error})
      r_.*at = std::max(r_.*at, p.*at);
    for (const auto at : {&RunReport::stored_J, &RunReport::supplied_J, &RunReport::dissipated_J,
                          &RunReport::defect_J, &RunReport::turned_over_J})
      r_.*at += p.*at;
    for (const auto list : {&RunReport::storages, &RunReport::ports, &RunReport::losses})
      for (const auto& [name, joule] : p.*list) book(r_.*list, name, joule);
    for (const MomentumRow& m : p.momentum) hold(m);
    Impulses& given = r_.impulses;
    for (const ImpulseRow& row : p.impulses.rows) {
      auto known = std::find_if(given.rows.begin(), given.rows.end(),
                                [&](const ImpulseRow& k) { return k.name == row.name; });
      if (known == given.rows.end()) {
        given.rows.push_back(row);
        continue;
      }
      for (size_t c = 0; c < 3; ++c)
        known->impulse[c] += row.impulse[c], known->angular[c] += row.angular[c];
      known->on_s += row.on_s, known->propellant_kg += row.propellant_kg;
    }
    given.linear_left = std::max(given.linear_left, p.impulses.linear_left);
    given.angular_left = std::max(given.angular_left, p.impulses.angular_left);
    for (const Check& c : p.checks) worst(c);
    for (const NotApplicable& n : p.not_applicable) cannot(n);
    for (const auto& n : p.notes) r_.notes.push_back(fmt::format("from {:g} s: {}", from, n));
    r_.outcome = p.outcome, r_.interrupted = p.interrupted, r_.trouble = p.trouble;
    if (p.space && r_.space)
      space::append(*r_.space, *p.space);
    else if (p.space)
      r_.space = p.space;
  }
  /// Momenta across an event are those of everything that moves: no invariant where the ground takes a part.
  void add(const Event& e, const mechanics::Impact& i, bool on_ground) {
    book(r_.losses, text(e), i.dissipated_J);
    r_.stored_J -= i.dissipated_J, r_.dissipated_J += i.dissipated_J;
    r_.turned_over_J += i.dissipated_J;
    if (on_ground)
      return cannot(
          {"momentum_across_events", "the model stands on the ground, which takes a part"});
    const auto relative = [](double jump, double of) { return of > 0 ? jump / of : jump; };
    const double jump =
        std::max(relative(i.linear_jump, std::max(size(i.momentum.linear), i.scale.linear)),
                 relative(i.angular_jump, std::max(size(i.momentum.angular), i.scale.angular)));
    worst({"momentum_across_events", jump, momentum_limit, jump <= momentum_limit, false});
  }
  RunReport& report() { return r_; }

 private:
  static void book(RunReport::Named& list, const std::string& name, double joule) {
    for (auto& [known, sum] : list)
      if (known == name) return void(sum += joule);
    list.emplace_back(name, joule);
  }
  static void most(RunReport::Named& list, const std::string& name, double joule) {
    for (auto& [known, largest] : list)
      if (known == name) return void(largest = std::max(largest, joule));
    list.emplace_back(name, joule);
  }
  /// A wheel that is locked keeps its last row.
  void hold(const MomentumRow& m) {
    for (MomentumRow& known : r_.momentum)
      if (known.name == m.name) {
        known.end = m.end, known.largest = std::max(known.largest, m.largest);
        return;
      }
    r_.momentum.push_back(m);
  }
  /// A check of one phase is one of the run; what no phase can check is listed.
  void cannot(const NotApplicable& n) {
    const auto same = [&](const auto& known) { return known.name == n.name; };
    if (std::none_of(r_.checks.begin(), r_.checks.end(), same) &&
        std::none_of(r_.not_applicable.begin(), r_.not_applicable.end(), same))
      r_.not_applicable.push_back(n);
  }
  void worst(const Check& c) {
    std::erase_if(r_.not_applicable, [&](const auto& n) { return n.name == c.name; });
    for (Check& known : r_.checks)
      if (known.name == c.name) {
        known.pass &= c.pass;
        known.telling |= c.telling;
        if (!(c.value <= known.value)) known.value = c.value;
        return;
      }
    r_.checks.push_back(c);
  }
  RunReport r_;
};

Json json_of(const Event& e, double at, const mechanics::Impact& i,
             const std::optional<CentreOfMass>& centre) {
  const auto [P, L] = centre ? centre->in_world(at, i.momentum) : i.momentum;
  return {{"at_s", at},
          {"event", text(e)},
          {"dissipated_J", i.dissipated_J},
          {"linear_momentum", {P.x, P.y, P.z}},
          {"angular_momentum", {L.x, L.y, L.z}},
          {"linear_momentum_jump", i.linear_jump},
          {"angular_momentum_jump", i.angular_jump},
          {"largest_twist_jump", i.rate_jump}};
}

RunReport::Named named(const Json& j) {
  RunReport::Named list;
  for (const auto& [name, joule] : j.items()) list.emplace_back(name, joule.get<double>());
  return list;
}
double number(const Json& j) { return j.is_number() ? j.get<double>() : NAN; }

space::LedgerReport read_ledger(const Json& j, const char* name) {
  const Json& l = j[name];
  return {name,
          number(l["initial_J"]),
          number(l["change_J"]),
          number(l["defect_J"]),
          number(l["largest_defect_J"]),
          number(l["scale_J"]),
          number(l["turned_over_J"]),
          named(l["works_J"])};
}
space::SpaceReport read_space(const Json& j) {
  space::SpaceReport s;
  s.orbital = read_ledger(j, "orbital"), s.coupling = read_ledger(j, "coupling");
  s.harmonics = read_ledger(j, "harmonics");
  const Json& L = j["angular_momentum"];
  s.angular_momentum = number(L["largest_kg_m2_s"]);
  s.angular_impulse = number(L["gradient_impulse_kg_m2_s"]);
  s.angular_defect = number(L["largest_relative_defect"]);
  s.next_order = number(j["neglected_next_order"]);
  return s;
}

/// The report of a phase as its summary tells it.
RunReport read_report(const fs::path& folder, const phs::State& end) {
  const Json j = Json::parse(read_file(folder / "summary.json"));
  RunReport r;
  r.steps = j["steps"], r.records = j["records"], r.simulated_s = number(j["simulated_s"]);
  r.cpu_s = number(j["cpu_s"]), r.wall_s = number(j["wall_s"]);
  r.cost.evaluations = j["evaluations"], r.cost.steps = r.steps;
  r.cost.sweeps = std::llround(number(j["sweeps_per_step"]) * double(r.steps));
  const Json &e = j["energy"], &b = j["balance"];
  r.energy = {number(e["initial_J"]),       number(e["scale_J"]),
              number(e["max_abs_error_J"]), number(e["max_rel_error"]),
              number(e["rms_rel_error"]),   number(e["growth_exponent"]),
              number(e["drift_per_s"]),     e["drift_is_significant"].get<bool>(),
              named(e["scale_parts_J"])};
  r.looks = j["looks"];
  r.linear_momentum_error = number(j["linear_momentum"]["max_rel_error"]);
  r.angular_momentum_error = number(j["angular_momentum"]["max_rel_error"]);
  r.quaternion_norm_error = number(j["quaternion_norm"]["max_error"]);
  r.stored_J = number(b["stored_J"]), r.supplied_J = number(b["supplied_J"]);
  r.dissipated_J = number(b["dissipated_J"]), r.defect_J = number(b["defect_J"]);
  r.turned_over_J = number(b["turned_over_J"]);
  r.storages = named(b["storages"]), r.ports = named(b["ports"]), r.losses = named(b["losses"]);
  for (const auto& c : j["checks"])
    r.checks.push_back(
        {c["name"], number(c["value"]), number(c["limit"]), c["pass"], c["telling"]});
  for (const auto& n : j["not_applicable"]) r.not_applicable.push_back({n["name"], n["why"]});
  for (const auto& n : j["notes"]) r.notes.push_back(n);
  if (j.contains("momentum"))
    for (const auto& [name, m] : j["momentum"].items())
      r.momentum.push_back(
          {name, number(m["start_Nms"]), number(m["end_Nms"]), number(m["largest_Nms"])});
  if (j.contains("ledgers")) r.space = read_space(j["ledgers"]);
  if (j.contains("impulses")) {
    for (const auto& [name, i] : j["impulses"].items()) {
      ImpulseRow row{.name = name, .type = i["type"]};
      row.angular = i["angular_impulse_Nms"].get<std::array<double, 3>>();
      if (i.contains("impulse_Ns")) {
        row.impulse = i["impulse_Ns"].get<std::array<double, 3>>();
        row.on_s = i["on_s"], row.propellant_kg = i["propellant_kg"];
      }
      r.impulses.rows.push_back(row);
    }
    if (j.contains("momentum_less_impulses"))
      r.impulses.linear_left = number(j["momentum_less_impulses"]["linear"]),
      r.impulses.angular_left = number(j["momentum_less_impulses"]["angular"]);
  }
  r.final_state = end;
  return r;
}

/// The scene of a phase: what acts at joints that are locked rests with them, and so does a torquer whose wheels are all
/// locked: there is no momentum left to unload.
Scene phase_of(const Scene& scene, const mechanics::Moving& moving, const Latching& latching,
               double end) {
  Scene s = scene;
  s.events.clear();
  s.duration = end;
  std::erase_if(s.elements, [&](const Element& e) { return moving.locked.count(e.joint) > 0; });
  if (std::none_of(s.elements.begin(), s.elements.end(), [](auto& e) { return e.wheel_gain; }))
    std::erase_if(s.elements, [](const Element& e) { return e.torquer && e.torquer->unload > 0; });
  latching.apply_to(s);
  return s;
}

Assembly assembly_of_phase(const Scene& scene, const Assembly& whole,
                           const mechanics::Moving& moving) {
  Assembly a = whole;
  a.mechanical = moving.model;
  a.mechanism =
      std::shared_ptr<const mechanics::Mechanism>(moving.model, &moving.model->mechanism());
  a.model = with_joint_parts(moving.model, scene);
  a.initial = moving.state;
  a.parts = moving.parts;
  return a;
}

/// A mechanism between phases, whose centre of mass moves apart from it: the state of its motion about that, which the
/// events change, and in orbit the orbit of that, which they do not.
class InOrbit {
 public:
  explicit InOrbit(const Assembly& a)
      : there_(a.spacecraft != nullptr), apart_(a.centre.has_value()) {}

  /// Takes the orbit off a state.
  void part(phs::State& s) {
    if (!there_) return;
    x_.assign(s.x.end() - 6, s.x.end()), lo_.assign(s.lo.end() - 6, s.lo.end());
    s.x.resize(s.x.size() - 6), s.lo.resize(s.lo.size() - 6);
  }
  /// The assembly of a phase with its orbit.
  void join(Assembly& a, const Scene& scene) const {
    if (!there_) return;
    try {
      a.spacecraft = std::make_shared<const space::Spacecraft>(
          a.mechanical, a.model, scene.orbit->environment, orbit_parts_of(scene));
    } catch (const InvalidArgument& e) {
      throw InvalidArgument(scene.orbit->where + ": " + e.what());
    }
    a.model = a.spacecraft;
    join(a.initial);
  }
  void join(phs::State& s) const {
    if (!there_) return;
    s.x.insert(s.x.end(), x_.begin(), x_.end()), s.lo.insert(s.lo.end(), lo_.begin(), lo_.end());
  }
  /// Leaves no rounding in the linear momentum, which is zero about the centre of mass.
  void still(mechanics::Moving& m) const {
    if (there_ || apart_) settle_momentum(m.model->mechanism(), m.state);
  }

 private:
  bool there_, apart_;
  std::vector<double> x_, lo_;
};

Assembly assembly_of_phase(const Scene& phase, const Assembly& whole,
                           const mechanics::Moving& moving, const InOrbit& orbit) {
  Assembly a = assembly_of_phase(phase, whole, moving);
  orbit.join(a, phase);
  return a;
}

mechanics::Impact apply_one(const Scene& scene, const Event& e, mechanics::Moving& moving,
                            Latching& latching, const InOrbit& orbit) {
  const bool soft = e.type == Event::Type::engage || e.type == Event::Type::disengage;
  const auto impact = soft ? latching.change(scene, moving, e) : apply(moving, e);
  orbit.still(moving);
  return impact;
}

/// All phases assembled before the first one runs, so that an event that cannot be ends no run half way. What depends on the
/// motion is left out: positions and rates are those of the start, limits of latches do not count, and an event that waits
/// comes as early as it may.
void rehearse(const Scene& scene, const Assembly& assembly, mechanics::Moving moving,
              const InOrbit& orbit) {
  Latching latching(scene);
  std::vector<Event> events = scene.events;
  for (Event& e : events) {
    if (e.waits()) e.at = e.after;
    e.latch.reach = e.latch.speed = e.latch.rate = HUGE_VAL;
  }
  std::stable_sort(events.begin(), events.end(),
                   [](const Event& a, const Event& b) { return a.at < b.at; });
  for (size_t i = 0; i < events.size(); ++i) {
    const Event& e = events[i];
    if (e.waits()) (void)Latching::margin(scene, moving, moving.state, 0, e);  // refuses names
    apply_one(scene, e, moving, latching, orbit);
    if (i + 1 < events.size() && events[i + 1].at == e.at && !e.waits()) continue;
    const Scene phase = phase_of(scene, moving, latching, scene.duration);
    try {
      const Assembly a = assembly_of_phase(phase, assembly, moving, orbit);
      (void)make_integrator(phase, *a.model, phase.step);
    } catch (const InvalidArgument& why) {
      throw InvalidArgument(fmt::format("{}: after the {}: {}", e.where, text(e), why.what()));
    }
  }
}

/// The outputs of sampled controllers, which an event between two instants leaves as they are. One whose joint was locked
/// in between begins anew, at its next instant.
class Held {
 public:
  void keep(const phs::Model& model, std::span<const double> memory) {
    values_.clear();
    for (const auto& hold : model.holds()) {
      if (memory.size() < hold->memory.size())
        require_size("memory of the sampled controllers", memory.size(), hold->memory.size());
      const auto own = memory.first(hold->memory.size());
      values_[hold->name].assign(own.begin(), own.end());
      memory = memory.subspan(own.size());
    }
  }
  /// As the start of the next phase, whose model has holds of its own.
  void put_in(const phs::Model& model) const {
    for (const auto& hold : model.holds())
      if (const auto known = values_.find(hold->name); known != values_.end())
        hold->fresh = known->second;
  }

 private:
  std::map<std::string, std::vector<double>> values_;
};

/// Whether the folders hold an unfinished run; finished ones of an earlier run make room.
void make_room(const RunOptions& o) {
  const bool finished = fs::exists(fs::path(o.out) / "summary.json");
  for (size_t k = 0; fs::exists(phase_folder(o, k)); ++k)
    if (!finished && (has_checkpoint(phase_folder(o, k) / "checkpoint") ||
                      has_checkpoint(end_folder(phase_folder(o, k)))))
      throw InvalidArgument(fmt::format(
          "{} holds an unfinished run: use --resume to continue it, or remove the folder", o.out));
  std::error_code ignored;
  for (size_t k = 0; fs::exists(phase_folder(o, k)); ++k)
    fs::remove_all(phase_folder(o, k), ignored);
  fs::remove(fs::path(o.out) / "summary.json", ignored);
}

}  // namespace

RunReport run_phases(const Scene& scene, const Assembly& assembly, const RunOptions& options) {
  check(scene);
  mechanics::Moving moving(assembly.parts);
  moving.model = assembly.mechanical, moving.state = assembly.initial;
  InOrbit orbit(assembly);
  Held held;
  orbit.part(moving.state);
  rehearse(scene, assembly, moving, orbit);
  Latching latching(scene);
  std::vector<const Event*> waiting;
  for (const Event& e : scene.events)
    if (e.waits()) waiting.push_back(&e);
  make_folder(options.out);
  if (!options.resume) make_room(options);

  Whole whole(scene);
  Json events = Json::array(), folders = Json::array();
  Assembly last = assembly;
  const auto write_summary = [&] {
    const RunReport& r = whole.report();
    Json summary = Json::parse(summary_json(scene, last, r, r.final_state));
    summary["events"] = events, summary["phases"] = folders;
    const fs::path path = fs::path(options.out) / "summary.json";
    write_aside(path, summary.dump(2, ' ', false, Json::error_handler_t::replace) + "\n");
    put_in_place(path);
  };
  double from = 0;
  const auto happens = [&](const Event* e) {
    return Latching::margin(scene, moving, moving.state, from, *e) >= 0;
  };
  const auto happen = [&](const Event* e) {
    std::erase(waiting, e);
    Event now = *e;
    if (e->waits()) now.at = from, now.latch.reach = now.latch.speed = now.latch.rate = HUGE_VAL;
    const auto impact = apply_one(scene, now, moving, latching, orbit);
    whole.add(*e, impact, on_ground(moving.parts));
    events.push_back(json_of(*e, from, impact, assembly.centre));
  };
  const auto happen_at_once = [&] {  // what a start or another event has brought about
    for (;;) {
      const auto e = std::find_if(waiting.begin(), waiting.end(), happens);
      if (e == waiting.end()) return;
      happen(*e);
    }
  };
  happen_at_once();
  size_t k = 0;
  for (bool more = true; more; ++k) {
    double end = end_after(scene, from);
    const fs::path folder = phase_folder(options, k);
    const Scene s = phase_of(scene, moving, latching, end);
    last = assembly_of_phase(s, assembly, moving, orbit);
    held.put_in(*last.model);
    RunReport r;
    phs::State watched(moving.model->description(), moving.state.x);
    if (options.resume && has_checkpoint(end_folder(folder))) {
      const Checkpoint done = read_checkpoint(end_folder(folder));
      if (const auto changes = difference(done.fingerprint, fingerprint(s)); !changes.empty())
        throw InvalidArgument(
            fmt::format("the phase in {} is of another run: {}", folder.string(), changes));
      r = read_report(folder, done.state);
      r.held = done.memory, r.until = int(done.statistics.at(0));
    } else {
      RunOptions o = options;
      o.out = folder.string();
      o.resume = options.resume && has_checkpoint(folder / "checkpoint");
      for (const Event* e : waiting)
        o.until.push_back({[&, e](double t, std::span<const double> x) {
                             std::copy_n(x.begin(), watched.x.size(), watched.x.begin());
                             return Latching::margin(scene, moving, watched, t, *e);
                           },
                           integrators::Crossing::rising});
      if (options.progress)
        o.progress = [&](double done, double spent, double left) {
          const double now = (from + done * (end - from)) / scene.duration;
          options.progress(
              now, spent,
              now > 0 && done > 0 ? left + spent * (1 - end / scene.duration) / now : left);
        };
      r = run(s, last, o);
      if (r.interrupted || r.outcome != integrators::Outcome::ok) {
        whole.add(r, from);
        whole.report().final_state = r.final_state, whole.report().phases = int(k) + 1;
        if (!r.interrupted) write_summary();
        return whole.report();
      }
      make_folder(end_folder(folder));
      Checkpoint c;
      c.state = r.final_state, c.memory = r.held, c.fingerprint = fingerprint(s);
      c.statistics = {double(r.until)};
      write_checkpoint(end_folder(folder), c);
    }
    whole.add(r, from);
    held.keep(*last.model, r.held);
    const Event* met = r.until < 0 ? nullptr : waiting.at(size_t(r.until));
    if (met) end = std::min(end, r.final_state.time(scene.step));
    folders.push_back({{"folder", folder.filename().string()}, {"from_s", from}, {"to_s", end}});
    moving.state = r.final_state;
    orbit.part(moving.state);
    from = end;
    more = met || end < scene.duration;
    std::vector<const Event*> due;
    for (const Event& e : scene.events)
      if (e.waits() ? &e == met || (std::count(waiting.begin(), waiting.end(), &e) && happens(&e))
                    : e.at == end)
        due.push_back(&e);
    for (const Event* e : due) happen(e);
    happen_at_once();
  }
  orbit.join(moving.state);
  RunReport& r = whole.report();
  for (const Event* e : waiting) r.notes.push_back("it never happened: " + text(*e));
  if (std::any_of(scene.events.begin(), scene.events.end(), [](auto& e) { return e.waits(); }))
    r.checks.push_back(
        {"events that never happened", double(waiting.size()), 0, waiting.empty(), false});
  r.final_state = moving.state, r.phases = int(k);
  write_summary();
  return r;
}

}  // namespace porthos::scene
