#include "scene/read/controller.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "mechanics/mechanical_model.h"
#include "scene/files/files.h"
#include "scene/read/controllers/controller_type.h"
#include "scene/read/scene.h"
#include "scene/read/toml_table-inl.h"

namespace porthos::scene {
namespace {

/// A law that sees the mechanism's state without what parts of the scene add to it.
phs::LawPtr of_mechanism(phs::LawPtr law, size_t nx) {
  return phs::law(
      [law = std::move(law), nx](auto t, auto x, auto y, auto u) { (*law)(t, x.first(nx), y, u); });
}

/// A law with a memory, or laws of ports behind sensors.
void add_sampled(phs::Network& n, const Controller& c, ControllerDesign made,
                 const std::shared_ptr<const mechanics::MechanicalModel>& model,
                 std::uint64_t of_case) {
  auto law = std::move(made.sampled);
  const bool of_ports = !law;
  size_t numbers = made.ports.size();
  if (of_ports) {
    for (const auto& l : made.laws) {
      made.ports.push_back(l.port);
      const auto& ports = model->description().ports;
      numbers += size_t(find_named(ports, l.port, "there is no port").size);
    }
    for (const auto& k : model->mechanism().coordinates())
      if (k.nv == 1) made.joints.push_back({k.name, size_t(k.q), size_t(k.v)});
    law = sampled_port_laws(std::move(made.laws), model);
  }
  if (c.sensing.any())
    law = sensed(std::move(law), c.sensing, 1 / c.rate, numbers, std::move(made.joints),
                 {c.name, of_case}, of_ports ? model : nullptr);
  for (auto& port : made.ports) port = "mechanism." + port;
  n.control(c.name, made.ports, std::move(law), 1 / c.rate);
}

LawFile read_law_file(const Table& t, const char* key, const std::string& folder) {
  LawFile f;
  f.name = t.text(key, "the name of a file");
  // "law.py:Law" names a class in the file.
  const size_t colon = f.name.rfind(".py:");
  const std::string file = colon == f.name.npos ? f.name : f.name.substr(0, colon + 3);
  f.path = std::filesystem::absolute(std::filesystem::path(folder) / file).string();
  at_line(t.at(key), [&] { f.text = read_file(f.path); });
  return f;
}

}  // namespace

std::vector<Controller> read_controllers(const Table& scene, const std::string& folder) {
  std::vector<Controller> list;
  scene.each_of("controller", "type", [&](const std::string& word, const Table& t) {
    Controller c;
    c.type = word;
    c.where = t.where();
    c.name = t.text("name", "the name of its row in the ledger");
    if (t.has("rate")) c.rate = t.positive("rate");
    for (const auto& other : list)
      if (other.name == c.name)
        t.fail("name", fmt::format("\"{}\" is that of another controller, expected one of its own",
                                   c.name));
    const auto& types = controller_types();
    const auto type = std::find_if(types.begin(), types.end(),
                                   [&](const ControllerType& k) { return k.name == word; });
    if (type->always_sampled) t.require("rate", "the sampling instants per second in Hz");
    if (!type->file_key.empty()) c.file = read_law_file(t, type->file_key.c_str(), folder);
    c.sensing = read_sensing(t);
    type->read(t, c);
    list.push_back(std::move(c));
  });
  return list;
}

std::vector<energy_shaping::Certificate> add_controllers(
    phs::Network& n, const std::shared_ptr<const mechanics::MechanicalModel>& model,
    const Scene& scene) {
  std::vector<energy_shaping::Certificate> certificates;
  const auto nx = size_t(model->description().nx);
  for (const Controller& c : scene.controllers)
    at_line(c.where, [&] {
      const bool of_the_user = !c.file.name.empty();
      if (!of_the_user)  // whose conditions are those of trees
        phs::refuse_constraints(model->description(), "controller '" + c.name + "'");
      auto made = c.design(c, {model, scene});
      certificates.push_back(std::move(made.certificate));
      if (made.sampled || c.sensing.any())
        return add_sampled(n, c, std::move(made), model, scene.of_case);
      for (auto& l : made.laws) l.law = of_mechanism(std::move(l.law), nx);
      phs::Network::Control how;
      if (c.rate > 0) how.period = 1 / c.rate;
      energy_shaping::control(n, c.name, "mechanism", made.laws, how);
    });
  return certificates;
}

ControlledJoint controlled_joint(const mechanics::MechanicalModel& model, const Controller& c,
                                 const std::string& joint) {
  const std::string member = "mechanism.";
  const JointPlace at = joint_place(model, c.where, "controller '" + c.name + "'", joint);
  return {size_t(at.q), at.port.substr(member.size())};
}

std::array<double, 4> read_attitude(const Table& t, const char* key) {
  if (!t.has(key)) return {1, 0, 0, 0};
  auto a = t.numbers<4>(key);
  const double size = std::hypot(std::hypot(a[0], a[1]), std::hypot(a[2], a[3]));
  if (!(size > 0)) t.fail(key, "has length 0, expected a quaternion");
  for (double& x : a) x /= size;
  return a;
}

std::vector<double> stated_start(const ControllerPlant& plant) {
  const auto& m = plant.model->mechanism();
  auto q = m.neutral();
  for (const auto& c : m.coordinates())
    if (const auto s = plant.scene.joints.find(c.name); c.nq == 1 && s != plant.scene.joints.end())
      q[size_t(c.q)] = s->second.position;
  return q;
}

}  // namespace porthos::scene
