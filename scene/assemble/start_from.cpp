#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>

#include "mechanics/reconfiguration.h"
#include "scene/assemble/assembly.h"
#include "scene/assemble/detail/start.h"
#include "scene/files/hdf5_file.h"
#include "scene/read/scene_texts.h"

namespace porthos::scene {

FromRecord numbers_of(const StartFrom& from, const phs::Description& d, int mechanical) {
  FromRecord r;
  r.state = phs::State(d, std::vector<double>(size_t(d.nx), 0.0));
  r.known.assign(size_t(d.nx), false);
  std::vector<std::string> missing;
  size_t angle = 0;
  const auto put = [&](const auto& group, const phs::Block& b, int at) {
    const auto own = group.find(link_name(b.name));
    if (own == group.end() || own->second.x.size() != size_t(b.size)) {
      if (at < mechanical) missing.push_back(b.name);
      return;
    }
    for (int k = 0; k < b.size; ++k) {
      const auto i = size_t(at + k);
      r.state.x[i] = own->second.x[size_t(k)];
      r.state.lo[i] = own->second.low[size_t(k)];
      r.known[i] = true;
    }
  };
  for (const auto& b : d.blocks) {
    put(from.state, b, b.at);
    if (b.momentum >= 0) put(from.momentum, b, b.momentum);
    if (b.kind != phs::BlockKind::angle) continue;
    if (const auto n = from.turns.find(b.name); n != from.turns.end())
      r.state.turns[angle] = n->second;
    ++angle;
  }
  for (const auto& [name, numbers] : from.state)
    if (!from.joined.locked.contains(name) &&
        std::ranges::none_of(
            d.blocks, [&, &own = name](const phs::Block& b) { return link_name(b.name) == own; }))
      r.left_over.push_back(name);
  if (!missing.empty())
    throw InvalidArgument(
        fmt::format("{}: the run in {} does not have the states of this model: {} are missing",
                    from.where, from.folder, fmt::join(missing, ", ")));
  return r;
}

namespace {

void require_bodies(const StartFrom& from, const mechanics::MechanismBuilder& parts) {
  for (const auto& h : from.joined.holds)
    for (const std::string& name : {h.body, h.link})
      if (!name.empty() && std::ranges::none_of(parts.bodies(), [&](const mechanics::BodySpec& b) {
            return b.name == name;
          }))
        throw InvalidArgument(fmt::format(
            "{}: at {:g} s of the run in {} '{}' holds '{}', and this scene has no '{}', expected "
            "the same bodies and robots",
            from.where, from.time, from.folder, h.link, h.body, name));
}

/// One captive may hang on another: after as many passes as there are captives all are in place.
void place_captives(mechanics::MovingMechanism& m, const Joined& joined) {
  for (size_t pass = 0; pass < joined.holds.size(); ++pass)
    for (const auto& h : joined.holds)
      if (h.joint.empty()) mechanics::move_with(m, h.link, h.body, h.pose);
}

}  // namespace

Start taken_apart(const StartFrom& from, const mechanics::MechanismBuilder& parts) {
  require_bodies(from, parts);
  mechanics::MovingMechanism apart(parts);
  const auto& m = apart.model->mechanism();
  const auto known = numbers_of(from, apart.model->description(), 0);
  Start s{m.neutral(), std::vector<double>(size_t(m.nv()), 0.0)};
  for (size_t i = 0; i < s.q.size(); ++i)
    if (known.known[i]) s.q[i] = known.state.x[i];
  apart.set(s.q, s.v);
  place_captives(apart, from.joined);
  // The record's momenta are those of the mechanism as joined, which has its rates.
  mechanics::MovingMechanism joined = apart;
  for (const Event& e : carried_events(from)) apply(joined, e);
  const auto& one = joined.model->mechanism();
  const auto record = numbers_of(from, joined.model->description(), 2 * one.nq());
  const auto rates = joined.model->rates(record.state.x, record.state.turns);
  std::copy_n(apart.state.x.begin(), s.q.size(), s.q.begin());
  for (const auto& c : m.coordinates())
    for (const auto& of : one.coordinates())
      if (of.name == c.name && of.nv == c.nv)
        std::copy_n(rates.begin() + of.v, c.nv, s.v.begin() + c.v);
  apart.set(s.q, s.v);
  place_captives(apart, from.joined);
  std::copy_n(apart.state.x.begin(), s.q.size(), s.q.begin());
  s.v = apart.model->rates(apart.state.x, apart.state.turns);
  return s;
}

void put_exactly(const FromRecord& from, phs::State& s) {
  for (size_t i = 0; i < s.x.size(); ++i) {
    if (!from.known[i]) continue;
    s.x[i] = from.state.x[i];
    s.lo[i] = from.state.lo[i];
  }
  s.turns = from.state.turns;
}

namespace {

/// The scene of the run of a record; none of an older version, or where its files are gone.
std::optional<Scene> scene_before(const StartFrom& from) {
  if (from.scene_text.empty()) return {};
  try {
    return read_scene_again((std::filesystem::path(from.folder) / "scene.toml").string(),
                            {from.scene_text, from.model_text, input_files(from.files_text)});
  } catch (const InvalidArgument&) {
    return {};
  }
}

/// What goes on in orbit, and which forces the other run had besides.
std::string note_of_orbit(const StartFrom& from, const OrbitScene& orbit) {
  const auto own = space::forces_of(orbit.environment);
  std::string on = "orbit";
  for (const char* moving : {"the Sun", "the Moon", "the dipole"})
    if (std::ranges::count(own, moving)) on += std::string(", ") + moving;
  std::string note = fmt::format("; {} go on from there, whatever start [orbit] states", on);
  if (on == "orbit") note = "; the orbit goes on from there, whatever start [orbit] states";
  if (!orbit.epoch.empty()) note += fmt::format(", {:.9g} s after the epoch", from.elapsed);
  const auto list = [](const std::vector<std::string>& of, const std::vector<std::string>& not_in) {
    std::vector<std::string> rest;
    std::ranges::copy_if(of, std::back_inserter(rest),
                         [&](const auto& name) { return !std::ranges::count(not_in, name); });
    return rest;
  };
  if (const auto before = scene_before(from); before && before->orbit) {
    const auto &was = before->orbit->environment.planet, &is = orbit.environment.planet;
    if (was.mu != is.mu || was.radius != is.radius)
      note += fmt::format(
          "; that run's planet has mu {:.10g} m^3/s^2 and radius {:.10g} m, this scene's {:.10g} "
          "and {:.10g}",
          was.mu, was.radius, is.mu, is.radius);
  }
  if (!from.epoch) return note;
  if (const auto lost = list(from.forces, own); !lost.empty())
    note += fmt::format("; that run had {}, and this scene has not", fmt::join(lost, ", "));
  if (const auto more = list(own, from.forces); !more.empty())
    note += fmt::format("; this scene has {}, and that run had not", fmt::join(more, ", "));
  return note;
}

/// The bodies that have other masses or inertias than in that run; empty where that cannot be told.
std::string heavier_or_lighter(const StartFrom& from, const mechanics::MechanismBuilder& parts) {
  std::string names;
  const auto scene = scene_before(from);
  if (!scene) return names;
  try {
    const auto numbers = [](const mechanics::BodySpec& b) {
      const auto I = mechanics::rotated(b.mass.axes, b.mass.inertia);
      const auto& c = b.mass.com;
      return std::array{b.mass.mass, c.x, c.y, c.z, I.xx, I.xy, I.xz, I.yy, I.yz, I.zz};
    };
    const Assembly before = assemble(*scene);
    for (const auto& b : before.parts.bodies()) {
      const auto own = std::ranges::find(parts.bodies(), b.name, &mechanics::BodySpec::name);
      if (own == parts.bodies().end()) continue;
      const auto was = numbers(b), is = numbers(*own);
      const bool same = std::ranges::equal(was, is, [](double x, double y) {
        return std::fabs(x - y) <= 1e-9 * std::fmax(std::fabs(x), std::fabs(y));
      });
      if (!same) add_to_list(names, "'" + b.name + "'");
    }
  } catch (const InvalidArgument&) {  // of another version, or it names files that are gone
  }
  return names;
}

}  // namespace

std::string note_of(const StartFrom& from, const FromRecord& record,
                    const std::array<double, 2>& own, const OrbitScene* orbit,
                    const mechanics::MechanismBuilder& parts) {
  std::string note =
      fmt::format("the start is the record at {:.17g} s of {}{}", from.time, from.folder,
                  from.low_words ? "" : ", whose low words were not recorded");
  if (from.failed) note += "; that run FAILED, as its summary says";
  for (const Event& e : carried_events(from)) note += fmt::format("; the {} holds", text(e));
  for (const std::string& other : from.joined.others)
    note += fmt::format("; the {} of that run is not continued: this scene states its own", other);
  if (orbit) note += note_of_orbit(from, *orbit);
  if (!record.left_over.empty()) {
    const std::string lost = fmt::format("states of the record that this scene has not: {}",
                                         fmt::join(record.left_over, ", "));
    if (orbit)
      throw InvalidArgument(fmt::format(
          "{}: {}; in orbit places count from the common centre of mass: expected the same bodies",
          from.where, lost));
    return note + "; " + lost;
  }
  if (const auto names = heavier_or_lighter(from, parts); !names.empty())
    return note +
           fmt::format(
               ". Rates jump: momenta are continued, and the masses or inertias of {} are not "
               "those of that run; expected its model, mass_factor and inertia",
               names);
  const auto other = [&](double energy) {
    return std::fabs(energy - *from.kinetic) > 1e-6 * std::fmax(energy, *from.kinetic);
  };
  if (from.kinetic && std::ranges::all_of(own, other))
    note += fmt::format(
        ". Its rates jump: its kinetic energy was {:.6g} J and is {:.6g} J by the masses of this "
        "scene, as momenta are continued; expected the model, mass_factor and inertia of that run",
        *from.kinetic, own[0]);
  return note;
}

}  // namespace porthos::scene
